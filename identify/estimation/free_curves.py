"""Free curves: a smooth curve over the coordinate that a law assumes, in its place or beside it.

What such a curve takes in one linear step is what the law's own shape cannot. Blocks left out of
the training logs choose how smooth it is, whether it turns with the direction of motion, and
whether it lets go at standstill. Of a friction, test functions with standstill are left out: there
it may be anything.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import (
    Columns,
    PreparedLog,
    motor_gain,
    moving,
    split_by_log,
    sticks,
)
from identify.estimation.fit import Fit
from identify.estimation.force_balance import jacobian
from identify.estimation.splines import STIFFNESS, Linearised, choose_stiffness
from identify.rules import RULE
from twin.curve import Curve
from twin.effect import Effect, Kind
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.model.parameters import ParameterReference
from twin.parallel import spread

COARSELY = STIFFNESS[::2]  # how smooth a curve may be, to tell whether it helps


@dataclass(frozen=True, eq=False)
class Shape:
    """A free curve for a law: where it lies, and how smooth it is.

    effect, kind: name and kind of the effect whose law it is. period: m, of the curve; None where
    it does not repeat. empty: the free curve at zero, laid over the law's coordinate. lets_go:
    whether it does at standstill. stiffness: of each part that the data ask for.
    """

    effect: str
    kind: Kind
    curve: Curve
    period: float | None
    empty: Fitted
    lets_go: bool
    stiffness: Mapping[str, float]

    @property
    def beside(self) -> bool:
        """Whether it goes beside the law, not in its place.

        A friction law holds the axis at rest, and any law that does not repeat goes on where the
        logs have not been; beyond them a curve keeps its end value.
        """
        return self.period is None


def shapes_of(fit: Fit, dataset: Dataset, effect: str | None = None) -> list[Shape]:
    """A free curve for each curve that a law of the fit assumes, where the data ask for one.

    effect: of the law of that effect alone.
    """
    assumed = [
        (law, curve) for law, curve in _assumed(fit.axis) if effect in (None, law.effect.name)
    ]
    made = spread(lambda laws: _chosen(fit, dataset, *laws), assumed)
    return [s for s in made if s is not None and not _has(fit.axis, s)]


def having_shape(effect: Effect, model: MachineModel, axis: str | None) -> list[str]:
    """The axes of a model, or the one given, where a free curve can replace the effect's law.

    Raises InputError where there is none.
    """
    if not effect.curves:
        raise InputError(f"the law of {effect.name} assumes no curve that could have another shape")
    names = [axis] if axis else list(model.axes)
    having = [n for n in names if effect.name in model.axis(n).names]
    if not having:
        raise InputError(
            f"axis {', '.join(names)} has no effect '{effect.name}'; `twin add {effect.name}` adds "
            "it"
        )
    return having


def sticking(axis: AxisModel, shape: Shape) -> bool:
    """Whether a curve says nothing of test functions with standstill."""
    return sticks(axis) or shape.kind is not Kind.FORCE


def columns_of(axis: AxisModel, shape: Shape, samples: int) -> Columns:
    """Forces (m, j) N of each log such that the smoothing of j strengths is a unit penalty."""
    effect = shape.empty.effect
    alone = replace(axis, effects=(shape.empty,))
    parts = [p for p in effect.parts if p.name in shape.stiffness]
    scales = []
    for part in parts:
        rows = np.sqrt(samples) * shape.stiffness[part.name] * part.rows(len(part.strengths))
        scales.append(np.linalg.inv(np.linalg.cholesky(rows.T @ rows)).T)

    def columns(logs: Sequence[PreparedLog]) -> list[np.ndarray]:
        every = []
        for part, scale in zip(parts, scales, strict=True):
            where = [ParameterReference(effect.name, effect.parameter(n)) for n in part.strengths]
            every.append(jacobian(alone, logs, where) @ scale)
        return split_by_log(np.hstack(every) / motor_gain(axis, logs), logs)

    return columns


def _assumed(axis: AxisModel) -> list[tuple[Fitted, Curve]]:
    """The laws with their curves; of two over the same coordinate the more special one."""
    frictions_first = sorted(axis.effects, key=lambda f: f.effect.kind is not Kind.FRICTION)
    unlike: dict[tuple[object, ...], tuple[Fitted, Curve]] = {}
    for fitted in frictions_first:
        for curve in fitted.effect.curves:
            period = fitted.values.get(curve.period or "")
            unlike[curve.over, period, curve.by_direction] = (fitted, curve)
    return list(unlike.values())


def _chosen(fit: Fit, dataset: Dataset, law: Fitted, curve: Curve) -> Shape | None:
    """The smoothing and the form at standstill with the least cross-validated error.

    A curve for each direction needs both to be well visited.
    """
    if curve.by_direction and not _both_ways(fit, dataset):
        if curve.rubs:
            return None
        curve = replace(curve, by_direction=False)
    forms = (False, True) if curve.by_direction else (False,)
    tried = [_smoothed(fit, dataset, law, curve, lets_go) for lets_go in forms]
    return min(tried, key=lambda found: found[1])[0]


def _both_ways(fit: Fit, dataset: Dataset) -> bool:
    """Whether each direction has a fifth of the motion: of fewer, a curve is a guess."""
    velocity = np.concatenate(
        [log.test_function.mean(log.motion.velocity) for log in dataset.training]
    )
    ahead = float(np.mean(velocity[fit.kept] > 0.0))
    return min(ahead, 1.0 - ahead) >= RULE.least_part


def _smoothed(
    fit: Fit, dataset: Dataset, law: Fitted, curve: Curve, lets_go: bool
) -> tuple[Shape | None, float]:
    """A form with its best smoothing, and its squared cross-validated error; None without any."""
    shape = _laid(fit.axis, law, curve, dataset, lets_go)
    if shape is None:
        return None, np.inf
    mask = moving(dataset.training, sticking(fit.axis, shape))[fit.kept]
    linear = Linearised.about(fit, dataset, shape.empty, mask)
    stiffness = choose_stiffness(linear, COARSELY)
    if not stiffness:
        return None, np.inf
    return replace(shape, stiffness=stiffness), linear.left_out_error(stiffness)


def _has(axis: AxisModel, shape: Shape) -> bool:
    """Whether the axis has a free curve of such parts over that coordinate."""
    own = set(shape.stiffness)
    return any(
        own <= {p.name for p in f.effect.parts if not f.fixed.issuperset(p.strengths)}
        and all(np.isclose(f.values[n], shape.empty.values[n]) for n in f.effect.free_shape.over)
        for f in axis.effects
        if f.effect.free_shape
    )


def _laid(
    axis: AxisModel, law: Fitted, curve: Curve, dataset: Dataset, lets_go: bool
) -> Shape | None:
    """The curve at zero; None where the axis has as many as it can have."""
    free = next((e for e in load_catalogue().after(axis.names) if e.free_shape), None)
    if free is None or free.free_shape is None:
        return None
    period = None if curve.period is None else law.values[curve.period]
    values = free.free_shape.laid(curve, period, dataset.excitation, lets_go)
    empty, (even, odd) = Fitted.at_start(free, values), free.parts
    if not curve.by_direction:
        empty = replace(empty, fixed=empty.fixed | set(odd.strengths))
    if curve.rubs:  # a force that does not turn with the direction is no friction
        empty = replace(empty, fixed=empty.fixed | set(even.strengths))
    return Shape(law.effect.name, law.effect.kind, curve, period, empty, lets_go, {})
