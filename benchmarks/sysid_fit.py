"""The same fit by mujoco.sysid, MuJoCo's own toolbox, stopped when it takes too long."""

from __future__ import annotations

import io
from collections.abc import Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass
from time import perf_counter

import mujoco
import numpy as np
from mujoco import sysid

from benchmarks.slides import PERIOD, Recording, Slide
from benchmarks.timing import Array

MOST_SECONDS = 60.0
BOUNDS = (0.01, 10.0)  # times the true value


@dataclass(frozen=True)
class Peer:
    """mujoco.sysid with some options of its ``optimize``."""

    name: str
    options: Mapping[str, str]


DEFAULT = Peer("mujoco.sysid", {})
SCALED = Peer("mujoco.sysid with SciPy, scaled", {"optimizer": "scipy", "x_scale": "jac"})


class _TimeUp(Exception):
    pass


@dataclass(frozen=True, eq=False)
class PeerFit:
    """What the peer found: values (n_parameters,), its wall time in s, whether it was stopped."""

    values: Array
    seconds: float
    stopped: bool


def available() -> bool:
    """Whether mujoco.sysid can be used; without its extras the package is empty."""
    return hasattr(sysid, "default_report")


def fit_with_sysid(peer: Peer, slide: Slide, recording: Recording, start: Array) -> PeerFit:
    """Fit from these values; where time is up, the best values so far."""
    parameters = sysid.ParameterDict()
    for c, value, true in zip(slide.where, start, slide.true, strict=True):
        parameters.add(sysid.Parameter(c.label, value, BOUNDS[0] * true, BOUNDS[1] * true))
    simulate = sysid.build_residual_fn(
        models_sequences=[_measured(slide, recording, start)],
        build_model=lambda p, _: mujoco.MjModel.from_xml_string(slide.mjcf(p.as_vector(), PERIOD)),
    )
    begun = perf_counter()
    best, lowest = start, np.inf

    def residual(x: Array, p: object, **rest: object) -> tuple:
        nonlocal best, lowest
        if perf_counter() - begun > MOST_SECONDS:
            raise _TimeUp
        found = simulate(x, p, **rest)
        cost = sum(float(np.sum(np.square(r))) for r in found[0])
        if np.size(x) == len(start) and cost < lowest:
            best, lowest = np.array(x).ravel(), cost
        return found

    try:
        with redirect_stdout(io.StringIO()):
            fitted, _ = sysid.optimize(parameters, residual, **peer.options)
    except _TimeUp:
        return PeerFit(best, perf_counter() - begun, True)
    return PeerFit(fitted.as_vector(), perf_counter() - begun, False)


def _measured(slide: Slide, recording: Recording, start: Array) -> sysid.ModelSequences:
    spec = mujoco.MjSpec.from_string(slide.mjcf(start, PERIOD))
    model = spec.compile()
    data = mujoco.MjData(model)
    time = PERIOD * np.arange(len(recording.position))
    # A rollout's sensors describe the state before the step whose end they are stamped with.
    position = sysid.TimeSeries.from_names(time + PERIOD, recording.position[:, None], model)
    state = sysid.create_initial_state(
        model, recording.position[:1], np.array([recording.velocity]), data.act
    )
    control = sysid.TimeSeries(time, recording.force[:, None])
    return sysid.ModelSequences("slide", spec, "log", state, control, position)
