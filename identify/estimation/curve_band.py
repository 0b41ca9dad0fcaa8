"""A curve that follows from the parameters of a fit, with its 90 % band."""

from __future__ import annotations

from collections.abc import Callable, Collection

import numpy as np

from identify.estimation.fit import Fit
from identify.estimation.intervals import half_widths, half_widths_of
from twin.model.machine import AxisModel
from twin.model.parameters import ParameterReference, read, write
from twin.signals import Array

PART = 0.1  # of a half width, the step of a difference


def with_band(
    fit: Fit, curve: Callable[[AxisModel], Array], among: Collection[ParameterReference]
) -> tuple[Array, Array]:
    """The curve (k,) of a fitted axis, and half the width (k,) of its 90 % band, in its unit.

    among: the free parameters that the curve depends on.
    """
    where, half = fit.scaling.where, half_widths(fit)
    centre, values = curve(fit.axis), read(fit.axis, where)
    slopes = np.zeros((len(where), len(centre)))
    for i in np.flatnonzero(np.isfinite(half)):
        if where[i] in among:
            step = PART * half[i]
            slopes[i] = (curve(write(fit.axis, [where[i]], [values[i] + step])) - centre) / step
    return centre, half_widths_of(fit, slopes)
