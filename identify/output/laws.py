"""What the laws made of effects, as text and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from twin.laws.verdict import LawReport, Outcome


def laws_text(reports: Sequence[LawReport]) -> str:
    """One line a law."""
    return "\n".join(f"{r.effect}: {_line(outcome)}" for r in reports for outcome in r.outcomes)


def _line(outcome: Outcome) -> str:
    if outcome.holds:
        return f"ok: {outcome.law}"
    return f"{'not tried' if outcome.holds is None else 'FAILED'}: {outcome.law}: {outcome.fault}"


def laws_json(reports: Sequence[LawReport]) -> dict[str, Any]:
    """Whether all laws hold for all effects, and each law; ``holds`` is null where not tried."""
    return {
        "ok": all(r.ok for r in reports),
        "effects": {
            r.effect: [
                {"law": o.law, "holds": o.holds, "fault": o.fault or None} for o in r.outcomes
            ]
            for r in reports
        },
    }
