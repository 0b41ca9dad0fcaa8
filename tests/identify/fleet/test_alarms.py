"""What changed is told soon, with its date and size; what did not, and what all do, is not."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, timedelta

import numpy as np
import pytest
from fleet_cases import panel

from identify.fleet.alarms import alarms_of
from identify.fleet.change_point import changes
from identify.fleet.rates import level_of
from identify.results.fleet import Scope

FC = 0.31  # N
SCATTER = 0.008  # of it, from night to night


def nights(seed: int, machines: int = 6, count: int = 90) -> np.ndarray:
    rng = np.random.default_rng(seed)
    own = FC * (1.0 + 0.1 * rng.standard_normal((machines, 1)))
    return own * (1.0 + SCATTER * rng.standard_normal((machines, count)))


def test_machines_that_are_well_raise_none() -> None:
    for seed in range(3):
        assert alarms_of([panel(nights(seed, count=300))]) == ()


@pytest.mark.parametrize(("share", "within"), [(0.1, 5), (0.03, 30)])
def test_a_change_is_told_within_its_nights_with_date_and_size(share, within) -> None:
    for seed in range(5):
        values = nights(seed)
        before = values[2, :40].mean()
        values[2, 40:] *= 1.0 + share
        (alarm,) = alarms_of([panel(values)])
        since = date(2026, 1, 1) + timedelta(days=40)
        assert (alarm.machine, alarm.parameter, alarm.unit) == ("m2", "lugre.Fc", "N")
        assert since <= alarm.night < since + timedelta(days=within)
        assert alarm.earliest <= since <= alarm.latest
        assert alarm.size == pytest.approx(share * before, abs=2.5 * alarm.half_width)
        assert alarm.trend is None


def test_what_grows_is_one_alarm_that_goes_on() -> None:
    values = nights(1)
    values[0, 40:] *= 1.0 + 0.005 * np.arange(50)
    (alarm,) = alarms_of([panel(values)])
    assert alarm.trend == pytest.approx(0.005 * values[0, :40].mean(), rel=0.2)
    assert alarm.size > 0.15 * alarm.before


def test_what_all_machines_do_is_told_once_as_the_halls() -> None:
    values = nights(1)
    values[:, 40:] *= 0.95
    (alarm,) = alarms_of([panel(values)])
    assert alarm.scope is Scope.HALL
    assert alarm.machine is None
    assert alarm.size == pytest.approx(-0.05 * FC, rel=0.4)


def test_a_thermometer_explains_what_temperature_does() -> None:
    rng = np.random.default_rng(2)
    warmer = 4.0 * (np.arange(120) > 60) + rng.standard_normal(120)
    values = nights(2, machines=1, count=120) * (1.0 - 0.012 * warmer)
    assert alarms_of([panel(values, temperatures=293.0 + warmer[None])]) == ()


def test_of_a_single_machine_without_one_only_large_changes_are_told() -> None:
    values = nights(2, machines=1, count=120)
    for share, count in ((0.03, 0), (0.15, 1)):
        changed = values * np.where(np.arange(120) < 60, 1.0, 1.0 + share)
        assert len(alarms_of([panel(changed)])) == count


def test_one_odd_night_and_one_that_is_not_known_are_no_change() -> None:
    values = nights(3)
    values[1, 50] *= 1.5
    values[2, 60:64] = np.nan
    assert alarms_of([panel(values)]) == ()


def test_parameters_that_change_at_once_are_one_alarm_led_by_the_force_error() -> None:
    rng = np.random.default_rng(4)
    friction, error = nights(4), 0.003 * np.exp(0.08 * rng.standard_normal((6, 90)))
    error[3, 50:] *= 5.0
    friction[3, 53:] *= 1.1
    (alarm,) = alarms_of([panel(friction), panel(error, "force_error")])
    assert (alarm.machine, alarm.parameter, alarm.others) == ("m3", "force_error", ("lugre.Fc",))


def test_a_night_weighs_by_its_interval() -> None:
    values, deviations = nights(5), np.full((6, 90), 1e-4)
    values[0, 60:] *= 1.0 + np.random.default_rng(1).normal(0.1, 0.1, 30)
    deviations[0, 60:] = 0.1 * FC
    sure = panel(values)
    assert not [a for a in alarms_of([replace(sure, deviations=deviations)]) if a.night.month < 3]


def test_a_parameter_of_which_nothing_varies_has_no_change() -> None:
    assert changes(np.full(60, 2.0), np.zeros(60), 0.01, 4.5) == []
    values = np.where(np.arange(60) < 30, 2.0, 3.0)
    (change,) = changes(values, np.zeros(60), 0.01, 4.5)
    assert (change.first, change.earliest, change.latest) == (30, 30, 30)
    assert change.told <= 32


def test_more_series_need_a_higher_level() -> None:
    assert 4.0 < level_of(5) < level_of(20) <= 5.0
