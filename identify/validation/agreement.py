"""Whether two fits agree within their uncertainties, and which effect would make the difference.

A parameter differs where |b - a| exceeds the quantile of Student's t for that many comparisons at
once (Z. Sidak, JASA 62, 1967) times the joint standard error, the root of the sum of both squared.
An effect that only one of the fits has is, in the other, an effect of no strength.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot, inf

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import datasets
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit, Outcome, finished
from identify.estimation.force_balance import residual
from identify.estimation.intervals import BLOCKS, LARGEST_RATIO, QUANTILE
from identify.estimation.least_squares import orthonormal, unabsorbed
from identify.selection.candidates import usable
from identify.selection.confounded import linear_bases
from twin.effects import Catalogue
from twin.errors import CannotRun, InputError
from twin.experiments.named import simulate
from twin.model.machine import AxisModel, MachineModel
from twin.model.parameters import ParameterReference, free_parameters, write
from twin.simulator import ReducedSimulator

Array = NDArray[np.float64]

FALSE_ALARM = 0.01  # chance that two fits of one machine are said to differ
LEAST_SHARE = 0.05  # of the squared force of the difference, for an effect to be a cause of it
ALIKE = 0.01  # of that squared force, by which effects that explain equally much may differ
TRIED = 10.0  # s of simulated motion along which forces are compared


@dataclass(frozen=True)
class Difference:
    """One parameter in two fits: a, b and the joint standard error in ``unit``.

    limit: of ``ratio``, above which the parameter differs.
    """

    label: str
    a: float
    b: float
    standard_error: float
    unit: str
    limit: float

    @property
    def ratio(self) -> float:
        """b - a in joint standard errors."""
        return (self.b - self.a) / self.standard_error if self.standard_error else inf

    @property
    def differs(self) -> bool:
        """Whether it is more than the uncertainties allow."""
        return abs(self.ratio) > self.limit


@dataclass(frozen=True)
class Cause:
    """An effect that neither fit has and that could make a share of the squared difference.

    alike: other effects that could make the same share.
    """

    effect: str
    share: float
    alike: tuple[str, ...] = ()


@dataclass(frozen=True)
class AxisAgreement:
    """Two fits of one axis.

    not_compared: labels without an interval, or held at different values. only_a, only_b: effects
    that one of the fits has alone. above_floor: force error over noise floor of both fits. force:
    RMS force (in ``unit``) of the parameters that differ, along a simulated motion; None where
    nothing differs or no motion can be simulated. causes: effects that together could make the
    difference, the largest share first.
    """

    differences: Sequence[Difference]
    not_compared: Sequence[str]
    only_a: Sequence[str]
    only_b: Sequence[str]
    above_floor: tuple[float, float]
    unit: str
    force: float | None = None
    causes: Sequence[Cause] = ()

    @property
    def differing(self) -> list[Difference]:
        """The parameters that differ, the surest first."""
        return sorted((d for d in self.differences if d.differs), key=lambda d: -abs(d.ratio))

    @property
    def of_wrong_models(self) -> bool:
        """Whether a fit's error is more than noise, so that its intervals are scatter alone."""
        return max(self.above_floor) > LARGEST_RATIO


@dataclass(frozen=True)
class Agreement:
    """Two fits, axis by axis. not_compared: axes without intervals in one of them."""

    axes: Mapping[str, AxisAgreement]
    not_compared: Sequence[str] = field(default=())

    @property
    def agrees(self) -> bool:
        """Whether no parameter differs by more than the uncertainties allow."""
        return not any(axis.differing for axis in self.axes.values())


def agreement(a: MachineModel, b: MachineModel, catalogue: Catalogue) -> Agreement:
    """Compare two fitted machines by the intervals that they carry.

    catalogue: effects that may be the cause of a difference. Raises InputError where no parameter
    has an interval in both.
    """
    shared = [axis for axis in a.axes if axis in b.axes]
    axes = {}
    for axis in shared:
        if not all(axis in fit.intervals and fit.intervals[axis].ends for fit in (a, b)):
            continue
        found = _compared(a, b, axis)
        if found.differences:
            axes[axis] = _explained(found, a, b, axis, catalogue) if found.differing else found
    if not axes:
        raise InputError(
            f"{a.name} and {b.name}: no parameter has an interval in both, so nothing can be "
            f"compared; {_what_to_do(a, b)}"
        )
    return Agreement(axes, tuple(axis for axis in shared if axis not in axes))


def _what_to_do(a: MachineModel, b: MachineModel) -> str:
    """How the machines would come to intervals, as the end of a sentence."""
    above = max((i.above_floor for m in (a, b) for i in m.intervals.values()), default=1.0)
    if above > LARGEST_RATIO:
        return (
            f"a fit that leaves {above:.3g} times its noise floor has none, as its model is wrong: "
            "find what it lacks with `twin diagnose MODEL LOG...`"
        )
    return "fit each with `twin fit MODEL LOG... -o FILE`, which writes its intervals"


def _compared(a: MachineModel, b: MachineModel, axis: str) -> AxisAgreement:
    one, two = _numbers(a, axis), _numbers(b, axis)
    own, other = set(a.axes[axis].names), set(b.axes[axis].names)
    pairs, skipped = {}, []
    for label in {**one, **two}:
        first, second = one.get(label), two.get(label)
        if first is None or second is None:
            known = one.get(label) or two[label]
            if not known.reference.parameter.strength:
                continue  # a shape of an effect that the other has not
            absent = _Number(0.0, 0.0, known.reference)
            first, second = first or absent, second or absent
        if first.error is None or second.error is None:
            skipped.append(label)
        elif error := hypot(first.error, second.error):
            pairs[label] = first, second, error
        elif first.value != second.value:
            skipped.append(label)
    units = a.axes[axis].units
    limit = _limit(len(pairs))
    differences = tuple(
        Difference(
            label, first.value, second.value, error, units(first.reference.parameter.unit), limit
        )
        for label, (first, second, error) in pairs.items()
    )
    return AxisAgreement(
        differences, tuple(skipped), tuple(sorted(own - other)), tuple(sorted(other - own)),
        (a.intervals[axis].above_floor, b.intervals[axis].above_floor),
        units.force,
    )  # fmt: skip


@dataclass(frozen=True)
class _Number:
    """A parameter with its standard error, 0 where it was held; None where it is not known."""

    value: float
    error: float | None
    reference: ParameterReference


def _numbers(model: MachineModel, axis: str) -> dict[str, _Number]:
    """All parameters of an axis by label, the mass too."""
    stage, intervals = model.axes[axis], model.intervals[axis].ends
    free = {c.label for c in free_parameters(stage)}
    out = {}
    for reference, value in _values(stage):
        label = reference.label
        error: float | None = None if label in free else 0.0
        if label in intervals:
            low, high = intervals[label]
            error = max(high - value, value - low) / QUANTILE
        out[label] = _Number(value, error, reference)
    return out


def _values(axis: AxisModel) -> list[tuple[ParameterReference, float]]:
    own = [
        (ParameterReference(f.effect.name, p), float(f.values[p.name]))
        for f in axis.effects
        for p in f.effect.parameters
    ]
    return [(ParameterReference("", axis.mass_parameter), axis.mass), *own]


def _limit(count: int) -> float:
    """Quantile of t that none of so many comparisons exceeds, but for FALSE_ALARM."""
    from scipy.special import stdtrit  # no fit needs it

    each = 1.0 - (1.0 - FALSE_ALARM) ** (1.0 / max(count, 1))
    return float(stdtrit(2 * (BLOCKS - 1), 1.0 - each / 2.0))


def _explained(
    found: AxisAgreement, a: MachineModel, b: MachineModel, axis: str, catalogue: Catalogue
) -> AxisAgreement:
    """The same with the force of the difference and the effects that could make it."""
    base = _along_a_motion(a, axis)
    differing = {d.label for d in found.differing}
    moved = [(r, v) for r, v in _values(b.axes[axis]) if r.label in differing]
    moved = [(r, v) for r, v in moved if not r.effect or r.effect in a.axes[axis].names]
    if base is None or not moved:
        return found
    changed = write(base.axis, [r for r, _ in moved], [v for _, v in moved])
    force = (residual(changed, base.logs) - residual(base.axis, base.logs))[base.kept]
    known = usable(catalogue, a)
    apart = [n for n in known if n not in b.axes[axis].names]
    bases = linear_bases(base, Catalogue([known[n] for n in apart]))
    return AxisAgreement(
        found.differences, found.not_compared, found.only_a, found.only_b,
        found.above_floor, found.unit, rms(force), _causes(force, bases),
    )  # fmt: skip


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
        if most < LEAST_SHARE:
            break
        # Of effects that explain equally much the one with the fewest parameters comes first.
        equal = [n for n, share in shares.items() if share > most - ALIKE]
        best = min(equal, key=lambda n: bases[n].shape[1])
        causes.append(Cause(best, shares[best], tuple(n for n in equal if n != best)))
        taken, left = joined[best], left - shares[best]
    return tuple(causes)


def _along_a_motion(model: MachineModel, axis: str) -> Fit | None:
    """The model on a simulated motion of its own; None where the machine can make none."""
    try:
        log = simulate(model, "tracking", duration=TRIED, simulator=ReducedSimulator)
    except CannotRun:
        return None
    stage = model.axes[axis]
    return finished(stage, stage, datasets(model, {"": log}, {})[axis].fit, Outcome.CONVERGED)
