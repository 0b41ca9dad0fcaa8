"""Laws of planted effects, explanations without data and the free run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import PLAIN, axis_of, built_dataset, fitted
from constructed import COVERED, dataset_of, effect, fit_of, log_of, moved, windowed
from machines import CATALOGUE

from identify.dataset.drive import reading_error
from identify.dataset.motion import motion_of
from identify.estimation.confounded import linear_bases
from identify.estimation.evidence import rms
from identify.estimation.fit import Outcome, finished
from identify.estimation.force_balance import residual
from identify.estimation.open_loop import START_FIT, states_along
from identify.experiment_design import rival_hypotheses as explanations
from identify.experiment_design.discrimination import Explanation
from identify.experiment_design.planting import (
    FORCE,
    SPREAD,
    added_force,
    draw_effect,
    exemplary_motion,
    hidden_part,
    other_machine,
    signature,
    strength_for,
    visible_force,
)
from identify.experiment_design.rival_hypotheses import differing_axis, explained, rivals_of
from identify.output.machine import draw
from identify.validation.free_run import free_run
from twin.core.walks import walk
from twin.effects import Catalogue
from twin.errors import InputError
from twin.model.file import save_model
from twin.model.machine import AxisModel, MachineModel, axis_table
from twin.model.parameters import free_parameters, read
from twin.simulation.simulators import MujocoSimulator, ReducedSimulator

LOGS = [
    windowed(moved(np.random.default_rng(s), 1.0, 1000.0).head(n)) for s, n in ((1, 0.5), (2, 0.3))
]
AXIS = AxisModel(
    1.7,
    effects=(
        effect("lugre", {"Fc": 0.31, "Fs": 0.33, "v0": 0.013, "sigma2": 1.9}),
        effect("cable_slab", {"offset": 0.2, "k1": -3.0}),
    ),
)


@pytest.mark.parametrize("name", ["cogging", "cable_slab", "encoder_delay", "encoder_quantization"])
def test_a_drawn_effect_has_the_force_that_was_asked(name):
    bare, noise = AxisModel(1.7), name == "encoder_quantization"
    for force, seed in ((0.03, 1), (0.11, 2)):
        rng = np.random.default_rng(seed)
        found = draw_effect(CATALOGUE[name], bare, LOGS, COVERED, force, rng)
        added = residual(bare.with_effect(found), LOGS) - residual(bare, LOGS)
        if noise:
            alone = AxisModel(1.7, effects=(found,))
            parts = [1.7 * w.fine.acceleration(reading_error(alone, w.motion)[1]) for w in LOGS]
            added = np.concatenate(parts)
        assert rms(added) == pytest.approx(force, rel=0.05 if noise else 1e-3)
        np.testing.assert_allclose(added_force(found, bare, LOGS, residual(bare, LOGS)), added)


def test_beside_a_fit_only_what_its_parameters_cannot_take_over_counts():
    fit = fit_of(AXIS, *LOGS)
    rng = np.random.default_rng(3)
    found = draw_effect(CATALOGUE["cogging"], AXIS, LOGS, COVERED, 0.2, rng)
    added = residual(AXIS.with_effect(found), LOGS) - residual(AXIS, LOGS)
    columns = fit.jacobian / np.linalg.norm(fit.jacobian, axis=0)
    left = added - columns @ np.linalg.lstsq(columns, added, rcond=1e-6)[0]
    assert rms(added) > rms(left)
    assert visible_force(found, fit, dataset_of(*LOGS)) == pytest.approx(rms(left), rel=2e-2)
    hidden = hidden_part(found, fit, dataset_of(*LOGS))
    assert hidden == pytest.approx(1.0 - rms(left) / rms(added), abs=0.02)
    tilt = effect("constant_force", {"F0": 0.7})
    assert hidden_part(tilt, fit, dataset_of(*LOGS)) == pytest.approx(1.0, abs=1e-3)
    assert hidden_part(effect("constant_force"), fit, dataset_of(*LOGS)) == 1.0


def test_strengths_are_scaled_in_their_direction_and_within_bounds():
    cable = CATALOGUE["cable_slab"]

    def all_of(fitted):
        return np.array(list(fitted.values.values()))

    def one(name, parameter, wanted, *more):
        size = lambda fitted: np.array([fitted.values[parameter]])  # noqa: E731
        return strength_for(CATALOGUE[name], size, wanted, *more).values

    np.testing.assert_allclose(all_of(strength_for(cable, all_of, 3.0)), 3.0, rtol=1e-6)
    signs = set()
    for seed in range(20):  # none is more than three times another
        drawn = all_of(strength_for(cable, all_of, 3.0, None, np.random.default_rng(seed)))
        assert rms(drawn) == pytest.approx(3.0, rel=1e-6)
        assert 1.0 / 3.0 < np.abs(drawn).min() / np.abs(drawn).max() < 0.99
        signs |= {*np.sign(drawn)}
    assert signs == {-1.0, 1.0}
    held = one("cogging", "a1", 0.4, {**CATALOGUE["cogging"].starts(), "p": 0.0371})
    assert (held["p"], held["a1"]) == (0.0371, pytest.approx(0.4))
    assert one("encoder_delay", "tau", 9.0)["tau"] == pytest.approx(6e-3)
    friction = one("stribeck", "Fc", 0.4, None, np.random.default_rng(1))
    assert friction["Fs"] >= friction["Fc"] == pytest.approx(0.4)


def test_another_machine_has_each_value_within_a_fifth_and_the_same_mass():
    where = [c for c in free_parameters(AXIS) if c.effect]
    truth = read(AXIS, where)
    ratios = []
    for seed in range(200):
        other = other_machine(AXIS, np.random.default_rng(seed))
        assert other.mass == AXIS.mass
        assert other["lugre"].values["Fs"] >= other["lugre"].values["Fc"]
        assert other["lugre"].values["n"] == AXIS["lugre"].values["n"]
        ratios.append(read(other, where)[truth != 0.0] / truth[truth != 0.0])
    free = np.array(ratios)[:, [c.parameter.name != "Fs" for c, v in zip(where, truth) if v]]  # noqa: B905
    assert free.min() == pytest.approx(1.0 - SPREAD, abs=0.01)
    assert free.max() == pytest.approx(1.0 + SPREAD, abs=0.01)
    assert np.corrcoef(free[:, 0], free[:, 1])[0, 1] < 0.3
    at_bound = AxisModel(1.7, effects=(effect("encoder_delay", {"tau": 5.9e-3}),))
    drawn = [other_machine(at_bound, np.random.default_rng(s)) for s in range(30)]
    assert max(axis["encoder_delay"].values["tau"] for axis in drawn) == 6e-3


RATE = 2000.0
T = np.arange(round(1.7 * RATE)) / RATE


@pytest.mark.parametrize("simulator", [ReducedSimulator, MujocoSimulator])
def test_an_axis_that_stands_still_is_seen_where_it_stands(simulator):
    """A friction that grows with the place of the other axis: of 0.3 N at 0.1 m and 10/m, 0.6."""
    brush = effect("dahl", {"Fc": 0.3, "sigma0": 4e3})
    axis = AxisModel(1.7, effects=(brush, effect("load_dependent_friction", {"offset": 10.0})))
    x, phase = 0.1 * np.sin(3.0 * T + 0.1), 3.0 * (T + 0.5 / RATE) + 0.1
    force = -0.9 * 1.7 * 10.0 * 0.1 * np.sin(phase) + 0.6 * np.sign(np.cos(phase))
    log = {"x": windowed(motion_of(log_of(RATE, x, force, np.full(len(T), 0.1)), "x", "log"))}
    model = MachineModel("s", {"x": axis, "y": AxisModel(2.0, effects=(effect("dahl"),))})
    run = free_run(model, log, simulator)
    blind = free_run(MachineModel("s", {"x": axis}), log, simulator)
    first = round(START_FIT * RATE) + np.arange(round(0.3 * RATE))
    assert np.abs(run.error["x"][first]).max() < 0.1 * np.abs(blind.error["x"][first]).max()


def states_of(axis, x, starts, command=None):
    """The table of two such axes, and their states at the starts along positions (n, 2) m."""
    table = MachineModel("s", {"x": axis, "y": axis}).table()
    given = 0.0 * x if command is None else command
    path = np.diff(x, axis=0) * RATE
    return table, states_along(table, x, path, given, 1.0 / RATE, starts, 0.0)


def test_states_at_a_restart_are_those_of_the_motion_before_it():
    """A lag is where its step response is; that of each axis in its own states."""
    x = np.stack([0.1 * T, -0.2 * T[::-1]], axis=1)
    command = np.stack([3.0 * (T >= 0.5), np.full(len(T), -5.0)], axis=1)
    axis = AxisModel(1.0, effects=(effect("actuator_lag", {"tau": 0.03}),))
    starts = np.array([800, 1100, 1700])
    table, states = states_of(axis, x, starts, command)
    own = states[:, table.entries[:, 3].astype(int)].T
    since = starts / RATE - 0.5
    wanted = np.where(since > 0.0, 3.0 * (1.0 - np.exp(-since / 0.03)), 0.0)
    np.testing.assert_allclose(own[0], wanted, atol=1e-9)
    np.testing.assert_allclose(own[1], -5.0)


def test_friction_before_a_restart_knows_the_place_and_the_other_axis():
    """A dragged Dahl brush has the force that its modifiers leave there, to a thousandth."""
    x = np.stack([0.1 * T, -0.05 + 0.2 * T], axis=1)
    brush = effect("dahl", {"Fc": 0.4, "sigma0": 4e3})
    place = effect("position_dependent_friction", {"c1": 0.3, "c2": 0.2})
    load = effect("load_dependent_friction", {"motor": 0.0, "corner": 1.7, "offset": 0.9})
    axis = AxisModel(1.0, effects=(brush, place, load))
    starts = np.array([900, 2100, 3000])
    table, states = states_of(axis, x, starts)
    alone = axis_table({"x": axis})
    first, last, begin, *_ = alone.axes[0]
    for a in (0, 1):
        label = ("xy"[a], "dahl")
        own = int(table.entries[table.labels.index(label), 3])
        steady = []
        for k in starts:
            at = np.stack([np.full(200, 0.5 * (x[k, i] + x[k - 1, i])) for i in (a, 1 - a)])
            motion = np.stack([at[0], np.full(200, (x[k, a] - x[k - 1, a]) * RATE), 0.0 * at[0]])
            other = np.stack([at[1], 0.0 * at[1], 0.0 * at[1]])
            rows = np.zeros((len(alone.entries), 200))
            walk(alone.entries, first, last, alone.parameters, np.zeros(alone.n_states), begin,
                 motion, other, 1.0 / RATE, 0, rows)  # fmt: skip
            steady.append(-rows.sum(axis=0)[-1])
        np.testing.assert_allclose(states[:, own], steady, rtol=5e-3)
        assert np.ptp(steady) > 0.02


# Effects that are a parameter by another name, explanations without data, signatures


@pytest.fixture(scope="module")
def dataset():
    return built_dataset("run")


def test_only_effects_without_a_shape_can_be_a_parameter_by_another_name(dataset):
    fit = finished(PLAIN, PLAIN, dataset.training, Outcome.CONVERGED)
    names = ("payload_mass", "axis_coupling", "cogging", "lugre", "coulomb_viscous")
    found = linear_bases(fit, Catalogue([CATALOGUE[n] for n in names]))
    assert {n: b.shape[1] for n, b in found.items()} == {"axis_coupling": 2, "payload_mass": 1}
    for basis in found.values():
        np.testing.assert_allclose(basis.T @ basis, np.eye(basis.shape[1]), atol=1e-9)


def test_an_effect_or_a_model_is_an_explanation(monkeypatch, dataset):
    own = axis_of(fitted("wear"), fitted("cogging", a1=0.7))
    stage = MachineModel("stage", {"x": own})
    other = MachineModel(
        "other", {"x": replace(axis_of(mass=6.0), hardware=replace(own.hardware, force_limit=7.0))}
    )
    monkeypatch.setattr(
        explanations, "_supposed", lambda effect, axis, dataset: (effect.name, axis.names)
    )
    rivals = [CATALOGUE["cogging"], CATALOGUE["constant_force"], other]
    first, second, third = explained(rivals, stage, dataset, False)
    assert first == Explanation("cogging", own)
    base = ("coulomb_viscous", "wear")
    assert second == Explanation("constant_force", ("constant_force", base))
    assert third == Explanation("other", replace(other.axes["x"], hardware=own.hardware))


def test_an_effect_without_data_is_ten_floors_strong(monkeypatch, dataset):
    found = explanations._supposed(CATALOGUE["constant_force"], PLAIN, dataset)
    floor = explanations.floor_of(PLAIN, dataset.training)
    added = residual(found, dataset.training) - residual(PLAIN, dataset.training)
    assert rms(added) == pytest.approx(10.0 * floor, rel=1e-6)


def test_models_differ_on_the_axis_where_they_do():
    a = MachineModel("a", {"x": PLAIN, "y": PLAIN})
    b = MachineModel("b", {"x": PLAIN, "y": replace(PLAIN, mass=6.0)})
    c = MachineModel("c", {"x": PLAIN, "y": axis_of(fitted("wear"))})
    assert differing_axis([a, b], a) == "y"
    assert differing_axis([a, c], a) == "y"
    assert differing_axis([a, replace(a, name="d")], a) == "x"
    assert differing_axis([CATALOGUE["wear"]], a) == "x"


def test_explanations_are_given_by_themselves_by_name_and_by_file(tmp_path):
    """Two models of one machine have one name, and were refused as the same."""
    a = MachineModel("a", {"x": PLAIN})
    heavier = MachineModel("a", {"x": replace(PLAIN, mass=6.0)})
    file = tmp_path / "b.toml"
    save_model(a, file)
    found = rivals_of([a, heavier, "wear", CATALOGUE["cogging"], str(file)], CATALOGUE)
    assert [r.name for r in found] == ["a (1)", "a (2)", "wear", "cogging", str(file)]
    for given in ([a, heavier, a], ["wear", CATALOGUE["wear"]]):
        with pytest.raises(InputError, match="is given twice; give two different explanations"):
            rivals_of(given, CATALOGUE)
    with pytest.raises(InputError, match="nothing"):
        rivals_of(["nothing"], CATALOGUE)


def test_a_signature_has_its_force_on_one_motion_and_a_friction_its_own(tmp_path):
    motion, force = signature(CATALOGUE["constant_force"], CATALOGUE)
    assert rms(force) == pytest.approx(FORCE, rel=1e-6)
    assert np.ptp(force) == pytest.approx(0.0, abs=1e-12)
    again = exemplary_motion()
    np.testing.assert_array_equal(motion.position, again.position)
    np.testing.assert_allclose(np.gradient(again.position, 1e-3), again.velocity)
    assert np.abs(again.position).max() == pytest.approx(0.15)
    rest = again.command - 10.0 * np.gradient(again.velocity, 1e-3)
    np.testing.assert_allclose(rest, 0.3 * np.sign(again.velocity), atol=1e-12)
    np.testing.assert_array_equal(again.raw, [again.velocity, again.command])
    np.testing.assert_allclose(np.gradient(again.others[0], 1e-3), again.others[1])
    np.testing.assert_allclose(np.gradient(again.others[1], 1e-3), again.others[2])
    peaks = [np.abs(again.velocity[a:b]).max() for a, b in ((0, 3000), (3000, 9000), (9000, 21000))]
    np.testing.assert_allclose(peaks, 0.15 * np.pi / np.array([1.5, 3.0, 6.0]), rtol=1e-2)
    with pytest.raises(InputError, match="end the name"):
        draw(CATALOGUE["constant_force"], motion, force, tmp_path / "f.txt")
    motion, force = signature(CATALOGUE["coulomb_viscous"], CATALOGUE)
    fast = np.abs(motion.velocity) > 0.01
    assert (np.sign(force[fast]) == -np.sign(motion.velocity[fast])).all()
    _, modified = signature(CATALOGUE["asymmetric_friction"], CATALOGUE)
    assert rms(modified) == pytest.approx(FORCE, rel=1e-6)  # of a friction that it modifies


def test_the_picture_of_an_effect_is_over_time_position_and_speed(monkeypatch, tmp_path):
    import matplotlib.pyplot as plt

    shown = []
    monkeypatch.setattr(plt, "close", shown.append)
    motion, force = signature(CATALOGUE["constant_force"], CATALOGUE)
    draw(CATALOGUE["constant_force"], motion, force, tmp_path / "f.svg")
    (figure,) = shown
    across = {
        "Time (s)": motion.time, "Position (mm)": 1e3 * motion.position,
        "Speed (mm/s)": 1e3 * motion.velocity,
    }  # fmt: skip
    assert [a.get_xlabel() for a in figure.axes] == list(across)
    assert len({round(a.get_position().y0, 3) for a in figure.axes}) == 1  # side by side
    for axes, values in zip(figure.axes, across.values(), strict=True):
        x, y = axes.get_lines()[0].get_data()
        np.testing.assert_allclose(x, values)
        np.testing.assert_allclose(y, force)
    assert figure.axes[0].get_ylabel() == "Added force (N)"
    assert "<svg" in (tmp_path / "f.svg").read_text(encoding="utf-8")
