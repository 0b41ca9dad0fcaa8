"""Machines for the self-test: drawn values, planted effects, and logs from a finer simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.dataset.dataset import datasets
from identify.dataset.noise_floor import floor_of
from identify.estimation.fit import fit_axis
from identify.experiment_design.planting import (
    draw_effect,
    hidden_part,
    other_machine,
    visible_force,
)
from twin.effect import Effect, Kind
from twin.effects import load_catalogue
from twin.experiments.named import simulate
from twin.log import Log
from twin.model.machine import Fitted, MachineModel
from twin.simulator import FineSimulator, ReducedSimulator

AXIS = "x"
DURATION = 12.0  # s of each log
EXPERIMENTS = ("tracking", "moves", "tracking")  # the last is held out
HIDDEN = 0.9  # part of an effect's force, absorbed by a fit, from which the mass is held fixed
ROUNDS = 2  # corrections of a friction's level
SPREAD = 0.3  # of the logarithm of a friction's own parameters
REACHED = 0.7  # part of the wanted force that an effect must reach within its bounds


@dataclass(frozen=True, eq=False)
class Machine:
    """A machine with planted effects, and its logs.

    model: the model that the diagnosis starts from. true: the machine. planted: effects that the
    model lacks.
    """

    model: MachineModel
    true: MachineModel
    planted: tuple[Fitted, ...]
    logs: Mapping[str, Log]
    holdout: Mapping[str, Log]


class NotShown(Exception):
    """The effect cannot reach the wanted force on this stage's motion within its bounds."""


def machine(
    stage: MachineModel, effects: Sequence[Effect], strength: float, rng: np.random.Generator
) -> Machine:
    """Draw a machine about a stage, plant effects of ``strength`` times the noise floor, log it.

    Only the part of the force that the model's own parameters cannot reproduce counts for the
    strength. Values and motion are random; the simulation steps ten times finer than the samples of
    the logs. Raises NotShown.
    """
    true = stage
    for name, axis in stage.axes.items():
        true = true.with_axis(name, other_machine(axis, rng))
    seeds = [int(s) for s in rng.integers(1 << 31, size=len(EXPERIMENTS) + 1)]
    model = replace(stage, axes={AXIS: stage.axes[AXIS]})
    planted: list[Fitted] = []
    # Friction first, as its level is found with a model that lacks nothing else.
    for effect in sorted(effects, key=lambda e: e.kind is not Kind.FRICTION):
        if effect.kind is Kind.FRICTION:
            model = model.with_axis(
                AXIS, model.axes[AXIS].with_effect(plain_friction(stage, effect))
            )
            true, fitted = _with_friction(true, model, effect, strength, seeds[-1], rng)
        else:
            true, fitted = _with_planted(true, effect, strength, seeds[-1], rng)
        planted.append(fitted)
    held = replace(model.axes[AXIS], mass_fixed=true.axes[AXIS].mass_fixed)
    logs = {
        f"log {i}": simulate(true, run, seed=seed, duration=DURATION, simulator=FineSimulator)
        for i, (run, seed) in enumerate(zip(EXPERIMENTS, seeds, strict=False), start=1)
    }
    last = list(logs)[-1]
    return Machine(
        model=model.with_axis(AXIS, held),
        true=true,
        planted=tuple(planted),
        logs=logs,
        holdout={last: logs.pop(last)},
    )


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
    true: MachineModel,
    model: MachineModel,
    effect: Effect,
    strength: float,
    seed: int,
    rng: np.random.Generator,
) -> tuple[MachineModel, Fitted]:
    """The machine with another friction, scaled until the model's error has that strength."""
    own = next(f for f in true.axes[AXIS].effects if f.effect.kind is Kind.FRICTION)
    free = [p for p in effect.parameters if not p.fixed]
    shared = {p.name: own.values[p.name] for p in free if p.name in own.values}
    drawn = {
        p.name: p.start * float(np.exp(SPREAD * rng.uniform(-1.0, 1.0)))
        for p in free
        if p.name not in shared and p.lower < p.upper
    }
    fitted = Fitted.at_start(effect, {**effect.starts(), **drawn, **shared})

    def left(machine: MachineModel) -> float:
        """Error of the model on that machine above the noise floor, as a multiple of it."""
        trial = simulate(
            machine, EXPERIMENTS[0], seed=seed, duration=DURATION, simulator=ReducedSimulator
        )
        dataset = datasets(model, {"trial": trial}, {})[AXIS]
        base = fit_axis(model.axes[AXIS], dataset.fit)
        floor = floor_of(machine.axes[AXIS], dataset.fit)
        return float(np.sqrt(max(base.error**2 - floor**2, 1e-4 * floor**2)) / floor)

    machine = true.with_axis(AXIS, true.axes[AXIS].with_effect(fitted))
    for _ in range(ROUNDS):
        scale = float(np.clip(strength / left(machine), 0.1, 10.0))
        scaled = {p.name: scale * fitted.values[p.name] for p in effect.strengths}
        fitted = Fitted.at_start(effect, {**fitted.values, **scaled})
        machine = true.with_axis(AXIS, true.axes[AXIS].with_effect(fitted))
    if left(machine) < REACHED * strength:
        raise NotShown(effect.name)
    return machine, fitted


def _with_planted(
    true: MachineModel, effect: Effect, strength: float, seed: int, rng: np.random.Generator
) -> tuple[MachineModel, Fitted]:
    """The machine with one more effect; its mass is held where a fit would absorb the effect."""
    trial = simulate(true, EXPERIMENTS[0], seed=seed, duration=DURATION, simulator=ReducedSimulator)
    dataset = datasets(replace(true, axes={AXIS: true.axes[AXIS]}), {"trial": trial}, {})[AXIS]
    base = fit_axis(true.axes[AXIS], dataset.fit)
    at_start = draw_effect(
        effect, base.axis, dataset.fit, dataset.excitation, base.floor, np.random.default_rng(seed)
    )
    if hidden_part(at_start, base, dataset) > HIDDEN:
        base = fit_axis(replace(true.axes[AXIS], mass_fixed=True), dataset.fit)
    wanted = strength * base.floor
    fitted = draw_effect(effect, base.axis, dataset.fit, dataset.excitation, wanted, rng, base)
    if visible_force(fitted, base, dataset) < REACHED * wanted:
        raise NotShown(effect.name)
    axis = replace(true.axes[AXIS], mass_fixed=base.axis.mass_fixed)
    return true.with_axis(AXIS, axis.with_effect(fitted)), fitted
