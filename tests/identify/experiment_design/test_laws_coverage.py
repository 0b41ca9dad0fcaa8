"""Laws of coverage: what the logs lack is where a difference lives and the data do not."""

from dataclasses import replace

import numpy as np
import pytest
from constructed import SHORT, moved, windowed

from identify.dataset.prepared_log import REST_SPEED
from identify.experiment_design.missing_excitation import (
    UNITS,
    gap,
    most_missed,
    properties,
)

LOG = windowed(SHORT)


def test_properties_are_windowed_means_of_the_motion():
    m, w = SHORT, LOG.test_function
    found = properties(LOG)
    assert list(found) == list(UNITS)
    for name, wanted in {
        "speed": np.abs(w.mean(m.velocity)),
        "acceleration": np.abs(LOG.acceleration),
        "motor force": np.abs(LOG.command),
        "rate of change of the motor force": np.abs(w.mean(np.gradient(m.command, m.period))),
        "speed of the other axis": np.abs(w.mean(m.others[1])),
        "acceleration of the other axis": np.abs(w.mean(m.others[2])),
    }.items():
        np.testing.assert_allclose(found[name], wanted, atol=0.01 * np.ptp(wanted))


def test_a_rest_is_the_time_stood_before_the_motion():
    """Walked sample by sample: how long the last standstill was, while it lasts how long so far."""
    for length, rounded in ((84, 0.3), (116, 0.3), (83, 0.2), (117, 0.4)):  # of 3 ms each
        speed = np.full(1000, 0.2)
        speed[100 : 100 + length] = 0.99 * REST_SPEED * 0.2
        speed[600:620] = -0.5 * REST_SPEED * 0.2
        speed[700:900] = 3.0 * REST_SPEED * 0.2
        motion = replace(SHORT, signals=np.stack([speed, speed, speed]), period=3e-3)
        log = replace(LOG, motion=motion)
        stood, last, rest = 0, 0.0, []
        for v in speed:
            stood = stood + 1 if abs(v) < REST_SPEED * 0.2 else 0
            last = stood * motion.period if stood else last
            rest.append(last)
        wanted = np.round(log.test_function.mean(np.array(rest)), 1)
        np.testing.assert_allclose(properties(log)["rest before the motion"], wanted)
        assert wanted.max() == pytest.approx(rounded)


def test_the_gap_is_where_the_difference_is_and_the_data_are_not():
    planned = windowed(moved(np.random.default_rng(2), 2.0, 1000.0))
    speed = properties(planned)["speed"]
    where = (speed > np.quantile(speed, 0.8)).astype(float)
    slow = windowed(replace(SHORT, signals=SHORT.signals * [[1.0], [1e-3], [1.0]]))
    found = gap(planned, where, [slow])
    assert (found.feature, found.share, found.unit) == ("speed", 0.0, "m/s")
    ordered = np.sort(speed[where > 0])
    assert found.low == pytest.approx(np.quantile(ordered, 0.25), rel=0.05)
    assert found.high == pytest.approx(np.quantile(ordered, 0.75), rel=0.05)
    alone = gap(planned, where, [])
    assert (alone.feature, alone.share) == ("speed", None)
    assert gap(planned, np.ones(len(speed)), [planned]).share > 0.4


@pytest.mark.parametrize(("speed", "counts"), [(5e-8, False), (5e-2, True)])
def test_dust_of_an_axis_at_rest_is_no_motion(speed, counts):
    """Its speed alone tells where the difference is; a loop that settles makes one as small."""
    planned = windowed(moved(np.random.default_rng(2), 2.0, 1000.0))
    where = (np.arange(len(planned)) < len(planned) // 2).astype(float)
    rests = replace(planned.motion, others=np.zeros_like(planned.motion.others))
    early = planned.time < np.median(planned.time)
    rests.others[1] = speed * np.interp(rests.time, planned.time, early)
    found = gap(replace(planned, motion=rests), where, [windowed(SHORT)])
    assert (found.feature == "speed of the other axis") is counts


@pytest.mark.parametrize(
    ("inside", "shares", "wanted"),
    [
        ((50, 10), (0, 0), "b"),  # what tells the windows of the difference from the others
        ((20, 30), (10, 2), "b"),  # what the data miss more
        ((10, 90), (3, 1), "a"),  # but not where it tells nothing
        ((10, 20), (1, 0), "a"),
    ],
)
def test_a_gap_weighs_how_much_is_missed_by_how_well_it_tells(inside, shares, wanted):
    """Windows of the difference have 1 to 2 of a property, so have some others, and some data."""

    def values(count, first):
        return np.concatenate([first, np.full(count, 1.5), np.full(100 - count, 9.0)])

    ones = np.tile([1.0, 1.5, 1.5, 1.5, 2.0], 2)
    planned = {"still": np.zeros(110), **{n: values(i - 10, ones) for n, i in zip("ab", inside)}}  # noqa: B905
    data = {n: values(count, np.zeros(0)) for n, count in zip("ab", shares, strict=True)}
    where = np.concatenate([np.ones(10), np.zeros(100)])
    share = shares["ab".index(wanted)] / 100.0
    assert most_missed(planned, where, data) == (wanted, 1.5, 1.5, pytest.approx(share))
