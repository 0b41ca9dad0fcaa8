"""Laws of a run: its parts are its whole, what broke it is named, and what a user gives is read."""

import numpy as np
import pytest
from constructed import effect, two_waves

from twin.effect import INDEX, OUT, READING, TIME, Effect, Kind
from twin.entries import read_toml, shown, toml_document
from twin.errors import CannotRun, InputError, at
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.simulation import simulators
from twin.simulation.loop import N_SIGNALS, READING_COLUMN, Controller, gain_table
from twin.simulation.simulators import MujocoSimulator, ReducedSimulator, run, run_parts

RATE = 1000.0
EFFECTS = {
    "x": (effect("lugre"), effect("cable_slab", {"k1": 30.0})),
    "y": (effect("gms", {"elements": 9}), effect("actuator_lag"), effect("cogging", {"a1": 0.4})),
}
MODEL = MachineModel(
    "m",
    {a: AxisModel(m, Hardware(encoder_noise=n), EFFECTS[a])
     for a, m, n in (("x", 2.0, 1e-6), ("y", 3.0, 5e-6))},
    RATE,
)  # fmt: skip


@pytest.mark.parametrize("stage", [ReducedSimulator, MujocoSimulator])
def test_a_run_in_parts_is_the_same_run_and_tells_how_far_it_is(stage):
    """The same seed draws the same noise, part by part; what comes later changes nothing."""
    chunk, more, told = simulators.CHUNK, 500, []
    n = 2 * chunk + more
    wanted = two_waves(n)
    whole = run(
        MODEL, wanted, np.random.default_rng(3), simulator=stage,
        progress=lambda done, of: told.append((done, of)),
    )  # fmt: skip
    parts = list(run_parts(MODEL, wanted, np.random.default_rng(3), simulator=stage))
    assert [len(p) for p in parts] == [chunk, chunk, more]
    assert told == [(chunk, n), (2 * chunk, n), (n, n)]
    begin = run(MODEL, two_waves(chunk), np.random.default_rng(3), simulator=stage)
    for name in ("signals", "forces", "states"):
        joined = np.concatenate([getattr(p, name) for p in parts])
        np.testing.assert_array_equal(joined, getattr(whole, name))
        np.testing.assert_array_equal(getattr(begin, name), getattr(parts[0], name))


def test_states_are_logged_under_their_names_where_they_are_few():
    done = run(MODEL, two_waves(200), np.random.default_rng(1), simulator=ReducedSimulator)
    states = {f.effect.name: f.effect.states for axis in EFFECTS.values() for f in axis}
    assert len(states["gms"]) > simulators.WATCHED_STATES
    wanted = {("x", f"lugre_{s}") for s in states["lugre"]}
    wanted |= {("y", f"actuator_lag_{s}") for s in states["actuator_lag"]}
    assert set(done.state_names) == wanted
    assert done.states.shape == (200, len(wanted))
    # the deflection of the bristles goes against their force
    bristle = done.states[:, [a for a, _ in done.state_names].index("x")]
    force = done.forces[:, done.table.labels.index(("x", "lugre"))]
    assert np.corrcoef(bristle, force)[0, 1] < -0.9


@pytest.mark.parametrize("kind", [InputError, CannotRun])
def test_an_error_says_where_in_one_line_and_stays_of_its_kind(kind):
    def fail(error):
        with at("file a"):
            raise error

    with pytest.raises(kind, match=r"^file a: one two$") as told:
        fail(kind("one\ntwo"))
    assert type(told.value) is kind
    with pytest.raises(KeyError):  # no fault of the input
        fail(KeyError("x"))


def test_a_toml_file_is_read_up_to_its_limit(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text("a = 1\n")
    assert read_toml(path) == {"a": 1}
    assert toml_document(path) == ("a = 1\n", {"a": 1})
    path.write_bytes(b"#" * 5_000_000)
    assert read_toml(path) == {}
    path.write_bytes(b"#" * 5_000_001)
    with pytest.raises(InputError, match=r"is larger than 5 MB; give a TOML file$"):
        read_toml(path)
    path.write_text("a = ")
    with pytest.raises(InputError, match="is not a TOML file"):
        read_toml(path)


def test_a_long_value_is_cut_in_a_message():
    assert shown("a" * 58) == repr("a" * 58)
    assert shown("a" * 59) == f"'{'a' * 59}..."
    deep: list = []
    for _ in range(100_000):
        deep = [deep]
    assert shown(deep) == "something too large to be shown"
    while deep:  # to be freed without recursion
        deep = deep[0]


def _index_and_time(p, s, io):
    io[OUT] = io[INDEX] + io[TIME]


def _time(p, s, io):
    io[READING] = io[TIME]


def told_by(kind, law, number=1):
    """An effect without parameters that tells what its law is given."""
    told = Effect(kind, "tells", "", "this test", (), law, fingerprint="", excited_by="")
    return Fitted(told.numbered(number), {}, frozenset())


@pytest.mark.parametrize("origin", [0.0203, -0.0203, 1e6])
@pytest.mark.parametrize("stage", [ReducedSimulator, MujocoSimulator])
def test_the_origin_is_in_the_time_of_a_law_and_not_in_its_index(stage, origin):
    """A force and a sensor in either simulation; no other place of the time of a sample is."""
    effects = told_by(Kind.FORCE, _index_and_time), told_by(Kind.SENSING, _time, number=2)
    model = MachineModel("clock", {"x": AxisModel(1.0, Hardware(), effects)}, RATE)
    table, first, n = model.table(), 30, 40
    simulation = stage(model, table)
    simulation.place(np.zeros(1), np.zeros(1), np.zeros(table.n_states), first, origin)
    shared = (
        1.0 / RATE, (table.entries, table.axes, table.parameters), np.zeros(table.n_states),
        gain_table({"x": Controller()}, model.axes, 1.0 / RATE), np.zeros((1, 3)),
        np.zeros(0, dtype=np.int64),
    )  # fmt: skip
    signals, forces = np.empty((n, 1, N_SIGNALS)), np.zeros((n, 2))
    out = signals, forces, np.empty((n, 0))
    simulation.run(first, shared, np.zeros((n, 1, 4)), np.zeros((n, 1)), out)
    index = np.arange(first, first + n)
    time = origin + index / RATE
    np.testing.assert_allclose(signals[:, 0, READING_COLUMN], time, rtol=0, atol=1e-9)
    told = forces[:, table.labels.index(("x", effects[0].effect.name))]
    np.testing.assert_allclose(told, index + time, rtol=0, atol=1e-9)
