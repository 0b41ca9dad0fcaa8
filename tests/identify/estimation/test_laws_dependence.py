"""Laws of what a residual depends on, and of its whiteness; each against a plain loop."""

from types import SimpleNamespace

import numpy as np
import pytest
from constructed import dataset_of, log_of, moved, windowed

from identify.dataset.coordinates import coordinates_of
from identify.dataset.motion import _follows, motion_of
from identify.estimation.residual_dependence import (
    BINS,
    _shares,
    dependences,
    find_dependence,
    line,
    share,
)
from identify.rules import RULE
from identify.validation.whiteness import Loop, correlation, loop_of

RNG = np.random.default_rng(51)


# --- dependence ---------------------------------------------------------------------------------


def test_the_share_of_noise_is_none_and_of_a_function_all():
    x, noise = RNG.uniform(size=6000), RNG.normal(size=6000)
    assert share(noise, x) < 0.05
    assert share(np.floor(24.0 * x) % 2.0 - 0.5, x) > 0.93
    half = np.sin(6.28 * x) + np.sqrt(0.5) * noise
    assert share(half, x) == pytest.approx(0.5, abs=0.05)
    fine = np.sign(np.sin(2.0 * np.pi * 90.0 * x))
    assert share(fine, x) > 0.4  # the finest bins see it
    few = slice(0, 5 * BINS[1])
    assert share(fine[few], x[few]) < 0.3  # too few for them


@pytest.mark.parametrize("period", [0.0043, 0.021])
def test_a_line_of_the_residual_has_its_period_and_share(period):
    x = RNG.uniform(-0.05, 0.1, 3000)
    r = 0.5 * np.sin(2.0 * np.pi * x / period + 0.7) + RNG.normal(0.0, 0.2, 3000)
    found, strength = line(r, x)
    resolved = 1.1 * period / (4.0 * np.ptp(x))  # quarters of a cycle over the span
    assert found == pytest.approx(period, rel=resolved)
    assert strength == pytest.approx(0.125 / (0.125 + 0.04), abs=0.08)
    moved_, again = line(7.0 * r, 3.0 * x + 1.0)
    assert (moved_, again) == pytest.approx((3.0 * found, strength), rel=1e-6)
    assert line(RNG.normal(size=3000), x) is None
    assert line(r, 0.0 * x) is None
    assert RULE.line_share < 0.5


def where_of(log) -> dict:
    return coordinates_of(log)


LONG = [windowed(moved(np.random.default_rng(s), 6.0, 1000.0), 0.02) for s in (1, 2)]
DATASET = dataset_of(*LONG)
WHERE = {k: np.concatenate([where_of(w)[k] for w in LONG]) for k in where_of(LONG[0])}
KEPT = np.ones(len(WHERE["time"]), bool)


def fit_leaving(force):
    return SimpleNamespace(residual=force, kept=KEPT, error=float(np.sqrt(np.mean(force**2))))


@pytest.mark.parametrize("name", ["position", "velocity", "acceleration", "other_axis_velocity"])
def test_what_a_residual_depends_on_is_found(name):
    noise = np.random.default_rng(3).normal(0.0, 0.1, len(KEPT))
    x = (WHERE[name] - WHERE[name].mean()) / np.std(WHERE[name])
    forwards = np.tanh(2.0 * x) + 0.4 * x**2
    force = forwards + noise
    found = find_dependence(fit_leaving(force), DATASET)
    assert found.depends_on == name
    assert found.share_of_error > 0.85
    assert found.unit == {"position": "m", "acceleration": "m/s^2"}.get(name, "m/s")
    assert found.shares == dependences(force, fit_leaving(force), DATASET)
    turned = forwards * WHERE["direction"] + noise  # a friction that depends on it
    if name != "velocity":
        assert find_dependence(fit_leaving(turned), DATASET).shares[name] > 0.8


def test_a_residual_that_repeats_has_a_period_in_position_or_time():
    noise = np.random.default_rng(4).normal(0.0, 0.1, len(KEPT))
    place = np.sin(2.0 * np.pi * WHERE["position"] / 0.0083)
    found = find_dependence(fit_leaving(place + noise), DATASET)
    assert (found.depends_on, found.unit) == ("position", "m")
    assert found.period == pytest.approx(0.0083, rel=0.02)
    pump = np.sin(2.0 * np.pi * WHERE["time"] / 0.113 + (np.arange(len(KEPT)) < len(LONG[0])))
    found = find_dependence(fit_leaving(pump + noise), DATASET)
    assert (found.depends_on, found.unit) == ("time", "s")
    assert found.period == pytest.approx(0.113, rel=0.01)
    shares, periods = _shares(pump + noise, WHERE, np.array([len(LONG[0])]))
    assert list(periods) == ["time"]
    assert shares["time"] > 0.9


# --- whiteness ----------------------------------------------------------------------------------


def test_correlations_are_the_plain_sums_at_their_lags():
    logs = [RNG.normal(0.3, 1.0, n) for n in (200, 170)]
    signals = [RNG.normal(-2.0, 3.0, n) for n in (200, 170)]
    for name, other in (("command", signals), ("residual", logs)):
        found = correlation(name, logs, other, 0.02, Loop.OPEN)
        a, b = (np.concatenate(rows).mean() for rows in (logs, other))
        a, b = [r - a for r in logs], [r - b for r in other]
        size = np.sqrt(sum(np.sum(r**2) for r in a) * sum(np.sum(r**2) for r in b))
        lags = np.rint(found.lag / 0.02).astype(int)
        assert lags.tolist() == list(range(1 if name == "residual" else -40, 41))
        for lag, value in zip(lags, found.value, strict=True):
            total = sum(
                x[k] * y[k - lag]
                for x, y in zip(a, b, strict=True)
                for k in range(len(x))
                if 0 <= k - lag < len(x)
            )
            assert value == pytest.approx(total / size)
        assert found.tested.all()
    short = correlation(
        "command", [*logs, logs[0][:40]], [*signals, signals[0][:40]], 1.0, Loop.OPEN
    )
    assert np.abs(short.lag).max() == 10


def test_a_loop_is_closed_where_the_position_follows_its_setpoint():
    t = np.arange(4000) / 1000.0
    a, b = np.sin(6.0 * t), RNG.normal(size=len(t))
    b -= a * (a @ b) / (a @ a)
    b *= np.std(a) / np.std(b)

    def log(setpoint=None):
        more = {} if setpoint is None else {"setpoint_position": setpoint}
        return windowed(motion_of(log_of(1000.0, a, t, **more), "x", "l"))

    for angle, wanted in ((0.24, Loop.CLOSED), (0.26, Loop.OPEN), (1.0, Loop.CLOSED)):
        mixed = np.cos(np.pi * angle) * a + np.sin(np.pi * angle) * b
        assert loop_of([log(mixed)]) is wanted
    assert loop_of([log(0.0 * a)]) is Loop.OPEN
    assert loop_of([log()]) is Loop.UNKNOWN
    assert loop_of([log(a), log()]) is Loop.UNKNOWN
    assert loop_of([log(0.0 * a), log(a)]) is Loop.CLOSED
    assert _follows(log_of(1000.0, 0.0 * a, t, setpoint_position=a).axes["x"]) is False
