"""A self-test in words, as a JSON object, and in pictures: a sentence for each rate and trial."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from benchmarks.selftest.machines import NOTHING
from benchmarks.selftest.tally import (
    AMBIGUOUS,
    SHAPE,
    UNEXPLAINED,
    Rate,
    by_stratum,
    confusion,
    coverage_by_parameter,
    failures,
    rates,
    reliability,
)
from benchmarks.selftest.trial import TrialResult
from identify.selection.findings import FindingKind
from twin.errors import InputError
from twin.files import write_atomically

FORMATS = (".png", ".svg", ".pdf")
ANSWERS = {
    FindingKind.MISSING: "{}",
    FindingKind.WRONG_SHAPE: "{} of another shape",
    FindingKind.RESEMBLES: "something like {}",
    FindingKind.WRONG_VALUE: "{} of another value",
}


def selftest_text(results: Sequence[TrialResult], seed: int) -> str:
    """The rates; by variation; confidence; and the machines that failed."""
    lines = [f"seed {seed}, {len(results)} machines"]
    lines += [rate_in_words(rate) for rate in rates(results)]
    lines += [f"  interval of {rate_in_words(r)}" for r in coverage_by_parameter(results).values()]
    lines += [
        f"  {name}, {rate_in_words(rate)}"
        for name, own in by_stratum(results).items()
        for rate in own
    ]
    lines += [
        f"  confidence: stated {100 * t.stated:.0f} % on average, right {rate_in_words(t.right)}"
        for t in reliability(results)
    ]
    lines += [f"  {failure_in_words(o)}" for o in failures(results)]
    return "\n".join(lines)


def target_in_words(rate: Rate) -> str:
    """E.g. "at least 95 %"; "" where no target is set."""
    if rate.asked is None:
        return ""
    low, high = rate.asked
    if high == 1.0:
        return f"at least {100 * low:g} %"
    return f"at most {100 * high:g} %" if low == 0.0 else f"{100 * low:g} to {100 * high:g} %"


def rate_in_words(rate: Rate) -> str:
    """E.g. "named at 5: 30 of 31 (97 %, 95 % interval 83 to 100 %), target: ..."."""
    target = f", target: {target_in_words(rate)}" if rate.asked else ""
    if not rate.trials:
        return f"{rate.what}: 0 of 0{target}"
    low, high = (100.0 * end for end in rate.interval)
    share = f"{100 * rate.value:.0f} %, 95 % interval {low:.0f} to {high:.0f} %"
    return f"{rate.what}: {rate.count} of {rate.trials} ({share}){target}"


def trial_in_words(result: TrialResult) -> str:
    """One line: the machine by its name, and what the diagnosis answered."""
    case = result.case
    if not result.shown:
        return (
            f"{case}: cannot reach {case.strength:g} times the noise floor within its bounds on "
            "this stage's motion"
        )
    answers = [
        f"{ANSWERS[a.kind].format(' or '.join(a.names))} ({100 * a.confidence:.0f} %)"
        for a in result.answers
    ]
    return f"{case}: {' and '.join(answers) or result.verdict.lower().replace('_', ' ')}"


def tell(result: TrialResult, done: int, total: int) -> None:
    """Say on standard error that a machine is done."""
    print(f"{done} of {total}: {trial_in_words(result)}", file=sys.stderr, flush=True)


def failure_in_words(result: TrialResult) -> str:
    """One line: the command that makes the machine again, and what was answered."""
    what = "wrong" if result.wrong else "missed"
    return f"{what}: python -m benchmarks selftest --case {trial_in_words(result)}"


def selftest_json(results: Sequence[TrialResult], seed: int) -> dict[str, Any]:
    """Seed, rates, strata, coverage, reliability, confusion matrix and every trial."""
    return {
        "seed": seed,
        "rates": [_rate(r) for r in rates(results)],
        "by_variation": {k: [_rate(r) for r in own] for k, own in by_stratum(results).items()},
        "coverage": {k: _rate(r) for k, r in coverage_by_parameter(results).items()},
        "reliability": [{"stated": t.stated, **_rate(t.right)} for t in reliability(results)],
        "confusion": confusion(results),
        "trials": [_trial(o) for o in results],
    }


def _rate(rate: Rate) -> dict[str, Any]:
    low, high = rate.interval
    return {
        "what": rate.what, "count": rate.count, "trials": rate.trials, "low": low, "high": high,
        "asked": target_in_words(rate),
    }  # fmt: skip


def _trial(o: TrialResult) -> dict[str, Any]:
    case = o.case
    return {
        "case": str(case), "strength": case.strength, "variation": case.variation,
        "seed": case.seed, "planted": case.effects, "in_catalogue": case.known,
        "shown": o.shown, "depends_on": o.depends_on, "seconds": o.seconds,
        "ratio_before": _known(o.ratio), "ratio_after": _known(o.left),
        "test_ratio": _known(o.tested), "verdict": o.verdict.lower(),
        "answers": [
            {"names": a.names, "kind": a.kind.value, "right": a.right,
             "confidence": _known(a.confidence), "left": _known(a.part)}
            for a in o.answers
        ],
    }  # fmt: skip


def _known(value: float) -> float | None:
    """None for what is no number, which JSON does not know."""
    return value if math.isfinite(value) else None


# --- pictures --------------------------------------------------------------------------------


def confusion_matrix(results: Sequence[TrialResult]) -> Figure:
    """The picture of the confusion matrix, in % of the trials of each row."""
    table = confusion(results)
    rows = [*sorted(r for r in table if r != NOTHING), *([NOTHING] if NOTHING in table else [])]
    named = {a for row in table.values() for a in row} - {AMBIGUOUS, NOTHING, UNEXPLAINED, SHAPE}
    columns = [*sorted(named | (set(rows) - {NOTHING})), AMBIGUOUS, SHAPE, UNEXPLAINED, NOTHING]
    shares = np.array([[table[r].get(c, 0.0) for c in columns] for r in rows])
    figure = Figure(figsize=(2.6 + 0.27 * len(columns), 2.3 + 0.25 * len(rows)), dpi=110)
    axes = figure.subplots()
    axes.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for i, j in np.argwhere(shares):
        axes.text(
            j, i, f"{100 * shares[i, j]:.0f}", ha="center", va="center", fontsize=6.5,
            color="white" if shares[i, j] > 0.6 else "black",
        )  # fmt: skip
    axes.set_xticks(range(len(columns)), [c.replace("_", " ") for c in columns], rotation=90)
    axes.set_yticks(range(len(rows)), [r.replace("_", " ") for r in rows])
    axes.tick_params(labelsize=7.5, length=0)
    axes.set_xlabel("answer of the diagnosis, % of the trials")
    axes.set_ylabel("planted effect")
    axes.set_xticks(np.arange(len(columns)) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(rows)) - 0.5, minor=True)
    axes.grid(which="minor", color="0.9", linewidth=0.5)
    return figure


def reliability_diagram(results: Sequence[TrialResult]) -> Figure:
    """The picture of stated confidence against how often right, with 95 % intervals."""
    tenths = reliability(results)
    stated = np.array([100.0 * t.stated for t in tenths])
    right = np.array([100.0 * t.right.value for t in tenths])
    ends = 100.0 * np.array([t.right.interval for t in tenths]).reshape(-1, 2).T
    figure = Figure(figsize=(4.2, 4.0), dpi=110)
    axes = figure.subplots()
    axes.plot([0, 100], [0, 100], color="0.7", linewidth=1.0)
    axes.errorbar(stated, right, yerr=np.abs(ends - right), fmt="o", capsize=3)
    for x, y, tenth in zip(stated, right, tenths, strict=True):
        axes.annotate(f"{tenth.right.trials}", (x, y), (6, -10), textcoords="offset points")
    axes.set(xlim=(0, 100), ylim=(0, 100), xlabel="stated confidence, %", ylabel="right, %")
    axes.set_title("answers in each tenth beside the points", fontsize=9)
    return figure


def require_format(path: Path) -> None:
    """Raise InputError for another ending than .png, .svg or .pdf."""
    if path.suffix not in FORMATS:
        raise InputError(f"{path}: give a name that ends in {', '.join(FORMATS)}")


def save(figure: Figure, path: Path) -> None:
    """Write a picture, whole or not at all."""
    figure.tight_layout()
    content = BytesIO()
    figure.savefig(content, format=path.suffix[1:])
    write_atomically(path, content.getvalue())
