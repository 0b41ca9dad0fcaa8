"""Setpoints: jerk-limited moves, passes, staircases, reversals and sines.

The jerk-limited profile is this project's assumption; the thesis prints no generator of its motion
platform. A recorded reference replaces it (twin.experiments.replay).
"""

from twin.experiments.trajectory.generators import (
    constant_speed_passes,
    micro_reversals,
    open_loop_sine,
    point_to_point,
    velocity_staircase,
)
from twin.experiments.trajectory.jerk_limited import move
from twin.experiments.trajectory.limits import Limits
from twin.experiments.trajectory.random_tracking import random_tracking
from twin.experiments.trajectory.setpoint import Setpoint, concatenate

__all__ = [
    "Limits",
    "Setpoint",
    "concatenate",
    "constant_speed_passes",
    "micro_reversals",
    "move",
    "open_loop_sine",
    "point_to_point",
    "random_tracking",
    "velocity_staircase",
]
