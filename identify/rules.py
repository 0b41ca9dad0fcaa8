"""The thresholds that decisions share, in one place and each with its reason.

Errors are RMS forces, parts are of the squared error above the noise floor, 0..1.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DecisionRule:
    """When a change of a model is accepted, and when a search ends."""

    at_floor: float = 1.3
    """Error over noise floor below which a residual counts as noise; the floor is an estimate,
    accurate to 10 % on most machines. Above it parameters have no intervals."""

    least_part: float = 0.2
    """Of what is left above the noise floor, the least part that a change must take to be named.
    Beside a wrong law what is left can shrink by less than that by chance."""

    chance: float = 0.05
    """Of a false answer, 1 in 20, for the gain over blocks and beside controls."""

    promise: float = 0.5
    """Part of what a refit must take that a linear step before it shows."""

    most_steps: int = 5
    """Changes of one axis at most."""

    fewest_cycles: float = 2.5
    """Over the travel, of a force that is said to repeat along the track; fewer are any smooth
    force of position."""

    least_bic: float = 10.0
    """Difference of BIC that is "very strong" evidence in R. E. Kass, A. E. Raftery, Bayes Factors,
    JASA 90 (1995): of a channel delay, of a phase, between explanations of a plan."""

    collapse: float = 0.3
    """A strength has collapsed if less than this part of it is left."""

    rather: float = 0.8
    """Within one run every coordinate is a function of time. So another one is preferred to time
    from this part of what time accounts for."""

    line_chance: float = 1e-3
    """False-alarm probability below which a spectral line counts."""

    line_share: float = 0.2
    """Part of the squared residual from which it is the period of a dependence."""

    least_fall: float = 0.1
    """Part of the squared error below which a fall is hardly one: by a channel delay, between two
    turns of a fit whose priors are weighed by the error, of a predicted force."""

    least_shift: float = 0.05
    """Samples; less is no channel delay."""

    most_shift: float = 3.0
    """Samples; more no recorder makes of one, and so has to be most of what is wrong."""

    @property
    def fallen(self) -> float:
        """Part of an RMS error up to which it has fallen by more than is hardly anything."""
        return float((1.0 - self.least_fall) ** 0.5)


RULE = DecisionRule()
