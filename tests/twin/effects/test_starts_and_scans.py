"""Start rules and scans are formulas in the units of the log.

With lengths in other units of length, times in other units of time and forces in other units of
force, a rule gives the same values in those units. Ladders of fixed times and ratios keep their own
laws; of lengths and forces there are none but the periods of scales.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from effect_runs import LOG
from machines import CATALOGUE

from twin.effect import IO_SIZE, OUT, Effect, Excitation, U, X
from twin.excitation import Repeating
from twin.model.units import dimension

RULED = {f"{e.name}-{p.name}": p for e in CATALOGUE.values() for p in e.parameters if p.start_rule}
SCANNED = {f"{e.name}-{p.name}": p for e in CATALOGUE.values() for p in e.parameters if p.scan}
UNITS = [(2.0, 1.0, 1.0), (1.0, 3.0, 1.0), (1.0, 1.0, 5.0), (0.7, 1.9, 0.3)]  # force, length, time


def scaled(e: Excitation, force: float, length: float, time: float) -> Excitation:
    """The same log in units that are smaller by these factors."""
    return Excitation(
        length * e.position_low, length * e.position_high, length / time * e.speed_max,
        force * e.dry_level, time * e.duration, time * e.period, force * e.force_max,
        Repeating(tuple(f / time for f in e.lines)), tuple(length * r for r in e.ripples),
        length * e.resolution, other_joints=e.other_joints, force_usual=force * e.force_usual,
        speed_least=length / time * e.speed_least, shortest=length * e.shortest,
    )  # fmt: skip


def follows_units(rule: Callable, unit: str) -> bool:
    here = np.atleast_1d(rule(LOG))
    for units in UNITS:
        there = np.atleast_1d(rule(scaled(LOG, *units)))
        factor = np.prod(np.array(units) ** dimension(unit))
        if there.shape != here.shape or not np.allclose(there, factor * here, rtol=1e-12, atol=0):
            return False
    return True


def test_units_are_read_as_they_are_written() -> None:
    assert dimension("N s^2/m^2") == (1, -2, 2)
    assert dimension("1/J") == (-1, -1, 0)
    assert follows_units(lambda e: e.dry_level / e.travel, "N/m")
    assert not follows_units(lambda e: e.dry_level / e.travel, "N")
    assert not follows_units(lambda e: e.dry_level + 1e-3, "N")


@pytest.mark.parametrize("name", RULED)
def test_a_start_rule_follows_the_units_of_the_log(name: str) -> None:
    p = RULED[name]
    if name == "gms-C":  # a rule of thumb: force levels over a time of 10 ms
        assert p.start_rule(LOG) == pytest.approx(LOG.dry_level / 1e-2)
    else:
        assert follows_units(p.start_rule, p.unit)


# Scans that try fixed times and ratios.
ABSOLUTE = {
    "backlash-frequency", "dwell_stiction-time", "base_vibration-damping", "flexible_mode-damping",
    "transmission_coupling-joint", "transmission_coupling-turns",
}  # fmt: skip
OWN = {
    "base_vibration-frequency", "flexible_mode-frequency", "encoder_ripple-period",
    "unbalance-gear",  # by turns of the shaft: an angle has no other unit
}  # fmt: skip


@pytest.mark.parametrize("name", SCANNED)
def test_a_scan_is_sorted_within_bounds_and_in_the_units_of_the_log(name: str) -> None:
    p = SCANNED[name]
    tried = np.array(p.scan(LOG))
    assert len(set(tried)) == len(tried) > 0
    assert p.lower <= tried.min() <= tried.max() <= p.upper
    start = p.start_from(LOG)
    if start > 0.0 and tried.min() > 0.0 and name != "encoder_ripple-period":
        assert tried.min() / 10.0 <= start <= 10.0 * tried.max()
    if name in OWN:
        return
    if name != "periodic_disturbance-f":  # strongest first
        assert np.all(np.diff(tried) > 0.0) or np.all(np.diff(tried) < 0.0)
    if name in ABSOLUTE:
        for units in UNITS:
            np.testing.assert_array_equal(p.scan(scaled(LOG, *units)), tried)
    else:
        assert follows_units(p.scan, p.unit)


KNEES = [(e, knee) for e in CATALOGUE.values() for knee in e.knees]


@pytest.mark.parametrize(("effect", "knee"), KNEES, ids=lambda one: one.name)
def test_what_a_log_shows_of_a_knee_is_in_the_units_of_the_log(effect, knee) -> None:
    of_values = ("width", "free travel", "largest push", "joint")
    if knee.name not in (*of_values, "gear"):  # an angle has no other unit
        for end in (0, 1):
            assert follows_units(
                lambda e, end=end: knee.shown(effect.starts(LOG), e)[end], knee.unit
            )


MEANT = {
    "Fc": LOG.dry_level, "start": LOG.position_low, "low": LOG.position_low,
    "high": LOG.position_high, "length": LOG.travel, "speed": LOG.speed_max,
    "step": LOG.resolution, "T": 1.0 / LOG.lines[0], "tau": 0.5 * LOG.duration,
}  # fmt: skip
WITHIN = {"v0": (0.02 * LOG.speed_max, 0.1 * LOG.speed_max),  # the slow part of the motion
          "limit": (0.5 * LOG.force_max, LOG.force_max)}  # fmt: skip


@pytest.mark.parametrize("name", RULED)
def test_a_start_that_the_log_shows_is_that_of_the_log(name: str) -> None:
    p = RULED[name]
    found = p.start_from(LOG)
    if p.name in MEANT:
        assert found == pytest.approx(MEANT[p.name], rel=1e-14)
    if p.name == "Fs":  # at rest a little more holds than while it slides, where there is a curve
        rise = found / LOG.dry_level
        assert rise == 1.0 if p.fixed else 1.05 < rise < 1.3
    low, high = WITHIN.get(p.name, (-np.inf, np.inf))
    assert low < found < high
    assert replace(p, start_rule=None).start_from(LOG) == p.start


def scan(effect: str, name: str, e: Excitation = LOG) -> np.ndarray:
    return np.array(CATALOGUE[effect].parameter(name).scan(e))


@pytest.mark.parametrize(
    ("effect", "most", "travel"), [("cogging", 120, 0.02), ("force_constant_ripple", 70, 0.4)]
)
def test_pitches_are_half_a_cycle_apart_from_three_cycles_on(effect, most, travel):
    """Up to as many cycles as the data can tell apart."""
    tried = scan(effect, "p", replace(LOG, position_low=0.03, position_high=0.03 + travel))
    halves = 2.0 * travel / tried
    np.testing.assert_allclose(halves, np.arange(6, 6 + len(tried)), rtol=1e-12)
    assert halves[-1] / 2.0 == pytest.approx(most, abs=0.01)


@pytest.mark.parametrize(
    ("effect", "known", "wanted"),
    [("cogging", "pitches", (0.02, 0.04, 0.06)),
     ("force_constant_ripple", "thrust_pitches", (0.02, 0.04)),
     ("friction_ripple", "friction_pitches", (0.02, 0.04))],
)  # fmt: skip
def test_a_pitch_that_the_log_shows_may_be_that_of_a_harmonic(effect, known, wanted) -> None:
    np.testing.assert_allclose(
        scan(effect, "p", replace(LOG, repeats=Repeating(**{known: (0.02,)}))), wanted
    )


def test_stops_are_tried_from_both_ends_alike_and_not_beyond_the_middle() -> None:
    low, high = scan("end_stop", "low"), scan("end_stop", "high")
    np.testing.assert_allclose(low - LOG.position_low, LOG.position_high - high)
    assert np.all((low > LOG.position_low) & (low < LOG.position_low + 0.5 * LOG.travel))
    assert np.diff(low).max() <= 0.1 * LOG.travel


def test_lines_of_the_log_are_tried_and_a_ladder_where_there_are_none() -> None:
    assert tuple(scan("periodic_disturbance", "f")) == LOG.lines
    ladder = scan("periodic_disturbance", "f", replace(LOG, repeats=Repeating()))
    np.testing.assert_allclose(ladder[1:] / ladder[:-1], 1.1)
    assert ladder[0] == 0.5
    assert ladder[-1] > 50.0


def force(effect: Effect, values: dict[str, float], x: float) -> float:
    io = [0.0] * IO_SIZE
    io[X], io[U] = x, 1.0
    effect.law([values[p.name] for p in effect.parameters], [], io)
    return io[OUT] + io[U]


@pytest.mark.parametrize(
    ("name", "k", "others"),
    [
        ("cogging", 1, 0.0), ("cogging", 2, 0.09), ("cogging", 2, 0.11), ("cogging", 3, 0.0),
        ("force_constant_ripple", 2, 0.09),
    ],
)  # fmt: skip
def test_the_simplest_pitch_has_the_same_force(name: str, k: int, others: float) -> None:
    """A harmonic alone is a fundamental of a part of the pitch; less than a tenth is left out."""
    effect = CATALOGUE[name]
    every = {int(p.name[1:]) for p in effect.strengths}
    values = {"p": 0.03, **{f"{c}{j}": 0.0 for c in "ab" for j in every}}
    values[f"a{k}"], values[f"b{k}"] = 0.6, -0.8
    for j in every - {k}:
        values[f"b{j}"] = 0.5 * others
    simple = effect.simplest(values)
    assert set(simple) == set(values)
    changed = k > 1 and others < 0.1
    assert (simple == values) == (not changed)
    assert simple["p"] == pytest.approx(values["p"] / (k if changed else 1))
    for x in np.linspace(-0.02, 0.03, 7):
        assert force(effect, simple, x) == pytest.approx(
            force(effect, values, x), abs=others + 1e-12
        )
