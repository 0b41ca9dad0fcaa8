"""Why the logs do not prove a change, in words."""

from __future__ import annotations

from identify.selection.refusal import (
    ByChance,
    EndsAtBound,
    Instead,
    OutsideKnee,
    Refusal,
    TakesLittle,
    Uncertain,
)

INSTEAD = {
    Instead.NO_REFIT: "by one linear step it gains too little",
    Instead.ERROR_OF_ANOTHER_SIZE: "its noise is no good part of the error, or more than it",
    Instead.ANY_FORCE_OF_THE_MOTION: (
        "the motion repeats with it, so that any force of the motion could be it"
    ),
    Instead.WEIGHT_OF_BODIES: (
        "a tenth more or less of what the bodies of the file weigh could be it"
    ),
    Instead.ROTOR_OR_BODIES: (
        "another rotor, or bodies with values within a tenth of the file's, explain as much"
    ),
    Instead.CURVE_BETWEEN_KNOTS: "a free curve beside it may miss as much between its knots",
    Instead.FRICTION: "it takes the place of the friction, which another friction would",
    Instead.FRICTION_OUT_OF_STEP: (
        "the friction alone, a moment earlier or later, explains as much"
    ),
    Instead.INERTIA: "it takes the place of the inertia",
    Instead.FORCE_BEFORE_ITS_STAMP: (
        "the force acts before its time stamp, where it would act after it"
    ),
    Instead.LAW_WITHIN_BAND: "its band holds the law everywhere",
}


def refusal_in_words(reason: Refusal) -> str:
    """Why a change is not proved, or not as that law; no capital, no full stop."""
    match reason:
        case TakesLittle(part):
            return f"takes {100.0 * max(part, 0.0):.0f} % of what is left"
        case Uncertain(t, least):
            return f"gain uncertain: t = {t:.1f}, where {least:.1f} is sure"
        case ByChance(part):
            return f"shifted in time, where it cannot be real, it takes {100.0 * part:.0f} %"
        case OutsideKnee():
            return _outside_knee(reason)
        case EndsAtBound(labels):
            return f"{' and '.join(labels)} {'end' if labels[1:] else 'ends'} at a bound"
        case Instead():
            return INSTEAD[reason]


def _outside_knee(reason: OutsideKnee) -> str:
    size, edge = (f"{v:.3g} {reason.unit}".removesuffix(" 1") for v in (reason.size, reason.edge))
    side = "below" if reason.size < reason.edge else "beyond"
    value = "" if size == edge else f" of {size}"
    return f"its {reason.name}{value} is {side} {edge}, so that it is {reason.of.value} here"
