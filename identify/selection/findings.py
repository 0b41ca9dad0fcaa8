"""Findings: what a missing effect, or another shape, explains of the test error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

from identify.dataset.dataset import Dataset
from identify.dataset.given_logs import Role
from identify.estimation.errors import Errors, error_in, gain_held_out
from identify.estimation.fit import Fit, fit_axis
from identify.selection.bends import Bend, bend_of, straight
from identify.selection.bent_curve import bent_curve
from identify.selection.confidence import confidence
from identify.selection.decoys import Proof, proof
from identify.selection.found_shape import FoundShape, found_shape
from identify.selection.wrong_shape import WrongShape, gain_on_test_logs
from twin.effect import Effect
from twin.model.machine import AxisModel


class FindingKind(Enum):
    """What is wrong with the model.

    It lacks an effect; a law of it has another shape than the machine's force; it lacks an effect
    that the nearest one of the catalogue resembles, with another shape of its law.
    """

    MISSING = "missing"
    WRONG_SHAPE = "wrong_shape"
    RESEMBLES = "resembles"


@dataclass(frozen=True)
class Finding:
    """A missing effect, or one whose law has the wrong shape, that the data prove.

    tied: effects that these data cannot separate from it. explains: part of the squared test error
    above the noise floor that comes back when it alone is taken out, at most 1. tested: test
    errors in ``unit`` without it and with it; of a wrong shape with the law and with a free curve,
    as one linear step predicts where no refit was made. chosen: the same on the logs that chose;
    without test logs the test errors are these. parameters, parameter_units: of its law. proof:
    beside decoys; None where a shift in time makes none. shape: the curve that is assumed and the
    one found, where they differ. bend: what gives the law that curve, where it has such a
    parameter. left, left_fitted: over the noise floor, the error that all findings together leave
    on the logs that chose, and on the training logs.
    """

    effect: str
    tied: tuple[str, ...]
    explains: float
    tested: Errors
    chosen: Errors
    unit: str
    parameters: dict[str, float]
    proof: Proof | None
    kind: FindingKind = FindingKind.MISSING
    shape: FoundShape | None = None
    bend: Bend | None = None
    left: float = 1.0
    left_fitted: float = 1.0
    parameter_units: dict[str, str] = field(default_factory=dict)

    @property
    def is_sure(self) -> bool:
        """Whether a wrong shape differs from the law somewhere by more than its band."""
        if self.kind is not FindingKind.WRONG_SHAPE or self.shape is None:
            return True
        return self.bend is not None or self.shape.differs

    @property
    def confidence(self) -> float:
        """How often such an answer was right on machines of the self-test, 0..1."""
        return confidence(self.least_left)

    @property
    def least_left(self) -> float:
        """What is left over the noise floor where it is least: on training or on other logs."""
        return min(self.left, self.left_fitted)


def found(
    effect: Effect, tied: tuple[str, ...], base: Fit, final: Fit, without: Fit, dataset: Dataset
) -> Finding:
    """The finding of one effect of a final fit; without: the same fit less this effect alone.

    An effect with another bend than its law holds by design resembles what is missing.
    """
    chosen, tested = _errors(without, final, dataset)
    fitted = final.axis[effect.name]
    bend = bend_of(fitted)
    finding = Finding(
        effect=effect.name,
        tied=tied,
        explains=share_explained(tested, base, dataset),
        tested=tested,
        chosen=chosen,
        unit=final.axis.units.force,
        parameters=dict(fitted.values),
        parameter_units=final.axis.parameter_units(effect.name),
        proof=proof(without, fitted, dataset, gain_held_out(without, final, dataset)),
        bend=bend,
    )
    if bend is None or not bend.differs:
        return finding
    law = straight(final, dataset, fitted, bend).axis[effect.name]
    drawn = bent_curve(law, final, dataset)
    return replace(finding, kind=FindingKind.RESEMBLES, shape=drawn)


def found_wrong(shape: WrongShape, base: Fit, final: Fit, dataset: Dataset) -> Finding:
    """The finding of a law with the wrong shape in a final fit."""
    chosen = tested = _linear_step(final, dataset, dataset.chosen_on, shape.taken)
    if dataset.test:
        gain = gain_on_test_logs(shape, final, dataset)
        tested = _linear_step(final, dataset, Role.TEST, gain)
    drawn = found_shape(shape.shape, final, dataset)
    return _of_shape(shape, drawn, base, final.axis, dataset, (chosen, tested))


def found_reshaped(
    shape: WrongShape, base: Fit, before: Fit, final: Fit, dataset: Dataset
) -> Finding:
    """The finding of a law whose free curve a final fit has; before: the fit with the law alone.

    As of a missing effect, the final fit less this curve tells what it explains.
    """
    curve = shape.shape.empty.effect.name
    if curve not in final.axis.names:
        return _found_bent(shape, base, before, final, dataset)
    axis = final.axis.without(curve)
    if shape.effect not in axis.names:
        axis = axis.with_effect(before.axis[shape.effect])
    without = fit_axis(axis, dataset.fit)
    drawn = found_shape(shape.shape, before, dataset)
    errors = _errors(without, final, dataset)
    return _of_shape(shape, drawn, base, before.axis, dataset, errors)


def _found_bent(shape: WrongShape, base: Fit, before: Fit, final: Fit, dataset: Dataset) -> Finding:
    """The same of a law whose own curve is bent in a final fit, if that has it still."""
    held = before.axis[shape.effect]
    law = final.axis[shape.effect] if shape.effect in final.axis.names else held
    bend = bend_of(law)
    if bend is None or bend.parameter not in held.fixed:
        return found_wrong(shape, base, before, dataset)
    bend = replace(bend, held=held.values[bend.parameter])
    errors = _errors(straight(final, dataset, law, bend), final, dataset)
    drawn = bent_curve(held, final, dataset)
    return replace(_of_shape(shape, drawn, base, final.axis, dataset, errors), bend=bend)


def _errors(without: Fit, final: Fit, dataset: Dataset) -> tuple[Errors, Errors]:
    """On the logs that chose, and on test logs; without these the first twice."""
    chosen = Errors.of(without, final, dataset, dataset.chosen_on)
    return chosen, Errors.of(without, final, dataset, Role.TEST) if dataset.test else chosen


def _of_shape(
    shape: WrongShape,
    drawn: FoundShape,
    base: Fit,
    axis: AxisModel,
    dataset: Dataset,
    errors: tuple[Errors, Errors],
) -> Finding:
    """The finding of a wrong shape of a law of an axis, with its chosen and tested errors."""
    chosen, tested = errors
    return Finding(
        effect=shape.effect,
        tied=(),
        explains=max(share_explained(tested, base, dataset), 0.0),
        tested=tested,
        chosen=chosen,
        unit=axis.units.force,
        parameters=dict(axis[shape.effect].values),
        parameter_units=axis.parameter_units(shape.effect),
        proof=shape.proof,
        kind=FindingKind.WRONG_SHAPE,
        shape=drawn,
    )


def with_shape(findings: Sequence[Finding], wrong: Finding) -> tuple[Finding, ...]:
    """The findings with a wrong shape: that of a missing effect says what it resembles."""
    if wrong.effect not in [f.effect for f in findings]:
        return (*findings, wrong)
    return tuple(
        replace(f, kind=FindingKind.RESEMBLES, shape=wrong.shape)
        if (f.effect, f.kind) == (wrong.effect, FindingKind.MISSING)
        else f
        for f in findings
    )


def as_a_whole(findings: tuple[Finding, ...], final: Fit, dataset: Dataset) -> tuple[Finding, ...]:
    """The findings with what they leave together, beside a final fit with the missing effects."""
    errors = [f.chosen.after for f in findings if f.kind is FindingKind.WRONG_SHAPE]
    least = min([error_in(dataset.chosen_on, final, dataset), *errors])
    return tuple(replace(f, left=least / final.floor, left_fitted=final.ratio) for f in findings)


def squared_left(finding: Finding) -> float:
    """Squared error that a finding leaves on the logs that chose, N^2."""
    return finding.chosen.after**2


def _linear_step(fit: Fit, dataset: Dataset, on: Role, gain: float) -> Errors:
    """The errors of a fit before and after a linear step that takes this part of the square.

    Of noise it takes none, whatever it takes of the few test functions that a curve is tried on;
    nor does it add any, where a part of a log is beyond what it was fitted to.
    """
    before = error_in(on, fit, dataset)
    return Errors(before, max(before * (1.0 - max(gain, 0.0)) ** 0.5, min(fit.floor, before)), on)


def share_explained(errors: Errors, base: Fit, dataset: Dataset) -> float:
    """Part of the squared error above the noise floor by which an error falls.

    Of the base's, or of the error before where the fit without one finding leaves more.
    """
    above = max(error_in(errors.on, base, dataset), errors.before) ** 2 - base.floor**2
    taken = errors.before**2 - errors.after**2
    return min(taken / above, 1.0) if above > 0.0 else 0.0
