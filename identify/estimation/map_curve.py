"""The curve through one direction of a velocity-friction map, with intervals of its parameters.

The Stribeck curve where the map asks for it by evidence, else a straight line of Coulomb and
viscous friction: a few fast speeds say nothing of a Stribeck velocity.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from identify.estimation.evidence import evidence
from identify.estimation.intervals import CONFIDENCE
from identify.estimation.stribeck_curve import StribeckCurve, fit_stribeck
from identify.estimation.velocity_map import VelocityMap
from twin.errors import InputError

Array = NDArray[np.float64]

NAMES = ("Fc", "Fs", "v0", "sigma2")
LINE = ("Fc", "sigma2")
ALIKE = 0.02  # of a speed, within which two plateaus count as one speed


@dataclass(frozen=True, eq=False)
class MapCurve:
    """The curve, and half widths of the 90 % intervals of the parameters that were fitted."""

    curve: StribeckCurve
    half: Mapping[str, float]

    @property
    def values(self) -> dict[str, float]:
        """What was fitted, by name."""
        return {name: getattr(self.curve, name) for name in self.half}

    def __call__(self, speed: Array) -> Array:
        """Friction (k,) N at speeds (k,) m/s."""
        return self.curve(speed)


def speeds_of(one_way: VelocityMap) -> list[NDArray[np.int64]]:
    """Entries of a map, in groups of one speed, by rising speed."""
    speed = np.abs(one_way.velocity)
    order = np.argsort(speed, kind="stable")
    edges = np.flatnonzero(np.diff(speed[order]) > ALIKE * speed[order][1:]) + 1
    return np.split(order, edges)


def curve_through(one_way: VelocityMap) -> MapCurve:
    """The curve through one direction of a map.

    Raises InputError for fewer than two speeds, or no more plateaus than parameters.
    """
    groups = speeds_of(one_way)
    if len(groups) < 2 or len(one_way) <= len(LINE):
        raise InputError(
            f"the map holds {len(one_way)} plateaus at {len(groups)} "
            f"speed{'' if len(groups) == 1 else 's'} in one direction; a curve needs three at two "
            "speeds, and a Stribeck curve six speeds or more"
        )
    line = line_through(one_way)
    if len(groups) <= len(NAMES) + 1:
        return line
    stribeck = stribeck_through(one_way)
    before, after = (_left(found.curve, one_way) for found in (line, stribeck))
    gained = evidence(before, after, len(NAMES) - len(LINE))
    return stribeck if gained.delta_bic > 0.0 else line


def stribeck_through(one_way: VelocityMap) -> MapCurve:
    """The Stribeck curve through one direction of a map."""
    speed, weight = np.abs(one_way.velocity), np.sqrt(one_way.samples)
    curve = fit_stribeck(speed, one_way.friction, weight)
    return MapCurve(curve, _half(curve, one_way, NAMES))


def line_through(one_way: VelocityMap) -> MapCurve:
    """Coulomb and viscous friction through one direction of a map."""
    speed, weight = np.abs(one_way.velocity), np.sqrt(one_way.samples)
    rows = weight[:, None] * np.stack([np.ones_like(speed), speed], axis=1)
    (level, slope), *_ = np.linalg.lstsq(rows, weight * one_way.friction, rcond=None)
    curve = StribeckCurve(float(level), float(level), float(speed.min()), float(slope))
    return MapCurve(curve, _half(curve, one_way, LINE))


def _left(curve: StribeckCurve, one_way: VelocityMap) -> Array:
    weight = np.sqrt(one_way.samples)
    return np.asarray(weight * (curve(np.abs(one_way.velocity)) - one_way.friction))


def _half(curve: StribeckCurve, one_way: VelocityMap, names: tuple[str, ...]) -> dict[str, float]:
    """Half widths by the scatter of the plateaus about the curve."""
    slopes = dict(zip(NAMES, curve.slopes(np.abs(one_way.velocity)).T, strict=True))
    if names == LINE:  # there Fs is Fc
        slopes["Fc"] = slopes["Fc"] + slopes["Fs"]
    columns = np.sqrt(one_way.samples)[:, None] * np.stack([slopes[n] for n in names], axis=1)
    left, freedom = _left(curve, one_way), len(one_way) - len(names)
    covariance = np.linalg.pinv(columns.T @ columns) * float(left @ left) / freedom
    quantile = float(stdtrit(freedom, 0.5 + CONFIDENCE / 2.0))
    return dict(zip(names, (quantile * np.sqrt(np.diag(covariance))).tolist(), strict=True))
