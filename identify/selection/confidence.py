"""Confidence of a finding: how often such an answer was right on machines of the self-test.

An answer is read by its margin: how much less error the effect leaves than its best decoy does or,
where a shift in time makes no decoy, than the model without it. Few levels, as each is known only
as well as its answers are many. The table is not fitted to the machines on which it is judged:
`twin selftest --full` draws those with the seed of the release and prints stated confidence beside
how often right.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Level:
    """From which margin on answers were right how often, 0..1."""

    margin: float
    right: float


# 70 answers on 84 machines of seed 22 (0 to 5 floors, every variation, some outside the catalogue):
# all right but two, which named the nearest effect for one of no catalogue, as resembled since. So
# few wrong ones do not tell margins apart, and a level is known to some 5 points.
# `python -m benchmarks.confidence --seed 1` fits the table anew, on more machines.
BESIDE_DECOYS = (Level(-0.44, 0.95),)  # 63 answers
WITHOUT_DECOYS = (Level(0.0, 0.89),)  # 7 answers


def confidence(margin: float, *, beside_decoys: bool) -> float:
    """How often answers with such a margin were right, 0..1."""
    table = BESIDE_DECOYS if beside_decoys else WITHOUT_DECOYS
    reached = [level for level in table if margin >= level.margin]
    return (reached or table[:1])[-1].right
