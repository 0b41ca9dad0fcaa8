"""Confounded parameters: values that a fit changed, and what may have caused the change.

An effect whose force equals that of a parameter (a tilt and the constant of the cable, a payload
and the mass) is absorbed by the fit and never found missing. It shows as a changed value here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import PreparedLog
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit
from identify.estimation.fit_problem import is_linear
from identify.estimation.force_balance import changes, jacobian, residual
from identify.estimation.intervals import half_widths
from identify.estimation.least_squares import orthonormal, unabsorbed
from identify.estimation.variable_projection import absent_effects
from identify.rules import RULE
from twin.effect import Effect, Kind
from twin.effects import Catalogue
from twin.model.machine import AxisModel, Fitted
from twin.model.parameters import ParameterReference, read
from twin.model.units import LINEAR

Array = NDArray[np.float64]

LEAST_FORCE = 0.1  # of the error before the fit: least force of a change that is reported
SAME_FORCE = 0.01  # largest part of that force outside the span of an effect with the same force
MOST_CHANGES = 3  # that are reported
HEAD = 4.0  # s of the first log, on which most effects show that they are none of the alike


@dataclass(frozen=True)
class Change:
    """A parameter that a fit moved by more than its interval.

    before, after: in ``unit``. force: RMS force that the change makes, in ``force_unit``. alike:
    absent effects that can produce the same force.
    """

    label: str
    before: float
    after: float
    unit: str
    force: float
    alike: tuple[str, ...] = ()
    force_unit: str = LINEAR.force


@dataclass(frozen=True)
class Refit:
    """RMS force errors of an axis before and after a fit, in ``unit``, and the main changes."""

    given: float
    refitted: float
    changes: tuple[Change, ...]
    unit: str = LINEAR.force


def refit(given: AxisModel, fit: Fit, catalogue: Catalogue) -> Refit:
    """What a fit changed of the given model; nothing where its error was at the noise floor."""
    error, units = rms(residual(given, fit.logs)[fit.kept]), fit.axis.units
    if not error > RULE.at_floor * max(fit.floor, fit.error):
        return Refit(error, fit.error, (), units.force)
    where = fit.scaling.where
    before, after = read(given, where), read(fit.axis, where)
    moved = np.flatnonzero(np.abs(after - before) > half_widths(fit))
    found: list[tuple[Change, Array]] = []
    for j, back in zip(moved, _backs(fit, moved, before - after), strict=True):
        c = where[j]
        change = Change(
            c.label, float(before[j]), float(after[j]), units(c.parameter.unit), rms(back),
            force_unit=units.force,
        )  # fmt: skip
        found.append((change, back))
    found = [t for t in found if t[0].force > LEAST_FORCE * error]
    found = sorted(found, key=lambda t: -t[0].force)[:MOST_CHANGES]
    alike = _alike(fit, catalogue, [back for _, back in found])
    told = (replace(change, alike=own) for (change, _), own in zip(found, alike, strict=True))
    return Refit(error, fit.error, tuple(told), units.force)


def _backs(fit: Fit, moved: NDArray[np.intp], steps: Array) -> Array:
    """Change (m, n) N of the residual as each of m parameters by itself moves by its step.

    moved (m,): which of all; steps: of all.
    """
    where = fit.scaling.where
    out = fit.jacobian[:, moved].T * steps[moved, None]
    bent = np.array([not is_linear(fit.axis, where[j]) for j in moved], dtype=bool)
    own = moved[bent]
    out[bent] = changes(fit.axis, fit.logs, [where[j] for j in own], steps[own])[:, fit.kept]
    return out


def _alike(fit: Fit, catalogue: Catalogue, forces: Sequence[Array]) -> list[tuple[str, ...]]:
    """For each force (n,) N the absent linear effects that can produce it.

    What an effect leaves of a force on a part by itself is less than what it leaves there when it
    is fitted on all, so that the head of the first log rules out most.
    """
    found: list[list[str]] = [[] for _ in forces]
    whole = fit.logs[0]
    head = PreparedLog.of(whole.motion.head(HEAD), whole.test_function.length)
    first = fit.kept[: len(head)]
    for effect in _linear_effects(fit, catalogue) if forces else ():
        begun = orthonormal(_columns(fit, effect, [head])[first])
        possible = [f for f in forces if _size_left(f[: len(begun)], begun) < _same(f)]
        if not possible:
            continue
        basis = orthonormal(_columns(fit, effect, fit.logs)[fit.kept])
        for names, force in zip(found, forces, strict=True):
            if _size_left(force, basis) < _same(force):
                names.append(effect.name)
    return [tuple(names) for names in found]


def linear_bases(fit: Fit, catalogue: Catalogue) -> dict[str, Array]:
    """Orthonormal basis (n, k) of the force of each absent effect that is linear, by name."""
    return {
        effect.name: orthonormal(_columns(fit, effect, fit.logs)[fit.kept])
        for effect in _linear_effects(fit, catalogue)
    }


def _linear_effects(fit: Fit, catalogue: Catalogue) -> list[Effect]:
    """Effects that the fitted axis lacks and whose parameters are all linear, but no friction."""
    absent = (e for e in absent_effects(fit.axis, catalogue) if e.kind is not Kind.FRICTION)
    return [e for e in absent if len(e.strengths) == len(e.parameters)]


def _columns(fit: Fit, effect: Effect, logs: Sequence[PreparedLog]) -> Array:
    """Derivative (n, k) of the residual by the parameters of a linear effect beside a fit."""
    where = [ParameterReference(effect.name, p) for p in effect.strengths]
    return jacobian(fit.axis.with_effect(Fitted.at_start(effect)), logs, where)


def _size_left(force: Array, basis: Array) -> float:
    """Size of what a basis leaves of a force (n,): root of the sum of squares, N."""
    return float(np.linalg.norm(unabsorbed(force, basis)))


def _same(force: Array) -> float:
    """Size below which what is left of a force is nothing."""
    return SAME_FORCE * float(np.linalg.norm(force))


@dataclass(frozen=True)
class MovedParameter:
    """A parameter that an added effect changed by more than it scatters between blocks of the logs.

    before, after: in ``unit``. collapsed: whether hardly any of a linear parameter is left, so that
    it had taken over the force of the effect that was missing.
    """

    label: str
    before: float
    after: float
    unit: str
    collapsed: bool


def moved_parameters(before: Fit, after: Fit) -> tuple[MovedParameter, ...]:
    """The parameters of the smaller model that changed when the effect was added."""
    shared = [c for c in before.scaling.where if c in after.scaling.where]
    old, new = read(before.axis, shared), read(after.axis, shared)
    index = [after.scaling.where.index(c) for c in shared]
    width = half_widths(after)[index]
    earlier = half_widths(before)[[before.scaling.where.index(c) for c in shared]]
    allowed = np.hypot(width, earlier)
    out = []
    for c, a, b, limit, first in zip(shared, old, new, allowed, earlier, strict=True):
        p = c.parameter
        # Its new interval does not matter here: a confounded parameter may be collinear with the
        # effect.
        collapsed = p.strength and abs(b) < RULE.collapse * abs(a) and abs(a) > first
        if not collapsed and not abs(b - a) > limit:
            continue
        unit = after.axis.units(p.unit)
        out.append(MovedParameter(c.label, float(a), float(b), unit, bool(collapsed)))
    return tuple(out)
