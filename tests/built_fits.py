"""Fits, candidates and motions built from given numbers: nothing is simulated or diagnosed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.blocks import Blocks
from identify.dataset.dataset import Dataset, Role
from identify.dataset.motion import Motion
from identify.dataset.noise_floor import NoiseFloor
from identify.dataset.prepared_log import PreparedLog, total_force
from identify.estimation.evidence import Evidence, Gain
from identify.estimation.fit import Fit, Outcome, finished
from identify.estimation.scaling import Scaling
from identify.selection.acceptance import Judged, Score, Taken
from identify.selection.candidates import Candidate
from identify.selection.changes import Added, Screening
from identify.selection.search import Step
from identify.selection.trying import Tried
from twin.effect import Effect, Excitation
from twin.effects import load_catalogue
from twin.model.machine import AxisModel, Fitted, Hardware, axis_table
from twin.model.parameters import free_parameters

Array = NDArray[np.float64]

CATALOGUE = load_catalogue()
NOISE = CATALOGUE["encoder_quantization"]  # lowers no error
PERIOD = 1e-3  # s
HARDWARE = Hardware(
    travel=(-0.11, 0.13), encoder_noise=1e-9, current_noise=1e-3, force_constant=10.0,
    velocity=0.2, acceleration=2.0, jerk=100.0,
)  # fmt: skip
FRICTION = Fitted.at_start(CATALOGUE["coulomb_viscous"], {"Fc": 0.31, "Fs": 0.31, "sigma2": 0.53})


def axis_of(*effects: Fitted, mass: float = 5.3) -> AxisModel:
    """An axis with a Coulomb friction and these effects."""
    return AxisModel(mass, HARDWARE, (FRICTION, *effects))


def fitted(name: str, **values: float) -> Fitted:
    return Fitted.at_start(CATALOGUE[name], values)


PLAIN = axis_of()


def known_floor(value: float) -> NoiseFloor:
    """A noise floor (N RMS) without uncertainty."""
    return NoiseFloor(value, value, value, value, {"rounding": 0.0, "aliasing": 0.0})


def built_fit(
    error: float,
    floor: float = 1.0,
    axis: AxisModel = PLAIN,
    *,
    residual: Array | None = None,
    kept: NDArray[np.bool_] | None = None,
    logs: Sequence[PreparedLog] = (),
    jacobian: Array | None = None,
    outcome: Outcome = Outcome.CONVERGED,
    begun: AxisModel | None = None,
) -> Fit:
    """A fit with this RMS error and noise floor (N)."""
    if residual is None:
        residual = error * np.array([1.0, -1.0] * 8)
    kept = np.ones(len(residual), dtype=bool) if kept is None else kept
    scaling = Scaling(free_parameters(axis))
    fit = Fit(axis, logs, scaling, outcome, residual, kept, begun or axis)
    fit.__dict__.update(noise=known_floor(floor), gain=1.0, at_bound=())
    if jacobian is not None:
        fit.__dict__["jacobian"] = jacobian
    return fit


def built(
    effect: str | Effect = "cogging",
    bic: float = 500.0,
    t: float = 9.0,
    before: float = 7.0,
    after: float = 2.0,
    *,
    fit: Fit | None = None,
    axis: str = "x",
    control: float = 0.05,
) -> Candidate:
    """A candidate that takes the error from before to after (N, RMS), at this t.

    bic: difference of BIC. control: part of the error that its controls take.
    """
    effect = CATALOGUE[effect] if isinstance(effect, str) else effect
    if fit is None:
        fit = built_fit(after, axis=axis_of().with_effect(Fitted.at_start(effect)))
    left = (after / before) ** 2
    taken = Taken(t, 1.0 - left, 1.0 - left)
    return Candidate(
        effect, axis, fit, Evidence(bic / 100.0, 0, 100.0), Gain(before, after, t, left),
        Score(taken, taken, control),
    )  # fmt: skip


def tried(candidate: Candidate, dataset: Dataset | None = None) -> Tried:
    """An added effect as a search has tried it."""
    change = Added(candidate.effect)
    judged = Judged(candidate.fit, dataset or dataset_stub())  # type: ignore[arg-type]
    return Tried(change, Screening(change, candidate.part), judged, candidate)


def step(candidate: Candidate | str = "cogging", *level: Candidate, **told: object) -> Step:
    """A step that added an effect, and those that were level with it."""
    candidate = built(candidate) if isinstance(candidate, str) else candidate
    return Step(tried(candidate), tuple(map(tried, level)), **told)  # type: ignore[arg-type]


def dataset_stub(
    selection: Sequence[object] = (), training: Sequence[object] = ()
) -> SimpleNamespace:
    """What the rules ask of a dataset, with no logs in it."""
    return SimpleNamespace(
        axis="x", selection=tuple(selection), training=tuple(training), channel_delay=0.0,
        chosen_on=Role.SELECTION if selection else Role.TRAINING,
    )  # fmt: skip


def built_motion(name: str = "run", seconds: float = 3.0, seed: int = 1, slow: float = 1.0):
    """A smooth motion of 5.3 kg against a dry friction, with white noise on the command."""
    rng = np.random.default_rng(seed)
    t = PERIOD * np.arange(round(seconds / PERIOD))
    w1, w2 = 2.0 * np.pi * 0.9 / slow, 2.0 * np.pi * 2.3 / slow
    x = 0.04 * np.sin(w1 * t) + 0.011 * np.cos(w2 * t + 0.3)
    v = 0.04 * w1 * np.cos(w1 * t) - 0.011 * w2 * np.sin(w2 * t + 0.3)
    a = -0.04 * w1**2 * np.sin(w1 * t) - 0.011 * w2**2 * np.cos(w2 * t + 0.3)
    u = 5.3 * a + 0.31 * np.sign(v) + 0.53 * v + 0.02 * rng.standard_normal(len(t))
    others = np.stack([0.3 * np.roll(x, 700), 0.3 * np.roll(v, 700), 0.3 * np.roll(a, 700)])
    return Motion(
        name=name, axis="x", track=Blocks(np.stack([x, v, u]), np.stack([v, u])), others=others,
        period=PERIOD, start=0.0, sample_period=PERIOD, position_noise=3e-9,
    )  # fmt: skip


def pushed(motion: Motion, law: Fitted) -> Motion:
    """The motion with the command that it takes against one force more."""
    force = total_force(axis_table({"": AxisModel(5.3, HARDWARE, (law,))}), motion)
    x, v, u = motion.signals
    return replace(motion, track=Blocks(np.stack([x, v, u - force]), np.stack([v, u - force])))


def built_dataset(*names: str, held: Sequence[str] = (), window: float = 0.04) -> Dataset:
    """A dataset of built motions, of a length and seed of their own each."""

    def logs(which: Sequence[str], first: int) -> tuple[PreparedLog, ...]:
        return tuple(
            PreparedLog.of(
                built_motion(n, 2.0 + 0.5 * i, seed=first + i, slow=1.0 + 0.2 * i), window
            )
            for i, n in enumerate(which)
        )

    return Dataset("x", logs(names or ("run",), 1), logs(held, 11), seen)


def seen() -> Excitation:
    """What the motion of the logs covers."""
    return Excitation(-0.05, 0.05, 0.4, 0.3, 3.0, PERIOD, fewest_cycles=2.5)


def built_machine(
    dataset: Dataset, model: AxisModel, force: Callable[[Array, Array], Array] | None = None
) -> Dataset:
    """The dataset of a machine with the forces of a model, and noise of 1 mN.

    force: (position, direction) -> N, beside them.
    """
    rng = np.random.default_rng(4)

    def moved(log: PreparedLog) -> PreparedLog:
        motion = log.motion
        beside = (
            force(motion.position, np.sign(motion.velocity)) if force else 0.0 * motion.position
        )
        own = finished(model, model, (log,), Outcome.CONVERGED)
        rest = np.zeros(len(log))
        rest[own.kept] = own.residual
        noise = 1e-3 * rng.standard_normal(len(log))
        return replace(log, command=log.command - rest - log.test_function.mean(beside) + noise)

    return replace(
        dataset,
        training=tuple(map(moved, dataset.training)),
        selection=tuple(map(moved, dataset.selection)),
    )
