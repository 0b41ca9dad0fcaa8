"""Start rules and scans are formulas in the units of the log.

With lengths in other units of length, times in other units of time and forces in other units of
force, a rule gives the same values in those units. Ladders of fixed times and ratios keep their own
laws; of lengths and forces there are none but the periods of scales.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from effect_runs import CATALOGUE

from twin.effect import IO_SIZE, OUT, Effect, Excitation, Parameter, X

LOG = Excitation(
    position_low=-0.13, position_high=0.21, speed_max=0.37, dry_level=0.83, duration=47.0,
    period=2.5e-4, force_max=11.0, lines=(53.0, 17.0), ripples=(3.1e-5, 1.7e-5), resolution=2.3e-7,
)  # fmt: skip
PARAMETERS = [(e, p) for e in CATALOGUE.values() for p in e.parameters]
RULED = [(e, p) for e, p in PARAMETERS if p.start_rule]
SCANNED = [(e, p) for e, p in PARAMETERS if p.scan]


def ids(pairs: list[tuple[Effect, Parameter]]) -> list[str]:
    return [f"{e.name}-{p.name}" for e, p in pairs]


# --- units ----------------------------------------------------------------------------------------

BASE = {"m": (1, 0, 0), "s": (0, 1, 0), "N": (0, 0, 1), "Hz": (0, -1, 0), "1": (0, 0, 0),
        "J": (1, 0, 1), "kg": (-1, 2, 1)}  # fmt: skip


def dimension(unit: str) -> np.ndarray:
    """Exponents of metre, second and newton."""
    above, _, below = unit.partition("/")
    total = np.zeros(3)
    for sign, part in ((1, above), (-1, below)):
        for factor in part.replace("(", "").replace(")", "").split():
            name, _, power = factor.partition("^")
            total += sign * int(power or 1) * np.array(BASE[name])
    return total


def scaled(e: Excitation, length: float, time: float, force: float) -> Excitation:
    """The same log in units that are smaller by these factors."""
    return Excitation(
        length * e.position_low, length * e.position_high, length / time * e.speed_max,
        force * e.dry_level, time * e.duration, time * e.period, force * e.force_max,
        tuple(f / time for f in e.lines), tuple(length * r for r in e.ripples),
        length * e.resolution,
    )  # fmt: skip


UNITS = [(2.0, 1.0, 1.0), (1.0, 3.0, 1.0), (1.0, 1.0, 5.0), (0.7, 1.9, 0.3)]


def follows_units(rule: Callable, unit: str) -> bool:
    here = np.atleast_1d(rule(LOG))
    for units in UNITS:
        there = np.atleast_1d(rule(scaled(LOG, *units)))
        factor = np.prod(np.array(units) ** dimension(unit))
        if there.shape != here.shape or not np.allclose(there, factor * here, rtol=1e-12, atol=0):
            return False
    return True


def test_units_are_read_as_they_are_written() -> None:
    np.testing.assert_array_equal(dimension("N s^2/m^2"), [-2, 2, 1])
    np.testing.assert_array_equal(dimension("1/J"), [-1, 0, -1])
    assert follows_units(lambda e: e.dry_level / e.travel, "N/m")
    assert not follows_units(lambda e: e.dry_level / e.travel, "N")
    assert not follows_units(lambda e: e.dry_level + 1e-3, "N")


# A rule of thumb: force levels over a time of 10 ms.
THUMB = {"C": 1.0 / 1e-2}


@pytest.mark.parametrize(("effect", "p"), RULED, ids=ids(RULED))
def test_a_start_rule_follows_the_units_of_the_log(effect: Effect, p: Parameter) -> None:
    if p.name in THUMB:
        assert p.start_rule(LOG) == pytest.approx(THUMB[p.name] * LOG.dry_level)
    else:
        assert follows_units(p.start_rule, p.unit)


# Scans that try fixed times and ratios.
ABSOLUTE = {
    "backlash-frequency", "dwell_stiction-time", "base_vibration-damping", "flexible_mode-damping",
}  # fmt: skip
OWN = {"base_vibration-frequency", "flexible_mode-frequency", "encoder_ripple-period"}


@pytest.mark.parametrize(("effect", "p"), SCANNED, ids=ids(SCANNED))
def test_a_scan_is_sorted_within_bounds_and_in_the_units_of_the_log(
    effect: Effect, p: Parameter
) -> None:
    name = f"{effect.name}-{p.name}"
    tried = np.array(p.scan(LOG))
    assert len(set(tried)) == len(tried) > 0
    assert p.lower <= tried.min() <= tried.max() <= p.upper
    if name not in OWN and name != "periodic_disturbance-f":  # strongest first
        assert np.all(np.diff(tried) > 0.0) or np.all(np.diff(tried) < 0.0)
    if name in OWN:
        return
    if name in ABSOLUTE:
        for units in UNITS:
            np.testing.assert_array_equal(p.scan(scaled(LOG, *units)), tried)
    else:
        assert follows_units(p.scan, p.unit)


@pytest.mark.parametrize(("effect", "p"), SCANNED, ids=ids(SCANNED))
def test_a_scan_has_its_start_within_reach(effect: Effect, p: Parameter) -> None:
    """No tried value is farther from the next, or from the start, than the scan is fine."""
    tried = np.array(p.scan(replace(LOG, lines=(), ripples=())))
    start = p.start_from(LOG)
    if start > 0.0 and tried.min() > 0.0:
        assert tried.min() / 10.0 <= start <= 10.0 * tried.max()


# --- starts that are known -----------------------------------------------------------------------

MEANT = {
    "Fc": LOG.dry_level,
    "start": LOG.position_low,
    "low": LOG.position_low,
    "high": LOG.position_high,
    "length": LOG.position_high - LOG.position_low,
    "speed": LOG.speed_max,
    "step": LOG.resolution,
    "T": 1.0 / LOG.lines[0],
}


@pytest.mark.parametrize(("effect", "p"), RULED, ids=ids(RULED))
def test_a_start_that_the_log_shows_is_that_of_the_log(effect: Effect, p: Parameter) -> None:
    if p.name in MEANT:
        assert p.start_from(LOG) == pytest.approx(MEANT[p.name], rel=1e-14)
    if p.name == "Fs":  # at rest a little more holds than while it slides, where there is a curve
        rise = p.start_rule(LOG) / LOG.dry_level
        assert rise == 1.0 if p.fixed else 1.05 < rise < 1.3
    if p.name == "v0":  # the curve falls within the slow part of the motion
        assert 0.02 * LOG.speed_max <= p.start_rule(LOG) <= 0.1 * LOG.speed_max
    if p.name == "tau":  # half of what is warming up shows in the log
        assert p.start_rule(LOG) == 0.5 * LOG.duration
    if p.name == "limit":  # below the largest command, above half of it
        assert 0.5 * LOG.force_max < p.start_rule(LOG) < LOG.force_max
    assert replace(p, start_rule=None).start_from(LOG) == p.start


# --- scans with laws of their own -----------------------------------------------------------------


def scan(effect: str, name: str, e: Excitation = LOG) -> np.ndarray:
    return np.array(CATALOGUE[effect].parameter(name).scan(e))


@pytest.mark.parametrize(("effect", "most"), [("cogging", 120), ("force_constant_ripple", 70)])
@pytest.mark.parametrize("travel", [0.02, 0.1, 0.4])
def test_pitches_are_half_a_cycle_apart_from_three_cycles_on(
    effect: str, most: int, travel: float
) -> None:
    """Up to as many cycles as the data can tell apart."""
    tried = scan(effect, "p", replace(LOG, position_low=0.03, position_high=0.03 + travel))
    halves = 2.0 * travel / tried
    np.testing.assert_allclose(halves, np.arange(6, 6 + len(tried)), rtol=1e-12)
    assert halves[-1] / 2.0 == pytest.approx(most, abs=0.01)


def test_stops_are_tried_from_both_ends_alike_and_not_beyond_the_middle() -> None:
    low, high = scan("end_stop", "low"), scan("end_stop", "high")
    np.testing.assert_allclose(low - LOG.position_low, LOG.position_high - high)
    assert np.all((low > LOG.position_low) & (low < LOG.position_low + 0.5 * LOG.travel))
    ratios = np.diff(low) / LOG.travel
    assert ratios.max() <= 0.1 + 1e-9, "a gap wider than a tenth of the travel"


def test_lines_of_the_log_are_tried_and_a_ladder_where_there_are_none() -> None:
    assert tuple(scan("periodic_disturbance", "f")) == LOG.lines
    ladder = scan("periodic_disturbance", "f", replace(LOG, lines=()))
    np.testing.assert_allclose(ladder[1:] / ladder[:-1], 1.1)
    assert ladder[0] == 0.5
    assert ladder[-1] > 50.0


@pytest.mark.parametrize("k", [1, 2, 3])
@pytest.mark.parametrize("others", [0.0, 0.09, 0.11])
def test_the_simplest_pitch_has_the_same_force(k: int, others: float) -> None:
    """A harmonic alone is a fundamental of a part of the pitch; less than a tenth is left out."""
    effect = CATALOGUE["cogging"]
    values = {"p": 0.03, **{f"{c}{j}": 0.0 for c in "ab" for j in (1, 2, 3)}}
    values[f"a{k}"], values[f"b{k}"] = 0.6, -0.8
    for j in {1, 2, 3} - {k}:
        values[f"b{j}"] = 0.5 * others
    simple = effect.simplest(values)
    assert set(simple) == set(values)
    changed = k > 1 and others < 0.1
    assert (simple == values) == (not changed)
    assert simple["p"] == pytest.approx(values["p"] / (k if changed else 1))

    def force(of: dict[str, float], x: float) -> float:
        io = [0.0] * IO_SIZE
        io[X] = x
        effect.law([of[p.name] for p in effect.parameters], [], io)
        return io[OUT]

    for x in np.linspace(-0.02, 0.03, 7):
        assert force(simple, x) == pytest.approx(force(values, x), abs=others + 1e-12)
