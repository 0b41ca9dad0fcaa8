"""A floor of machines: how often alarms are false, how soon they come, what a store costs.

``python -m benchmarks fleet --calibrate`` prints the rates that ``identify.fleet.rates`` holds,
``--rates`` and ``--scale`` the one half of the figures or the other, ``--live`` those
of `twin watch`, ``--kills`` those of 100 ingests that are killed, in a quarter of an hour.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence

from benchmarks.figures import Figure, report
from benchmarks.fleet import kills, live, rates, scale

TITLE = "A floor of machines over time"


def measure() -> list[Figure]:
    """All figures."""
    return [*rates.figures(), *scale.figures(), *live.figures()]


def main(given: Sequence[str]) -> int:
    """Print some of them; 0 where every target is met."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks fleet", description=__doc__)
    parts: dict[str, Callable[[], Iterator[Figure]]]
    parts = {
        "calibrate": rates.calibration,
        "rates": rates.figures,
        "scale": scale.figures,
        "kills": kills.figures,
        "live": live.figures,
    }
    for name in parts:
        parser.add_argument(f"--{name}", action="append_const", dest="parts", const=name)
    chosen = parser.parse_args(given).parts or []
    return max([report([*parts[name]()]) for name in chosen], default=0)
