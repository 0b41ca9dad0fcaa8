"""The rates of a self-test, with their counts and what chance leaves open."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import betaincinv

from benchmarks.selftest.design import STRONG, WEAK
from benchmarks.selftest.laws import OUTSIDE
from benchmarks.selftest.machines import NOTHING
from benchmarks.selftest.trial import Answer, TrialResult
from identify.selection.findings import FindingKind

Range = tuple[float, float]

ALARMS, PAIRS, COORDINATE, COVERED = (0.0, 0.01), (0.85, 1.0), (0.80, 1.0), (0.85, 0.95)
NAMED = {WEAK: (0.80, 1.0), STRONG: (0.95, 1.0)}  # by force over the noise floor
WRONG_INSIDE, WRONG_OUTSIDE, HELD = (0.0, 0.01), (0.0, 0.03), (0.85, 1.0)
CONFIDENT = 0.9  # stated confidence from which an engineer acts on a name
LEVEL = 0.95  # of the interval of a rate
NEAR_FLOOR = 1.3  # test error over what noise leaves
TENTHS = 10
SHAPE, UNEXPLAINED, AMBIGUOUS = "wrong shape", "unexplained", "ambiguous with it"


@dataclass(frozen=True)
class Rate:
    """How many trials had an outcome. asked: the range of the rate that is the target, if any."""

    what: str
    count: int
    trials: int
    asked: Range | None = None

    @property
    def value(self) -> float:
        """0..1; not a number without trials."""
        return self.count / self.trials if self.trials else float("nan")

    @property
    def interval(self) -> Range:
        """Interval (95 %) of the rate that these trials are a sample of, 0..1.

        C. J. Clopper, E. S. Pearson, Biometrika 26 (1934), 404-413.
        """
        k, n, tail = self.count, self.trials, 0.5 * (1.0 - LEVEL)
        low = float(betaincinv(k, n - k + 1, tail)) if k else 0.0
        return low, float(betaincinv(k + 1, n - k, 1.0 - tail)) if k < n else 1.0


@dataclass(frozen=True)
class Tenth:
    """The answers whose stated confidence lies in one tenth. stated: its mean, 0..1."""

    stated: float
    right: Rate


def rates(results: Sequence[TrialResult]) -> list[Rate]:
    """All rates of a self-test; those without trials are left out."""
    shown = [o for o in results if o.shown]
    empty = [o for o in shown if not o.case.effects]
    inside = [o for o in shown if o.case.effects and not _outside(o)]
    outside = [o for o in shown if o.case.known and _outside(o)]
    # No target: some laws contain that of another, and some motions of the stage part no two.
    left_out = [o for o in shown if not o.case.known]
    one = [o for o in inside if len(o.case.effects) == 1]
    by_strength = _by_strength(one)
    out = [
        *(_rate(f"named or in a declared ambiguity, force {s:g} times the noise floor", own,
                _right, NAMED.get(s)) for s, own in by_strength.items()),
        _rate("false findings, nothing planted", empty, _wrong, ALARMS),
        _rate("both of two named", [o for o in inside if len(o.case.effects) == 2], _right, PAIRS),
        *_wrong_names("inside", inside, WRONG_INSIDE),
        *_wrong_names("outside", outside, WRONG_OUTSIDE),
        _rate("outside the catalogue: no wrong name, and the right coordinate", outside, _honest,
              COORDINATE),
        _rate("another name for an effect taken out of the catalogue", left_out, _wrong_name),
        _rate("test error within 1.3 of what noise leaves, where the answer is right",
              [o for o in one if o.right], lambda o: o.tested < NEAR_FLOOR),
        coverage(empty, "90 % intervals that hold the truth, nothing missing", COVERED),
        *(coverage(own, f"90 % intervals that hold the truth beside a missing effect of {s:g} "
                   "floors", HELD) for s, own in by_strength.items()),
    ]  # fmt: skip
    return [r for r in out if r.trials]


def by_stratum(results: Sequence[TrialResult]) -> dict[str, list[Rate]]:
    """For each variation its rates of right and of wrong answers."""
    groups: dict[str, list[TrialResult]] = {}
    for o in results:
        if o.shown:
            groups.setdefault(o.case.variation, []).append(o)
    return {name: _of_group(groups[name]) for name in sorted(groups)}


def _of_group(group: Sequence[TrialResult]) -> list[Rate]:
    one = [o for o in group if len(o.case.effects) == 1 and not _outside(o)]
    found = [
        *(_rate(f"named at {s:g}", own, _right) for s, own in _by_strength(one).items()),
        _rate("false", [o for o in group if not o.case.effects], _wrong),
        _rate("wrong inside", one, _wrong_name),
        _rate("wrong outside", [o for o in group if o.case.known and _outside(o)], _wrong_name),
    ]
    return [r for r in found if r.trials]


def failures(results: Iterable[TrialResult]) -> list[TrialResult]:
    """The machines whose effect was not named, or on which something wrong was."""
    return [o for o in results if o.shown and (o.wrong or not (o.right or _outside(o)))]


def coverage(
    results: Iterable[TrialResult], what: str, asked: Range | None = None, wider: float = 1.0
) -> Rate:
    """Of the intervals given, those that hold the truth, were they ``wider`` times as wide."""
    given = [h.off <= wider for o in results for h in o.held if h.given]
    return Rate(what, sum(given), len(given), asked)


def coverage_by_parameter(results: Sequence[TrialResult]) -> dict[str, Rate]:
    """Coverage of the intervals by parameter, of machines with nothing planted."""
    found: dict[str, list[bool]] = {}
    for o in results:
        for h in o.held if not o.case.effects else ():
            if h.given:
                found.setdefault(h.label, []).append(h.off <= 1.0)
    return {k: Rate(k, sum(v), len(v), COVERED) for k, v in found.items()}


def answers_of(results: Sequence[TrialResult]) -> list[Answer]:
    """The answers that confidence speaks of.

    Less those where an effect was taken out of the catalogue: some laws contain that of another, so
    that another name need not be wrong.
    """
    return [a for o in results if o.case.known for a in o.answers]


def reliability(results: Sequence[TrialResult]) -> list[Tenth]:
    """Stated confidence against how often right, by tenths of it; empty tenths are left out."""
    answers = [a for a in answers_of(results) if np.isfinite(a.confidence)]  # no test contradicts
    out = []
    for i in range(TENTHS):
        inside = [a for a in answers if min(int(a.confidence * TENTHS), TENTHS - 1) == i]
        if inside:
            what = f"{100 * i // TENTHS} to {100 * (i + 1) // TENTHS} %"
            rate = Rate(what, sum(a.right for a in inside), len(inside))
            out.append(Tenth(float(np.mean([a.confidence for a in inside])), rate))
    return out


def confusion(results: Sequence[TrialResult]) -> dict[str, dict[str, float]]:
    """Planted effect -> answer -> part of the trials: a name, "ambiguous", or none.

    An ambiguity that holds the planted effect counts for it, in a column of its own.
    """
    table: dict[str, dict[str, float]] = {}
    for o in results:
        if o.shown and o.case.known and len(o.case.effects) <= 1:
            planted = o.case.effects[0] if o.case.effects else NOTHING
            row, answer = table.setdefault(planted, {}), _answer(o, planted)
            row[answer] = row.get(answer, 0.0) + 1.0
    return {
        name: {answer: n / sum(row.values()) for answer, n in row.items()}
        for name, row in table.items()
    }


def _answer(o: TrialResult, planted: str) -> str:
    missing = [a.names for a in o.answers if a.kind is FindingKind.MISSING]
    if not missing:
        silent = UNEXPLAINED if o.verdict == "UNEXPLAINED" else NOTHING
        return SHAPE if o.answers else silent
    if any(names[0] == planted for names in missing):
        return planted
    return AMBIGUOUS if any(planted in names for names in missing) else missing[0][0]


def _by_strength(results: Sequence[TrialResult]) -> dict[float, list[TrialResult]]:
    strengths = sorted({o.case.strength for o in results})
    return {s: [o for o in results if o.case.strength == s] for s in strengths}


def _wrong_names(where: str, trials: Sequence[TrialResult], asked: Range) -> list[Rate]:
    text = f"planted {where} the catalogue"
    return [
        _rate(f"wrong names, {text}", trials, _wrong_name),
        _rate(f"confident wrong names, {text}", trials,
              lambda o: any(a.confidence >= CONFIDENT for a in o.wrong), asked),
    ]  # fmt: skip


def _rate(
    what: str,
    trials: Sequence[TrialResult],
    good: Callable[[TrialResult], bool],
    asked: Range | None = None,
) -> Rate:
    return Rate(what, sum(map(good, trials)), len(trials), asked)


def _outside(o: TrialResult) -> bool:
    return not o.case.known or any(name in OUTSIDE for name in o.case.effects)


def _right(o: TrialResult) -> bool:
    return o.right


def _wrong(o: TrialResult) -> bool:
    return bool(o.wrong)


def _wrong_name(o: TrialResult) -> bool:
    return any(a.kind is FindingKind.MISSING for a in o.wrong)


def _honest(o: TrialResult) -> bool:
    return not o.wrong and not o.named_coordinates.isdisjoint(o.coordinates)
