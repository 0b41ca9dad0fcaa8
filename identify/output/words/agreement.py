"""Sentences about two fits: what differs, by how much, and which effect would make it."""

from __future__ import annotations

from identify.output.words.numbers import PLAIN, Numbers, with_unit
from identify.validation.agreement import AxisAgreement, Difference
from twin.model.units import units_of


def difference_in_words(d: Difference, numbers: Numbers = PLAIN) -> str:
    """One parameter that differs."""
    return (
        f"{d.label} differs by {numbers.amount(d.b - d.a, d.unit)} "
        f"({with_unit(f'{d.a:.6g} and {d.b:.6g}', d.unit)}), {numbers.ratio(abs(d.ratio))} joint "
        f"standard errors; allowed are {numbers.ratio(d.limit)}"
    )


def agreement_in_words(axis: str, found: AxisAgreement) -> str:
    """Whether two fits of an axis agree."""
    count, differing = len(found.differences), len(found.differing)
    if not differing:
        return f"axis {axis}: the fits agree in all {count} parameters that can be compared"
    return f"axis {axis}: the fits differ in {differing} of {count} parameters"


def causes_in_words(found: AxisAgreement) -> list[str]:
    """What the difference amounts to, and what would make it; nothing where the fits agree."""
    said = []
    for names, which in ((found.only_a, "first"), (found.only_b, "second")):
        if names:
            said.append(f"only the {which} fit has {', '.join(names)}")
    if found.force is None:
        return said
    said.append(f"the parameters that differ amount to {found.force:.3g} {found.unit} RMS")
    if not found.causes:
        said.append(
            units_of(found.unit).words("no absent effect with linear parameters has such a force")
        )
    words = units_of(found.unit).words
    return said + [
        f"{' or '.join([c.effect, *c.alike])} would make {100.0 * c.share:.0f} % of this "
        f"difference ({words('squared force')})"
        for c in found.causes
    ]


def wrong_models_in_words(found: AxisAgreement) -> str | None:
    """What the answer is worth where a model is wrong, or None."""
    if not found.of_wrong_models:
        return None
    first, second = found.above_floor
    return (
        f"the errors are {first:.1f} and {second:.1f} times the noise floor: the model is wrong, "
        "so this tells whether the machines are alike, not whether the values are right"
    )


def not_compared_in_words(found: AxisAgreement) -> str | None:
    """Which parameters could not be compared, or None."""
    if not found.not_compared:
        return None
    return f"not compared, for lack of an interval: {', '.join(found.not_compared)}"
