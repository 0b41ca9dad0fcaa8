"""What refitting changed: where a model as given disagrees with a machine by its values alone.

A fit takes over what its parameters can, so an effect that is one of them by another name (a tilt
and the cable's constant, a payload and the mass) never shows as missing. It shows here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.candidates import absent_effects
from identify.fit import AT_FLOOR, Fit, rms
from identify.residual import jacobian, residual
from identify.subspace import orthonormal, unabsorbed
from identify.uncertainty import half_widths
from twin.effect import Kind
from twin.effects import Catalogue
from twin.model import AxisModel, Coordinate, Fitted, read, write

Array = NDArray[np.float64]

LEAST_FORCE = 0.1  # of the error as given, that a parameter's change must make to be told
SAME_FORCE = 0.01  # of a parameter's force at most, that an effect leaves which is it by other name
MOST_TOLD = 3


@dataclass(frozen=True)
class Change:
    """A parameter that a fit moved by more than its interval.

    before, after: in ``unit``. force: RMS force that the change makes, N. alike: absent effects
    that are the same force.
    """

    label: str
    before: float
    after: float
    unit: str
    force: float
    alike: tuple[str, ...] = ()

    def in_words(self) -> str:
        """E.g. "mass 15 -> 15.6 kg makes 0.57 N (payload_mass would be the same force)"."""
        same = f" ({' and '.join(self.alike)} would be the same force)" if self.alike else ""
        values = f"{self.before:.4g} -> {self.after:.4g} {self.unit}"
        return f"{self.label} {values} makes {self.force:.3g} N{same}"


@dataclass(frozen=True)
class Refit:
    """The RMS force errors (N) of an axis as given and refitted, and the changes that told most."""

    given: float
    refitted: float
    changes: tuple[Change, ...]

    def in_words(self) -> str | None:
        """A sentence, or None where the values given were good."""
        if not self.changes:
            return None
        told = ", ".join(c.in_words() for c in self.changes)
        return (
            f"as given the model misses by {self.given:.3g} N, refitted by {self.refitted:.3g} N: "
            f"{told}"
        )


def refit(given: AxisModel, fit: Fit, catalogue: Catalogue) -> Refit:
    """What a fit changed of the model given, where that stood above the noise floor."""
    error = rms(residual(given, fit.logs)[fit.kept])
    if not error > AT_FLOOR * max(fit.floor, fit.error):
        return Refit(error, fit.error, ())
    where = fit.scaling.where
    values = zip(where, read(given, where), read(fit.axis, where), half_widths(fit), strict=True)
    told: list[tuple[Change, Array]] = []
    for c, before, after, half in values:
        if abs(after - before) > half:
            back = residual(write(fit.axis, [c], [before]), fit.logs)[fit.kept] - fit.residual
            unit = c.parameter.unit
            told.append((Change(c.label, float(before), float(after), unit, rms(back)), back))
    told = [t for t in told if t[0].force > LEAST_FORCE * error]
    told = sorted(told, key=lambda t: -t[0].force)[:MOST_TOLD]
    bases = _bases(fit, catalogue) if told else {}
    changes = tuple(
        replace(change, alike=tuple(name for name, basis in bases.items() if _within(back, basis)))
        for change, back in told
    )
    return Refit(error, fit.error, changes)


def _bases(fit: Fit, catalogue: Catalogue) -> dict[str, Array]:
    """Orthonormal basis (n, k) of what each absent effect without a shape can be, by name."""
    out = {}
    for effect in absent_effects(fit.axis, catalogue):
        if effect.kind is Kind.FRICTION or len(effect.strengths) < len(effect.parameters):
            continue
        where = [Coordinate(effect.name, p) for p in effect.strengths]
        with_it = fit.axis.with_effect(Fitted.at_start(effect))
        out[effect.name] = orthonormal(jacobian(with_it, fit.logs, where)[fit.kept])
    return out


def _within(force: Array, basis: Array) -> bool:
    return rms(unabsorbed(force, basis)) < SAME_FORCE * rms(force)
