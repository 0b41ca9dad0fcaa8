"""Counts: of an encoder in one turn or metre, behind a gear, and counters that begin again."""

from __future__ import annotations

from pathlib import Path

import cli_runs
import numpy as np
import pytest
from import_cases import mapping, write_csv

from twin.checks import Fault, check_log
from twin.errors import InputError
from twin.importers import import_log, import_notes
from twin.importers.counters import find_wraps
from twin.logs import Log

T = 1e-3 * np.arange(4000)
TURNS = 6.0 * np.sin(2.0 * T)
TORQUE = 0.3 * np.cos(2.0 * T)
COUNTS = np.rint(4096.0 * TURNS)
HEAD = "sample_rate = 1000.0\n[axes.q]\n"
POSITION = 'position = {column = "enc", unit = "counts", counts_per_turn = 4096}\n'
FORCE = 'force = {column = "tau", unit = "N m"}\n'


def imported(folder: Path, text: str, **columns: np.ndarray) -> Log:
    write_csv(folder / "a.csv", {"enc": COUNTS, "tau": TORQUE, **columns})
    return import_log(folder / "a.csv", mapping(folder, HEAD + text))


def test_counts_of_a_turn_and_of_a_metre_and_a_second(tmp_path):
    velocity = 'velocity = {column = "w", unit = "counts/s", counts_per_turn = 4096}\n'
    log = imported(tmp_path, POSITION + velocity + FORCE, w=4096.0 * 12.0 * np.cos(2.0 * T))
    axis = log.axes["q"]
    assert axis.kind.rotary
    np.testing.assert_allclose(axis.position, 2.0 * np.pi * COUNTS / 4096.0)
    np.testing.assert_allclose(axis.columns["velocity"], 24.0 * np.pi * np.cos(2.0 * T))
    linear = POSITION.replace("counts_per_turn = 4096", "counts_per_metre = 1e6")
    axis = imported(tmp_path, linear + FORCE.replace("N m", "N")).axes["q"]
    assert not axis.kind.rotary
    np.testing.assert_allclose(axis.position, 1e-6 * COUNTS)


def test_what_an_axis_says_of_its_encoder_holds_for_its_signals_in_counts(tmp_path):
    bare = POSITION.replace(", counts_per_turn = 4096", "")
    setpoint = 'setpoint_position = {column = "enc", unit = "counts", counts_per_turn = 8192}\n'
    axis = imported(tmp_path, "counts_per_turn = 4096\n" + bare + setpoint + FORCE).axes["q"]
    np.testing.assert_allclose(axis.position, 2.0 * np.pi * COUNTS / 4096.0)
    np.testing.assert_allclose(axis.columns["setpoint_position"], 0.5 * axis.position)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("counts_per_metre = 2.0\n" + POSITION + FORCE, "none of the axis' signals is in counts"),
        ('position = {column = "enc", unit = "counts"}\n' + FORCE,
         "axes.q: position: unit 'counts' needs counts_per_turn or counts_per_metre"),
        ('position = {column = "enc", unit = "inc", scale = 1e-6}\n'
         'current = {column = "tau", unit = "mA"}\n',
         "position: counts with a scale are of an axis that turns or one that travels; say which"),
        (POSITION.replace("}", ", counts_per_metre = 2.0}") + FORCE, "give one of counts_per_turn"),
        (POSITION.replace("}", ", scale = 2.0}") + FORCE, "scale and counts_per_turn are both"),
        (POSITION.replace('"counts"', '"deg"') + FORCE, 'with unit = "counts"'),
        ("gear = 0.0\n" + POSITION + FORCE, "gear: give a number other than 0"),
        ('side = "load"\n' + POSITION + FORCE, "needs the ratio of the gear"),
        ('gear = 5.0\nside = "left"\n' + POSITION + FORCE, 'side = \'left\': give "motor" or'),
    ],
)  # fmt: skip
def test_what_is_not_known_of_counts_is_asked_for(tmp_path, text, message):
    with pytest.raises(InputError, match=message):
        imported(tmp_path, text)


@pytest.mark.parametrize(
    ("entries", "moved", "driven"),
    [("gear = 10\n", 0.1, 10.0), ('gear = 10.0\nside = "load"\n', 1.0, 10.0),
     ("gear = -10.0\n", -0.1, -10.0)],
)  # fmt: skip
def test_a_gear_brings_the_motor_to_the_load(tmp_path, entries, moved, driven):
    axis = imported(tmp_path, entries + POSITION + FORCE).axes["q"]
    np.testing.assert_allclose(axis.position, moved * 2.0 * np.pi * COUNTS / 4096.0, atol=1e-12)
    np.testing.assert_allclose(axis.force, driven * TORQUE, atol=1e-12)


def test_a_torque_may_be_measured_at_the_load(tmp_path):
    force = FORCE.replace("}", ', side = "load"}')
    axis = imported(tmp_path, "gear = 10.0\n" + POSITION + force).axes["q"]
    np.testing.assert_allclose(axis.force, TORQUE, atol=1e-12)


def cut(counts: np.ndarray, signed: bool) -> np.ndarray:
    """As 16 bits show it."""
    whole = np.rint(counts).astype(np.int64).astype(np.uint16)
    return whole.astype(np.int16 if signed else np.uint16).astype(float)


@pytest.mark.parametrize("signed", [True, False])
@pytest.mark.parametrize("start", [0.0, -3.0])
def test_wraps_of_16_bits_are_told_and_taken_out_on_request(tmp_path, signed, start):
    counts = 2e5 * np.sin(2.0 * T) + start
    log = imported(tmp_path, POSITION + FORCE, enc=cut(counts, signed))
    (wrapped,) = [f for f in check_log(log).findings if f.what.startswith("column 'enc' jumps by")]
    assert wrapped.fault is Fault.WRAPPED
    assert "65536 between rows" in wrapped.what
    assert "give wraps = 65536 for its position" in wrapped.remedy
    whole = imported(
        tmp_path, POSITION.replace("}", ", wraps = 65536}") + FORCE, enc=cut(counts, signed)
    )
    expected = 2.0 * np.pi * np.rint(counts) / 4096.0
    np.testing.assert_allclose(whole.axes["q"].position, expected, atol=1e-9)
    assert import_notes(whole) == ["column 'enc': a counter that begins again after 65536 goes on"]
    assert not [f for f in check_log(whole).findings if f.fault is Fault.WRAPPED]


def test_a_small_current_without_its_sign_is_said_by_check(tmp_path):
    write_csv(tmp_path / "a.csv", {"enc": COUNTS, "i": cut(40.0 * TORQUE - 3.0, signed=False)})
    current = 'current = {column = "i", unit = "counts", scale = 0.00269}\nforce_constant = 1.8\n'
    (tmp_path / "m.toml").write_text(HEAD + POSITION + current)
    done = cli_runs.twin("import", "a.csv", "--map", "m.toml", "-o", "a.mcap", folder=tmp_path)
    assert "column 'i' jumps by 65536 between rows" in done.stderr
    done = cli_runs.twin("check", "a.mcap", folder=tmp_path)
    assert done.returncode == 1
    assert "column 'i' jumps by 65536 between rows" in done.stdout
    (tmp_path / "m.toml").write_text(HEAD + POSITION + current.replace("}", ", wraps = 65536}"))
    log = import_log(tmp_path / "a.csv", mapping(tmp_path, (tmp_path / "m.toml").read_text()))
    assert np.abs(log.axes["q"].columns["current"]).max() < 0.1


def test_no_counter_begins_again_where_a_signal_jumps():
    rng = np.random.default_rng(1)
    square = np.where(np.sin(30.0 * T) > 0.0, 200.0, 0.0)
    for column in (square, square - 100.0, COUNTS, 3e4 * np.sign(np.sin(5.0 * T)),
                   32000.0 * rng.uniform(-1.0, 1.0, len(T))):  # fmt: skip
        assert find_wraps(column) is None
