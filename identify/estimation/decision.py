"""The thresholds of every decision, in one place and each with its reason.

Evidence is a difference of BIC on the effective sample size, errors are RMS forces, parts are of
the squared error above the noise floor, 0..1.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DecisionRule:
    """When an effect is supported, when it is named, and when a search ends.

    at_floor: error over noise floor below which a residual counts as noise; the floor is an
    estimate, accurate to 10 % on most machines. Above it parameters have no intervals.
    least_bic: evidence that supports an effect, "very strong" in R. E. Kass, A. E. Raftery, Bayes
    Factors, JASA 90 (1995). no_evidence: "not worth more than a bare mention", same source.
    least_t: gain on the held-out logs over its standard error across blocks. friction_t: the same
    of a friction that leaves clearly less (beside_decoys); laws of another shape, which each
    friction leaves as they are, make the blocks uneven.

    fewest_cycles: over the travel, of a force that is said to repeat along the track; fewer are any
    smooth force of position.

    beyond_doubt: evidence required of an effect where the error is already at the noise floor.
    partial_bic: evidence required of an effect after which the residual still depends on something.
    nearly_all: explained part that is sufficient by itself. least_part: explained part required
    where the effect also removes the foremost dependence. floor_sure: error over noise floor within
    which no further effect is sought. most_steps: effects added to one axis at most. most_shifts:
    how often a diagnosis may start again because a channel delay was found anew.

    near: part of the best candidate's gain in log likelihood from which another is a rival. tie: t
    of the held-out difference from which one of two candidates is better. least_separation:
    evidence that separates two candidates. settled: a refit of the base is kept if it lowers the
    error below this part. collapse: a strength has collapsed if less than this part of it is left.

    promise: part of the required evidence that a linear step must reach before a refit is made.
    contender: part of what the best candidate explains that it must reach as well; a refit that
    started from less has not come near a best one, and is found beside it in the next step.
    same_error: relative error that simpler values may have. pair_first: part of the squared error
    that the first of two effects must explain alone.

    beside_decoys: part of what its decoys leave of the squared error that an effect may leave;
    of what the fit without it leaves, where it has no decoys.
    least_finding: least part of the squared error that one of several effects must explain; the law
    of another, a tenth off, leaves as much.

    least_share: share of the squared residual below which a dependence does not count. rather: part
    of the share of time from which another coordinate is preferred. left_over: part of a dependence
    that may remain after an effect that explains it.

    foretold: part of the squared test error that a curve over a coordinate, or the past, must take
    for what is left of a force to be more than noise.

    line_chance: false-alarm probability below which a spectral line counts. line_share: part of the
    squared residual from which it is the period of a dependence.

    least_fall: part of the squared error that a channel delay must remove. least_shift, most_shift:
    samples; less is no delay, more is a fault of the log that its check finds.
    """

    chance: float = 0.05
    most_ways: int = 2
    not_above: float = 0.85
    at_floor: float = 1.3
    least_bic: float = 10.0
    no_evidence: float = 2.0
    least_t: float = 3.0
    friction_t: float = 2.0
    fewest_cycles: float = 2.5

    beyond_doubt: float = 100.0
    partial_bic: float = 50.0
    nearly_all: float = 0.95
    least_part: float = 0.2
    floor_sure: tuple[float, float] = (0.85, 1.15)
    most_steps: int = 5
    most_shifts: int = 2

    near: float = 0.8
    tie: float = 2.0
    least_separation: float = 10.0
    settled: float = 0.999
    collapse: float = 0.3

    promise: float = 0.5
    contender: float = 0.1
    same_error: float = 1.01
    pair_first: float = 0.1

    beside_decoys: float = 0.8
    least_finding: float = 0.01

    least_share: float = 0.1
    rather: float = 0.8
    left_over: float = 0.5

    foretold: float = 0.05

    line_chance: float = 1e-3
    line_share: float = 0.2

    least_fall: float = 0.1
    least_shift: float = 0.05
    most_shift: float = 3.0


RULE = DecisionRule()
