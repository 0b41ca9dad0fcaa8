"""What follows from nothing measured is noise; what the motion foretells, or its size, is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import PLAIN, built_dataset

from identify.estimation.fit import Outcome, finished
from identify.output.words.estimation import prepared_in_words
from identify.selection.unpredictable import (
    is_unpredictable,
    keeps_its_amplitude,
    noise_known,
    with_own_noise,
)

SIZE = 0.05  # N RMS, far above what sensors make here


def slow_noise(rng, n: int):
    """First-order noise (n,) of unit RMS, correlated over some ten test functions."""
    out, keep = np.zeros(n), np.exp(-0.1)
    for k, drawn in enumerate(rng.standard_normal(n)):
        out[k] = keep * out[k - 1] + np.sqrt(1.0 - keep**2) * drawn
    return out


def left(force, held=("held",)):
    """A dataset on which the plain axis leaves force(log, rng) (n,) N."""
    rng = np.random.default_rng(8)

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


def fit_to(data):
    return finished(PLAIN, PLAIN, data.fit, Outcome.CONVERGED)


@pytest.mark.parametrize("held", [("held",), ()], ids=["held out", "left out"])
@pytest.mark.parametrize(
    ("force", "is_noise"), [(noise, True), (of_place, False), (of_speed, False), (chirp, False)]
)
def test_only_what_nothing_foretells_is_noise(force, is_noise, held):
    data = left(force, held)
    fit = fit_to(data)
    assert fit.ratio > 2.0
    assert is_unpredictable(fit, data) is is_noise
    known, again = with_own_noise(fit, data)
    assert (known is data) is not is_noise
    assert again.at_floor is is_noise


def test_noise_is_part_of_the_floor_and_said():
    data = left(noise)
    fit = fit_to(data)
    known = noise_known(PLAIN, data)
    assert known.force_noise == pytest.approx(np.sqrt(fit.error**2 - fit.floor**2))
    assert fit_to(known).ratio == pytest.approx(1.0)
    assert "nothing measured foretells" in prepared_in_words(known)[0]
    assert fit_to(known.with_force_noise(0.0)).floor == pytest.approx(fit.floor)
    assert all(log.force_noise == known.force_noise for log in known.logs)


def test_what_is_larger_on_the_held_out_logs_is_no_noise():
    data = left(noise)
    more = tuple(replace(log, command=2.0 * log.command) for log in data.holdout)
    assert not is_unpredictable(fit_to(data), replace(data, holdout=more))


def test_one_log_alone_does_not_show_that_what_is_left_is_noise():
    data = left(noise)
    alone = replace(data, fit=data.fit[:1], holdout=())
    assert not is_unpredictable(fit_to(alone), alone)


def test_a_tone_keeps_its_amplitude_and_noise_does_not():
    """Kurtosis 1.5 and 3; the limit of n independent samples is 3 - 3 sqrt(24 / n)."""
    rng = np.random.default_rng(4)
    time = np.linspace(0.0, 1.0, 4000)
    swinging = np.sin(2.0 * np.pi * (5.0 + 60.0 * time) * time)
    assert keeps_its_amplitude(swinging)
    assert keeps_its_amplitude(swinging + 0.3 * rng.standard_normal(4000))
    assert not any(keeps_its_amplitude(rng.standard_normal(400)) for _ in range(100))
    assert not any(keeps_its_amplitude(slow_noise(rng, 2000)) for _ in range(20))
    assert not keeps_its_amplitude(swinging[:300])  # too few to tell
