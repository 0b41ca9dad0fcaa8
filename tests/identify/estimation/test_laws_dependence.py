"""What a residual depends on, what repeats in it, and when it is noise."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import PLAIN, built_dataset
from constructed import dataset_of, effect, fit_of, moved, ridden, windowed

from identify.dataset.coordinates import coordinates_of
from identify.estimation.fit import Outcome, finished
from identify.estimation.residual_dependence import (
    BINS,
    Repeat,
    dependences,
    find_dependence,
    not_general,
    share,
)
from identify.estimation.residual_noise import is_noise as noise_is_left
from identify.estimation.residual_noise import noise_known, with_own_noise
from identify.output.words.fit import prepared_in_words, repeat_in_words
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


SIZE = 0.05  # N RMS, far above what sensors make here


def slow_noise(rng, n: int):
    """First-order noise (n,) of unit RMS, correlated over some three test functions."""
    out, keep = np.zeros(n), np.exp(-0.3)
    for k, drawn in enumerate(rng.standard_normal(n)):
        out[k] = keep * out[k - 1] + np.sqrt(1.0 - keep**2) * drawn
    return out


def left(force, held=("held",), seed=8):
    """A dataset on which the plain axis leaves force(log, rng) (n,) N."""
    rng = np.random.default_rng(seed)

    def moved(log):
        own = finished(PLAIN, PLAIN, (log,), Outcome.CONVERGED)
        rest = np.zeros(len(log))
        rest[own.kept] = own.residual
        return replace(log, command=log.command - rest + force(log, rng))

    data = built_dataset("one", "two", held=held)
    return replace(data, fit=tuple(map(moved, data.fit)), holdout=tuple(map(moved, data.holdout)))


def noise(log, rng):
    return SIZE * slow_noise(rng, len(log))


def of_place(log, rng):
    return noise(log, rng) + SIZE * np.sign(log.test_function.mean(log.motion.position))


def of_speed(log, rng):
    return noise(log, rng) * (1.0 + 4.0 * (log.test_function.mean(log.motion.velocity) > 0.0))


def chirp(log, rng):
    """A tone that moves from 5 to 25 Hz, of constant amplitude."""
    time = log.time
    return np.sqrt(2.0) * SIZE * np.sin(2.0 * np.pi * (5.0 + 10.0 * time / time[-1]) * time)


def bursts(log, rng):
    """A force that acts now and then, for some test functions."""
    return 6.0 * SIZE * rng.standard_normal(len(log)) * (np.arange(len(log)) % 97 < 4)


def drift(log, rng):
    """A force that falls in each log alike, such as with its warming."""
    return noise(log, rng) + 3.0 * SIZE * (1.0 - 2.0 * log.time / log.time[-1])


def fit_to(data):
    return finished(PLAIN, PLAIN, data.fit, Outcome.CONVERGED)


@pytest.mark.parametrize("held", [("held",), ()], ids=["held out", "left out"])
@pytest.mark.parametrize(
    ("force", "is_noise"),
    [
        (noise, True),
        (of_place, False),
        (of_speed, False),
        (chirp, False),
        (bursts, False),
        (drift, False),
    ],
)
def test_only_what_nothing_foretells_is_noise(force, is_noise, held):
    data = left(force, held)
    fit = fit_to(data)
    assert fit.ratio > 2.0
    assert noise_is_left(fit, data) is is_noise
    known, again = with_own_noise(fit, data)
    assert (known is data) is not is_noise
    assert again.at_floor is is_noise


def test_noise_is_part_of_the_floor_and_said():
    data = left(noise)
    fit = fit_to(data)
    known = noise_known(PLAIN, data)
    assert known.force_noise == pytest.approx(np.sqrt(fit.error**2 - fit.floor**2))
    assert fit_to(known).ratio == pytest.approx(1.0)
    assert "force noise that no sensor explains" in prepared_in_words(known)[0]
    assert fit_to(known.with_force_noise(0.0)).floor == pytest.approx(fit.floor)
    assert all(log.force_noise == known.force_noise for log in known.logs)


def test_one_log_or_one_that_is_larger_where_held_out_does_not_show_noise():
    data = left(noise)
    alone = replace(data, fit=data.fit[:1], holdout=())
    assert not noise_is_left(fit_to(alone), alone)
    more = tuple(replace(log, command=2.0 * log.command) for log in data.holdout)
    assert not noise_is_left(fit_to(data), replace(data, holdout=more))


def test_no_noise_of_many_is_refused_often():
    """One in 41 by chance of the controls, of each of two questions."""
    told = []
    for seed in range(12):
        data = left(noise, seed=seed)
        told.append(noise_is_left(fit_to(data), data))
    assert sum(told) >= 11
