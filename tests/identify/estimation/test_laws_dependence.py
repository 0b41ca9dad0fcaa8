"""Laws of what a residual depends on, and of a force that repeats along the track."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from constructed import dataset_of, effect, fit_of, moved, ridden, windowed

from identify.dataset.coordinates import coordinates_of
from identify.estimation.residual_dependence import (
    BINS,
    Repeat,
    dependences,
    find_dependence,
    line,
    not_general,
    share,
)
from identify.output.words.residual import repeat_in_words
from twin.model.machine import AxisModel

RNG = np.random.default_rng(51)


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


def test_a_line_of_the_residual_has_its_period_and_share():
    period = 0.0043
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


LONG = [windowed(moved(np.random.default_rng(s), 6.0, 1000.0), 0.02) for s in (1, 2)]
DATASET = dataset_of(*LONG)
WHERE = {k: np.concatenate([coordinates_of(w)[k] for w in LONG]) for k in coordinates_of(LONG[0])}
KEPT = np.ones(len(WHERE["time"]), bool)


def fit_leaving(force):
    return SimpleNamespace(residual=force, kept=KEPT, error=float(np.sqrt(np.mean(force**2))))


@pytest.mark.parametrize("name", ["position", "velocity", "other_axis_velocity"])
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
    assert found.share_of_error > 0.9


def test_a_repeat_is_general_where_its_terms_are_alike():
    def repeat(phase, height=1.0):
        return Repeat(2.5e-3, {"a": 1.0, "b": height}, {"a": 0.3, "b": 0.3 + phase})

    turned = 2.0 * np.arcsin(0.25)  # of a unit vector, which moves its end by 1/2
    assert repeat(0.99 * turned).general
    assert not repeat(1.01 * turned).general
    assert repeat(0.0, 0.51).general
    assert not repeat(0.0, 0.49).general
    assert repeat(2.0 * np.pi).general
    words = repeat_in_words(repeat(1.0))
    assert "repeats every 2.50 mm of travel (1.00 N in a, 1.00 N in b)" in words
    assert "by 57 degrees" in words


def test_a_force_with_another_phase_in_each_log_is_told():
    def log(phase, name, pitch=2.3e-3, size=0.3):
        m = ridden(lambda m: size * np.sin(2.0 * np.pi * m.position / pitch + phase))
        return windowed(replace(m, name=name))

    coulomb = effect("coulomb_viscous", {"Fc": 0.7, "Fs": 0.7, "sigma2": 0.9})
    cable = effect("cable_slab", {"offset": 0.2, "k1": -3.0, "k3": 40.0})
    fit = fit_of(AxisModel(1.3, effects=(coulomb, cable)), log(0.3, "a"))
    found = not_general(fit, dataset_of(log(0.3, "a"), holdout=(log(1.8, "b"),)))
    assert found.period == pytest.approx(2.3e-3, rel=5e-3)
    assert found.amplitude == pytest.approx({"a": 0.3, "b": 0.3}, rel=0.1)
    turn = found.phase["b"] - found.phase["a"]
    assert np.mod(turn + np.pi, 2.0 * np.pi) - np.pi == pytest.approx(1.5, abs=0.1)
    same = dataset_of(log(0.3, "a"), log(0.3, "b"))
    assert not_general(fit, same) is None
    assert not_general(fit, dataset_of(log(0.3, "a"))) is None
    other = dataset_of(log(0.3, "a"), log(1.8, "b", 2.6e-3))
    assert not_general(fit, other) is None
    none = dataset_of(log(0.3, "a"), log(1.8, "b", size=0.0))
    assert not_general(fit, none) is None
