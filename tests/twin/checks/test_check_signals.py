"""Laws of the low-pass, the lag and the rough dynamics that the checks of a log rest on.

Polynomials pass a symmetric low-pass in closed form; the noise of a linear map is the norm of one
of its rows; a lag that is put in is the lag that is found.
"""

import numpy as np
import pytest

from twin.checks.explain import Smoother, find_lag, fit_dynamics

KEPT = np.ones(6000)


@pytest.mark.parametrize("rate", [200.0, 1500.0])
def test_lines_and_parabolas_pass_in_closed_form(rate):
    """x = a + b t + c t^2: position a + b t, velocity b + 2 c t, acceleration 2 c, at time()."""
    smoother = Smoother(1.0 / rate)
    t = np.arange(round(0.5 * rate) + 3) / rate
    a, b, c = 0.3, -1.7, 2.9
    line, parabola = a + b * t, a + b * t + c * t**2
    at = smoother.time(np.arange(len(smoother.position(line))))
    for found, wanted in (
        (smoother.position(line), a + b * at),
        (smoother.velocity(parabola), b + 2.0 * c * at),
        (smoother.acceleration(parabola)[1:-1], np.full(len(at) - 2, 2.0 * c)),
        # a held signal acts from its sample on: over a block its mean is half a sample early
        (smoother.held(line), a + b * (at - 0.5 / rate)),
        (smoother.rate(line), a + b * at),
        (smoother.direction(b * t, 0.1), np.full(len(at), np.tanh(b / 0.1))),
    ):
        assert len(found) == len(wanted)
        np.testing.assert_allclose(found, wanted, rtol=1e-6)


@pytest.mark.parametrize("rate", [200.0, 1500.0])
def test_noise_is_the_norm_of_what_unit_impulses_give(rate):
    smoother = Smoother(1.0 / rate)
    unit = np.eye(6 * len(smoother.weights) * smoother.samples + 1)
    for transform, noise in (
        (smoother.velocity, smoother.velocity_noise),
        (smoother.acceleration, smoother.acceleration_noise),
        (smoother.held, smoother.held_noise),
    ):
        response = np.array([transform(row) for row in unit])
        row = response[:, response.shape[1] // 2]
        assert noise(3.0) == pytest.approx(3.0 * np.linalg.norm(row), rel=1e-9)


def signals(lag_blocks: float, noise: float = 0.0):
    """A signal that follows two regressors so many blocks late."""
    k = np.arange(6000.0)

    def motion(at: np.ndarray) -> np.ndarray:
        return np.column_stack([
            np.sin(0.031 * at) + 0.7 * np.sin(0.083 * at + 1.0) + 0.3 * np.sin(0.0071 * at),
            np.cos(0.023 * at + 0.4) * np.sin(0.0057 * at),
        ])  # fmt: skip

    signal = motion(k - lag_blocks) @ np.array([2.0, -3.0]) + 5.0
    return signal + noise * np.random.default_rng(6).standard_normal(len(k)), motion(k)


@pytest.mark.parametrize(
    ("lag", "block"), [(-200.0, 1e-3), (-30.5, 5e-4), (-0.3, 1e-3), (1.0, 1e-3), (150.0, 5e-4)]
)
def test_the_lag_put_in_is_the_lag_found_to_a_tenth_of_a_block(lag, block):
    signal, regressors = signals(lag)
    seconds, clear = find_lag(signal, regressors, KEPT, block)
    assert seconds == pytest.approx(lag * block, abs=0.1 * block)
    assert clear == (abs(lag) >= 1.0)  # a lag of 0.3 leaves less than 3 % of the signal
    # neither scale nor offset of the signals matter
    scaled = find_lag(-3.0 * signal + 100.0, 7.0 * regressors, KEPT, block)
    assert scaled == (pytest.approx(seconds, abs=1e-6 * block), clear)


@pytest.mark.parametrize(
    ("lag", "noise", "block", "clear"),
    [
        (40.0, 0.0, 1e-3, True),
        (40.0, 0.0, 0.02, False),  # 0.25 s are 12 blocks of these
        (250.0, 0.0, 1e-3, False),  # at the end of what is searched
        (40.0, 3.0, 1e-3, False),
    ],
)
def test_a_lag_longer_than_is_searched_or_drowned_in_noise_is_not_clear(lag, noise, block, clear):
    assert find_lag(*signals(lag, noise), KEPT, block)[1] is clear


@pytest.mark.parametrize(
    ("angle", "noise", "clear"),
    [
        # a late sine leaves the sine of its angle: three hundredths of it do not count
        (np.arcsin(0.027), 0.005, False),
        (np.arcsin(0.034), 0.005, True),
        # a quarter of a period is not told from damping
        (1.5, 0.46, False),
        (1.5, 0.54, False),
        # the least that is left is 0.56 or 0.64 of what is left without a lag
        (np.arcsin(np.sqrt(((0.3 / 0.56) ** 2 - 0.09) / 0.91)), 0.3, True),
        (np.arcsin(np.sqrt(((0.3 / 0.64) ** 2 - 0.09) / 0.91)), 0.3, False),
    ],
)
def test_a_lag_is_clear_where_it_explains_much_and_much_more_than_none(angle, noise, clear):
    """A sine that is late by an angle, with white noise that is a part of the whole."""
    k = np.arange(6000.0)
    rms = noise / np.sqrt(1.0 - noise**2) * 0.5**0.5
    signal = np.sin(0.05 * k - angle) + rms * np.random.default_rng(1).standard_normal(6000)
    seconds, told = find_lag(signal, np.sin(0.05 * k)[:, None], KEPT, 1e-3)
    assert told is clear
    if noise < 0.01:
        assert seconds == pytest.approx(angle / 0.05 * 1e-3, abs=2e-5)


@pytest.mark.parametrize(("late", "speed"), [(-1.5, 0.031), (0.4, 0.083), (2.5, 0.031)])
def test_a_sine_is_late_by_the_least_that_explains_it_though_half_a_period_does_too(late, speed):
    """Between two samples neither of them is exact, where half a period later one may be."""
    k = np.arange(4000.0)
    signal = np.sin(speed * (k - late)) + 1e-3 * np.random.default_rng(2).standard_normal(4000)
    seconds, _ = find_lag(signal, np.sin(speed * k)[:, None], np.ones(4000), 1e-3)
    assert seconds == pytest.approx(late * 1e-3, abs=2e-5)


RARE = 0.02  # of a log may be a burst


def motion_and_force(noise: float, mass: float = 3.5):
    k = np.arange(2000.0)
    regressors = np.column_stack([
        4.0 * np.sin(0.05 * k), 0.8 * np.cos(0.05 * k), np.sign(np.cos(0.05 * k)), np.ones(2000)
    ])  # fmt: skip
    clean = regressors @ np.array([mass, 1.2, 2.0, -0.7])
    white = np.random.default_rng(7).standard_normal(2000)
    return regressors, clean + noise * np.std(clean) * white


def test_gains_are_those_put_in_whatever_a_few_samples_say():
    regressors, force = motion_and_force(0.0)
    force[700:720] += 500.0  # one in a hundred, trimmed
    force[100:130] = np.nan_to_num(np.inf)
    kept = np.ones(2000)
    kept[100:130] = 0.0
    fit = fit_dynamics(force, regressors, kept, 11, RARE)
    assert (fit.mass, fit.first) == (pytest.approx(3.5, rel=1e-9), 11)
    np.testing.assert_allclose(fit.residual[700:720], 500.0, rtol=1e-6)
    assert fit_dynamics(-force, regressors, kept, 0, RARE).mass == pytest.approx(-3.5, rel=1e-9)
    assert fit_dynamics(force[:90], 0.0 * regressors[:90], kept[:90], 0, RARE).mass is None


@pytest.mark.parametrize(
    ("noise", "mass", "explains", "matters"),
    [(0.2, 3.5, True, True), (0.6, 3.5, False, True), (0.0, 0.05, True, False),
     (0.0, 0.15, True, False), (0.0, 0.6, True, True)],
)  # fmt: skip
def test_a_model_explains_where_little_is_left_and_mass_matters_from_three_tenths_on(
    noise, mass, explains, matters
):
    regressors, force = motion_and_force(noise, mass)
    fit = fit_dynamics(force, regressors, np.ones(2000), 0, RARE)
    assert fit.explains is explains
    if not noise:
        assert (
            fit.mass_matters == (np.std(mass * regressors[:, 0]) / np.std(force) > 0.3) == matters
        )
