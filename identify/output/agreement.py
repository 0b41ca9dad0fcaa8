"""The agreement of two fits as text and as a JSON object."""

from __future__ import annotations

from typing import Any

from identify.output.words.agreement import (
    agreement_in_words,
    causes_in_words,
    difference_in_words,
    not_compared_in_words,
    wrong_models_in_words,
)
from identify.validation.agreement import Agreement, AxisAgreement, Difference


def agree_text(result: Agreement) -> str:
    """By axis whether the fits agree, what differs, and what would make the difference."""
    lines = []
    for axis, found in result.axes.items():
        lines.append(agreement_in_words(axis, found))
        lines += [f"  {difference_in_words(d)}" for d in found.differing]
        lines += [f"  {cause}" for cause in causes_in_words(found)]
        if doubt := wrong_models_in_words(found):
            lines.append(f"  {doubt}")
        if skipped := not_compared_in_words(found):
            lines.append(f"  {skipped}")
    lines += [f"axis {axis}: not compared, as it has no intervals" for axis in result.not_compared]
    return "\n".join(lines)


def agree_json(result: Agreement) -> dict[str, Any]:
    """By axis every compared parameter, and the effects that would make the difference."""
    return {
        "agree": result.agrees,
        "axes": {axis: _axis(found) for axis, found in result.axes.items()},
        "not_compared": list(result.not_compared),
    }


def _axis(found: AxisAgreement) -> dict[str, Any]:
    return {
        "agree": not found.differing,
        "parameters": {d.label: _difference(d) for d in found.differences},
        "differing": [d.label for d in found.differing],
        "not_compared": list(found.not_compared),
        "only_in_a": list(found.only_a),
        "only_in_b": list(found.only_b),
        "error_over_noise_floor": list(found.above_floor),
        "force": found.force,
        "force_unit": found.unit,
        "causes": [
            {"effect": c.effect, "share": c.share, "or": list(c.alike)} for c in found.causes
        ],
    }


def _difference(d: Difference) -> dict[str, Any]:
    return {
        "a": d.a, "b": d.b, "difference": d.b - d.a, "standard_error": d.standard_error,
        "unit": d.unit, "in_standard_errors": d.ratio, "limit": d.limit, "differs": d.differs,
    }  # fmt: skip
