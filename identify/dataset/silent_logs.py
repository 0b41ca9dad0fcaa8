"""Logs that say nothing of a model: they are left out, and which and why is told."""

from __future__ import annotations

import logging
from dataclasses import replace

from identify.dataset.dataset import Dataset, Role
from identify.dataset.prepared_log import PreparedLog, moving

LOGGER = logging.getLogger("identify")  # by itself it writes its lines on standard error


def telling(dataset: Dataset, sticks: bool) -> Dataset:
    """The dataset less the logs without a test function that counts; each is told in one line.

    sticks: whether the axis has static friction, whose force at rest the motion does not determine.
    The training logs stay where none of them says anything: no fit can begin then, and that is its
    error to tell.
    """
    silent = {
        log.motion.name: _why(log, dataset.axis)
        for role in Role
        for log in dataset.having(role)
        if not moving([log], sticks).any()
    }
    left_out = {**dataset.left_out, **silent}
    for name, why in left_out.items():
        LOGGER.warning("%s is left out: %s", name, why)
    fit, holdout, test = (
        tuple(log for log in dataset.having(role) if log.motion.name not in silent) for role in Role
    )
    return replace(dataset, fit=fit or dataset.fit, holdout=holdout, test=test, left_out=left_out)


def _why(log: PreparedLog, axis: str) -> str:
    """Why a log has no test function that counts, and what to give instead."""
    if not log.reached.any():
        return f"axis {axis} is nowhere where a training log has been; give one on the same travel"
    return (
        f"axis {axis} comes to rest within every test function of {log.test_function.length:g} s, "
        "and at rest its friction is unknown; give a log in which it moves for longer at a time, "
        "or a shorter --test-function (s)"
    )
