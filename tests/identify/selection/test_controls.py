"""Controls over the whole catalogue: what is planted passes, and its control leaves clearly more.

A control that spans the same as what it controls, as a constant shifted in time does, would refuse
the truth; one that takes nothing would let anything pass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from built_fits import CATALOGUE, FRICTION, PLAIN, built_machine
from constructed import log_of

from identify.dataset.dataset import Dataset
from identify.dataset.motion import motion_of
from identify.dataset.prepared_log import PreparedLog, split_by_log, sticks
from identify.estimation.fit import fit_axis
from identify.estimation.force_balance import jacobian
from identify.estimation.least_squares import unabsorbed
from identify.estimation.variable_projection import tried_shapes
from identify.selection.acceptance import Judged, score
from identify.selection.controls import Columns, Trial, change_control, with_unit_penalty
from twin.effect import Effect, Excitation, Kind
from twin.model.machine import AxisModel, Fitted
from twin.model.parameters import ParameterReference

RATE = 1000.0  # Hz
CLEARLY = 0.8  # of what a control leaves, at most, that the truth leaves
SIZE = 0.05  # N RMS beside what the base takes, 50 times the noise
SEEN = Excitation(-0.05, 0.05, 0.3, 0.3, 3.0, 1.0 / RATE)
STICKY = Fitted.at_start(CATALOGUE["lugre"])
PHYSICAL = [
    e
    for e in CATALOGUE.values()
    if e.strengths and not (e.is_nonparametric or e.is_noise or e.of_joints)
]
FRICTIONS = [e for e in PHYSICAL if e.kind is Kind.FRICTION]
OTHERS = [e for e in PHYSICAL if e.kind is not Kind.FRICTION]
AXES = (
    replace(PLAIN, mass_fixed=True),
    replace(PLAIN, rotary=True),
    replace(PLAIN, effects=()),
    *(PLAIN.with_effect(Fitted.at_start(CATALOGUE[n])) for n in ("cable_slab", "cable_hysteresis")),
)  # each effect can be had on one of them


def prepared(name: str, seed: int) -> PreparedLog:
    """Four seconds of smooth moves that pause, of both axes."""
    rng = np.random.default_rng(seed)
    t = np.arange(4000) / RATE
    pace = np.clip(0.6 + 1.2 * np.sin(2.0 * np.pi * 0.8 * t + rng.uniform(0.0, 6.0)), 0.0, 1.0)
    pace = np.convolve(pace, np.hanning(100) / np.hanning(100).sum(), "same")
    s, phase = np.cumsum(pace) / RATE, rng.uniform(0.0, 6.0, 3)
    x = 0.035 * np.sin(2.0 * np.pi * 0.7 * s + phase[0]) + 0.01 * np.sin(15.0 * s + phase[1])
    a = np.gradient(np.gradient(x)) * RATE**2
    u = 5.3 * a + 0.02 * rng.standard_normal(len(t))
    other = 0.03 * np.sin(2.0 * np.pi * 1.1 * t + phase[2])
    return PreparedLog.of(motion_of(log_of(RATE, x, u, other), "x", name), 0.04)


@cache
def logs() -> Dataset:
    return Dataset("x", (prepared("one", 1),), (prepared("two", 2),), lambda: SEEN)


def axis_for(effect: Effect) -> AxisModel:
    """The first axis that can have it; what friction has at rest needs one that sticks."""
    if effect.name == "dwell_stiction":
        return replace(AXES[0], effects=(STICKY,))
    having = (a for a in AXES if a.can_have(effect) and effect.name not in a.names)
    return next(a for a in having if a.effects or effect.kind is not Kind.MODIFIER)


@dataclass(frozen=True, eq=False)
class Planted:
    """A fit of the base to logs that have an effect's force, and the effect's columns."""

    judged: Judged
    columns: Columns
    sticking: bool

    @property
    def part(self) -> float:
        return Trial.beside(self.judged).part(self.columns, sticking=self.sticking)

    @property
    def control(self) -> float:
        return Trial.beside(self.judged).control(self.columns, sticking=self.sticking)


def planted(effect: Effect, size: float = SIZE) -> Planted:
    """With the effect's own force at the middle one of its start shapes."""
    base = axis_for(effect)
    honest = built_machine(logs(), base)
    fit = fit_axis(base, honest.fit)
    places = np.concatenate([log.motion.position for log in honest.fit])
    seen = replace(SEEN, position_low=float(places.min()), position_high=float(places.max()))
    shapes = list(tried_shapes(effect, seen))
    axis = fit.axis.with_effect(Fitted.at_start(effect, shapes[len(shapes) // 2]))
    where = [ParameterReference(effect.name, p) for p in effect.strengths]

    def columns(logs: Sequence[PreparedLog]) -> list[np.ndarray]:
        return split_by_log(jacobian(axis, logs, where), logs)

    own = np.concatenate(columns(honest.fit))[fit.kept]
    sizes = np.linalg.norm(own, axis=0)
    assert sizes.any(), "its columns are nothing on these logs"
    strengths = np.random.default_rng(3).uniform(0.5, 1.0, len(where)) / np.maximum(sizes, 1e-12)
    shown = unabsorbed(own @ strengths, fit.basis)
    strengths *= size / np.sqrt(np.mean(shown**2))

    def having(logs: tuple[PreparedLog, ...]) -> tuple[PreparedLog, ...]:
        pairs = zip(logs, columns(logs), strict=True)
        return tuple(replace(log, command=log.command - c @ strengths) for log, c in pairs)

    dataset = replace(honest, fit=having(honest.fit), holdout=having(honest.holdout))
    judged = Judged(fit_axis(base, dataset.fit), dataset)
    return Planted(judged, with_unit_penalty(columns, judged.fit), sticks(axis))


def beside(control: float) -> float:
    """What is left that is clearly less than what a control leaves."""
    return CLEARLY * (1.0 - control)


@pytest.mark.parametrize("effect", OTHERS, ids=lambda e: e.name)
def test_what_is_planted_passes_and_its_control_leaves_clearly_more(effect: Effect) -> None:
    found = planted(effect)
    assert found.part > 0.95
    assert 1.0 - found.part < beside(found.control)


@pytest.mark.parametrize("effect", OTHERS, ids=lambda e: e.name)
def test_of_noise_an_effect_takes_next_to_nothing(effect: Effect) -> None:
    found = planted(effect, 0.0)
    assert abs(found.part) < 0.05


def test_a_selection_log_of_fewer_test_functions_than_blocks_has_controls() -> None:
    found = planted(CATALOGUE["cogging"])
    (log,) = found.judged.dataset.holdout
    short = PreparedLog.of(log.motion.head(0.2), 0.04)
    judged = replace(found.judged, dataset=replace(found.judged.dataset, holdout=(short,)))
    assert len(short) < 24
    assert np.isfinite(replace(found, judged=judged).control)


@pytest.mark.parametrize("effect", FRICTIONS, ids=lambda e: e.name)
def test_a_planted_friction_passes_beside_another_by_what_it_changes(effect: Effect) -> None:
    """It has no columns of its own."""
    other = STICKY if effect.name == "coulomb_viscous" else FRICTION
    true, base = (replace(AXES[0], effects=(f,)) for f in (Fitted.at_start(effect), other))
    dataset = built_machine(logs(), true)
    before, after = (Judged(fit_axis(axis, dataset.fit), dataset) for axis in (base, true))
    found = score(before, after, change_control(before, after))
    assert found.part > 0.95
    assert found.accepted
    assert 1.0 - found.part < beside(found.control)
