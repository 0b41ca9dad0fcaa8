"""The thresholds of alarms, from the rate of false ones that is stated.

Measured by ``python -m benchmarks fleet --calibrate`` on nights that differ by chance alone: how
often a series is told to have changed, without a dead band, by the level of its test.
"""

from __future__ import annotations

import numpy as np

STATED = 1e-3  # false alarms a machine and night: one in 1000 nights
# Of the test in ``change_point``: standard deviations, and false changes a series and night.
LEVELS = (3.5, 4.0, 4.5, 5.0)
FALSE = (1.9e-3, 3.2e-4, 4.4e-5, 4e-6)


def level_of(series: int) -> float:
    """The level at which a machine with so many series has the stated rate, all together."""
    wanted = np.log10(STATED / max(series, 1))
    return float(np.interp(-wanted, -np.log10(FALSE), LEVELS))
