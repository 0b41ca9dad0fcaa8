"""What the motion of logs covers, from which effects compute where they start."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol


class Repeats(Protocol):
    """What of a force repeats, see ``Excitation``; it may be looked for when it is asked for."""

    @property
    def lines(self) -> tuple[float, ...]: ...
    @property
    def pitches(self) -> tuple[float, ...]: ...
    @property
    def thrust_pitches(self) -> tuple[float, ...]: ...
    @property
    def friction_pitches(self) -> tuple[float, ...]: ...


@dataclass(frozen=True)
class Repeating:
    """What of a force is known to repeat."""

    lines: tuple[float, ...] = ()
    pitches: tuple[float, ...] = ()
    thrust_pitches: tuple[float, ...] = ()
    friction_pitches: tuple[float, ...] = ()


@dataclass(frozen=True)
class Excitation:
    """What a log's motion covers; start rules and scans are computed from it."""

    position_low: float
    """Low end, m: of the axis' travel where the model gives it."""
    position_high: float
    """High end, m."""
    speed_max: float
    """Highest speed, m/s."""
    dry_level: float
    """Half the gap between the force in the two directions, N."""
    duration: float
    """Of the logs, s."""
    period: float
    """Sample period, s."""
    force_max: float = 1.0
    """Largest command, N."""
    repeats: Repeats = Repeating()
    """What of the force repeats."""
    ripples: tuple[float, ...] = ()
    """Periods at which the reading's error may repeat in position, m; strongest first."""
    resolution: float = 0.0
    """Step of the readings, m; 0 where none shows."""
    reached: tuple[float, float] | None = None
    """Lowest and highest position of the logs, m; the ends of the travel where None."""
    other_joints: tuple[float, ...] = ()
    """Numbers of a mechanism's other joints, in the order of its axes; none of a plain axis."""
    force_usual: float = 0.5
    """Median of the command's size while the axis moves, N."""
    speed_least: float = 0.0
    """Speed below which the axis may as well be at rest, m/s."""
    shortest: float = 0.0
    """Least change of position that the readings tell from their rounding and noise, m."""
    longest: float | None = None
    """Duration of the longest log, s; of all of them where None."""
    both_ways: float = 1.0
    """Of the places that the axis passed, the part that it passed both ways, 0..1."""
    temperature: float = 293.15
    """Mean of what was logged of it, K."""
    fewest_cycles: float = 1.0
    """Cycles that have to be seen of what is said to repeat."""
    presliding: float = 0.0
    """Distance over which the contacts of the model's friction bend before they slide, m."""

    @property
    def lines(self) -> tuple[float, ...]:
        """Frequencies at which the force repeats in time, Hz; strongest first."""
        return self.repeats.lines

    @property
    def pitches(self) -> tuple[float, ...]:
        """Periods at which what a model leaves of the force repeats along the track, m; strongest
        first, none without a model."""
        return self.repeats.pitches

    @property
    def thrust_pitches(self) -> tuple[float, ...]:
        """The same of the motor's force in proportion to it, m."""
        return self.repeats.thrust_pitches

    @property
    def friction_pitches(self) -> tuple[float, ...]:
        """The same of a force that turns with the direction of motion, m."""
        return self.repeats.friction_pitches

    @property
    def travel(self) -> float:
        """Distance covered, m."""
        return self.position_high - self.position_low

    @property
    def stroke(self) -> float:
        """Time that the travel takes at the highest speed, s."""
        return self.travel / self.speed_max

    @property
    def longest_period(self) -> float:
        """Period along the track of which enough cycles were seen, m."""
        low, high = self.been
        return (high - low) / self.fewest_cycles

    @property
    def frequencies(self) -> tuple[float, float]:
        """Lowest and highest frequency that a log shows, Hz."""
        return self.fewest_cycles / (self.longest or self.duration), 0.5 / self.period

    @property
    def been(self) -> tuple[float, float]:
        """Lowest and highest position that was reached, m."""
        return self.reached or (self.position_low, self.position_high)
