"""The rates of a self-test, with their counts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from identify.selftest.trial import TrialResult


@dataclass(frozen=True)
class Rate:
    """How many trials had an outcome. asked: the range of the rate that is the target, if any."""

    what: str
    count: int
    trials: int
    asked: tuple[float, float] | None = None

    @property
    def value(self) -> float:
        """0..1; not a number without trials."""
        return self.count / self.trials if self.trials else float("nan")


ASKED = {5.0: (0.95, 1.0), 2.0: (0.80, 1.0)}  # by force over the noise floor
ALARMS, PAIRS, OUTSIDE, COVERED = (0.0, 0.01), (0.85, 1.0), (0.80, 1.0), (0.85, 0.95)


def rates(results: Sequence[TrialResult]) -> list[Rate]:
    """All rates of a self-test."""
    shown = [o for o in results if o.shown]
    one = [o for o in shown if len(o.case.effects) == 1 and o.case.known]
    out = [
        _rate(
            f"named or in a declared ambiguity, force {s:g} times the noise floor",
            [o for o in one if o.case.strength == s], _right, ASKED.get(s),
        )
        for s in sorted({o.case.strength for o in one})
    ]  # fmt: skip
    empty = [o for o in shown if not o.case.effects]
    two = [o for o in shown if len(o.case.effects) == 2]
    out.append(_rate("false alarms, nothing planted", empty, _alarm, ALARMS))
    out.append(_rate("wrong names given with confidence, one planted", one, _wrong))
    out.append(_rate("both of two named", two, _right, PAIRS))
    left_out = [o for o in shown if not o.case.known]
    out.append(
        _rate("effect outside the catalogue: floor reached or the right coordinate", left_out,
              lambda o: o.honest, OUTSIDE)
    )  # fmt: skip
    covered = [c for o in empty for _, c in o.covered]
    out.append(Rate("90 % intervals that hold the truth", sum(covered), len(covered), COVERED))
    return [r for r in out if r.trials]


def _rate(
    what: str,
    trials: Sequence[TrialResult],
    good: Callable[[TrialResult], bool],
    asked: tuple[float, float] | None = None,
) -> Rate:
    return Rate(what, sum(map(good, trials)), len(trials), asked)


def _right(o: TrialResult) -> bool:
    return o.right


def _alarm(o: TrialResult) -> bool:
    return not o.quiet


def _wrong(o: TrialResult) -> bool:
    return not o.quiet and not o.right


def coverage(results: Sequence[TrialResult]) -> dict[str, Rate]:
    """Coverage of the intervals by parameter, of machines with nothing planted."""
    found: dict[str, list[bool]] = {}
    for o in results:
        for label, inside in o.covered:
            found.setdefault(label, []).append(inside)
    return {k: Rate(k, sum(v), len(v), COVERED) for k, v in found.items()}


def confusion(results: Sequence[TrialResult]) -> dict[str, dict[str, float]]:
    """Planted effect -> answer -> part of the trials: a name, "ambiguous", or none.

    An ambiguity that holds the planted effect counts for it, in a column of its own.
    """
    one = [o for o in results if o.shown and o.case.known and len(o.case.effects) <= 1]
    table: dict[str, dict[str, float]] = {}
    for o in one:
        planted = o.case.effects[0] if o.case.effects else NOTHING
        row = table.setdefault(planted, {})
        row[_answer(o)] = row.get(_answer(o), 0.0) + 1.0
    return {
        name: {answer: n / sum(row.values()) for answer, n in row.items()}
        for name, row in table.items()
    }


NOTHING, UNEXPLAINED, AMBIGUOUS = "nothing", "unexplained", "ambiguous with it"


def _answer(o: TrialResult) -> str:
    if o.quiet:
        return UNEXPLAINED if o.verdict == "UNEXPLAINED" else NOTHING
    planted = o.case.effects[0] if o.case.effects else ""
    if planted in o.named:
        return planted
    return AMBIGUOUS if any(planted in answer for answer in o.answers) else o.named[0]
