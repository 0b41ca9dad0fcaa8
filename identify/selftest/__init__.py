"""The self-test: machines with planted effects, and how often the diagnosis names them."""

from __future__ import annotations

from identify.selftest.design import FULL, QUICK, Design, run_all
from identify.selftest.picture import draw
from identify.selftest.tally import confusion, coverage, rates
from identify.selftest.trial import Case, TrialResult

__all__ = [
    "FULL",
    "QUICK",
    "Case",
    "Design",
    "TrialResult",
    "confusion",
    "coverage",
    "draw",
    "rates",
    "run_all",
]
