"""Fewer samples of a log: readings every few samples, and the mean of the command between them."""

from __future__ import annotations

from dataclasses import replace

from twin.log.log import Array, Log

HELD = ("current", "force")  # held over a sample, so that their mean acts; all others are readings


def thinned(log: Log, every: int) -> Log:
    """The log at 1/``every`` of its rate, less samples that do not fill a last step.

    It is the log that a slower recorder would have written: position, velocity and setpoint at the
    first of each ``every`` samples, current and force as means over them. Truth is left out.
    """
    if every == 1:
        return replace(log, truth={})
    count = len(log) // every * every

    def fewer(field: str, column: Array) -> Array:
        kept = column[:count].reshape(-1, every)
        return kept.mean(axis=1) if field in HELD else kept[:, 0].copy()

    axes = {
        name: replace(axis, columns={f: fewer(f, c) for f, c in axis.columns.items()})
        for name, axis in log.axes.items()
    }
    return replace(log, sample_rate=log.sample_rate / every, axes=axes, truth={})
