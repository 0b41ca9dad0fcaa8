"""Laws of what a residual depends on, and of its whiteness; each against a plain loop."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from constructed import SHORT, dataset_of, log_of, moved, windowed
from scipy.stats import norm

from identify.dataset.coordinates import coordinates_of
from identify.dataset.motion import _follows, motion_of
from identify.estimation.decision import RULE
from identify.estimation.evidence import effective_samples
from identify.estimation.residual_dependence import (
    BINS,
    _foremost,
    _share,
    _shares,
    dependences,
    find_dependence,
    line,
    share,
)
from identify.output.words.fit import correlation_in_words
from identify.validation.whiteness import Correlation, Loop, correlation, loop_of, residual_tests

LOG = windowed(SHORT)
RNG = np.random.default_rng(51)


# --- dependence ---------------------------------------------------------------------------------


def test_a_share_is_what_the_means_over_quantile_bins_explain():
    x, r = RNG.normal(size=1000), RNG.normal(size=1000)
    r += np.sin(3.0 * x)
    levels = np.quantile(x, np.linspace(0.0, 1.0, 25))
    left, groups = r.copy(), 0
    for a, b in pairwise(levels):
        inside = (x >= a) & ((x < b) | (b == levels[-1]))
        left[inside] -= r[inside].mean()
        groups += 1
    n = effective_samples(left)
    wanted = 1.0 - np.sum(left**2) / np.sum(r**2) * n / (n - groups)
    assert _share(r, x, 24) == pytest.approx(wanted)
    assert _share(r, np.full(1000, 2.0), 24) == 0.0
    assert _share(r, np.where(x > 0.0, 1.0, 2.0), 24) < 0.2


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


def test_the_foremost_is_the_largest_and_time_only_where_no_other_comes_near():
    assert _foremost({"position": 0.5, "velocity": 0.6, "time": 0.3}) == "velocity"
    near, far = 1.01 * RULE.rather, 0.99 * RULE.rather
    assert _foremost({"position": near * 0.9, "velocity": 0.1, "time": 0.9}) == "position"
    assert _foremost({"position": far * 0.9, "velocity": 0.1, "time": 0.9}) == "time"


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


def test_a_line_in_several_runs_keeps_its_period_but_not_its_phase():
    t = np.tile(np.arange(1000) * 0.01, 2)
    r = np.sin(2.0 * np.pi * 3.3 * t + np.repeat([0.0, np.pi], 1000))
    found, strength = line(r, t, [1000])
    assert found == pytest.approx(1.0 / 3.3, rel=0.01)
    assert strength > 0.8
    together = line(r, t)  # the two cancel where they are taken for one
    assert together is None or abs(together[0] * 3.3 - 1.0) > 0.01


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


def test_logs_are_told_apart_even_where_one_begins_later_than_the_other_ends():
    """The second is at rest until the first has ended, so that time does not fall between them."""
    kept = np.concatenate([WHERE["time"][: len(LONG[0])] < 2.7, LONG[1].time > 3.0])
    time = WHERE["time"][kept]
    assert (np.diff(time) > 0.0).all()
    second = np.arange(len(KEPT))[kept] >= len(LONG[0])
    noise = np.random.default_rng(4).normal(0.0, 0.1, len(time))
    pump = np.sin(2.0 * np.pi * time / 0.113 + 2.5 * second) + noise
    fit = SimpleNamespace(residual=pump, kept=kept)
    assert find_dependence(fit, DATASET).shares["time"] > 0.9
    still = SimpleNamespace(
        residual=pump[second], kept=kept & (np.arange(len(kept)) >= len(LONG[0]))
    )
    assert find_dependence(still, DATASET).shares["time"] > 0.9


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


@pytest.mark.parametrize("loop", list(Loop))
def test_bounds_are_those_of_a_white_residual_over_the_lags_tested(loop):
    r = RNG.normal(size=400)
    r[:23] = np.nan
    for name, count in (("residual", 40), ("velocity", 81 if loop is Loop.OPEN else 40)):
        found = correlation(name, [r], [r], 0.5, loop)
        assert found.tested.sum() == count
        assert found.bound == pytest.approx(norm.ppf(0.95) / np.sqrt(377))
        # both tails of all tested lags together have one in a hundred
        tail = 2.0 * norm.sf(found.limit * np.sqrt(377))
        assert tail * count == pytest.approx(0.01)
        own_instant = found.lag[found.tested] <= 0.0
        assert own_instant.any() == (name != "residual" and loop is Loop.OPEN)


def test_what_is_outside_and_passes_counts_the_tested_lags_alone():
    value = np.array([0.5, 0.09, -0.11, 0.21, -0.05])
    tested = np.array([False, True, True, True, True])
    found = Correlation("command", np.arange(-1.0, 4.0), value, tested, 0.1, 0.22)
    assert found.outside == 0.5
    assert found.passes
    assert not Correlation("command", found.lag, value, tested, 0.1, 0.205).passes
    assert not Correlation("command", found.lag, -value, tested, 0.1, 0.205).passes
    assert (
        "against command: 50 % of the lags beyond the 90 % bounds of ±0.1, none beyond the ±0.22"
        in correlation_in_words(found)
    )
    own = Correlation("residual", found.lag, value, tested, 0.1, 1)
    assert "its own past" in correlation_in_words(own)


def test_residual_tests_take_windows_that_do_not_overlap():
    logs = LONG
    force = np.random.default_rng(6).normal(0.0, 0.2, len(KEPT))
    kept = KEPT.copy()
    kept[10:60] = False
    found = residual_tests(logs, force, kept, 0.2, Loop.OPEN)
    apart, begin = [], 0
    w = logs[0].test_function
    step = next(k for k in range(1, 99) if k * w.stride >= len(w.weights))
    for log in logs:
        own = np.arange(begin, begin + len(log))[::step]
        apart.append(np.where(kept[own], force[own], np.nan))
        begin += len(log)
    left = np.concatenate(apart)
    left = left[np.isfinite(left)]
    assert found.samples == len(left)
    assert found.within == pytest.approx(np.mean(np.abs(left) < norm.ppf(0.95) * 0.2))
    spacing = step * w.stride * w.period
    own = correlation("residual", apart, apart, spacing, Loop.OPEN)
    np.testing.assert_allclose(found.correlations[0].value, own.value)
    np.testing.assert_allclose(found.correlations[0].lag, own.lag)
    commands = [log.command[::step] for log in logs]
    speeds = [log.test_function.mean(log.motion.velocity)[::step] for log in logs]
    for k, signal in ((1, commands), (2, speeds)):
        wanted = correlation("", apart, signal, spacing, Loop.OPEN)
        np.testing.assert_allclose(found.correlations[k].value, wanted.value)
    assert [c.signal for c in found.correlations] == ["residual", "command", "velocity"]
    width = np.diff(found.edges)
    assert np.sum(found.density * width) == pytest.approx(1.0)
    assert found.edges[-1] == -found.edges[0] == pytest.approx(1.0)  # five floors
    wide = residual_tests(logs, 4.0 * force, kept, 0.2, Loop.OPEN)
    assert wide.edges[-1] == pytest.approx(np.quantile(4.0 * np.abs(left), 0.995))
    assert (found.floor, found.loop) == (0.2, Loop.OPEN)
    assert found.passes == all(c.passes for c in found.correlations)


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
