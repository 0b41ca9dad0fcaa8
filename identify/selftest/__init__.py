"""The self-test: machines with planted effects, and how often the diagnosis names them."""

from __future__ import annotations

from identify.selftest.calibration import levels, reliability
from identify.selftest.case import Case, parse_case
from identify.selftest.design import FULL, QUICK, Design, release_seed, run_all
from identify.selftest.picture import draw, draw_reliability
from identify.selftest.tally import (
    by_stratum,
    confusion,
    coverage_by_parameter,
    failures,
    rates,
)
from identify.selftest.trial import TrialResult

__all__ = [
    "FULL",
    "QUICK",
    "Case",
    "Design",
    "TrialResult",
    "by_stratum",
    "confusion",
    "coverage_by_parameter",
    "draw",
    "draw_reliability",
    "failures",
    "levels",
    "parse_case",
    "rates",
    "release_seed",
    "reliability",
    "run_all",
]
