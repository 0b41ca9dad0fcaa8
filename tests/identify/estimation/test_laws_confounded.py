"""Effects that are a parameter by another name, explanations without data, signatures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import CATALOGUE, PLAIN, axis_of, built_dataset, fitted

from identify.estimation.confounded import linear_bases
from identify.estimation.evidence import rms
from identify.estimation.fit import Outcome, finished
from identify.estimation.force_balance import residual
from identify.experiment_design import rival_hypotheses as explanations
from identify.experiment_design.discrimination import Explanation
from identify.experiment_design.planting import FORCE, exemplary_motion, signature
from identify.experiment_design.rival_hypotheses import differing_axis, explained, require_different
from identify.output.machine import draw
from twin.effects import Catalogue
from twin.errors import InputError
from twin.model.machine import MachineModel


@pytest.fixture(scope="module")
def dataset():
    return built_dataset("run")


def test_only_effects_without_a_shape_can_be_a_parameter_by_another_name(dataset):
    fit = finished(PLAIN, PLAIN, dataset.fit, Outcome.CONVERGED)
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
    floor = explanations.floor_of(PLAIN, dataset.fit)
    added = residual(found, dataset.fit) - residual(PLAIN, dataset.fit)
    assert rms(added) == pytest.approx(10.0 * floor, rel=1e-6)


def test_models_differ_on_the_axis_where_they_do():
    a = MachineModel("a", {"x": PLAIN, "y": PLAIN})
    b = MachineModel("b", {"x": PLAIN, "y": replace(PLAIN, mass=6.0)})
    c = MachineModel("c", {"x": PLAIN, "y": axis_of(fitted("wear"))})
    assert differing_axis([a, b], a) == "y"
    assert differing_axis([a, c], a) == "y"
    assert differing_axis([a, replace(a, name="d")], a) == "x"
    assert differing_axis([CATALOGUE["wear"]], a) == "x"
    require_different([a, b, CATALOGUE["wear"]])
    with pytest.raises(InputError, match="a is given twice"):
        require_different([a, b, a])


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
