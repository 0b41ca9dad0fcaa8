"""What a residual depends on, what repeats in it, when it is noise; clocks that a fit moves."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import PLAIN, built_dataset
from constructed import dataset_of, effect, fit_of, log_of, moved, ridden, waves, windowed
from machines import CATALOGUE, PROTON, one_axis, tracked

from identify.dataset.coordinates import coordinates_of
from identify.dataset.motion import motion_of
from identify.estimation.alignment import (
    depends_on_time_origin,
    fit_aligned,
    misalignment,
    moved_by,
    phases_found,
    realigned,
    synchronised,
    time_origins,
    with_time_origins,
    without_timed_forces,
)
from identify.estimation.evidence import rms
from identify.estimation.fit import Outcome, finished, fit_axis
from identify.estimation.force_balance import residual
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
from identify.output.words.fit import (
    channel_delay_in_words,
    prepared_in_words,
    repeat_in_words,
)
from identify.rules import RULE
from twin.logs import Log
from twin.model.machine import AxisModel, Fitted

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
    assert "its size differs between the logs: it" in repeat_in_words(repeat(0.05, 0.3))


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
    return replace(
        data, training=tuple(map(moved, data.training)), selection=tuple(map(moved, data.selection))
    )


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
    return finished(PLAIN, PLAIN, data.training, Outcome.CONVERGED)


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


@pytest.mark.parametrize(("force", "is_noise"), [(noise, True), (of_place, False)])
def test_what_one_log_is_louder_by_makes_no_noise_of_the_others(force, is_noise):
    def touched(log, rng):
        return force(log, rng) + 3.0 * noise(log, rng) * (log.motion.name == "one")

    data = left(touched)
    assert noise_is_left(fit_to(data), data) is is_noise


def test_noise_is_part_of_the_floor_and_said():
    data = left(noise)
    fit = fit_to(data)
    known = noise_known(PLAIN, data)
    assert known.force_noise == pytest.approx(np.sqrt(fit.error**2 - fit.floor**2))
    assert fit_to(known).ratio == pytest.approx(1.0)
    assert "Its origin is not known" in prepared_in_words(known)[0]
    looked = replace(known.with_force_noise(0.0), looks=2, asked=0.013)
    (said,) = prepared_in_words(looked)
    assert said.startswith("the force is averaged over 40.0 ms: a length asked besides")
    assert fit_to(known.with_force_noise(0.0)).floor == pytest.approx(fit.floor)
    assert all(log.force_noise == known.force_noise for log in known.logs)


def test_one_log_or_one_that_is_larger_where_held_out_does_not_show_noise():
    data = left(noise)
    alone = replace(data, training=data.training[:1], selection=())
    assert not noise_is_left(fit_to(alone), alone)
    more = tuple(replace(log, command=2.0 * log.command) for log in data.selection)
    assert not noise_is_left(fit_to(data), replace(data, selection=more))


# Laws of clocks: a force channel is moved by as much as it is off, time origins by a line


RATE, MASS = 1000.0, 1.7
PLACE = waves((0.03, 1.3, 0.4), (0.006, 5.1, 1.0), (0.0007, 19.0, 2.0))


def aligned(samples: float, seed: int = 5, noise: float = 1e-3, duration: float = 5.0):
    """A log whose force channel was stamped so many samples late."""
    t = np.arange(round(duration * RATE)) / RATE
    s = t + (0.5 - samples) / RATE
    push = MASS * (PLACE(s + 1e-4) - 2.0 * PLACE(s) + PLACE(s - 1e-4)) / 1e-8
    force = push + np.random.default_rng(seed).normal(0.0, noise, len(t))
    return windowed(motion_of(log_of(RATE, PLACE(t), force), "x", f"log {seed}", ripples=()), 0.02)


def test_a_fit_moves_the_force_by_as_much_as_it_is_off():
    dataset = dataset_of(aligned(1.4), holdout=(aligned(1.4, 6),))
    axis = AxisModel(1.5)
    found, fit = fit_aligned(axis, dataset)
    assert found.channel_delay == pytest.approx(1.4e-3, rel=0.02)
    assert fit.axis.mass == pytest.approx(MASS, rel=3e-3)
    assert fit.begun.mass == 1.5
    np.testing.assert_array_equal(fit.logs[0].command, found.training[0].command)
    wanted = realigned(dataset, found.channel_delay)
    np.testing.assert_allclose(found.training[0].command, wanted.training[0].command, atol=0.05)
    np.testing.assert_allclose(found.selection[0].command, wanted.selection[0].command, atol=0.05)
    still, fit = fit_aligned(axis, dataset_of(aligned(0.0)))
    assert still.channel_delay == 0.0
    assert fit.axis.mass == pytest.approx(MASS, rel=3e-3)


def test_a_larger_model_moves_the_force_on_or_back():
    axis = AxisModel(MASS)
    late = dataset_of(aligned(1.4))
    assert moved_by(fit_of(axis, *late.training), late).channel_delay == pytest.approx(
        1.4e-3, rel=0.05
    )
    part = realigned(late, 0.6e-3)
    assert moved_by(fit_of(axis, *part.training), part).channel_delay == pytest.approx(
        1.4e-3, rel=0.05
    )
    right = dataset_of(aligned(0.0))
    assert moved_by(fit_of(axis, *right.training), right) is None
    wrong = realigned(right, 0.9e-3)
    assert moved_by(fit_of(axis, *wrong.training), wrong).channel_delay == 0.0
    # back only where that takes a tenth of the square away
    base = fit_axis(axis, right.training)
    for part_, told in ((1.05, True), (0.95, False)):
        error = part_ * base.error / np.sqrt(1.0 - RULE.least_fall)
        scaled = replace(base, residual=base.residual * error / base.error)
        found = moved_by(scaled, replace(right, channel_delay=1e-9))
        assert (found is not None) == told


def test_a_force_that_acts_late_or_hardly_early_is_no_fault_of_the_log():
    axis = AxisModel(1.7)
    for samples, told in (
        (0.0, 0),
        (-1.0, 0),
        (0.042, 0),
        (0.058, 1),
        (2.7, 1),
        (3.6, 1),
        (6.0, 1),
        (11.0, 0),
    ):
        log = aligned(samples, noise=1e-4)
        found = misalignment(fit_of(axis, log), dataset_of(log))
        assert (found > 0.0) == bool(told), samples
    log = aligned(0.058, noise=3.0)  # lost in the noise
    assert misalignment(fit_of(axis, log), dataset_of(log)) == 0.0


@pytest.mark.parametrize(("part", "told"), [(0.2, True), (0.8, False)])
def test_a_delay_that_no_recorder_makes_of_a_sample_is_most_of_what_is_wrong(part, told):
    """Another effect of as much force may lag by a little of that; 3 samples are the recorder's."""
    log, axis = aligned(5.0, noise=1e-4), AxisModel(MASS)
    left = fit_of(axis, log)
    rest = np.random.default_rng(3).standard_normal(len(left.residual))
    other = part / (1.0 - part) * rms(left.residual) * rest
    both = replace(left, residual=left.residual + other)
    assert (misalignment(both, dataset_of(log)) > 0.0) == told


def test_a_recorder_that_reads_the_force_cycles_late_leaves_nothing_else_to_find():
    """A sound drive left 47 times its floor, and nothing was said of it."""
    late = dataset_of(aligned(4.0), holdout=(aligned(4.0, 6),))
    found, fit = fit_aligned(AxisModel(1.5), late)
    assert found.channel_delay == pytest.approx(4e-3, rel=0.01)
    assert fit.axis.mass == pytest.approx(MASS, rel=3e-3)
    assert fit.error < 0.03 * fit_axis(AxisModel(1.5), late.training).error


def test_a_shift_is_said_in_samples():
    log = aligned(0.0)
    assert channel_delay_in_words(dataset_of(log)) is None
    said = channel_delay_in_words(dataset_of(log, channel_delay=1.5e-3))
    assert said.startswith("the force acts 1.50 ms (1.50 samples) before")
    half = channel_delay_in_words(dataset_of(log, channel_delay=0.53 * log.motion.sample_period))
    assert "(0.53 samples)" in half
    assert "read at the same instant" in half


PUMP = effect("periodic_disturbance", {"f": 23.7, "a": 0.05, "b": 0.02})
STAGE = AxisModel(1.3, effects=(effect("coulomb_viscous", {"Fc": 0.7, "Fs": 0.7, "sigma2": 0.9}),))
REST = effect("cable_slab", {"offset": 0.2, "k1": -3.0, "k3": 40.0})


def started(late: float, seed: int = 0, f: float = 23.7):
    """A log that began so long after the pump; the pump pushes, so the command has to hold."""
    turn = lambda t: 2.0 * np.pi * f * (t + late)  # noqa: E731
    rng = np.random.default_rng(seed)
    motion = ridden(
        lambda m: -0.05 * np.sin(turn(m.time)) - 0.02 * np.cos(turn(m.time))
        + rng.normal(0.0, 0.01, len(m.time))
    )  # fmt: skip
    return windowed(replace(motion, name=f"{late}"), 0.02)


def turns(found, f=23.7):
    return np.mod(time_origins(found) * f + 0.5, 1.0) - 0.5


LATE = np.array([0.0, 0.0131, 0.0347])


@pytest.fixture(scope="module")
def dataset():
    logs = [started(late, seed) for seed, late in enumerate(LATE)]
    return dataset_of(*logs[:2], holdout=(logs[2],))


def test_a_log_begun_later_has_its_clock_later_modulo_the_period(dataset):
    axis = STAGE.with_effect(REST)
    wanted = np.mod(LATE * 23.7 + 0.5, 1.0) - 0.5
    np.testing.assert_allclose(turns(with_time_origins(axis, dataset)), wanted, atol=0.01)
    # by the model's own pump: the clock of the first is zero too, for it began with the pump
    np.testing.assert_allclose(
        turns(with_time_origins(axis.with_effect(PUMP), dataset)), wanted, atol=0.01
    )
    early = {**PUMP.values, "a": -0.02, "b": 0.05}  # a quarter of a turn ahead
    ahead = axis.with_effect(effect("periodic_disturbance", early))
    shifted = np.mod(wanted - 0.25 + 0.5, 1.0) - 0.5
    np.testing.assert_allclose(turns(with_time_origins(ahead, dataset)), shifted, atol=0.01)
    late = (
        time_origins(with_time_origins(ahead, dataset_of(*dataset.training, started(0.0211, 3))))
        * 23.7
    )
    assert (np.abs(late) <= 0.5).all()  # the nearest of all turns alike
    assert not time_origins(with_time_origins(axis, dataset_of(dataset.training[0]))).any()
    near = dataset_of(started(0.0), started(0.015 / 23.7, 1))
    assert not time_origins(with_time_origins(axis, near)).any()  # within two hundredths of a turn


def test_the_effects_that_read_the_clock_are_told(dataset):
    axis = STAGE.with_effect(PUMP)
    assert without_timed_forces(axis, dataset.training[0]).names == STAGE.names
    assert without_timed_forces(STAGE, dataset.training[0]) == STAGE
    assert depends_on_time_origin(axis, dataset)
    assert not depends_on_time_origin(STAGE, dataset)
    assert phases_found(axis, "periodic_disturbance", dataset) == 0
    known = with_time_origins(axis, dataset)
    set_ = sum(log.motion.time_origin != 0.0 for log in known.training)
    assert phases_found(axis, "periodic_disturbance", known) == set_ == 1
    assert phases_found(axis, "coulomb_viscous", known) == 0


LOGS = [windowed(moved(np.random.default_rng(s), 6.0, 1000.0), 0.02) for s in range(4)]
N, F = len(LOGS[0]), 23.7  # F: Hz


def pushed(heights, size=1.0):
    """Logs that leave white residuals with a line of those heights, each with its own phase."""
    return [
        replace(w, command=w.command - residual(AxisModel(1.7), [w]) + size * (
            np.random.default_rng(90 + k).normal(size=N) + a * np.cos(2 * np.pi * F * w.time + k)
        ))
        for k, (w, a) in enumerate(zip(LOGS, heights, strict=True))
    ]  # fmt: skip


@pytest.mark.parametrize("size", [1e-6, 1e4])
def test_a_fit_is_synchronised_unless_it_reads_the_clock(size):
    logs = pushed([0.8, 0.5, 0.7, 0.6], size)
    dataset = dataset_of(*logs)
    found, fit = synchronised(fit_of(AxisModel(1.7), *logs), dataset)
    np.testing.assert_allclose(turns(found), np.arange(4) / (2.0 * np.pi), atol=0.05)
    assert fit.logs is found.training
    pump = AxisModel(1.7, effects=(effect("periodic_disturbance", {"f": F, "a": 0.01}),))
    own = fit_of(pump, *logs)
    assert synchronised(own, dataset) == (dataset, own)


def test_a_line_of_less_evidence_than_its_phases_cost_is_chance():
    """Samples x gain must exceed two numbers a log: in all logs it does, in one it does not."""
    height = 11.5 / np.sqrt(N)
    needed = 2 * 4 * np.log(4 * N) + RULE.least_bic
    assert 0.5 * height**2 * N < needed < 4.0 * 0.5 * height**2 * N
    alone = dataset_of(*pushed([height, 0.0, 0.0, 0.0]))
    assert not time_origins(with_time_origins(AxisModel(1.7), alone)).any()
    every = dataset_of(*pushed([height] * 4))
    assert time_origins(with_time_origins(AxisModel(1.7), every)).any()


SLIDE = one_axis(PROTON)
BESIDE = Fitted.at_start(CATALOGUE["periodic_disturbance"], {"f": 23.7, "a": 0.02, "b": 0.01})
BEGUN = (0.0, 0.313, 0.871)  # s


@pytest.fixture(scope="module")
def logs() -> list[Log]:
    """Logs of a stage beside a pump that had run for a while when each began."""
    out = []
    for i, late in enumerate(BEGUN):
        phase = 2.0 * np.pi * BESIDE.values["f"] * late
        turned = (BESIDE.values["a"] + 1j * BESIDE.values["b"]) * np.exp(1j * phase)
        values = {**BESIDE.values, "a": turned.real, "b": turned.imag}
        axis = SLIDE.axes["x"].with_effect(Fitted.at_start(BESIDE.effect, values))
        machine = replace(SLIDE, axes={"x": axis})
        out.append(tracked(machine, i, 8.0))
    return out
