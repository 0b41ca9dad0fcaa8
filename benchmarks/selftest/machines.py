"""Machines of the self-test: drawn values, planted effects, and logs from a finer simulation.

A ``Case`` names a machine; the same name makes the same machine again.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Collection, Container, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks.selftest.laws import NOISE, OUTSIDE
from benchmarks.selftest.variations import (
    MASS_OFF,
    VARIATIONS,
    Drawn,
    drawn_values,
    other_exponents,
)
from identify.dataset.dataset import Dataset
from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.errors import error_on
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit, fit_axis
from identify.estimation.force_balance import residual
from identify.estimation.least_squares import unabsorbed
from identify.experiment_design.planting import (
    added_force,
    hidden_part,
    other_machine,
    strength_for,
    visible_force,
)
from twin.effect import Effect, Kind
from twin.effects import Catalogue, load_catalogue
from twin.errors import InputError
from twin.experiments.experiment import Experiment
from twin.experiments.kinds import Moves, Tracking
from twin.logs import Log
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.simulation.simulate import simulate
from twin.simulation.simulators import FineSimulator, ReducedSimulator

STAGE, AXIS = "proton_xy", "x"
DURATION = 12.0  # s of tracking
MOVES = 8  # places of a log of fastest moves
TRAINING = 2  # logs, of tracking and of moves; one more of each is for selection and for the test
HIDDEN = 0.9  # part of an effect's force, absorbed by a fit, from which the mass is held fixed
ROUNDS = 2  # corrections of a friction's level
LEVELS = (0.1, 10.0)  # times the machine's own friction, within which the level is sought
FARTHER = 3.0  # times a rounding's step at most, of one try to the next
OWN = 0.999  # of an effect's force, absorbed by a fit, from which the model has it by itself
Run = tuple[Experiment, int]  # what is commanded, and the seed of its log
REACHED = 0.7  # part of the wanted force that an effect must reach within its bounds
TRIES = 6  # draws of an effect's values until it shows


NOTHING = "nothing"
_FORM = re.compile(
    r"(?P<effects>[a-z_+]+)@(?P<strength>[0-9.]+)/(?P<variation>[a-z]+)/(?P<seed>\d+)(?P<out>/out)?"
)


@dataclass(frozen=True)
class Case:
    """What is planted: effect names, their force over the noise floor, and the seed.

    variation: how machine and logs depart from the model besides. known: whether the planted
    effects stay in the catalogue of the analysis.
    """

    effects: tuple[str, ...]
    strength: float
    seed: int
    variation: str = "plain"
    known: bool = True

    def __str__(self) -> str:
        planted = "+".join(self.effects) or NOTHING
        out = "" if self.known else "/out"
        return f"{planted}@{self.strength:g}/{self.variation}/{self.seed}{out}"


def parse_case(text: str, effects: Container[str], variations: Collection[str]) -> Case:
    """The case of a name such as "cogging@5/bumps/17"; InputError for any other text.

    effects, variations: those there are.
    """
    found = _FORM.fullmatch(text)
    if found is None:
        raise InputError(
            f"case '{text:.60}': give EFFECT@STRENGTH/VARIATION/SEED as the self-test prints it, "
            f"such as {Case((), 0.0, 17)}"
        )
    names = () if found["effects"] == NOTHING else tuple(found["effects"].split("+"))
    for name in names:
        if name not in effects:
            raise InputError(f"case '{text:.60}': no effect '{name}'; `twin effects` lists them")
    if found["variation"] not in variations:
        raise InputError(
            f"case '{text:.60}': no variation '{found['variation']}'; there are "
            f"{', '.join(variations)}"
        )
    return Case(
        names, float(found["strength"]), int(found["seed"]), found["variation"], not found["out"]
    )


@dataclass(frozen=True, eq=False)
class Machine:
    """A machine with planted effects, and its logs.

    model: the model that the diagnosis starts from. true: the machine. planted: effects that the
    model lacks. reshaped: effects of the model whose law is not the machine's. right: other effects
    that are right to name. logs, holdout: to fit, and to select by. test: decides nothing.
    """

    model: MachineModel
    true: MachineModel
    planted: tuple[Fitted, ...]
    reshaped: frozenset[str]
    right: frozenset[str]
    logs: Mapping[str, Log]
    holdout: Mapping[str, Log]
    test: Mapping[str, Log]


class NotShown(Exception):
    """The effect cannot reach the wanted force on this stage's motion within its bounds."""


@dataclass(frozen=True)
class Setting:
    """Where machines are made: the stage that they are about, the catalogue, and s of a log."""

    stage: MachineModel
    catalogue: Catalogue
    duration: float = DURATION

    @classmethod
    def standard(cls) -> Setting:
        """The stage of the product with the whole catalogue."""
        catalogue = load_catalogue()
        return cls(load_model(STAGE, catalogue), catalogue)


def machine_of(case: Case, setting: Setting) -> Machine:
    """The machine that a case names. Raises NotShown."""
    rng = np.random.default_rng([case.seed, *(zlib.crc32(e.encode()) for e in case.effects)])
    effects = [OUTSIDE[e] if e in OUTSIDE else setting.catalogue[e] for e in case.effects]
    return machine(setting.stage, effects, case.strength, case.variation, rng, setting.duration)


def machine(
    stage: MachineModel,
    effects: Sequence[Effect],
    strength: float,
    variation: str,
    rng: np.random.Generator,
    duration: float = DURATION,
) -> Machine:
    """Draw a machine about a stage, plant effects of ``strength`` times the noise floor, log it.

    variation: how it departs from the stage besides. The noise floor is what the machine's own laws
    leave of its logs. Only the part of a force that the model's parameters cannot reproduce counts
    for the strength. The simulation steps ten times finer than the samples. Raises NotShown.
    """
    drawn = _about(stage, rng)
    drawn = VARIATIONS[variation](drawn, AXIS, rng)
    experiments = 2 * (Tracking(duration), Moves(MOVES))
    seeds = rng.integers(1, 1 << 31, size=len(experiments))
    runs = [(e, int(seed)) for e, seed in zip(experiments, seeds, strict=True)]
    planted: list[Fitted] = []
    # Noise first, as it is a part of the floor; then friction, as its level is found with a model
    # that lacks nothing else.
    for effect in sorted(effects, key=lambda e: (not e.is_noise, e.kind is not Kind.FRICTION)):
        rubs = effect.kind is Kind.FRICTION
        put = _with_friction if rubs else _with_noise if effect.is_noise else _with_planted
        drawn, fitted = put(drawn, effect, strength, runs[:TRAINING], rng)
        planted.append(fitted)
    held = drawn.model.axes[AXIS].mass_fixed
    if held:  # a mass that is not fitted was weighed
        own = replace(drawn.model.axes[AXIS], mass=drawn.true.axes[AXIS].mass)
        drawn = replace(drawn, model=drawn.model.with_axis(AXIS, own))
    logs = _logged(drawn.true, runs, FineSimulator)
    test, selection = dict([logs.popitem()]), dict([logs.popitem()])
    return Machine(
        drawn.model, drawn.true, tuple(planted), drawn.reshaped, drawn.right, logs, selection, test
    )


def prepared(built: Machine, strength: float) -> Dataset:
    """The dataset of the diagnosis. Raises NotShown where a planted force is too small in the logs.

    Its strength was found with a simulation at the samples of a log. The machine is simulated
    finer, and its own laws at those samples may leave much of what it does: a load that strikes
    within its play moves on by chance.
    """
    dataset = datasets(built.model, built.logs, built.holdout, test=built.test)[AXIS]
    true = built.true.axes[AXIS]
    own = own_error(true, dataset.training)
    for planted in (f.effect for f in built.planted):
        if planted.kind is Kind.FRICTION or planted.is_noise:
            continue
        without = own_error(true.without(planted.name), dataset.training)
        if without**2 - own**2 < (REACHED * strength * own) ** 2:
            raise NotShown(planted.name)
    return dataset


def own_error(true: AxisModel, logs: Sequence[PreparedLog]) -> float:
    """RMS force (N) that a machine's own laws leave of its logs: what noise alone leaves."""
    return rms(error_on(_quiet(true), logs))


def _about(stage: MachineModel, rng: np.random.Generator) -> Drawn:
    """A machine about a stage: all values off by up to 20 %, masses by up to 10 %."""
    true = stage
    for name, axis in stage.axes.items():
        other = other_machine(axis, rng)
        mass = axis.mass * (1.0 + MASS_OFF * rng.uniform(-1.0, 1.0))
        true = true.with_axis(name, replace(other, mass=mass))
    return Drawn(replace(stage, axes={AXIS: stage.axes[AXIS]}), true)


def _logged(
    true: MachineModel, runs: Sequence[Run], simulator: type[ReducedSimulator]
) -> dict[str, Log]:
    """Logs of the machine; its force noise begins anew in each."""
    axis, logs = true.axes[AXIS], {}
    for i, (experiment, seed) in enumerate(runs, start=1):
        if NOISE.name in axis.names:
            values = {**axis[NOISE.name].values, "seed": float(seed - 1 or 1)}
            true = true.with_axis(AXIS, axis.with_effect(Fitted.at_start(NOISE, values)))
        logs[f"log {i}"] = simulate(true, experiment, seed=seed, simulator=simulator)
    return logs


def _quiet(true: AxisModel) -> AxisModel:
    return true.without(NOISE.name) if NOISE.name in true.names else true


@dataclass(frozen=True, eq=False)
class _Trial:
    """Training logs of the machine as it is, and the model's fit. floor: what noise leaves, N."""

    dataset: Dataset
    base: Fit
    floor: float

    @classmethod
    def of(cls, drawn: Drawn, runs: Sequence[Run]) -> _Trial:
        """On the motions of all training logs, as an end may be met in some alone."""
        logs = _logged(drawn.true, runs, ReducedSimulator)
        dataset = datasets(drawn.model, logs, {})[AXIS]
        base = fit_axis(drawn.model.axes[AXIS], dataset.training)
        return cls(dataset, base, own_error(drawn.true.axes[AXIS], dataset.training))


def plain_friction(stage: MachineModel, other: Effect) -> Fitted:
    """The simplest friction of the catalogue, at the level of the stage's own.

    Raises NotShown where the other friction is the simplest itself.
    """
    frictions = [e for e in load_catalogue().values() if e.kind is Kind.FRICTION]
    plain = min(frictions, key=lambda e: (len(e.states), len(e.parameters)))
    if plain.name == other.name:
        raise NotShown(other.name)
    own = next(f for f in stage.axes[AXIS].effects if f.effect.kind is Kind.FRICTION)
    free = [p.name for p in plain.parameters if not p.fixed]
    shared = {name: own.values[name] for name in free if name in own.values}
    return Fitted.at_start(plain, shared)


def _with_friction(
    drawn: Drawn, effect: Effect, strength: float, runs: Sequence[Run], rng: np.random.Generator
) -> tuple[Drawn, Fitted]:
    """A machine with another friction, scaled until the model falls short by that strength.

    The model gets the simplest friction. What the model would leave with the right friction, such
    as the form of the bumps, does not count.
    """
    plain = plain_friction(drawn.model, effect)
    own = next(f for f in drawn.true.axes[AXIS].effects if f.effect.kind is Kind.FRICTION)
    drawn = replace(
        drawn,
        model=drawn.model.with_axis(AXIS, drawn.model.axes[AXIS].with_effect(plain)),
        reshaped=drawn.reshaped - {own.effect.name},
    )
    free = {p.name for p in effect.parameters if not p.fixed}
    shared = {name: own.values[name] for name in free if name in own.values}
    seen = _Trial.of(drawn, runs).dataset.excitation
    fitted = Fitted.at_start(effect, {**drawn_values(effect, seen, rng), **shared})
    fitted = other_exponents(fitted, rng)

    def having(new: Fitted) -> Drawn:
        return drawn.on(AXIS, lambda a: a.with_effect(new))

    def left(new: Fitted) -> float:
        """Error of the model beyond that of one with the right friction, in noise floors."""
        trial = _Trial.of(having(new), runs)
        best = fit_axis(trial.base.axis.with_effect(new), trial.dataset.training).error
        beyond = max(trial.base.error**2 - max(best, trial.floor) ** 2, 1e-4 * trial.floor**2)
        return float(np.sqrt(beyond) / trial.floor)

    drawn_at, scale = fitted, 1.0
    for _ in range(ROUNDS):
        scale = float(np.clip(scale * strength / left(fitted), *LEVELS))
        scaled = {p.name: scale * drawn_at.values[p.name] for p in effect.strengths}
        fitted = Fitted.at_start(effect, {**drawn_at.values, **scaled})
    if left(fitted) < REACHED * strength:
        raise NotShown(effect.name)
    return having(fitted), fitted


def _with_noise(
    drawn: Drawn, effect: Effect, strength: float, runs: Sequence[Run], rng: np.random.Generator
) -> tuple[Drawn, Fitted]:
    """A machine whose readings are rounded, until its own laws leave that strength of it.

    The noise that they have dithers their rounding, and where the axis rests between two steps it
    hunts or not by chance, so that only logs with it tell what it adds.
    """
    plain = _Trial.of(drawn, runs)
    white = np.sqrt(12.0) * drawn.true.axes[AXIS].hardware.encoder_noise  # of as much rounding
    step, wanted = strength * white, (REACHED * strength, strength / REACHED)
    (name,) = (p.name for p in effect.strengths)
    for _ in range(TRIES):
        fitted = Fitted.at_start(effect, {name: float(step)})
        noisy = drawn.on(AXIS, partial(AxisModel.with_effect, new=fitted))
        more = (_Trial.of(noisy, runs).floor / plain.floor) ** 2 - 1.0
        added = float(np.sqrt(max(more, 0.0)))
        if wanted[0] <= added <= wanted[1]:
            return noisy, fitted
        step *= float(np.clip(strength / max(added, 1e-3), 1.0 / FARTHER, FARTHER))
    raise NotShown(effect.name)


def _with_planted(
    drawn: Drawn, effect: Effect, strength: float, runs: Sequence[Run], rng: np.random.Generator
) -> tuple[Drawn, Fitted]:
    """The machine with one more effect; its mass is held where a fit would absorb the effect."""
    trial = _Trial.of(drawn, runs)
    for _ in range(TRIES):
        values = drawn_values(effect, trial.dataset.excitation, rng)
        fitted = _scaled(effect, values, strength, trial, rng)
        if hidden_part(fitted, trial.base, trial.dataset) > HIDDEN:
            weighed = replace(trial.base.axis, mass_fixed=True, mass=drawn.true.axes[AXIS].mass)
            held = replace(trial, base=fit_axis(weighed, trial.dataset.training))
            fitted = _scaled(effect, values, strength, held, rng)
        else:
            held = trial
        reached = visible_force(fitted, held.base, trial.dataset)
        own = effect.imitation(fitted.values, trial.dataset.excitation) is None
        told = hidden_part(fitted, held.base, trial.dataset) < OWN
        if own and told and reached >= REACHED * strength * trial.floor:
            break
    else:
        raise NotShown(effect.name)
    model = drawn.model.axes[AXIS]
    model = replace(model, mass_fixed=model.mass_fixed or held.base.axis.mass_fixed)
    drawn = replace(drawn, model=drawn.model.with_axis(AXIS, model))
    return drawn.on(AXIS, lambda a: a.with_effect(fitted)), fitted


def _scaled(
    effect: Effect,
    values: Mapping[str, float],
    strength: float,
    trial: _Trial,
    rng: np.random.Generator,
) -> Fitted:
    """The effect so strong that the model cannot reproduce ``strength`` noise floors of it."""
    base, logs = trial.base, trial.dataset.training
    without = residual(base.axis, logs)

    def beyond(fitted: Fitted) -> np.ndarray:
        force = added_force(fitted, base.axis, logs, without)[base.kept]
        return unabsorbed(force, base.basis)

    return strength_for(effect, beyond, strength * trial.floor, values, rng)
