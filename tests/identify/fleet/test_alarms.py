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


def stepped(seed: int = 7, share: float = 0.2, first: int = 40, count: int = 70) -> np.ndarray:
    """Nights (n,) about 1 that change by a share."""
    scatter = SCATTER * np.random.default_rng(seed).standard_normal(count)
    return 1.0 + scatter + share * (np.arange(count) >= first)


def width(before: np.ndarray, after: np.ndarray) -> float:
    """Half the 90 % band of a difference of means, by the scatter of the nights before."""
    variance = np.var(before, ddof=1)
    return 1.645 * np.sqrt(variance / len(before) + variance / len(after))


@pytest.mark.parametrize("share", [0.2, -0.2])
def test_the_numbers_of_an_alarm_are_means_of_its_nights_in_its_unit(share: float) -> None:
    values = FC * stepped(share=share)
    (alarm,) = alarms_of([panel(values[None])])
    assert (alarm.changed - date(2026, 1, 1)).days == 40
    before, after = values[:40], values[-5:]
    assert alarm.before == pytest.approx(before.mean())
    assert alarm.after == pytest.approx(after.mean())
    assert alarm.size == pytest.approx(after.mean() - before.mean())
    assert alarm.half_width == pytest.approx(width(before, after), rel=1e-3)


def test_changes_one_behind_the_other_are_one_alarm_since_the_first_and_turns_are_two() -> None:
    """Dates are of the first change; the sizes are those before it and after the last."""
    values = FC * (stepped(count=120) + 0.3 * (np.arange(120) >= 75))
    (alarm,) = alarms_of([panel(values[None])])
    assert (alarm.changed - date(2026, 1, 1)).days == 40
    assert alarm.night < date(2026, 1, 1) + timedelta(days=50)
    assert alarm.before == pytest.approx(values[:40].mean())
    assert alarm.after == pytest.approx(values[-5:].mean())
    back = FC * (stepped(count=120) - 0.2 * (np.arange(120) >= 75))
    days = [(a.changed - date(2026, 1, 1)).days for a in alarms_of([panel(back[None])])]
    assert sorted(days) == [40, 75]


def test_of_a_force_error_they_are_ratios() -> None:
    values = 0.003 * np.exp(4.0 * stepped())
    (alarm,) = alarms_of([panel(values[None], "force_error")])
    logs = np.log(values)
    before, after = logs[:40], logs[-5:]
    assert alarm.before == pytest.approx(np.exp(before.mean()))
    assert alarm.after == pytest.approx(np.exp(after.mean()))
    wider = np.exp(after.mean() + width(before, after)) - np.exp(after.mean())
    assert alarm.half_width == pytest.approx(wider, rel=1e-3)


def test_a_trend_is_the_slope_of_the_nights_since_the_change() -> None:
    values = FC * (stepped(count=80) + 0.01 * np.maximum(np.arange(80) - 40, 0))
    (alarm,) = alarms_of([panel(values[None])])
    first = (alarm.changed - date(2026, 1, 1)).days
    slope = np.polyfit(np.arange(80 - first), values[first:], 1)[0]
    assert alarm.trend == pytest.approx(slope, rel=1e-6)


def test_a_change_of_the_hall_is_told_as_that_of_its_typical_machine() -> None:
    own = FC * np.array([0.8, 1.3, 0.9, 1.1, 1.05, 1.2, 0.7])
    common = stepped()
    (alarm,) = alarms_of([panel(own[:, None] * common)])
    assert (alarm.scope, alarm.machine) == (Scope.HALL, None)
    typical = FC * 1.05  # the median
    assert alarm.before == pytest.approx(typical * common[:40].mean(), rel=1e-6)
    assert alarm.after == pytest.approx(typical * common[-5:].mean(), rel=1e-6)


def test_a_change_is_the_same_in_any_unit_and_in_either_direction() -> None:
    """Of nights that scatter, some of which are known better than others."""
    rng = np.random.default_rng(3)
    deviations = 0.02 * rng.uniform(0.1, 2.0, 90)
    values = 1.0 + 0.01 * rng.standard_normal(90) + deviations * rng.standard_normal(90)
    values[50:] += 0.1
    wanted = changes(values, deviations**2, 0.01, 4.5)
    assert [c.first in range(45, 56) for c in wanted] == [True]
    for scale, offset in ((1.0, 7.0), (-1.0, 0.0), (1e3, -2e3)):
        moved = scale * values + offset
        found = changes(moved, (scale * deviations) ** 2, abs(scale) * 0.01, 4.5)
        assert [replace(c, strength=0.0) for c in found] == [
            replace(c, strength=0.0) for c in wanted
        ]
        np.testing.assert_allclose([c.strength for c in found], [c.strength for c in wanted])


def test_the_strength_of_a_change_is_students_where_nights_are_independent() -> None:
    """Over what each side scatters about its mean, with two degrees of freedom less than nights."""
    rng = np.random.default_rng(11)
    told, students = [], []
    for _ in range(40):
        values = 0.01 * rng.standard_normal(60)
        values[30:] += 0.05
        (change,) = changes(values, np.zeros(60), 0.01, 4.5)
        if change.told > 33 or change.first != 30:
            continue
        known = values[: change.told + 11]
        before, after = known[:30], known[30:]
        left = np.sum((before - before.mean()) ** 2) + np.sum((after - after.mean()) ** 2)
        error = np.sqrt(left / (len(known) - 2) * (1.0 / 30 + 1.0 / len(after)))
        told.append(change.strength)
        students.append((after.mean() - before.mean() - 0.01) / error)
    assert len(told) > 20
    ratios = np.array(told) / students
    assert ratios.max() <= 1.0 + 1e-9  # alike neighbours make it less sure, never surer
    assert np.median(ratios) > 0.75


@pytest.mark.parametrize("night", [0, 20])
def test_a_night_that_is_hardly_known_changes_no_verdict(night: int) -> None:
    """What it is off by is within its own interval, and tells nothing of how the others scatter."""
    rng = np.random.default_rng(2)
    values, deviations = 1.0 + 0.01 * rng.standard_normal(60), np.full(60, 1e-4)
    values[40:] += 0.05
    (wanted,) = changes(np.delete(values, night), np.delete(deviations, night) ** 2, 0.01, 4.5)
    values[night] += 1.0
    deviations[night] = 1.0
    (found,) = changes(values, deviations**2, 0.01, 4.5)
    assert (found.first, found.told) == (wanted.first + 1, wanted.told + 1)
    assert found.strength == pytest.approx(wanted.strength, rel=0.05)
