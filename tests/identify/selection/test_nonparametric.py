"""What no physical effect explains: described by a map or a learned model, where held-out logs ask.

The forces planted here are in no catalogue; the descriptions are found by their marker.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from machines import one_axis
from unexplained_effects import foreign

from identify.dataset.prepared_log import on_blocks, total_force
from identify.estimation.fit import fit_axis
from identify.estimation.variable_projection import absent_effects
from identify.results.results import Addition, FitResult
from identify.selection.nonparametric import fit_nonparametric
from identify.workflow import add, fit
from twin.effect import Effect
from twin.effects import load_catalogue
from twin.experiments.named import simulate
from twin.laws.trials import Motion, forces
from twin.logs import Log
from twin.model.file import load_model, save_model
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.simulator import MujocoSimulator, ReducedSimulator

CATALOGUE = load_catalogue()
RATE = 2500.0  # Hz: quicker than 10 kHz, and enough for curves over the travel
STAGE = replace(one_axis(load_model("proton_xy", CATALOGUE)), sample_rate=RATE)
QUICK = replace(STAGE, sample_rate=1000.0)
MAP, LEARNED = "empirical_map", "learned_residual"
SLOW = pytest.mark.slow
DESCRIPTIONS = pytest.mark.parametrize("name", [MAP, LEARNED])
Logs = dict[str, Log]
SHORT = 6.0  # s of a log that is enough for most
CHIRP = 0.05  # N, its height


def with_x(effect: Effect, **values: float) -> MachineModel:
    fitted = Fitted.at_start(effect, values)
    return STAGE.with_axis("x", STAGE.axes["x"].with_effect(fitted))


def recorded(machine: MachineModel, seeds: tuple[int, ...], duration: float = 20.0) -> Logs:
    return {
        f"log {s}": simulate(
            machine, "tracking", seed=s, duration=duration, simulator=ReducedSimulator
        )
        for s in seeds
    }


def test_descriptions_are_marked_and_never_a_diagnosis() -> None:
    marked = {name for name, effect in CATALOGUE.items() if effect.is_nonparametric}
    assert marked == {MAP, LEARNED, "free_curve"}
    offered = {e.name for e in absent_effects(STAGE.axes["x"], CATALOGUE)}
    assert not marked & offered
    for name in marked:
        assert "not a physical law" in CATALOGUE[name].summary


@pytest.fixture(scope="module")
def chirp(tmp_path_factory: pytest.TempPathFactory) -> Effect:
    return foreign("chirp", tmp_path_factory.mktemp("chirp"))


@pytest.fixture(scope="module")
def chirping(chirp: Effect) -> tuple[Logs, Logs]:
    """Two logs of a machine with the chirp, and one held out."""
    machine = replace(with_x(chirp, a=CHIRP), sample_rate=QUICK.sample_rate)
    return recorded(machine, (1, 2), SHORT), recorded(machine, (3,), SHORT)


@pytest.fixture(scope="module")
def mapped(chirping: tuple[Logs, Logs]) -> Addition:
    """The stage with a map added for the chirp."""
    return add(CATALOGUE[MAP], QUICK, *chirping)


@cache
def honest(seed: int) -> FitResult:
    """The stage's fit to logs of a machine that lacks nothing."""
    return fit(STAGE, recorded(STAGE, (seed, seed + 1), SHORT), recorded(STAGE, (seed + 2,), SHORT))


@pytest.mark.parametrize(
    ("force", "height", "name", "fall"),
    [
        ("chirp", CHIRP, MAP, 15.0),  # of an error that the physics before it has fitted to its end
        ("hill", 0.1, MAP, 15.0),
        ("sawtooth", 0.05, MAP, 3.5),
        ("bend", 0.05, LEARNED, 4.0),
    ],
)
@SLOW
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
    assert "not a physical law" in added.notes[0]
    assert added.position_error[1] < added.position_error[0]
    assert added.replayed == pytest.approx(added.position_error[1], rel=0.02)


def test_adding_a_map_lowers_the_errors_of_force_and_position(mapped: Addition) -> None:
    assert mapped.kept
    assert mapped.candidate.gain.t > 3.0
    assert mapped.step.holdout_error_before is not None
    assert mapped.step.holdout_error_after is not None
    # All but what lies at the ends of the travel, which the short logs hardly reach.
    assert mapped.step.holdout_error_after * 5.0 < mapped.step.holdout_error_before
    assert "not a physical law" in mapped.notes[0]
    assert mapped.position_error[1] < mapped.position_error[0]
    assert mapped.replayed == pytest.approx(mapped.position_error[1], rel=0.02)


def test_the_shape_is_recovered_and_the_physics_keeps_its_values(
    chirp: Effect, mapped: Addition
) -> None:
    found, motion = mapped.candidate.fit.axis, mapped.candidate.fit.logs[0].motion
    machine = with_x(chirp, a=CHIRP)
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
    before = honest(seed)
    found = fit_nonparametric(before.fits["x"], before.datasets["x"], CATALOGUE[name])
    assert not found.supported
    assert found.gain.after < 1.01 * found.gain.before


@cache
def noisy(judged: str) -> FitResult:
    """A fit to noise ten times as loud as encoder and amplifier have, with or without a holdout."""
    rng = np.random.default_rng(7)
    logs = recorded(STAGE, (1, 2, 3), SHORT)
    for log in logs.values():
        log.axes["x"].columns["force"] = log.axes["x"].force + rng.normal(0.0, 0.3, len(log))
    held = {"log 3": logs.pop("log 3")}
    return fit(STAGE, logs, held if judged == "by held-out logs" else {})


@pytest.mark.parametrize(
    ("name", "judged"),
    [
        pytest.param(MAP, "by held-out logs", marks=SLOW),
        pytest.param(LEARNED, "by left-out blocks", marks=SLOW),
        pytest.param(MAP, "by left-out blocks", marks=SLOW),
        pytest.param(LEARNED, "by held-out logs", marks=SLOW),
    ],
)
def test_pure_noise_is_not_described(name: str, judged: str) -> None:
    before = noisy(judged)
    found = fit_nonparametric(before.fits["x"], before.datasets["x"], CATALOGUE[name])
    assert not found.supported


@pytest.mark.parametrize("name", [MAP, pytest.param(LEARNED, marks=SLOW)])
def test_a_refit_smooths_as_was_chosen(
    name: str, chirping: tuple[Logs, Logs], mapped: Addition
) -> None:
    added = mapped if name == MAP else add(CATALOGUE[name], QUICK, *chirping)
    first = added.candidate.fit
    again = fit_axis(first.axis, first.logs)
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
        simulate(read, "moves", seed=1, duration=1.0, simulator=stage).truth["x"]
        for stage in (MujocoSimulator, ReducedSimulator)
    )
    np.testing.assert_allclose(found[name], reduced[name], rtol=0, atol=1e-6)
    assert np.abs(found[name]).max() > 0.01


def test_the_map_has_any_number_of_intervals(tmp_path: Path) -> None:
    model = with_x(CATALOGUE[MAP], elements=3, x_4=0.5)
    save_model(model, tmp_path / "stage.toml")
    values = load_model(tmp_path / "stage.toml", CATALOGUE).axes["x"][MAP].values
    assert values["elements"] == 3
    assert "x_5" not in values


@SLOW
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
