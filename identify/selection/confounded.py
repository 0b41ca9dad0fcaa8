"""Confounded parameters: values that a fit changed, and what may have caused the change.

An effect whose force equals that of a parameter (a tilt and the constant of the cable, a payload
and the mass) is absorbed by the fit and never found missing. It shows as a changed value here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.estimation.decision import RULE
from identify.estimation.fit import Fit, rms
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.intervals import half_widths
from identify.estimation.subspace import orthonormal, unabsorbed
from identify.selection.candidates import absent_effects
from twin.effect import Kind
from twin.effects import Catalogue
from twin.model.machine import AxisModel, Fitted
from twin.model.parameters import ParameterReference, read, write
from twin.model.units import LINEAR

Array = NDArray[np.float64]

LEAST_FORCE = 0.1  # of the error before the fit: least force of a change that is reported
SAME_FORCE = 0.01  # largest part of that force outside the span of an effect with the same force
MOST_CHANGES = 3  # that are reported


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
    values = zip(where, read(given, where), read(fit.axis, where), half_widths(fit), strict=True)
    found: list[tuple[Change, Array]] = []
    for c, before, after, half in values:
        if abs(after - before) > half:
            back = residual(write(fit.axis, [c], [before]), fit.logs)[fit.kept] - fit.residual
            change = Change(
                c.label, float(before), float(after), units(c.parameter.unit), rms(back),
                force_unit=units.force,
            )  # fmt: skip
            found.append((change, back))
    found = [t for t in found if t[0].force > LEAST_FORCE * error]
    found = sorted(found, key=lambda t: -t[0].force)[:MOST_CHANGES]
    bases = linear_bases(fit, catalogue) if found else {}
    changes = tuple(
        replace(change, alike=tuple(name for name, basis in bases.items() if _within(back, basis)))
        for change, back in found
    )
    return Refit(error, fit.error, changes, units.force)


def linear_bases(fit: Fit, catalogue: Catalogue) -> dict[str, Array]:
    """Orthonormal basis (n, k) of the force of each absent effect that is linear, by name."""
    out = {}
    for effect in absent_effects(fit.axis, catalogue):
        if effect.kind is Kind.FRICTION or len(effect.strengths) < len(effect.parameters):
            continue
        where = [ParameterReference(effect.name, p) for p in effect.strengths]
        with_it = fit.axis.with_effect(Fitted.at_start(effect))
        out[effect.name] = orthonormal(jacobian(with_it, fit.logs, where)[fit.kept])
    return out


def _within(force: Array, basis: Array) -> bool:
    return rms(unabsorbed(force, basis)) < SAME_FORCE * rms(force)


@dataclass(frozen=True)
class MovedParameter:
    """A parameter that an added effect changed by more than its interval.

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
