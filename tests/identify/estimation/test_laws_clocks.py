"""Laws of clocks: a time origin follows the beginning of a log, by a line that logs share."""

from dataclasses import replace

import numpy as np
import pytest
from constructed import dataset_of, effect, ridden, windowed

from identify.estimation.time_origin import (
    _amplitude,
    depends_on_time_origin,
    phases_found,
    time_origins,
    with_time_origins,
    without_timed_forces,
)
from twin.model.machine import AxisModel

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
        time_origins(with_time_origins(ahead, dataset_of(*dataset.fit, started(0.0211, 3)))) * 23.7
    )
    assert (np.abs(late) <= 0.5).all()  # the nearest of all turns alike
    near = dataset_of(started(0.0), started(0.015 / 23.7, 1))
    assert not time_origins(with_time_origins(axis, near)).any()  # within two hundredths of a turn


def test_a_clock_is_set_by_no_line_that_may_be_chance(dataset):
    axis = STAGE.with_effect(REST)
    assert with_time_origins(axis, dataset_of(dataset.fit[0])) is not None
    assert not time_origins(with_time_origins(axis, dataset_of(dataset.fit[0]))).any()
    quiet = [
        windowed(
            replace(
                ridden(lambda m, s=s: np.random.default_rng(s).normal(0, 0.01, len(m.time))),
                name=f"{s}",
            ),
            0.02,
        )
        for s in (1, 2)
    ]
    assert not time_origins(with_time_origins(axis, dataset_of(*quiet))).any()


def test_the_effects_that_read_the_clock_are_told(dataset):
    axis = STAGE.with_effect(PUMP)
    assert without_timed_forces(axis, dataset.fit[0]).names == STAGE.names
    assert without_timed_forces(STAGE, dataset.fit[0]) == STAGE
    assert depends_on_time_origin(axis, dataset)
    assert not depends_on_time_origin(STAGE, dataset)
    assert phases_found(axis, "periodic_disturbance", dataset) == 0
    known = with_time_origins(axis, dataset)
    set_ = sum(log.motion.time_origin != 0.0 for log in known.fit)
    assert phases_found(axis, "periodic_disturbance", known) == set_ == 1
    assert phases_found(axis, "coulomb_viscous", known) == 0


def test_an_amplitude_is_that_of_its_line():
    t = np.arange(4000) * 1e-3
    force = 0.7 * np.cos(2.0 * np.pi * 12.5 * t + 0.4) + 3.0
    assert abs(_amplitude(t, force, 12.5) - 0.7 * np.exp(0.4j)) < 1e-9
