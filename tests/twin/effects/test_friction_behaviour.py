"""What tells the friction models apart in motion: breakaway, lag, stick-slip and drift."""

import numpy as np
import pytest
from effect_runs import CATALOGUE
from friction_runs import (
    FORGETFUL,
    STATIC,
    STRIBECK,
    along,
    friction,
    pushed,
    time,
)

from twin.laws.trials import Array
from twin.model.machine import Fitted
from twin.simulator import MujocoSimulator, ReducedSimulator

BOTH = pytest.mark.parametrize("stage", [MujocoSimulator, ReducedSimulator])


# --- rest and breakaway ---------------------------------------------------------------------------


@BOTH
@pytest.mark.parametrize("share", [0.1, -0.5, 0.999])
@pytest.mark.parametrize("name", STATIC)
def test_a_static_model_does_not_creep_below_breakaway(
    name: str, share: float, stage: type[MujocoSimulator] | type[ReducedSimulator]
) -> None:
    x, v, held = pushed([friction(name)], np.full(5000, share * 1.5), simulator=stage)
    assert np.abs(x).max() < 1e-15
    assert np.abs(v).max() < 1e-15
    np.testing.assert_allclose(held, share * 1.5, rtol=1e-12)


def test_stribeck_is_the_curve_of_modelicas_friction_example() -> None:
    """Modelica Standard Library, MassWithStopAndFriction, with the values of Examples.Friction.

    F_prop v + F_Coulomb + F_Stribeck exp(-fexp v) with 1 N s/m, 5 N, 10 N and 2 s/m.
    """
    fitted = friction("stribeck", Fc=5.0, Fs=15.0, v0=0.5, sigma2=1.0, n=1.0)
    v = np.array([1e-6, 0.1, 0.5, 1.0, 3.0])
    expected = 1.0 * v + 5.0 + 10.0 * np.exp(-2.0 * v)
    np.testing.assert_allclose(along(fitted, v, 1e-4), expected, rtol=1e-12)
    np.testing.assert_allclose(along(fitted, -v, 1e-4), -expected, rtol=1e-12)


def breakaway(name: str, rate: float) -> float:
    """Highest friction before the mass runs away under a force growing at that rate (N/s)."""
    _, v, held = pushed([friction(name)], rate * time(2.0 / rate + 0.05))
    return float(held[: np.flatnonzero(v > 5e-3)[0]].max())


@pytest.mark.parametrize("name", STRIBECK)
def test_breakaway_force_falls_with_the_rate_of_force(name: str) -> None:
    """Canudas de Wit et al. 1995, section on the varying break-away force, for LuGre."""
    found = [breakaway(name, rate) for rate in (0.5, 2.0, 10.0, 50.0)]
    assert np.all(np.diff(found) < 0.0)
    assert 1.45 < found[0] < 1.5  # slowly: nearly Fs
    assert found[-1] < 0.9 * found[0]
    assert found[-1] > 0.99  # never below Fc


# --- stick-slip -----------------------------------------------------------------------------------


def pulled(fitted: Fitted, spring: float, speed: float, duration: float) -> tuple[Array, Array]:
    """Position m and velocity m/s of 1 kg on a spring whose far end moves at that speed."""
    t = time(duration)
    hung = Fitted.at_start(CATALOGUE["cable_slab"], {"k1": spring})
    x, v, _ = pushed([fitted, hung], spring * speed * t)
    return x, v


def slips(v: Array) -> Array:
    """Samples at which the mass breaks loose."""
    fast = v > 0.1 * v.max()
    starts = np.flatnonzero(fast[1:] & ~fast[:-1])
    return starts[np.diff(starts, prepend=-1000) > 500]


def test_stick_slip_of_a_pulled_mass_has_the_period_of_the_closed_form() -> None:
    """With Fs, Fc and no viscosity: stick 2 (Fs - Fc)/(k V), slip 2 (pi - atan(...))/omega."""
    spring, speed, excess = 100.0, 0.01, 0.5
    omega = np.sqrt(spring)
    slip = 2.0 * (np.pi - np.arctan(excess * omega / (spring * speed))) / omega
    x, v = pulled(friction("coulomb_viscous", sigma2=0.0), spring, speed, 8.0)
    starts = slips(v)
    period = 2.0 * excess / (spring * speed) + slip
    np.testing.assert_allclose(np.diff(starts) * 1e-4, period, rtol=2e-3)
    still = v < 1e-12
    assert np.mean(still[starts[0] : starts[-1]]) == pytest.approx(1.0 - slip / period, abs=5e-3)
    stuck = x[starts[1] - 8000 : starts[1] - 500]
    assert np.ptp(stuck) < 1e-15


# --- drift ----------------------------------------------------------------------------------------


def drift(name: str) -> tuple[float, float]:
    """Mean drift per period and amplitude, m, under a biased 10 Hz vibration below breakaway."""
    t = time(12.0)
    force = np.minimum(t, 1.0) * (0.5 + 0.45 * np.sin(2.0 * np.pi * 10.0 * t))
    x, _, _ = pushed([friction(name)], force)
    return (x[-1] - x[len(x) // 3]) / 80.0, float(np.ptp(x[-1000:]))


@pytest.mark.parametrize("name", FORGETFUL)
def test_a_model_that_forgets_drifts_without_end(name: str) -> None:
    walked, swing = drift(name)
    assert walked > 0.5 * swing
