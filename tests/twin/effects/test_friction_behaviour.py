"""What tells the friction models apart in motion: rest, breakaway, lag, stick-slip and drift."""

from functools import partial

import numpy as np
import pytest
from axis_runs import BOTH, Stepper, effect
from axis_runs import pushed as pushed_at
from friction_runs import RATE, friction, time

EACH = pytest.mark.parametrize("stage", BOTH)
pushed = partial(pushed_at, rate=RATE)


@EACH
@pytest.mark.parametrize("share", [-0.5, 0.999])
@pytest.mark.parametrize("name", ["coulomb_viscous", "stribeck"])
def test_a_friction_that_sticks_does_not_creep_below_breakaway(name, share, stage):
    assert friction(name).effect.sticks
    run = pushed(1.0, [friction(name)], np.full(5000, share * 1.5), stage)
    assert np.abs(run.x).max() < 1e-15
    assert np.abs(run.v).max() < 1e-15
    np.testing.assert_allclose(-run.of(name), share * 1.5, rtol=1e-12)


@EACH
def test_a_force_above_static_friction_breaks_it_away(stage: Stepper) -> None:
    fitted, force = effect("coulomb_viscous", Fc=0.8, Fs=1.0), 1.001
    run = pushed(2.0, [fitted], np.full(10_000, force), stage)
    once_it_slides = (force - 0.8) / 2.0 * time(1.0) ** 2 / 2.0
    np.testing.assert_allclose(run.x, once_it_slides, rtol=0, atol=1e-12)


def test_asymmetric_friction_sticks_on_its_strong_side() -> None:
    """What rounding leaves of the speed of a stuck axis must not choose the direction."""
    effects = (
        effect("coulomb_viscous", Fc=1.0, Fs=1.0, sigma2=3.0),
        effect("asymmetric_friction", coulomb=0.5),
        effect("cogging", a1=0.1, b1=0.08),
    )
    for seed in range(8):  # slide, stop, then push with 0.5 to 1.3 N, where it holds 1.5 N
        rng = np.random.default_rng(seed)
        force = np.r_[np.full(4000, 3.0), np.linspace(0.0, 1.3, 16_000)]
        force += rng.uniform(-0.01, 0.01, len(force))
        run = pushed(rng.uniform(1.0, 20.0), effects, force)
        assert np.ptp(run.x[10_000:]) < 1e-15
        assert run.x[-1] > 1e-3


def breakaway(name: str, rate: float) -> float:
    """Highest friction before the mass runs away under a force growing at that rate (N/s)."""
    run = pushed(1.0, [friction(name)], rate * time(2.0 / rate + 0.05))
    return float(-run.of(name)[: np.flatnonzero(run.v > 5e-3)[0]].min())


@pytest.mark.parametrize("name", ["lugre", "leuven", "modified_leuven", "gms"])
def test_breakaway_force_falls_with_the_rate_of_force(name: str) -> None:
    """Canudas de Wit et al. 1995, section on the varying break-away force, for LuGre."""
    found = [breakaway(name, rate) for rate in (0.5, 2.0, 10.0, 50.0)]
    assert np.all(np.diff(found) < 0.0)
    assert 1.45 < found[0] < 1.5  # slowly: nearly Fs
    assert found[-1] < 0.9 * found[0]
    assert found[-1] > 0.99  # never below Fc


def test_stick_slip_of_a_pulled_mass_has_the_period_of_the_closed_form() -> None:
    """With Fs, Fc and no viscosity: stick 2 (Fs - Fc)/(k V), slip 2 (pi - atan(...))/omega."""
    spring, speed, excess = 100.0, 0.01, 0.5
    omega = np.sqrt(spring)
    slip = 2.0 * (np.pi - np.arctan(excess * omega / (spring * speed))) / omega
    effects = (friction("coulomb_viscous", sigma2=0.0), effect("cable_slab", k1=spring))
    run = pushed(1.0, effects, spring * speed * time(8.0))
    fast = run.v > 0.1 * run.v.max()
    starts = np.flatnonzero(fast[1:] & ~fast[:-1])
    starts = starts[np.diff(starts, prepend=-1000) > 500]  # it breaks loose
    period = 2.0 * excess / (spring * speed) + slip
    np.testing.assert_allclose(np.diff(starts) / RATE, period, rtol=2e-3)
    still = run.v[starts[0] : starts[-1]] < 1e-12
    assert np.mean(still) == pytest.approx(1.0 - slip / period, abs=5e-3)
    assert np.ptp(run.x[starts[1] - 8000 : starts[1] - 500]) < 1e-15


@pytest.mark.parametrize("name", ["dahl", "lugre"])
def test_a_model_that_forgets_drifts_without_end(name: str) -> None:
    """Under a biased 10 Hz vibration below breakaway, by more than half its swing a period."""
    t = time(12.0)
    force = np.minimum(t, 1.0) * (0.5 + 0.45 * np.sin(2.0 * np.pi * 10.0 * t))
    x = pushed(1.0, [friction(name)], force).x
    assert (x[-1] - x[len(x) // 3]) / 80.0 > 0.5 * np.ptp(x[-1000:])
