"""The thresholds of every decision, each with its reason; nothing else decides with a number.

Evidence is a difference of BIC on the effective sample size, errors are RMS forces, parts are of
the squared error above the noise floor, 0..1.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DecisionRule:
    """When an effect is supported, when it is named, and when a search ends.

    at_floor: error over noise floor below which a residual is taken for noise; the floor is an
    estimate, within 10 % on most machines.
    least_bic: evidence that supports an effect, "very strong" in R. E. Kass, A. E. Raftery, Bayes
    Factors, JASA 90 (1995). no_evidence: "not worth more than a bare mention", same source.
    least_t: gain on the logs held out over its standard error across blocks.

    beyond_doubt: evidence asked of an effect where the error is at its floor already.
    partial_bic: evidence asked of an effect that leaves other dependence behind.
    nearly_all: part explained that speaks for itself. least_part: part that must be explained where
    what the residual depended on is gone. floor_sure: error over floor where nothing more is
    sought. most_steps: effects added to one axis at most. most_shifts: how often a channel delay
    may be found anew, after which a diagnosis begins again no more.

    near: part of the best's gain in log likelihood that makes a rival. tie: t of the held-out
    difference from which one of two is the better. least_separation: evidence that separates two.
    settled: part of the error to which another start of the base must bring it. collapse: part that
    a strength keeps at most where an effect took it over.

    promise: part of the evidence asked for that a first look must show. same_error: error that
    simpler values may cost. pair_first: part of the squared error that the first of two effects
    must explain alone.

    least_share: share of the residual's square below which a dependence says nothing. rather: part
    of the share of time from which another coordinate is preferred. left_over: part of a dependence
    that an explanation may leave.

    line_chance: false-alarm probability below which a spectral line is told. line_share: part of
    the residual's square from which it is the period of a dependence.

    least_fall: part of the squared error that a channel delay must take away. least_shift,
    most_shift: samples; less is no delay, more is a fault that the log's check finds.
    """

    at_floor: float = 1.3
    least_bic: float = 10.0
    no_evidence: float = 2.0
    least_t: float = 3.0

    beyond_doubt: float = 100.0
    partial_bic: float = 50.0
    nearly_all: float = 0.95
    least_part: float = 0.4
    floor_sure: tuple[float, float] = (0.85, 1.15)
    most_steps: int = 5
    most_shifts: int = 2

    near: float = 0.8
    tie: float = 2.0
    least_separation: float = 10.0
    settled: float = 0.999
    collapse: float = 0.3

    promise: float = 0.3
    same_error: float = 1.01
    pair_first: float = 0.1

    least_share: float = 0.1
    rather: float = 0.8
    left_over: float = 0.5

    line_chance: float = 1e-3
    line_share: float = 0.2

    least_fall: float = 0.1
    least_shift: float = 0.05
    most_shift: float = 3.0


RULE = DecisionRule()
