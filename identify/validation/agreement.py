"""Whether two fits agree within their uncertainties, and which effect would make the difference.

A parameter differs where |b - a| exceeds the quantile of Student's t for that many comparisons at
once (Z. Sidak, JASA 62, 1967) times the joint standard error, the root of the sum of both squared.
An effect that only one of the fits has is, in the other, an effect of no strength.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import hypot, inf
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from identify.dataset.preparation import datasets
from identify.estimation.confounded import linear_bases
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit, Outcome, finished
from identify.estimation.force_balance import residual
from identify.estimation.intervals import BLOCKS, QUANTILE
from identify.estimation.least_squares import orthonormal, unabsorbed
from identify.estimation.variable_projection import usable
from identify.printed import Printed
from identify.rules import RULE
from twin.effects import Catalogue
from twin.errors import CannotRun, InputError
from twin.model.machine import MachineModel
from twin.model.parameters import ParameterReference, all_parameters, free_parameters, read, write
from twin.record import Number, computed, record
from twin.signals import Array
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator


@record
class Difference:
    """One parameter in two fits, in ``unit``."""

    a: Number
    b: Number
    standard_error: Number
    """Of the difference, the root of the sum of both squared."""
    unit: str
    limit: Number
    """Joint standard errors above which the parameter differs."""

    @computed
    def difference(self) -> Number:
        """b - a."""
        return self.b - self.a

    @computed
    def in_standard_errors(self) -> Number:
        """The difference in joint standard errors."""
        return self.difference / self.standard_error if self.standard_error else inf

    @computed
    def differs(self) -> bool:
        """Whether it is more than the uncertainties allow."""
        return abs(self.in_standard_errors) > self.limit


@record
class Cause:
    """An effect that neither fit has and that could make a share of the squared difference."""

    effect: str
    share: Number
    or_: Annotated[tuple[str, ...], Field(alias="or")] = ()
    """Other effects that could make the same share."""


@record
class AxisAgreement:
    """Whether two fits of one axis agree."""

    parameters: Mapping[str, Difference]
    not_compared: Sequence[str]
    """Without an interval, or held at different values."""
    only_in_a: Sequence[str]
    """Effects that one of the fits has alone."""
    only_in_b: Sequence[str]
    error_over_noise_floor: tuple[Number, Number]
    force_unit: str
    force: Number | None = None
    """RMS of what the parameters that differ amount to, along a simulated motion; null where
    nothing differs or no motion can be simulated."""
    causes: Sequence[Cause] = ()
    """Effects that together could make the difference, the largest share first."""

    @computed
    def differing(self) -> list[str]:
        """The parameters that differ, the surest first."""
        known = self.parameters
        labels = (label for label, d in known.items() if d.differs)
        return sorted(labels, key=lambda label: -abs(known[label].in_standard_errors))

    @computed
    def agree(self) -> bool:
        """Whether none of them differs."""
        return not self.differing

    @property
    def of_wrong_models(self) -> bool:
        """Whether a fit's error is more than noise, so that its intervals are scatter alone."""
        return max(self.error_over_noise_floor) > RULE.at_floor


@dataclass(frozen=True, repr=False)
class Agreement(Printed):
    """Two fits, axis by axis. not_compared: axes without intervals in one of them."""

    axes: Mapping[str, AxisAgreement]
    not_compared: Sequence[str] = ()

    @property
    def agree(self) -> bool:
        """Whether no parameter differs by more than the uncertainties allow."""
        return all(axis.agree for axis in self.axes.values())


def agreement(a: MachineModel, b: MachineModel, catalogue: Catalogue) -> Agreement:
    """Compare two fitted machines by the intervals that they carry.

    catalogue: effects that may be the cause of a difference. Raises InputError where no parameter
    has an interval in both.
    """
    shared = [axis for axis in a.axes if axis in b.axes]
    if not shared:
        names = (", ".join(model.axes) for model in (a, b))
        raise InputError(
            "the models have no axis in common: one has {}, the other {}".format(*names)
        )
    axes = {}
    for axis in shared:
        if not all(axis in fit.intervals and fit.intervals[axis].ends for fit in (a, b)):
            continue
        found = _compared(a, b, axis)
        if found.parameters:
            axes[axis] = _explained(found, a, b, axis, catalogue) if found.differing else found
    if not axes:
        raise InputError(
            "no parameter has an interval in both models, so nothing can be "
            f"compared; {_what_to_do(a, b)}"
        )
    return Agreement(axes, tuple(axis for axis in shared if axis not in axes))


def _what_to_do(a: MachineModel, b: MachineModel) -> str:
    """How the machines would come to intervals, as the end of a sentence."""
    above = max((i.above_floor for m in (a, b) for i in m.intervals.values()), default=1.0)
    if above > RULE.at_floor:
        return (
            f"a fit that leaves {above:.3g} times its noise floor has none, as its model is wrong: "
            "find what it lacks with `twin diagnose MODEL LOG...`"
        )
    return "fit each with `twin fit MODEL LOG... -o FILE`, which writes its intervals"


def _compared(a: MachineModel, b: MachineModel, axis: str) -> AxisAgreement:
    one, two = _numbers(a, axis), _numbers(b, axis)
    own, other = set(a.axes[axis].names), set(b.axes[axis].names)
    units = a.axes[axis].units
    pairs: dict[str, tuple[float, float, float, str]] = {}
    skipped = []
    for label in {**one, **two}:
        parameter = (one.get(label) or two[label]).reference.parameter
        if not parameter.strength and (label in one) != (label in two):
            continue  # a shape of an effect that the other has not
        first, second = (side[label][1:] if label in side else (0.0, 0.0) for side in (one, two))
        if first[1] is None or second[1] is None:
            skipped.append(label)
        elif error := hypot(first[1], second[1]):
            pairs[label] = first[0], second[0], error, units(parameter.unit)
        elif first[0] != second[0]:
            skipped.append(label)
    limit = _limit(len(pairs))
    return AxisAgreement(
        {label: Difference(*pair, limit) for label, pair in pairs.items()},
        tuple(skipped), tuple(sorted(own - other)), tuple(sorted(other - own)),
        (a.intervals[axis].above_floor, b.intervals[axis].above_floor),
        units.force,
    )  # fmt: skip


class _Number(NamedTuple):
    """A parameter with its standard error, 0 where it was held; None where it is not known."""

    reference: ParameterReference
    value: float
    error: float | None


def _numbers(model: MachineModel, axis: str) -> dict[str, _Number]:
    """All parameters of an axis by label, the mass first."""
    stage, intervals = model.axes[axis], model.intervals[axis].ends
    every, free, out = all_parameters(stage), free_parameters(stage), {}
    for reference, value in zip(every, read(stage, every).tolist(), strict=True):
        error: float | None = None if reference in free else 0.0
        if reference.label in intervals:
            low, high = intervals[reference.label]
            error = max(high - value, value - low) / QUANTILE
        out[reference.label] = _Number(reference, value, error)
    return out


def _limit(count: int) -> float:
    """Quantile of t that none of so many comparisons exceeds, but for FALSE_ALARM."""
    from scipy.special import stdtrit  # no fit needs it

    false_alarm = 0.01  # chance that two fits of one machine are said to differ
    each = 1.0 - (1.0 - false_alarm) ** (1.0 / max(count, 1))
    return float(stdtrit(2 * (BLOCKS - 1), 1.0 - each / 2.0))


def _explained(
    found: AxisAgreement, a: MachineModel, b: MachineModel, axis: str, catalogue: Catalogue
) -> AxisAgreement:
    """The same with the force of the difference and the effects that could make it."""
    base = _along_a_motion(a, axis)
    there = _numbers(b, axis)
    moved = [there[label] for label in found.differing if label in there]
    moved = [n for n in moved if n.reference.effect in ("", *a.axes[axis].names)]
    if base is None or not moved:
        return found
    changed = write(base.axis, [n.reference for n in moved], [n.value for n in moved])
    force = (residual(changed, base.logs) - residual(base.axis, base.logs))[base.kept]
    known = usable(catalogue, a)
    apart = Catalogue([known[n] for n in known if n not in b.axes[axis].names])
    return replace(found, force=rms(force), causes=_causes(force, linear_bases(base, apart)))


def _causes(force: Array, bases: Mapping[str, Array]) -> tuple[Cause, ...]:
    """Effects that make up a force (n,) N, one after another, by their bases (n, k).

    None of no force, which what differs may make where the simulated motion does not reach.
    """
    causes: list[Cause] = []
    taken, left, whole = np.zeros((len(force), 0)), 1.0, rms(force)
    if whole == 0.0:
        return ()
    while len(causes) < len(bases):
        joined = {n: orthonormal(np.hstack([taken, basis])) for n, basis in bases.items()}
        shares = {n: left - (rms(unabsorbed(force, q)) / whole) ** 2 for n, q in joined.items()}
        most = max(shares.values())
        if most < 0.05:  # of the squared force of the difference, for an effect to be a cause of it
            break
        alike = 0.01  # of that squared force, by which effects that explain equally much may differ
        # Of effects that explain equally much the one with the fewest parameters comes first.
        equal = [n for n, share in shares.items() if share > most - alike]
        best = min(equal, key=lambda n: bases[n].shape[1])
        causes.append(Cause(best, shares[best], tuple(n for n in equal if n != best)))
        taken, left = joined[best], left - shares[best]
    return tuple(causes)


def _along_a_motion(model: MachineModel, axis: str) -> Fit | None:
    """The model on a simulated motion of its own; None where the machine can make none."""
    try:
        tried = 10.0  # s of simulated motion along which forces are compared
        log = simulate(model, "tracking", duration=tried, simulator=ReducedSimulator)
    except CannotRun:
        return None
    stage = model.axes[axis]
    return finished(stage, stage, datasets(model, {"": log}, {})[axis].training, Outcome.CONVERGED)
