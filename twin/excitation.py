"""What the motion of logs covers, from which effects compute where they start."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Excitation:
    """What a log's motion covers; start rules and scans are computed from it.

    position_low, position_high (m, of the axis' travel where the model gives it), speed_max (m/s),
    dry_level (N, half the gap between the force in the two directions), duration (s), period (s,
    sample period), force_max (N, largest command), lines (Hz, frequencies at which the force
    repeats in time; strongest first), resolution (m, step of the readings; 0 where none shows),
    ripples (m, periods at which the reading's error may repeat in position; strongest first),
    pitches, thrust_pitches (m, periods at which what a model leaves of the force, or of the motor's
    force in proportion to it, repeats along the track; strongest first; empty without a model).
    """

    position_low: float
    position_high: float
    speed_max: float
    dry_level: float
    duration: float
    period: float
    force_max: float = 1.0
    lines: tuple[float, ...] = ()
    ripples: tuple[float, ...] = ()
    resolution: float = 0.0
    pitches: tuple[float, ...] = ()
    thrust_pitches: tuple[float, ...] = ()

    @property
    def travel(self) -> float:
        """Distance covered, m."""
        return self.position_high - self.position_low
