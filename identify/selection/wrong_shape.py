"""Wrong shape: a law that is there, in whose place a free curve does better.

A smooth curve over the coordinate that the law assumes is put beside the law: what it takes of the
squared test error in one linear step is what the law's own shape cannot. Blocks left out of the fit
logs choose how smooth it is, whether it turns with the direction of motion, and whether it lets go
at standstill. It is proved as an absent effect is, against the same curve shifted in time. Of a
friction, test functions with standstill are left out: there it may be anything.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog, moving, split_by_log, sticks
from identify.estimation.decision import RULE
from identify.estimation.fit import Fit
from identify.estimation.force_balance import jacobian
from identify.selection.decoys import DECOYS, Proof, Trial, clearer
from identify.selection.smoothed import STIFFNESS, Linearised, choose_stiffness
from twin.curve import Curve
from twin.effect import Effect, Kind
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.model.parameters import ParameterReference
from twin.parallel import spread
from twin.signals import Array

COARSELY = STIFFNESS[::2]  # how smooth a curve may be, to tell whether it helps


@dataclass(frozen=True, eq=False)
class Shape:
    """A free curve for a law: where it lies, and how smooth it is.

    period: m, of the curve; None where it does not repeat. empty: the free curve at zero, laid over
    the law's coordinate. lets_go: whether it does at standstill. stiffness: of each part that the
    data ask for.
    """

    effect: str
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

    @property
    def turns(self) -> bool:
        """Whether a part of it turns with the direction of motion."""
        return self.empty.effect.parts[1].name in self.stiffness


@dataclass(frozen=True, eq=False)
class WrongShape:
    """A free curve in whose place a law has another shape, with the proof.

    taken: part of the whole squared error that one linear step takes on the logs that chose.
    """

    shape: Shape
    proof: Proof
    taken: float

    @property
    def effect(self) -> str:
        """Name of the effect whose law it is."""
        return self.shape.effect


def wrong_shape(fit: Fit, dataset: Dataset) -> WrongShape | None:
    """The law whose free curve takes most of a fit's squared test error, if it is proved."""
    likely = likely_shape(fit, dataset)
    return likely if likely and likely.proof.holds else None


def likely_shape(fit: Fit, dataset: Dataset) -> WrongShape | None:
    """The same, proved or not; None where no curve takes anything."""
    trial, shapes = _by_gain(fit, dataset)
    return _with_proof(trial, shapes[0], fit, dataset) if shapes else None


def wrong_shapes(fit: Fit, dataset: Dataset) -> Iterator[WrongShape]:
    """Each law of a fit that is proved to have another shape; those that take most come first."""
    trial, shapes = _by_gain(fit, dataset)
    proved = (_with_proof(trial, s, fit, dataset) for s in shapes)
    return (w for w in proved if w.proof.holds)


@lru_cache(maxsize=4)  # in the selection, and beside what it named
def _by_gain(fit: Fit, dataset: Dataset) -> tuple[Trial, tuple[Shape, ...]]:
    """The curves that the data ask for by falling gain; of about as little left, fewer parts.

    And the trial of the fit, beside which each is proved.
    """
    trial = Trial.of(fit, dataset)
    shapes = [s for s in _shapes(fit, dataset) if _rubs(trial, s, fit, dataset)]
    left = {s: 1.0 - max(p.gain for p in _proofs(trial, s, fit, dataset, decoys=0)) for s in shapes}
    order: list[Shape] = []
    while left:
        near = [s for s in left if RULE.near * left[s] <= min(left.values())]
        order.append(min(near, key=lambda s: len(s.stiffness)))
        del left[order[-1]]
    return trial, tuple(order)


def best_shape(fit: Fit, dataset: Dataset, effect: str) -> WrongShape | None:
    """The free curve for one law that takes most; None where the data ask for none."""
    trial = Trial.of(fit, dataset)
    shapes = [s for s in _shapes(fit, dataset) if s.effect == effect]
    tried = [_with_proof(trial, s, fit, dataset) for s in shapes]
    return max(tried, key=lambda w: w.proof.gain, default=None)


def gain_on_test_logs(found: WrongShape, fit: Fit, dataset: Dataset) -> float:
    """Part of a fit's squared error that a free curve takes on the test logs in one linear step."""
    return _gain(found, fit, replace(dataset, holdout=dataset.test))


def gain_on_fit_logs(found: WrongShape, fit: Fit, dataset: Dataset) -> float:
    """The same on the fit logs, each block by the step of the others."""
    return _gain(found, fit, replace(dataset, holdout=()))


def _gain(found: WrongShape, fit: Fit, dataset: Dataset) -> float:
    return _proofs(Trial.of(fit, dataset), found.shape, fit, dataset, decoys=0)[0].gain


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


def sticking(fit: Fit, shape: Shape) -> bool:
    """Whether a curve says nothing of test functions with standstill."""
    return sticks(fit.axis) or fit.axis[shape.effect].effect.kind is not Kind.FORCE


def _shapes(fit: Fit, dataset: Dataset) -> list[Shape]:
    """A free curve for each curve that a law of the fit assumes, where the data ask for one."""
    made = spread(lambda laws: _chosen(fit, dataset, *laws), _assumed(fit.axis))
    return [s for s in made if s is not None and not _has(fit.axis, s)]


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
    """The smoothing and the form at standstill with the least cross-validated error."""
    forms = (False, True) if curve.by_direction else (False,)
    tried = [_smoothed(fit, dataset, law, curve, lets_go) for lets_go in forms]
    best, _ = min(tried, key=lambda found: found[1])
    return best if best and (best.turns or not curve.rubs) else None


def _smoothed(
    fit: Fit, dataset: Dataset, law: Fitted, curve: Curve, lets_go: bool
) -> tuple[Shape | None, float]:
    """A form with its best smoothing, and its squared cross-validated error; None without any."""
    shape = _laid(fit.axis, law, curve, dataset, lets_go)
    mask = moving(dataset.fit, sticking(fit, shape))[fit.kept]
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


def _laid(axis: AxisModel, law: Fitted, curve: Curve, dataset: Dataset, lets_go: bool) -> Shape:
    free = _free(axis)
    assert free.free_shape is not None
    period = None if curve.period is None else law.values[curve.period]
    values = free.free_shape.laid(curve, period, dataset.excitation, lets_go)
    empty = Fitted.at_start(free, values)
    if not curve.by_direction:
        empty = replace(empty, fixed=empty.fixed | set(free.parts[1].strengths))
    return Shape(law.effect.name, curve, period, empty, lets_go, {})


def _free(axis: AxisModel) -> Effect:
    """The effect that can stand in the place of a further law of an axis."""
    return next(e for e in load_catalogue().after(axis.names) if e.free_shape)


def _rubs(trial: Trial, shape: Shape, fit: Fit, dataset: Dataset) -> bool:
    """Whether a curve for friction does so: what turns with the direction is proved by itself.

    What does not is any force of its coordinate.
    """
    if not shape.curve.rubs:
        return True
    turned = shape.empty.effect.parts[1].name
    alone = replace(shape, stiffness={turned: shape.stiffness[turned]})
    return clearer(_proofs(trial, alone, fit, dataset)).holds


@lru_cache(maxsize=4)
def _with_proof(trial: Trial, shape: Shape, fit: Fit, dataset: Dataset) -> WrongShape:
    proofs = _proofs(trial, shape, fit, dataset)
    return WrongShape(shape, clearer(proofs), taken=proofs[0].gain)


def _proofs(
    trial: Trial, shape: Shape, fit: Fit, dataset: Dataset, decoys: int = DECOYS
) -> tuple[Proof, Proof]:
    """Of the whole error and of that of a typical block."""
    resting = sticking(fit, shape)
    samples = int(np.count_nonzero(moving(dataset.fit, resting)))
    return trial.proofs(_columns(fit.axis, shape, samples), sticking=resting, decoys=decoys)


def _columns(
    axis: AxisModel, shape: Shape, samples: int
) -> Callable[[Sequence[PreparedLog]], list[Array]]:
    """Forces (m, j) N of each log such that the smoothing of j strengths is a unit penalty."""
    effect = shape.empty.effect
    alone = replace(axis, effects=(shape.empty,))
    parts = [p for p in effect.parts if p.name in shape.stiffness]
    scales = []
    for part in parts:
        rows = np.sqrt(samples) * shape.stiffness[part.name] * part.rows(len(part.strengths))
        scales.append(np.linalg.inv(np.linalg.cholesky(rows.T @ rows)).T)

    def columns(logs: Sequence[PreparedLog]) -> list[Array]:
        every = []
        for part, scale in zip(parts, scales, strict=True):
            where = [ParameterReference(effect.name, effect.parameter(n)) for n in part.strengths]
            every.append(jacobian(alone, logs, where) @ scale)
        return split_by_log(np.hstack(every), logs)

    return columns
