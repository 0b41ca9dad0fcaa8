"""Every view of a log is of one prepared dataset; what is left out of it; its windows.

Each test is of a fault that was mended."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cli_runs import refusal
from constructed import effect, log_of
from machines import CATALOGUE, PROTON, one_axis, tracked

from identify.analysis.first_model import first_model
from identify.dataset.dataset import by_log
from identify.dataset.preparation import datasets
from identify.estimation.alignment import aligned
from identify.output.as_json import json_of
from identify.validation.comparison import AxisComparison
from identify.validation.free_run import HORIZON, free_run, rms_error
from identify.workflow import compare, diagnose, fit
from twin.checks import Fault, check_log, moves
from twin.effects import Catalogue
from twin.errors import InputError
from twin.logs import AxisLog, Log, write_log
from twin.model.file import save_model
from twin.model.machine import AxisModel, MachineModel
from twin.simulation.simulators import MujocoSimulator, ReducedSimulator

RATE = 2000.0  # Hz
T = np.arange(4000) / RATE
TWO = replace(PROTON, sample_rate=RATE)
STAGE = one_axis(TWO)
BOTH = [ReducedSimulator, MujocoSimulator]


def with_effect(model: MachineModel, name: str, **values: float) -> MachineModel:
    return model.with_axis("x", model.axes["x"].with_effect(effect(name, values)))


def logged(model: MachineModel, seed: int = 1, seconds: float = 4.0, run: str = "tracking") -> Log:
    return tracked(model, seed, seconds, run)


def changed(log: Log, **columns) -> Log:
    x = log.axes["x"]
    new = {name: make(x.columns.get(name)) for name, make in columns.items()}
    return replace(log, axes={**log.axes, "x": replace(x, columns={**x.columns, **new})})


def compared(model: MachineModel, log: Log) -> AxisComparison:
    return compare(model, {"log": log}).axes["x"]


def drifts(model: MachineModel, log: Log, simulator=ReducedSimulator) -> float:
    """Free-running position error of x on a log as the model sees it, m RMS."""
    found = datasets(model, {"log": log}, {})
    seen = {a: aligned(model.axes[a], d) for a, d in found.items()}
    return rms_error(free_run(model, by_log(seen)["log"], simulator), "x")


def test_a_force_one_sample_early_is_the_same_to_fit_compare_and_diagnose():
    early = changed(logged(STAGE, seconds=5.0), force=lambda f: np.roll(f, 1))
    fitted = fit(STAGE, {"log": early})
    assert fitted.fits["x"].ratio < 1.15
    assert fitted.datasets["x"].channel_delay == pytest.approx(1.0 / RATE, rel=0.01)
    found = compared(fitted.model, early)
    assert found.ratio == pytest.approx(fitted.fits["x"].ratio, rel=0.1)
    assert found.position_error["log"] < 3.0 * found.position_drift_of_noise["log"]
    told = diagnose(STAGE, {"log": early}, catalogue=Catalogue([])).comparison.axes["x"]
    assert told.ratio == pytest.approx(fitted.fits["x"].ratio, rel=1e-6)
    assert told.position_error["log"] == pytest.approx(found.position_error["log"], rel=0.1)


@pytest.mark.parametrize("other", [(2000, 6000), (5000, 8000)])
def test_a_log_that_holds_a_stretch_of_a_fitted_one_is_refused(other):
    log = logged(STAGE)
    with pytest.raises(
        InputError, match=r"^b is (in 67 % )?a copy of a \(its .* s\): as a selection log it"
    ):
        datasets(STAGE, {"a": log.part(0, 7000)}, {"b": log.part(*other)})
    datasets(STAGE, {"a": log.part(0, 4000)}, {"b": log.part(4000, 8000)})


@pytest.mark.parametrize("simulator", BOTH)
def test_a_free_run_knows_the_phase_at_which_a_log_began(simulator):
    """Half a period later the force is the opposite one; of a friction without memory."""
    axis = replace(STAGE.axes["x"], effects=(effect("quadratic_drag", {"c": 0.5}),))
    pumped = with_effect(STAGE.with_axis("x", axis), "periodic_disturbance", f=12.5, a=0.3, b=0.1)
    log = logged(pumped)
    later = log.part(round(0.5 / 12.5 * RATE), len(log))
    error = drifts(pumped, later, simulator)
    assert error < 2.0 * drifts(pumped, log, simulator)
    off = by_log(datasets(pumped, {"log": later}, {}))["log"]
    assert rms_error(free_run(pumped, off, simulator), "x") > 10.0 * error


@pytest.mark.parametrize(
    ("simulator", "name", "values"),
    [
        (ReducedSimulator, "load_dependent_friction", {"corner": 2.0}),
        (MujocoSimulator, "axis_coupling", {"mass": 3.0}),
    ],
)
def test_a_restart_knows_the_other_axis_acceleration(simulator, name, values):
    """The first sample after a restart has the other axis' force, so no error jumps there."""
    found, bare = (
        free_run(m, by_log(datasets(m, {"log": logged(m)}, {}))["log"], simulator).error["x"]
        for m in (with_effect(TWO, name, **values), TWO)
    )
    starts = 10 + np.arange(1, 7) * round(HORIZON * RATE)
    jumps, usual = (np.abs(e[starts + 20]).max() for e in (found, bare))
    assert jumps < 3.0 * usual + 2e-8
    assert np.sqrt(np.nanmean(found**2)) < 3.0 * np.sqrt(np.nanmean(bare**2))


def test_the_position_error_of_the_true_model_is_what_noise_makes_of_it():
    lacking = STAGE.with_axis("x", STAGE.axes["x"].without("roller_spikes"))
    for seed in (2, 3):
        log = logged(STAGE, seed)
        true, wrong = (
            c.position_error["log"] / c.position_drift_of_noise["log"]
            for c in (compared(STAGE, log), compared(lacking, log))
        )
        assert 0.3 < true < 3.0
        assert wrong > 3.0 * true


def test_no_region_of_the_true_model_is_bad():
    told = [r for seed in range(4) for r in compared(STAGE, logged(STAGE, 10 + seed, 3.0)).worst]
    assert told == []


def halting(period: float = 0.05, stop: float = 0.01, n: int = 6000) -> np.ndarray:
    """Positions (n,) m that rest for a while in every period, s."""
    t = np.arange(n) / RATE
    speed = np.where(np.mod(t, period) < stop, 0.0, 0.05 * np.sign(np.sin(3.0 * t)))
    return np.cumsum(speed) / RATE


PLAIN = MachineModel(
    "plain",
    {"x": AxisModel(1.7, effects=(effect("coulomb_viscous", {"Fc": 0.3, "Fs": 0.3}),))},
    sample_rate=RATE,
)


def one_line(command, *arguments, **options) -> str:
    with pytest.raises(InputError) as error:
        command(*arguments, **options)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_an_axis_that_rests_in_every_window_is_refused_in_one_line(tmp_path):
    log = log_of(RATE, halting(), halting())
    for command in (fit, compare):
        told = one_line(command, PLAIN, {"log": log}, test_function=0.1)
        assert told.startswith("log: axis x comes to rest within every test function of 0.1 s")
        assert (
            "give a log in which it moves for longer at a time, or shorter test functions" in told
        )
    save_model(PLAIN, tmp_path / "model.toml")
    write_log(log, tmp_path / "log.mcap")
    refusal("fit", "model.toml", "log.mcap", "--test-function", "0.1", folder=tmp_path)
    short = fit(PLAIN, {"log": log}, test_function=0.02).fits["x"]
    assert np.isfinite(short.error)


def test_a_log_without_samples_is_refused_in_one_line_in_any_role():
    run = logged(STAGE, seconds=2.0)
    none = {"none": run.part(0, 0)}
    for given in ({"logs": none, "holdout": {}}, {"logs": {"run": run}, "holdout": none},
                  {"logs": {"run": run}, "holdout": {}, "test": none}):  # fmt: skip
        assert one_line(datasets, STAGE, **given).startswith(
            "none: has no samples; identification needs 0.5 s in which an axis moves"
        )
    assert one_line(first_model, none, "new", CATALOGUE).startswith("none: has no samples")


def test_what_is_not_a_number_is_refused_in_one_line():
    run = logged(STAGE, seconds=2.0)
    run = changed(run, velocity=lambda _: np.gradient(run.axes["x"].position))
    for signal in ("position", "force", "velocity", "setpoint_position"):
        holed = changed(run, **{signal: lambda v: np.where(np.arange(len(v)) == 700, np.nan, v)})
        told = one_line(fit, STAGE, {"log": holed})
        assert told.startswith(f"log: {signal} of axis x is not a finite number in 1 of 4000")
        assert "from 0.35 s; cut the log there" in told
    told = one_line(fit, STAGE, {"log": changed(run, position=lambda v: 1e120 * v)})
    assert "position of axis x reaches" in told
    assert "did a simulation diverge?" in told
    beside = AxisLog({"position": np.append(T[1:], np.nan), "force": T})
    both = replace(run, axes={**run.axes, "z": beside})
    told = one_line(fit, STAGE, {"log": both})  # whose motion x may depend on
    assert told.startswith("log: position of axis z is not a finite number in 1 of 4000")
    assert datasets(TWO, {"log": both}, {})  # that has two axes, no z
    wild = with_effect(STAGE, "quadratic_drag", c=1e6)
    law = wild.axes["x"]["quadratic_drag"]
    endless = replace(law, values={**law.values, "c": np.inf})
    told = one_line(fit, STAGE.with_axis("x", STAGE.axes["x"].with_effect(endless)), {"log": run})
    assert told.startswith("axis x: the force of the model is not a finite number in")


def still(kind: str) -> np.ndarray:
    rng, n = np.random.default_rng(3), 8000
    if kind == "between two steps":
        return 1e-6 * np.round(0.5 + rng.normal(0.0, 0.3, n))
    return 1e-6 * (np.arange(n) % 1000 < 500)  # a step of the encoder to and fro


@pytest.mark.parametrize("kind", ["between two steps", "slowly to and fro"])
def test_standstill_is_the_same_to_check_and_fit_and_told(kind):
    moving = logged(STAGE, seconds=3.0)
    log = log_of(RATE, still(kind), np.random.default_rng(4).normal(0.0, 0.1, 8000))
    assert not moves(log, "x")
    found = [f for f in check_log(log).findings if f.fault is Fault.WEAK_EXCITATION]
    assert [f.axis for f in found] == ["x"]
    assert not [f for f in check_log(moving).findings if f.fault is Fault.WEAK_EXCITATION]
    model = MachineModel("s", {**PLAIN.axes, "y": AxisModel(1.0)}, RATE)
    result = fit(model, {"run": moving, "rest": log}, {"held": log})
    assert list(result.left_out["x"]) == ["rest", "held"]
    for name in ("rest", "held"):
        assert f"{name} is left out: axis x stands still in it; give" in str(result)
    assert "axis y: not fitted, as no log says anything of it" in str(result)
    told = json_of(result)
    assert told["axes"]["x"]["left_out"] == ["rest", "held"]
    assert told["not_fitted"] == ["y"]
    with pytest.raises(InputError, match=r"says anything of axis x, y; rest: axis x stands"):
        fit(model, {"rest": log})


def test_logs_too_short_for_a_motion_or_a_test_function_are_told_by_their_length():
    short = {"a": logged(STAGE, seconds=0.2)}
    with pytest.raises(InputError, match=r"a: it lasts 0\.2 s, and identification needs 0.5 s"):
        datasets(PLAIN, short, {})
    other = MachineModel("s", {"z": PLAIN.axes["x"]}, RATE)
    with pytest.raises(InputError, match=r"\(z\) is in the logs, which have x; name the axes"):
        datasets(other, short, {})
    for length in (0.0, float("nan"), 4.0):
        with pytest.raises(InputError, match="s: give a length above 0 s and below that of the"):
            datasets(PLAIN, {"a": logged(STAGE, seconds=4.0)}, {}, length)


def test_the_beginnings_of_long_logs_are_their_own_beginnings():
    """Also where 30 s are no whole number of samples, and a beginning is a little longer."""
    t = np.arange(27_000) / 610.36
    log = log_of(610.36, np.sin(3.0 * t) + 0.3 * np.sin(11.0 * t), -9.0 * np.sin(3.0 * t))
    whole = datasets(PLAIN, {"l": log}, {})["x"]
    assert len(whole.part.training[0]) < len(whole.training[0])
    assert whole.part.part is whole.part
