"""Candidates: a model with one effect more, its score, and whether its values can be its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.body import ACCURACY
from identify.dataset.coordinates import gathered
from identify.dataset.dataset import Dataset
from identify.dataset.noise_floor import noise_beside
from identify.estimation.alignment import depends_on_time_origin, phases_found
from identify.estimation.errors import error_on
from identify.estimation.evidence import (
    Evidence,
    Gain,
    effective_samples,
    evidence,
    held_out_gain,
    noise_gain,
    rms,
)
from identify.estimation.fit import Fit, at_bounds
from identify.estimation.force_balance import averaged_force
from identify.estimation.least_squares import orthonormal, unabsorbed
from identify.estimation.scaling import AT_EDGE
from identify.rules import RULE
from identify.selection.acceptance import Judged, Score, Taken, score
from identify.selection.refusal import (
    EndsAtBound,
    Instead,
    OutsideKnee,
    Refusal,
    is_of_position,
)
from identify.selection.what import What
from twin.curve import Coordinate
from twin.effect import Effect, Excitation, Kind
from twin.knee import Imitation
from twin.model.machine import AxisModel, Fitted

Array = NDArray[np.float64]

MOTION = ("position", "velocity", "acceleration", "direction")
SAME_FORCE = 0.5  # of a force's square; where the motion leaves less of it, it is one of the motion


@dataclass(frozen=True, eq=False, repr=False)
class Candidate:
    """A model with one effect more: its fit, and what speaks for the effect.

    evidence, gain: Schwarz's criterion on the training logs, and the errors on the logs that were
    not fitted, for the report; neither decides. score: the acceptance test; None where one linear
    step takes so little that no refit was made, or where noise makes too little of the error.
    doubt: why its values cannot be its own; None where they can.
    """

    effect: Effect
    axis: str
    fit: Fit
    evidence: Evidence
    gain: Gain
    score: Score | None = None
    doubt: Refusal | None = None

    @classmethod
    def screened(cls, before: Judged, fit: Fit, effect: Effect, promise: float) -> Candidate:
        """An effect that was not refitted; promise: part of the error that a linear step takes."""
        error = before.other_error
        gain = Gain(error, error * np.sqrt(max(1.0 - max(promise, 0.0), 0.0)), 0.0)
        return cls(effect, before.dataset.axis, fit, Evidence(0.0, 1, 2.0), gain)

    def __repr__(self) -> str:
        return f"<Candidate {self.effect.name} on {self.axis}: {self.refused or 'accepted'}>"

    @property
    def delta_bic(self) -> float:
        """BIC without minus BIC with the effect; positive supports it."""
        return self.evidence.delta_bic

    @property
    def refused(self) -> Refusal | None:
        """Why the data do not prove it; None where they do."""
        if self.score is None:
            noise = self.effect.is_noise
            return Instead.ERROR_OF_ANOTHER_SIZE if noise else Instead.NO_REFIT
        return self.doubt or self.score.refused

    @property
    def supported(self) -> bool:
        """Whether the data prove the effect."""
        return self.refused is None

    @property
    def is_proved(self) -> bool:
        """Whether the data prove its force, whatever law that is."""
        return self.score is not None and self.score.accepted

    @property
    def is_of_position(self) -> bool:
        """Whether the data prove its force, and of that no more than that it is one of position."""
        force = self.effect.kind is Kind.FORCE
        return force and self.is_proved and is_of_position(self.doubt)

    @property
    def part(self) -> float:
        """Part of the error above the floor that it takes; 0 where it was not refitted."""
        return self.score.part if self.score else 0.0

    @property
    def in_turn(self) -> Taken | None:
        """The least that it takes where other logs prove it, choosing in turn."""
        return self.score.in_turn if self.score else None

    @property
    def is_noise(self) -> bool:
        """Whether the effect lowers no error but raises the noise floor."""
        return self.effect.is_noise


def candidate_of(
    before: Judged, after: Judged, effect: Effect, own: Sequence[str], among: int = 1
) -> Candidate:
    """What speaks for a fitted larger model, before its controls are asked.

    own: names of the parameters whose values must be its own. among: of how many it was chosen.
    """
    base, fit, dataset = before.fit, after.fit, before.dataset
    shared = base.kept & fit.kept
    left, less = (f.residual[shared[f.kept]] for f in (base, fit))
    added = max(len(fit.scaling.where) - len(base.scaling.where), 1)
    added += phases_found(fit.axis, effect.name, dataset) if effect.name in fit.axis.names else 0
    both = np.isfinite(before.other) & np.isfinite(after.other)
    return Candidate(
        effect=effect,
        axis=dataset.axis,
        fit=fit,
        evidence=evidence(left, less, added),
        gain=held_out_gain(before.other[both], after.other[both], base.floor),
        score=score(before, after, among=among),
        doubt=doubt(before, fit, effect, own),
    )


def doubt(before: Judged, fit: Fit, effect: Effect, own: Sequence[str]) -> Refusal | None:
    """Why the values that an effect was fitted with cannot be its own; None where they can.

    A value that ended at a bound belongs to another law, whatever the bound's sign; a strength at
    zero is no bound but absence. Where the motion does not pass a knee of it, it is another law.
    """
    dataset = before.dataset
    for fitted in (f for f in fit.axis.effects if f.effect.name == effect.name):
        ended = [label for label in at_bounds(fit, effect.name) if label.split(".")[-1] in own]
        if imitation := imitation_of(fit.axis, fitted, ended, dataset.excitation):
            return OutsideKnee.imitating(imitation, fit.axis)
        if ended:
            return EndsAtBound(tuple(ended))
        alone = replace(fit.axis, effects=(fitted,))
        if depends_on_time_origin(alone, dataset) and _follows_motion(alone, dataset):
            return Instead.ANY_FORCE_OF_THE_MOTION
        own_force = effect.kind is Kind.FORCE and not effect.of_joints
        if _may_be_of_bodies(alone, dataset):
            return Instead.WEIGHT_OF_BODIES
        if own_force and _is_between_knots(fitted, fit.axis, dataset):
            return Instead.CURVE_BETWEEN_KNOTS
        if own and effect.kind is Kind.FORCE and _is_the_friction(alone, before, fit):
            return Instead.FRICTION
    if _has_lost_inertia(before.fit, fit):
        return Instead.INERTIA
    if dataset.channel_delay > 0.0 and effect.delays:
        return Instead.FORCE_BEFORE_ITS_STAMP
    return None


def imitation_of(
    axis: AxisModel, fitted: Fitted, ended: Sequence[str], covered: Excitation
) -> Imitation | None:
    """What a law of an axis is where it is not itself; ended: labels of what a fit held there."""
    effect, values = fitted.effect, fitted.values
    beside = max((f.effect.presliding(f.values, covered) for f in axis.effects), default=0.0)
    covered = replace(covered, presliding=beside)
    names = [label.split(".")[-1] for label in ended]
    past = [
        {**values, n: values[n] * (1.0 + way * 2.0 * AT_EDGE)} for n in names for way in (-1, 1)
    ]
    found = (effect.imitation(each, covered) for each in (values, *past))
    return next((one for one in found if one), None)


def _follows_motion(alone: AxisModel, dataset: Dataset) -> bool:
    """Whether most of a force in time is told by where the axis is, how fast, and how it turns."""
    force = averaged_force(alone, dataset.training)
    where = gathered(dataset.training)
    return _is_of(force, np.column_stack([np.ones(len(force)), *(where[name] for name in MOTION)]))


def _is_of(force: Array, columns: Array) -> bool:
    """Whether most of a force (n,) N is in the span of some columns (n, k)."""
    left = unabsorbed(force, orthonormal(columns))
    return float(left @ left) < SAME_FORCE * float(force @ force)


def _is_between_knots(law: Fitted, axis: AxisModel, dataset: Dataset) -> bool:
    """Whether a force is no larger than what a free curve over its coordinate may miss.

    Between two knots a smooth curve is off the straight line by an eighth of its second difference.
    """
    over = {curve.over for curve in law.effect.curves}
    size = rms(averaged_force(replace(axis, effects=(law,)), dataset.training))
    return any(
        # an eighth, as above
        size < 0.125 * float(np.abs(np.diff(strengths, 2)).max(initial=0.0))
        for f in axis.effects
        if f.effect.free_shape
        and not law.effect.free_shape
        and (Coordinate.SPEED if f.values["per_speed"] else Coordinate.POSITION) in over
        for strengths in ([f.values[n] for n in part.strengths] for part in f.effect.parts)
    )


def _may_be_of_bodies(alone: AxisModel, dataset: Dataset) -> bool:
    """Whether bodies within their accuracy could take what one effect of a joint does.

    A force is theirs where it is the load times less than that. So is less of it than that where a
    motor's force follows the place, as what bodies are off by does, and not at once again. A curve
    that all joints were asked for beside their bodies is known.
    """
    (effect,) = (f.effect for f in alone.effects)
    by_place = effect.kind is Kind.ACTUATION and effect.reads("X") and not effect.repeats
    own_force = effect.kind is Kind.FORCE and not effect.of_joints
    known = dataset.beside_bodies and What.CURVE.covers(effect)
    if known or not (by_place or own_force) or not (load := _load(dataset)).any():
        return False
    force = averaged_force(alone, dataset.training)
    if by_place:
        return rms(force) < ACCURACY * rms(load)
    part = float(load @ force) / float(load @ load)
    return abs(part) < ACCURACY and _is_of(force, load[:, None])


def _load(dataset: Dataset) -> Array:
    """What the bodies of a mechanism take of a joint (n,) N; zero of a plain axis."""
    if any(log.motion.bodies is None for log in dataset.training):
        return np.zeros(1)
    rows = (log.test_function.mean(log.motion.joint_signals) for log in dataset.training)
    _, _, _, load, *_ = np.hstack([*rows])
    return np.asarray(load)


def _is_the_friction(alone: AxisModel, before: Judged, fit: Fit) -> bool:
    """Whether a force is most of the friction that has collapsed beside it.

    Below what the fit began with too: a friction that had taken the effect's place falls as well.
    """
    base = before.fit
    laws = (fit.axis.friction, base.axis.friction, base.begun.friction, *alone.effects)
    if None in laws:
        return False
    axes = (replace(alone, effects=(law,)) for law in laws if law)
    now, was, begun, own = (averaged_force(axis, before.dataset.training) for axis in axes)
    least = min(float(was @ was), float(begun @ begun))
    return float(now @ now) < RULE.collapse**2 * least and _is_of(was - now, own[:, None])


def _has_lost_inertia(base: Fit, fit: Fit) -> bool:
    """Whether the mass has collapsed that a base told.

    In a motion that repeats in time a sine in time can hold its force. Below what the base began
    with too, as its mass may be wrong for want of this effect. Where what only the mass explains is
    less than what the base leaves, no motion told it, and it had taken the place of another.
    """
    if not fit.axis.mass < RULE.collapse * min(base.axis.mass, base.begun.mass):
        return False
    is_mass = np.array([not c.effect for c in base.scaling.where])
    others = orthonormal(base.jacobian[:, ~is_mass])
    inertia = unabsorbed(base.axis.mass * base.jacobian[:, is_mass].sum(axis=1), others)
    return float(inertia @ inertia) > float(base.residual @ base.residual)


def noise_candidate(before: Judged, after: Judged, effect: Effect) -> Candidate:
    """An effect that is noise: it raises the floor that readings without it would have.

    It counts where it makes a good part of the error on all logs that choose, and no more than it:
    the steps are seen in the readings, whatever else is left.
    """
    dataset, fit = before.dataset, after.fit
    logs = (*dataset.training, *dataset.selection)
    left = error_on(fit.axis, logs)
    error, noise = rms(left), noise_beside(fit.axis, logs)
    floor, rounds = noise.value, noise.parts["rounding"]
    part, less = min((rounds / error) ** 2, 1.0), float(np.sqrt(floor**2 - rounds**2))
    plain = Candidate(
        effect, dataset.axis, fit, Evidence(0.0, 1, fit.samples), Gain(error, error, 0.0)
    )
    # 0.85 of a noise floor; of less error its estimate would be refuted
    if not (RULE.least_part < part and 0.85 * floor < error):
        return plain
    t = float(np.sqrt(max(effective_samples(left) * noise_gain(left, less, floor), 0.0)))
    taken = Taken(t, part, part)
    return replace(plain, score=Score(taken, taken), gain=Gain(error, error, t))


def ordered(candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Proved ones first, by their evidence; then those that were refitted, by what they leave."""

    def place(c: Candidate) -> tuple[bool, bool, float]:
        return not c.supported, c.score is None, -c.delta_bic if c.supported else c.gain.after

    return tuple(sorted(candidates, key=place))
