"""The thresholds of every decision, in one place and each with its reason.

Errors are RMS forces, parts are of the squared error above the noise floor, 0..1.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DecisionRule:
    """When a change of a model is accepted, and when a search ends.

    at_floor: error over noise floor below which a residual counts as noise; the floor is an
    estimate, accurate to 10 % on most machines. Above it parameters have no intervals.

    least_part: of what is left above the noise floor, the least part that a change must take. What
    another law leaves of it may hold less by chance; what takes less does not matter. chance: of a
    false answer, 1 in 20, for the gain over blocks and beside controls. promise: part of what a
    refit must take that a linear step before it shows. most_steps: changes of one axis at most.
    fewest_cycles: over the travel, of a force that is said to repeat along the track; fewer are any
    smooth force of position.

    least_bic: difference of BIC that is "very strong" evidence in R. E. Kass, A. E. Raftery, Bayes
    Factors, JASA 90 (1995): of a channel delay, of a phase, between explanations of a plan.
    collapse: a strength has collapsed if less than this part of it is left.

    rather: part of the share of time from which another coordinate is preferred, as within one run
    any coordinate is a function of time. line_chance: false-alarm probability below which a
    spectral line counts. line_share: part of the squared residual from which it is the period of a
    dependence.

    least_fall: part of the squared error that a channel delay must remove. least_shift, most_shift:
    samples; less is no delay, more is a fault of the log that its check finds.
    """

    at_floor: float = 1.3

    least_part: float = 0.2
    chance: float = 0.05
    promise: float = 0.5
    most_steps: int = 5
    fewest_cycles: float = 2.5

    least_bic: float = 10.0
    collapse: float = 0.3

    rather: float = 0.8
    line_chance: float = 1e-3
    line_share: float = 0.2

    least_fall: float = 0.1
    least_shift: float = 0.05
    most_shift: float = 3.0


RULE = DecisionRule()
