"""Mass, damping, resonances and delay that a frequency response shows.

The plant is a mass with viscous damping and stiffness, and modes beside it:

    P(s) = exp(-s tau) (1/(m s^2 + d s + k) + sum c_i/(s^2 + 2 z_i w_i s + w_i^2)).

The command is held over a sample and may act a part of one late, so that what is compared is the
exact response of its samples: each pole p is a state x' = p x + r u(t - tau), solved over a sample
(K. J. Astrom, B. Wittenmark, Computer-Controlled Systems, 3rd ed., 1997, chapter 2). Modes are
added while Schwarz's criterion asks for them. Bands are of linear error propagation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist

import numpy as np

from identify.frequency.response import Complex, Response
from identify.rules import RULE
from twin.errors import InputError
from twin.record import Number, record
from twin.signals import Array

SURE = NormalDist().inv_cdf(0.95)  # standard deviations to each side, of a 90 % band
TINY = np.finfo(float).tiny
LOUD = 3.0  # standard deviations from which an error counts less: what is not linear has peaks
DAMPING = (1e-4, 0.005, 0.05, 0.3)  # of a mode: least, two at which it is sought, and most


@record
class Banded:
    """A value and half its 90 % band, both in its unit."""

    value: Number
    band: Number


@record
class Mode:
    """A resonance: its frequency Hz, damping ratio, and part of the response beside the mass's."""

    frequency: Banded
    damping: Banded
    gain: Banded
    """c m (1): where positive, encoder and motor are on one side of the spring."""


@dataclass(frozen=True, eq=False)
class Plant:
    """What a response shows; on a rotary axis inertia (kg m^2) and so on."""

    mass: Banded
    """kg"""
    damping: Banded
    """N s/m"""
    stiffness: Banded
    """N/m: of a presliding friction, where the motion does not break away."""
    delay: Banded
    """s, from the beginning of the sample whose command acts."""
    modes: tuple[Mode, ...]
    fitted: Complex
    """The response (k,) m/N of these values at the frequencies of the estimate."""
    misfit: float
    """RMS of what it leaves, in standard deviations of the estimate; 1 where all of it is told."""


def plant_of(found: Response, most: int = 4) -> Plant:
    """Read the plant off a response, with ``most`` modes at most.

    Raises InputError where too few frequencies tell anything.
    """
    told = found.at(found.tells)
    if len(told.frequency) < 12:
        raise InputError(
            f"the response is told at {len(told.frequency)} of {len(found.frequency)} frequencies, "
            "too few for a mass; excite the axis more, as with a multisine"
        )
    # of a response: the error that a polynomial over a resonance may have of its own
    nearest = 0.01
    told = replace(told, spread=np.hypot(told.spread, nearest * np.abs(told.plant)))
    best = _best_from(told, _without_modes(told))
    for _ in range(most):
        better = _best_from(told, _with_mode(_roughly(told), best))
        if not all(_is_seen(mode, told) for mode in better.modes):
            break
        best = better
    return _read(found, told, best)


def _is_seen(mode: Mode, told: Response) -> bool:
    """Whether a mode is surely there, and both its sides are among the frequencies told.

    Its gain is, by Schwarz's criterion for three values more. What may be as damped as one can be
    is none: it has no peak.
    """
    low, high = (1.0 + sign * mode.damping.value for sign in (-1.0, 1.0))
    first, last = told.frequency[[0, -1]] / mode.frequency.value
    # 0.99: at the bound but for what the search leaves
    peaks = mode.damping.value + mode.damping.band < 0.99 * DAMPING[-1]
    evidence = (SURE * mode.gain.value / mode.gain.band) ** 2
    sure = evidence > 3.0 * np.log(2.0 * len(told.frequency)) + RULE.least_bic
    return bool(peaks and sure and first < low and high < last)


@dataclass(frozen=True, eq=False)
class _Solved:
    """Values (n,) at the least cost, with their covariance (n, n)."""

    values: Array
    cost: float
    covariance: Array

    @property
    def bands(self) -> Array:
        """Half the 90 % bands (n,) of the values."""
        return np.asarray(SURE * np.sqrt(np.maximum(np.diag(self.covariance), 0.0)))

    def banded(self, i: int, times: float = 1.0) -> Banded:
        """What the value at i is the logarithm of, times a number."""
        value, band = times * float(np.exp(self.values[i])), self.bands[i]
        # 50, a factor e^50: nothing is told, and exp stays finite
        return Banded(value, value * float(np.expm1(band)) if band < 50.0 else np.inf)

    @property
    def modes(self) -> tuple[Mode, ...]:
        """The modes, the slowest first."""
        modes = (
            Mode(
                self.banded(i, 0.5 / np.pi), self.banded(i + 1),
                Banded(float(self.values[i + 2]), float(self.bands[i + 2])),
            )
            for i in range(4, len(self.values), 3)
        )  # fmt: skip
        return tuple(sorted(modes, key=lambda m: m.frequency.value))


def _covariance(jac: Array, error: Array) -> Array:
    """Covariance (n, n) of values by the robust loss's Jacobian (2 k, n) and what is left (2 k,).

    What is left of a machine that is not linear is alike at near frequencies, and a smooth shape
    meets more of it than a narrow one: the sandwich of W. K. Newey, K. D. West, A Simple, Positive
    Semi-Definite, Heteroskedasticity and Autocorrelation Consistent Covariance Matrix, Econometrica
    55, 1987, with the correlations up to where they end, of no less than noise.
    """
    from scipy.linalg import toeplitz

    weight = 1.0 + (error / LOUD) ** 2
    # SciPy divides the Jacobian by weight^0.75, the curvature of this loss
    plain = (jac.T * weight**0.75).reshape(len(jac.T), 2, -1)
    left = (error / np.sqrt(weight)).reshape(2, -1)
    k = left.shape[1]
    alike = np.array([np.sum(left[:, lag:] * left[:, : k - lag]) for lag in range(k)])
    ends = int(np.argmax(alike <= 0.0)) or k
    alike[:ends] *= 1.0 - np.arange(ends) / ends
    alike[ends:] = 0.0
    level = max(alike[0] / max(2 * k - len(plain), 1), 1.0) / alike[0]
    meat = np.einsum("ipk,kl,jpl->ij", plain, level * toeplitz(alike), plain, optimize=True)
    size, ways = np.linalg.eigh(jac.T @ jac)
    bread = ways / np.maximum(size, 1e-3) @ ways.T  # a way that changes nothing is not told at all
    return np.asarray(bread @ meat @ bread)


def _roughly(told: Response) -> Response:
    """The same, known to a tenth: what it is like as a whole is found first."""
    # 0.1, as it says
    return replace(told, spread=np.hypot(told.spread, 0.1 * np.abs(told.plant)))


def _best_from(told: Response, starts: Sequence[Array]) -> _Solved:
    rough = min((_solved(_roughly(told), start) for start in starts), key=lambda s: s.cost)
    return _solved(told, rough.values)


def _solved(told: Response, start: Array) -> _Solved:
    from scipy.optimize import least_squares  # takes a while to load

    modes = (len(start) - 4) // 3

    omega = np.log(2.0 * np.pi * told.frequency[[0, -1]])
    # a factor e^7 of the mass begun with; of the others what no machine is beyond
    low = [start[0] - 7.0, -20.0, -20.0, -100.0] + [omega[0], np.log(DAMPING[0]), -np.inf] * modes
    # as below
    high = [start[0] + 7.0, 20.0, 40.0, 100.0] + [omega[1], np.log(DAMPING[-1]), np.inf] * modes
    done = least_squares(
        lambda v: _left(v, told), np.clip(start, low, high),
        lambda v: _slopes(v, np.array(low), np.array(high), told), bounds=(low, high),
        x_scale="jac", loss="soft_l1", f_scale=LOUD, max_nfev=200, ftol=1e-6, xtol=1e-6,
    )  # fmt: skip
    covariance = _covariance(done.jac, done.fun)
    # What ends at a bound is not told, nor what may change by a factor e and leaves all as it is.
    untold = (done.active_mask != 0) | (np.sum(done.jac**2, axis=0) < 1.0)
    covariance[np.diag(untold)] = np.inf
    return _Solved(done.x, 2.0 * done.cost, covariance)


def _without_modes(told: Response) -> tuple[Array, Array]:
    """Logarithms of mass, damping and stiffness over mass, delay in samples, to begin with.

    Of a free mass, and of one on a spring.
    """
    omega = 2.0 * np.pi * told.frequency
    masses = 1.0 / (omega**2 * np.abs(told.plant))
    free, sprung = (float(np.median(m)) for m in (masses, masses[-len(masses) // 3 :]))
    stiffness = 1.0 / float(np.median(np.abs(told.plant[: len(masses) // 6])))
    return (
        # 0.1: damping and stiffness that hardly act in the band, a tenth of a sample late
        np.array([np.log(free), np.log(0.1 * omega[0]), np.log(0.1 * omega[0] ** 2), 0.1]),
        np.array([np.log(sprung), np.log(omega[0]), np.log(stiffness / sprung), 0.1]),
    )


def _with_mode(told: Response, best: _Solved) -> list[Array]:
    """Values with one mode more, where that and the rest, each times a number, leave least.

    Beside the values found, and beside a free mass: without the mode they may have had to bend.
    """
    starts = []
    for values in (best.values, np.concatenate([_without_modes(told)[0], best.values[4:]])):
        mass, late = float(np.exp(values[0])), values[3] * told.period
        rest, aim = _sampled(values, told) / told.spread, told.plant / told.spread
        omega, damping = np.meshgrid(2.0 * np.pi * told.frequency[2:-2], DAMPING[1:-1])
        roots = _roots((2.0 * damping * omega).ravel(), (omega**2).ravel())
        mode = _held(roots, late, told) / mass / told.spread
        scale, taken = _scaled(rest, mode, aim)
        taken[scale[0] <= 0.0] = -np.inf
        if np.isfinite(taken[largest := int(np.argmax(taken))]):
            rest_times, gain = scale[:, largest]
            shape = [np.log(omega.flat[largest]), np.log(damping.flat[largest])]
            more = [*shape, gain / rest_times]
            starts.append(np.array([values[0] - np.log(rest_times), *values[1:], *more]))
    return starts


def _scaled(rest: Complex, modes: Complex, aim: Complex) -> tuple[Array, Array]:
    """Numbers (2, m) times the rest (k,) and times each of some modes (m, k) that leave least.

    And what they take of the aim's (k,) squares (m,).
    """
    square = float(np.vdot(rest, rest).real)
    across, modes_square = (modes @ rest.conj()).real, np.sum(np.abs(modes) ** 2, axis=1)
    met, modes_met = float(np.vdot(rest, aim).real), (modes.conj() @ aim).real
    whole = np.maximum(square * modes_square - across**2, TINY)
    first = (modes_square * met - across * modes_met) / whole
    second = (square * modes_met - across * met) / whole
    return np.stack([first, second]), first * met + second * modes_met


def _left(values: Array, told: Response) -> Array:
    """What values (n, ...) leave of the response (2 k, ...), in its standard deviations."""
    left = ((_sampled(values, told).T - told.plant) / told.spread).T
    return np.concatenate([left.real, left.imag]) * np.sqrt(2.0)


def _slopes(values: Array, low: Array, high: Array, told: Response) -> Array:
    """Derivatives (2 k, n) of what values (n,) leave, within their bounds, by differences."""
    step = np.sqrt(np.finfo(float).eps) * np.maximum(1.0, np.abs(values))
    step = np.where(values + step > high, -step, step)
    every = _left(np.column_stack([values, values[:, None] + np.diag(step)]), told)
    return (every[:, 1:] - every[:, :1]) / step


def _sampled(values: Array, told: Response) -> Complex:
    """Response (k, ...) of the samples of a plant with these values (n, ...)."""
    mass, damping, stiffness = np.exp(values[:3])
    omega, ratio = np.exp(values[4::3]), np.exp(values[5::3])
    roots = _roots(
        np.concatenate([damping[None], 2.0 * ratio * omega]),
        np.concatenate([stiffness[None], omega**2]),
    )
    gain = np.concatenate([np.ones_like(mass)[None], values[6::3]]) / mass
    return np.sum(gain[:, None] * _held(roots, values[3] * told.period, told), axis=0)


def _roots(linear: Array, constant: Array) -> tuple[Complex, Complex]:
    """The roots (m, ...) of s^2 + linear s + constant, never the same: each has its own state."""
    # 1e-6 of the pole: apart, and no peak is moved
    half, least = 0.5 * linear, 1e-6 * (0.5 * linear + 1e-9)
    apart = np.sqrt(np.asarray(half**2 - constant, dtype=complex))
    apart = np.where(np.abs(apart) > least, apart, least)
    far = np.asarray(-half - apart, dtype=complex)
    return far, np.where(apart.imag == 0.0, constant / far, -half + apart)


def _held(roots: tuple[Complex, Complex], late: Array, told: Response) -> Complex:
    """Responses (m, k, ...) of 1/((s - p) (s - q)), of roots (m, ...) p and q.

    To a command that is held over samples, and late (...) by s.
    """
    period, late = told.period, np.asarray(late)
    turn = (2j * np.pi * told.frequency * period).reshape(-1, *[1] * late.ndim)
    whole = np.floor(late / period)
    part, once, back = late - whole * period, np.exp(turn), np.exp(-turn)
    out = np.zeros((), dtype=complex)
    for own, other in (roots, roots[::-1]):
        before = np.exp(own * (period - part)) * _grown(own, part)  # by the command before
        drive = before[:, None] * back + _grown(own, period - part)[:, None]
        ahead = (own - other)[:, None] * (once - np.exp(own * period)[:, None])
        out = out + drive / ahead
    return out * np.exp(-turn * whole)


def _grown(pole: Complex, time: Array) -> Complex:
    """(exp(p t) - 1)/p, s."""
    x = pole * time
    # 1e-5: the next term of the series is below rounding
    small = np.abs(x) < 1e-5
    series = time * (1.0 + 0.5 * x + x * x / 6.0)
    return np.where(small, series, np.expm1(x) / np.where(small, 1.0, pole))


def _read(found: Response, told: Response, best: _Solved) -> Plant:
    values, mass = best.values, float(np.exp(best.values[0]))
    left = np.abs(_sampled(values, told) - told.plant) / told.spread
    return Plant(
        mass=best.banded(0),
        damping=best.banded(1, mass),
        stiffness=best.banded(2, mass),
        delay=Banded(float(values[3]) * told.period, float(best.bands[3]) * told.period),
        modes=best.modes,
        fitted=_sampled(values, found),
        misfit=float(np.sqrt(np.mean(left**2))),
    )


# --- the position loop ----------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Loop:
    """A position loop at the frequencies of a response; no number where it does not tell.

    Margins are no number where the loop does not cross within the frequencies that are told.
    """

    sensitivity: Complex
    """(k,) What is left of a disturbance of the position."""
    crossover: float
    """Hz, the highest at which the open loop falls below 1."""
    phase_margin: float
    """rad, there."""
    gain_margin: float
    """Times which the gain may grow until the loop is unstable."""
    peak: float
    """Largest sensitivity; its inverse is the modulus margin."""
    by_controller: bool
    """Whether the controller is that of a model. Else the sensitivity is the error over the
    setpoint, which a feedforward lowers: then the margins are not those of the loop."""


def loop_of(found: Response, controller: Complex | None) -> Loop | None:
    """The loop with a controller's response (k,) N/m, or by the setpoint; None without either.

    A sensitivity that exceeds 1 nowhere is that of no loop (H. W. Bode, Network Analysis and
    Feedback Amplifier Design, 1945): then the setpoint is fed forward, and its error tells none.
    """
    told = found.tells
    if controller is not None:
        open_loop = controller * found.plant
        sensitivity = 1.0 / (1.0 + open_loop)
    elif np.isfinite(found.closed).all():
        sensitivity = 1.0 - found.closed
        open_loop = found.closed / sensitivity
    else:
        return None
    if not told.any():
        return None
    where, along = found.frequency[told], open_loop[told]
    crossover, turn = _crossing(np.log(np.abs(along)), np.unwrap(np.angle(along)), where)
    below = np.angle(-along)  # zero where the phase is -180 degrees
    falls = np.flatnonzero((below[:-1] > 0.0) & (below[1:] <= 0.0) & (np.abs(along[1:]) < 1.0))
    gain = 1.0 / float(np.abs(along[falls[0] + 1])) if len(falls) else np.nan
    peak = float(np.abs(sensitivity[told]).max())
    if controller is None and peak <= 1.0:
        return None
    return Loop(
        np.where(told, sensitivity, np.nan), crossover, float(np.angle(-np.exp(1j * turn))), gain,
        peak, controller is not None,
    )  # fmt: skip


def _crossing(level: Array, phase: Array, frequency: Array) -> tuple[float, float]:
    """Where a logarithm falls through zero for the last time, Hz, and the phase there, rad."""
    falls = np.flatnonzero((level[:-1] > 0.0) & (level[1:] <= 0.0))
    if not len(falls):
        return np.nan, np.nan
    i = falls[-1]
    part = level[i] / (level[i] - level[i + 1])
    between = np.log(frequency[i]) + part * np.log(frequency[i + 1] / frequency[i])
    return float(np.exp(between)), float(phase[i] + part * (phase[i + 1] - phase[i]))
