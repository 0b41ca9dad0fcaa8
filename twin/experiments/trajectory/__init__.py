"""The PMP setpoint generator: jerk-limited moves, passes, staircases, reversals and sines."""

from twin.experiments.trajectory.generators import (
    constant_speed_passes,
    micro_reversals,
    open_loop_sine,
    point_to_point,
    velocity_staircase,
)
from twin.experiments.trajectory.limits import Limits
from twin.experiments.trajectory.random_tracking import random_tracking
from twin.experiments.trajectory.setpoint import Setpoint, concatenate

__all__ = [
    "Limits",
    "Setpoint",
    "concatenate",
    "constant_speed_passes",
    "micro_reversals",
    "open_loop_sine",
    "point_to_point",
    "random_tracking",
    "velocity_staircase",
]
