"""What follows from nothing measured is noise; what the motion foretells, or its size, is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import PLAIN, built_dataset

from identify.estimation.fit import Outcome, finished
from identify.estimation.residual_noise import (
    is_noise as noise_is_left,
)
from identify.estimation.residual_noise import (
    noise_known,
    with_own_noise,
)
from identify.output.words.fit import prepared_in_words

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


def fit_to(data):
    return finished(PLAIN, PLAIN, data.fit, Outcome.CONVERGED)


@pytest.mark.parametrize("held", [("held",), ()], ids=["held out", "left out"])
@pytest.mark.parametrize(
    ("force", "is_noise"),
    [(noise, True), (of_place, False), (of_speed, False), (chirp, False), (bursts, False)],
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
