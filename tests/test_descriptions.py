"""What no physical effect explains: described by a map or a learned model, where held-out logs ask.

The forces planted here are in no catalogue; the descriptions are found by their marker.
"""

from pathlib import Path

import numpy as np
import pytest
from effect_runs import Motion, forces
from machines import one_axis
from unexplained_effects import foreign

from identify.candidates import absent_effects
from identify.describe import describe
from identify.fit import fit_axis
from identify.residual import on_blocks, total_force
from identify.workflow import add, fit
from twin.effect import Effect
from twin.effects import load_catalogue
from twin.experiments import simulate
from twin.log import Log
from twin.model import AxisModel, Fitted, StageModel
from twin.model_file import load_model, save_model
from twin.simulator import MujocoStage, ReducedStage

CATALOGUE = load_catalogue()
STAGE = one_axis(load_model("proton_xy", CATALOGUE))
MAP, LEARNED = "empirical_map", "learned_residual"
SLOW = pytest.mark.slow
DESCRIPTIONS = pytest.mark.parametrize("name", [MAP, LEARNED])
Logs = dict[str, Log]
SHORT = 8.0  # s of a log that is enough for most


def with_x(effect: Effect, **values: float) -> StageModel:
    fitted = Fitted.at_start(effect, values)
    return STAGE.with_axis("x", STAGE.axes["x"].with_effect(fitted))


def recorded(machine: StageModel, seeds: tuple[int, ...], duration: float = 20.0) -> Logs:
    return {
        f"log {s}": simulate(machine, "tracking", seed=s, duration=duration, stage=ReducedStage)
        for s in seeds
    }


def test_descriptions_are_marked_and_never_a_diagnosis() -> None:
    marked = {name for name, effect in CATALOGUE.items() if effect.is_description}
    assert marked == {MAP, LEARNED}
    offered = {e.name for e in absent_effects(STAGE.axes["x"], CATALOGUE)}
    assert not marked & offered
    for name in marked:
        assert "not physics" in CATALOGUE[name].summary


@pytest.mark.parametrize(
    ("force", "height", "name", "fall"),
    [("chirp", 0.05, MAP, 20.0), pytest.param("hill", 0.1, MAP, 20.0, marks=SLOW),
     pytest.param("sawtooth", 0.05, MAP, 3.5, marks=SLOW),
     pytest.param("bend", 0.05, LEARNED, 4.0, marks=SLOW)],
)  # fmt: skip
def test_a_force_of_no_known_effect_is_described(
    force: str, height: float, name: str, fall: float, tmp_path: Path
) -> None:
    machine = with_x(foreign(force, tmp_path), a=height)
    added = add(CATALOGUE[name], STAGE, recorded(machine, (1, 2)), recorded(machine, (3,)))
    assert added.kept
    assert added.candidate.gain.t > 3.0
    assert added.step.holdout_error_before is not None
    assert added.step.holdout_error_after is not None
    assert added.step.holdout_error_after * fall < added.step.holdout_error_before
    assert "not physics" in added.notes[0]
    assert added.position_error[1] < added.position_error[0]
    assert added.replayed == pytest.approx(added.position_error[1], rel=0.02)


def test_the_shape_is_recovered_and_the_physics_keeps_its_values(tmp_path: Path) -> None:
    chirp = foreign("chirp", tmp_path)
    machine = with_x(chirp, a=0.05)
    before = fit(STAGE, recorded(machine, (1, 2)), recorded(machine, (3,)))
    base, study = before.fits["x"], before.studies["x"]
    found = describe(base, study, CATALOGUE[MAP]).fit.axis
    motion = study.fit[0].motion
    shape, true = (
        total_force(on_blocks(AxisModel(1.0, effects=(part,))), motion)
        for part in (found[MAP], machine.axes["x"][chirp.name])
    )
    # A constant and the slow part of the curve are the cable's, which the model has already.
    smooth = np.polynomial.Polynomial.fit(motion.position, shape - true, 3)
    left = shape - true - smooth(motion.position)
    assert np.sqrt(np.mean(left**2)) < 0.06 * np.sqrt(np.mean(true**2))
    assert found.mass == pytest.approx(STAGE.axes["x"].mass, rel=1e-3)
    assert found["lugre"].values["Fc"] == pytest.approx(0.285, rel=0.03)


@DESCRIPTIONS
@pytest.mark.parametrize("seed", [11, pytest.param(21, marks=SLOW)])
def test_nothing_is_kept_on_an_honest_machine(name: str, seed: int) -> None:
    logs, held = recorded(STAGE, (seed, seed + 1)), recorded(STAGE, (seed + 2,))
    before = fit(STAGE, logs, held)
    found = describe(before.fits["x"], before.studies["x"], CATALOGUE[name])
    assert not found.supported
    assert found.gain.after < 1.01 * found.gain.before


@DESCRIPTIONS
def test_pure_noise_is_not_described(name: str) -> None:
    """Noise ten times as loud as the encoder and amplifier have."""
    rng = np.random.default_rng(7)
    logs = recorded(STAGE, (1, 2, 3), SHORT)
    for log in logs.values():
        log.axes["x"].columns["force"] = log.axes["x"].force + rng.normal(0.0, 0.3, len(log))
    held = {"log 3": logs.pop("log 3")}
    for judged in (held, {}):  # by held-out logs, or by left-out blocks
        before = fit(STAGE, logs, judged)
        found = describe(before.fits["x"], before.studies["x"], CATALOGUE[name])
        assert not found.supported


@DESCRIPTIONS
def test_a_refit_smooths_as_was_chosen(name: str, tmp_path: Path) -> None:
    machine = with_x(foreign("chirp", tmp_path), a=0.05)
    before = fit(STAGE, recorded(machine, (1,), SHORT), {})
    study = before.studies["x"]
    first = describe(before.fits["x"], study, CATALOGUE[name]).fit
    again = fit_axis(first.axis, study.fit)
    assert again.error == pytest.approx(first.error, rel=0.05)


@DESCRIPTIONS
def test_it_is_saved_read_and_simulated_alike(name: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    effect = CATALOGUE[name]
    values = {p.name: float(rng.normal(0.0, 0.02)) for p in effect.strengths}
    model = with_x(effect, **values)
    save_model(model, tmp_path / "stage.toml")
    read = load_model(tmp_path / "stage.toml", CATALOGUE)
    assert dict(read.axes["x"][name].values) == dict(model.axes["x"][name].values)
    found, reduced = (
        simulate(read, "moves", seed=1, duration=1.0, stage=stage).truth["x"]
        for stage in (MujocoStage, ReducedStage)
    )
    np.testing.assert_allclose(found[name], reduced[name], rtol=0, atol=1e-6)
    assert np.abs(found[name]).max() > 0.01


def test_the_map_has_any_number_of_intervals(tmp_path: Path) -> None:
    model = with_x(CATALOGUE[MAP], elements=3, x_4=0.5)
    save_model(model, tmp_path / "stage.toml")
    values = load_model(tmp_path / "stage.toml", CATALOGUE).axes["x"][MAP].values
    assert values["elements"] == 3
    assert "x_5" not in values


def test_a_physical_effect_takes_the_place_of_a_description(tmp_path: Path) -> None:
    machine = with_x(CATALOGUE["cogging"], a1=0.05, p=0.03)
    logs = recorded(machine, (1,), SHORT)
    described = add(CATALOGUE[MAP], STAGE, logs).model
    better = add(CATALOGUE["cogging"], described, logs)
    assert better.kept
    assert MAP not in better.model.axes["x"].names
    assert any(MAP in note for note in better.notes)


@DESCRIPTIONS
def test_beyond_the_covered_travel_it_says_nothing(name: str) -> None:
    effect = CATALOGUE[name]
    part = effect.parts[0].strengths  # by position; the learned model's first is its constant
    constant = part if name == MAP else part[:1]
    fitted = Fitted.at_start(effect, dict.fromkeys(constant, 0.1))
    x = np.array([0.15 - 1e-9, 0.15 + 0.3 * 0.5 / 41, 0.17, -0.17])
    found = forces([fitted], Motion(1e-3, x, np.full(4, 0.1), np.zeros(4)))[name]
    assert found[0] == pytest.approx(0.1)
    assert 0.0 < found[1] / found[0] < 1.0
    assert not found[2:].any()
