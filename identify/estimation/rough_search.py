"""Search for the least of a rough error: a population around a start, then a simplex.

A model that is wrong comes to rest at other instants than the machine. Each such instant makes a
dent in the error of a simulated motion, and a search along slopes ends in the first one. R. Storn,
K. Price, "Differential evolution", J. Global Optim. 11 (1997); J. Nelder, R. Mead, "A simplex
method for function minimization", Comput. J. 7 (1965), which is also the thesis's search.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

POPULATION, MOST = 12, 72  # for each variable, and of all
GENERATIONS = 60  # at most
ALIKE = 1e-3  # scatter of the population's errors, in parts of their mean, at which it ends
REACH = 5.0  # standard deviations of the population, beyond which nothing is tried
SIMPLEX_EVALUATIONS = 600  # at most


def rough_minimum(
    error: Callable[[Array], float],
    start: Array,
    spread: Array,
    bounds: tuple[Array, Array],
    rng: np.random.Generator,
) -> Array:
    """Variables (k,) with the least error that is found, never larger than at the start (k,).

    spread (k,): standard deviation of the population around the start. Where the error is not
    finite the variables are not taken.
    """
    from scipy.optimize import differential_evolution, minimize

    def finite(x: Array) -> float:
        found = error(x)
        return found if np.isfinite(found) else np.inf

    low = np.maximum(bounds[0], start - REACH * spread)
    high = np.minimum(bounds[1], start + REACH * spread)
    size = (min(POPULATION * len(start), MOST), len(start))
    first = np.clip(start + spread * rng.standard_normal(size), low, high)
    first[0] = start
    found = differential_evolution(
        finite, list(zip(low, high, strict=True)), init=first, maxiter=GENERATIONS, tol=ALIKE,
        polish=False, rng=rng,
    ).x  # fmt: skip
    options = {"maxfev": SIMPLEX_EVALUATIONS}
    polished = minimize(
        finite, found, method="Nelder-Mead", bounds=list(zip(low, high, strict=True)),
        options=options,
    ).x  # fmt: skip
    return min((start, found, polished), key=finite)
