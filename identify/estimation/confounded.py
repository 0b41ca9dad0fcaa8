"""Confounded parameters: values that a fit changed, and what may have caused the change.

An effect whose force equals that of a parameter (a tilt and the constant of the cable, a payload
and the mass) is absorbed by the fit and never found missing. It shows as a changed value here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import PreparedLog
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit, is_linear
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
from twin.record import Number, record

Array = NDArray[np.float64]


@record
class ParameterShift:
    """A parameter that a fit moved by more than its interval."""

    parameter: str
    before: Number
    after: Number
    unit: str
    force: Number
    """RMS force that the change makes."""
    same_force_as: tuple[str, ...] = ()
    """Absent effects that can produce the same force."""
    force_unit: str = LINEAR.force


@record
class Refit:
    """RMS force errors of an axis before and after a fit, and what it changed most."""

    force_error_as_given: Number
    force_error: Number
    changed: tuple[ParameterShift, ...]
    force_unit: str = LINEAR.force


def refit(given: AxisModel, fit: Fit, catalogue: Catalogue) -> Refit:
    """What a fit changed of the given model; nothing where its error was at the noise floor."""
    error, units = rms(residual(given, fit.logs)[fit.kept]), fit.axis.units
    if not error > RULE.at_floor * max(fit.floor, fit.error):
        return Refit(error, fit.error, (), units.force)
    where = fit.scaling.where
    before, after = read(given, where), read(fit.axis, where)
    moved = np.flatnonzero(np.abs(after - before) > half_widths(fit))
    backs = _backs(fit, moved, before - after)
    found = sorted(zip(map(rms, backs), moved, backs, strict=True), key=lambda t: -t[0])
    # 0.1 of the error before the fit: least force of a change that is reported
    found = [t for t in found if t[0] > 0.1 * error][:3]  # no more are reported
    alike = _alike(fit, catalogue, [back for *_, back in found])
    told = []
    for (force, j, _), names in zip(found, alike, strict=True):
        unit, values = units(where[j].parameter.unit), (float(before[j]), float(after[j]))
        told.append(ParameterShift(where[j].label, *values, unit, force, names, units.force))
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
    # 4 s of the first log, on which most effects show that they are none of the alike
    head = PreparedLog.of(whole.motion.head(4.0), whole.test_function.length)
    first = fit.kept[: len(head)]

    def is_made(force: Array, basis: Array) -> bool:
        left = np.linalg.norm(unabsorbed(force[: len(basis)], basis))
        # largest part of that force outside the span of an effect with the same force
        same_force = 0.01
        return bool(left < same_force * np.linalg.norm(force))

    for effect in _linear_effects(fit, catalogue) if forces else ():
        begun = orthonormal(_columns(fit, effect, [head])[first])
        if not any(is_made(force, begun) for force in forces):
            continue
        basis = orthonormal(_columns(fit, effect, fit.logs)[fit.kept])
        for names, force in zip(found, forces, strict=True):
            if is_made(force, basis):
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
    was, now = (
        {
            c: (value, width)
            for c, value, width in zip(
                fit.scaling.where, read(fit.axis, fit.scaling.where), half_widths(fit), strict=True
            )
        }
        for fit in (before, after)
    )
    out = []
    for c in (c for c in was if c in now):
        (a, earlier), (b, later) = was[c], now[c]
        # Its new interval does not matter here: a confounded parameter may be collinear with the
        # effect.
        collapsed = c.parameter.strength and abs(b) < RULE.collapse * abs(a) and abs(a) > earlier
        if collapsed or abs(b - a) > np.hypot(earlier, later):
            unit = after.axis.units(c.parameter.unit)
            out.append(MovedParameter(c.label, float(a), float(b), unit, bool(collapsed)))
    return tuple(out)
