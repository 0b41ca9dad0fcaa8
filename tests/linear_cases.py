"""Linear least squares whose solutions the tests write down, for evidence and intervals."""

from itertools import pairwise

import numpy as np
from scipy.signal import lfilter


def coloured(n: int, pole: float, seed: int) -> np.ndarray:
    """Noise of one pole, of unit innovations."""
    return lfilter([1.0], [1.0, -pole], np.random.default_rng(seed).normal(size=n))


def linear(seed: int, n: int = 310, k: int = 3):
    """A linear problem: columns, data, and the residual at its least squares."""
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(n, k)) * [1.0, 30.0, 0.02]
    data = coloured(n, 0.5, seed) + columns @ [1.0, 0.2, -9.0]
    at = np.linalg.lstsq(columns, data, rcond=None)[0]
    return columns, data, at


def without(columns, data, block):
    """The solution of a fit that has not seen a block."""
    keep = np.ones(len(data), bool)
    keep[block] = False
    return np.linalg.lstsq(columns[keep], data[keep], rcond=None)[0]


def cut(n: int, blocks: int):
    """So many blocks of n samples."""
    edges = np.linspace(0, n, blocks + 1).astype(int)
    return [slice(a, b) for a, b in pairwise(edges)]
