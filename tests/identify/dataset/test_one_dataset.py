"""Every view of a log is of one prepared dataset; what is left out of it; its windows.

Each test is of a fault that was mended."""

from __future__ import annotations

import json
import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from built_fits import axis_of, fitted
from check_drive import BIAS, COULOMB, DAMPING, MASS, drive
from check_drive import MASS as DRIVEN
from cli_runs import refusal, twin
from constructed import effect, log_of, waves
from machines import CATALOGUE, PROTON, one_axis, tracked

from identify.analysis.first_model import first_model
from identify.dataset.dataset import Dataset, by_log
from identify.dataset.motion import motion_of
from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import moving
from identify.dataset.test_function import LEAST_BLOCKS
from identify.dataset.time_scale import FOREIGN, HELD, AtLength, beginnings
from identify.estimation.alignment import aligned, realigned
from identify.estimation.errors import error_on
from identify.estimation.evidence import rms
from identify.estimation.fit import fit_axis
from identify.output.as_json import json_of
from identify.output.text import fit_text
from identify.output.words.fit import prepared_in_words
from identify.results.results import FitResult
from identify.validation.comparison import AxisComparison
from identify.validation.free_run import HORIZON, free_run, rms_error
from identify.workflow import compare, diagnose, fit
from twin.checks import Fault, check_log, moves
from twin.effects import Catalogue
from twin.errors import InputError
from twin.logs import AxisLog, Log, write_log
from twin.model.file import save_model
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
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


@pytest.mark.slow
def test_a_force_one_sample_early_is_the_same_to_fit_compare_and_diagnose():
    early = changed(logged(STAGE, seconds=5.0), force=lambda f: np.roll(f, 1))
    fitted = fit(STAGE, {"log": early})
    assert fitted.fits["x"].ratio < 1.15
    assert fitted.datasets["x"].channel_delay == pytest.approx(1.0 / RATE, rel=0.01)
    found = compared(fitted.model, early)
    assert found.ratio == pytest.approx(fitted.fits["x"].ratio, rel=0.1)
    assert found.position_error["log"] < 3.0 * found.position_floor["log"]
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


@pytest.mark.slow
def test_the_position_error_of_the_true_model_is_what_noise_makes_of_it():
    lacking = STAGE.with_axis("x", STAGE.axes["x"].without("roller_spikes"))
    for seed in (2, 3):
        log = logged(STAGE, seed)
        true, wrong = (
            c.position_error["log"] / c.position_floor["log"]
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
        assert f"{name} is left out: axis x stands still in it; give" in fit_text(result)
    assert "axis y: not fitted, as no log says anything of it" in fit_text(result)
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


@pytest.mark.slow
def test_the_beginnings_of_long_logs_are_their_own_beginnings():
    """Also where 30 s are no whole number of samples, and a beginning is a little longer."""
    t = np.arange(27_000) / 610.36
    log = log_of(610.36, np.sin(3.0 * t) + 0.3 * np.sin(11.0 * t), -9.0 * np.sin(3.0 * t))
    whole = datasets(PLAIN, {"l": log}, {})["x"]
    assert len(whole.part.training[0]) < len(whole.training[0])
    assert whole.part.part is whole.part


# What is left out of logs: one that says nothing, and what lies where no training log has been


FRICTION = Fitted.at_start(CATALOGUE["coulomb_viscous"], {"Fc": COULOMB, "sigma2": DAMPING})
OFFSET = Fitted.at_start(CATALOGUE["constant_force"])
MODEL = MachineModel("m", {"x": AxisModel(MASS, Hardware(), (FRICTION, OFFSET))}, 1000.0)
LENGTH = 0.1  # s, of the test functions
HOP = 0.06  # s, of which it rests the last 24 ms


def hopping() -> Log:
    t = np.arange(4000) / 1000.0
    hop, within = np.divmod(t / HOP + 1e-9, 1.0)
    way = np.clip(within / 0.6, 0.0, 1.0)
    x = 4e-3 * np.abs((hop % 2) - way**3 * (10.0 - 15.0 * way + 6.0 * way**2))
    force = MASS * np.gradient(np.gradient(x, t), t)
    return Log(1000.0, {"x": AxisLog({"position": x, "force": force})})


def silent_still() -> Log:
    return drive(change=lambda c: c.update(position=np.zeros_like(c["position"])))


def elsewhere(part: float) -> Log:
    """A run of its own, as its noise tells."""

    def change(columns: dict) -> None:
        noise = np.random.default_rng(round(1e6 * part)).standard_normal((2, len(columns["force"])))
        columns["position"] = columns["position"] + part + 1e-7 * noise[0]
        columns["force"] = columns["force"] + 1e-3 * noise[1]

    return drive(change=change)


MOVING = {"run": drive()}
SILENT = {"hops": hopping(), "still": silent_still()}
REASONS = {
    "hops": "hops is left out: axis x comes to rest within every test function of 0.1 s",
    "still": "still is left out: axis x stands still in it; give one in which it moves",
}


@pytest.fixture(scope="module")
def without() -> FitResult:
    return fit(MODEL, MOVING, test_function=LENGTH)


@pytest.mark.parametrize(
    ("name", "role"), [("hops", "logs"), ("still", "logs"), ("hops", "holdout"), ("still", "test")]
)
def test_a_fit_is_as_without_it_and_says_so(caplog, without, name: str, role: str) -> None:
    given: dict[str, dict[str, Log]] = {"logs": MOVING, "holdout": {}, "test": {}}
    given[role] = {**given[role], name: SILENT[name]}
    with caplog.at_level(logging.WARNING, "identify"):
        found = fit(MODEL, *given.values(), test_function=LENGTH)
    (line,) = (record.getMessage() for record in caplog.records)
    assert line.startswith(REASONS[name])
    assert "; give " in line
    assert "\n" not in line
    assert list(found.left_out["x"]) == [name]
    assert found.fits["x"].error == pytest.approx(without.fits["x"].error)
    assert (found.holdout_error, found.test_error) == ({"x": None}, {"x": None})


def test_one_that_shares_no_travel_is_told_beside_one_that_does(caplog):
    held = {"near": drive(seconds=3.0), "far": elsewhere(1.0)}
    with caplog.at_level(logging.WARNING, "identify"):
        found = fit(MODEL, {"run": elsewhere(1e-4)}, held, test_function=LENGTH)
    (line,) = (record.getMessage() for record in caplog.records)
    assert line.startswith("far is left out: axis x is nowhere where a training log has been")
    error = found.holdout_error["x"]
    assert error is not None
    assert np.isfinite(error)


COMMANDS = (
    ("compare", "m.toml", "run.mcap", "hops.mcap"),
    ("add", "quadratic_drag", "m.toml", "run.mcap", "--test", "hops.mcap", "-o", "o.toml"),
    ("diagnose", "m.toml", "run.mcap", "--holdout", "hops.mcap", "--test", "still.mcap"),
)


def test_each_command_says_it_on_standard_error_and_in_json(tmp_path: Path):
    save_model(MODEL, tmp_path / "m.toml")
    for name, log in {**MOVING, **SILENT}.items():
        write_log(log, tmp_path / f"{name}.mcap")
    for command in COMMANDS:
        done = twin(*command, "--test-function", "0.1", "--json", folder=tmp_path)
        told = json.loads(done.stdout)
        silent = {n for n in command if n in ("hops.mcap", "still.mcap")}
        assert {line.split(" is left out: ")[0] for line in told["left_out"]} == silent
        for line in told["left_out"]:
            assert f"twin: {line}\n" in done.stderr
        assert "NaN" not in done.stdout


SILENT_RATE, SECONDS = 1000.0, 6.0
SPRUNG = axis_of(fitted("cable_slab", k1=1.0))


def step_beyond(x):
    """A force (N) where the logs to fit do not go: x > 40 mm."""
    return np.where(x > 0.04, 0.5, 0.0)


def log(centre: float, phase: float, force=step_beyond):
    """Two waves of 30 mm in all about a centre (m), under a mass, friction and a force of place."""
    t = np.arange(round(SECONDS * SILENT_RATE)) / SILENT_RATE
    wave = waves((0.02, 0.5, phase), (0.01, 1.3, 2.0 * phase))
    x, h = centre + wave(t), 1e-5
    v = (wave(t + h) - wave(t - h)) / (2.0 * h)
    a = (wave(t + h) - 2.0 * wave(t) + wave(t - h)) / h**2
    noise = 1e-3 * np.random.default_rng(round(1e3 * phase)).standard_normal(len(t))
    return log_of(SILENT_RATE, x, 5.3 * a + 0.31 * np.sign(v) + 0.53 * v + force(x) + noise)


def dataset_of(*centres: float) -> Dataset:
    fit = {"one": log(0.0, 0.3), "two": log(0.0, 1.1)}
    held = {f"held {i}": log(c, 2.0 + i) for i, c in enumerate(centres)}
    return datasets(MachineModel("m", {"x": SPRUNG}), fit, held, test_function=0.05)["x"]


def test_what_lies_beyond_the_fit_logs_tests_nothing() -> None:
    inside, beyond = dataset_of(0.0), dataset_of(0.02)
    assert inside.beyond == {}
    errors = [
        rms(error_on(fit_axis(SPRUNG, d.training).axis, d.selection)) for d in (inside, beyond)
    ]
    assert errors[1] == pytest.approx(errors[0], rel=0.5)  # the step of 0.5 N is not met
    (part,) = beyond.beyond.values()
    (held,) = beyond.selection
    assert part == pytest.approx(1.0 - np.mean(moving([held], sticks=False)))
    position = held.test_function.mean(held.motion.position)
    assert position[~held.reached].min() > 0.03
    assert 0.2 < part < 0.6
    (told,) = [text for text in prepared_in_words(beyond) if "selection log" in text]
    assert told.startswith(f"held 0: {100 * part:.0f} % of this selection log is left out: it lies")
    tested = replace(beyond, selection=(), test=beyond.selection)
    (told,) = [text for text in prepared_in_words(tested) if "no training log has been" in text]
    assert "of this test log is left out" in told
    assert realigned(beyond, 1e-4).beyond == pytest.approx(beyond.beyond, abs=0.02)


@pytest.mark.slow
def test_held_out_logs_that_share_little_test_all_the_same() -> None:
    assert dataset_of(0.2).beyond == {}
    assert set(dataset_of(0.2, 0.0).beyond) == {"held 0"}  # together they share half


# Test functions are as long as the logs ask for, and a hanging beginning is left out


FREE_RATE = 1000.0
FREE_MASS = 2.0
FREE_PLAIN = MachineModel("plain", {"x": AxisModel(FREE_MASS)}, sample_rate=FREE_RATE)


def passes(seed: int, cogging: float, noise: float, hang: float = 0.0, extra: float = 0.0):
    """A log of fast passes, 0.5 m/s back and forth, with cogging of 10 mm pitch (N), a noisy
    encoder (m) and for the first ``hang`` s a force (N) that moves nothing."""
    rng = np.random.default_rng(seed)
    t = np.arange(8001) / FREE_RATE
    x = 0.25 * np.sin(2.0 * t)
    force = (
        -4.0 * FREE_MASS * x + np.sign(np.cos(2.0 * t)) + cogging * np.sin(2.0 * np.pi * x / 0.01)
    )
    force[t < hang] += extra
    return log_of(FREE_RATE, x + rng.normal(0.0, noise, len(t)), force)


def test_what_a_quiet_length_averages_away_asks_for_a_shorter_one():
    noise = 2e-5  # m
    still = datasets(FREE_PLAIN, {"log": passes(1, 0.0, noise)}, {})["x"].test_function_length
    fast = datasets(FREE_PLAIN, {"log": passes(1, 1.5, noise)}, {})["x"].test_function_length
    assert fast < still
    # At 0.5 m/s a pitch is passed in 20 ms; the quiet length averages it away.
    motion = motion_of(passes(1, 1.5, noise), "x", "log", longest_block=fast / 8.0)
    short, long = (AtLength.of(length, [motion]) for length in (fast, still))
    assert short.shows_more_than(long)
    assert not long.shows_more_than(short)


def test_a_log_in_which_readings_are_held_has_the_blocks_of_the_others():
    """They look like noise; blocks as long as that asks for would smear every reversal."""

    def held(columns):
        at = np.arange(len(columns["position"]))
        columns["position"] = columns["position"][at - (at % 3 == 2)]

    whole, lossy = drive(5000.0), drive(5000.0, change=held)
    logs = {str(k): whole.part(4000 * k, 4000 * (k + 1)) for k in range(3)}
    friction = effect("coulomb_viscous", {"Fc": COULOMB, "Fs": COULOMB, "sigma2": DAMPING})
    axis = AxisModel(DRIVEN, effects=(friction, effect("constant_force", {"F0": -BIAS})))
    model = MachineModel("drive", {"x": axis}, 5000.0)
    found = datasets(model, logs, {"lossy": lossy.part(12_000, 16_000)}, 0.1)["x"]
    (other,) = found.selection
    assert other.motion.position_noise > 10.0 * found.training[0].motion.position_noise
    assert other.motion.period == found.training[0].motion.period
    assert rms(error_on(axis, found.selection)) < 0.02 * COULOMB


def test_a_beginning_in_which_a_force_moves_nothing_is_left_out():
    hanging = passes(2, 0.0, 1e-7, hang=0.5, extra=9.0)
    free = passes(3, 0.0, 1e-7)
    found = datasets(FREE_PLAIN, {"hanging": hanging, "free": free}, {})["x"]
    assert list(found.begun) == ["hanging"]
    assert found.begun["hanging"] == pytest.approx(0.5, abs=0.16)
    assert len(found.training[0]) < len(found.training[1])
    assert "hanging" in prepared_in_words(found)[0]
    # Its positions are those of the log from there on.
    at = round(found.begun["hanging"] * FREE_RATE)
    first = found.training[0].motion.position[0]
    assert first == pytest.approx(hanging.axes["x"].position[at], abs=2e-3)


def test_no_beginning_is_left_out_where_the_force_is_ordinary():
    def told(extra: float, hang: float = 0.5):
        log = passes(4, 0.3, 1e-7, hang=hang, extra=extra)
        return beginnings([motion_of(log, "x", "log")])

    assert told(9.0)
    assert not told(0.0)
    assert not told(0.2)  # not foreign beside the cogging
    assert not told(9.0, hang=3.0)  # no beginning
    assert FOREIGN > 1.0 > HELD


def slow(rate: float, seconds: float, hang: float = 0.0):
    """A log of a few samples a second, whose force belongs to the middle of each."""
    t = np.arange(round(seconds * rate)) / rate
    middle = t + 0.5 / rate
    x = 0.1 * np.sin(1.1 * t) + 0.02 * np.sin(3.7 * t)
    force = -FREE_MASS * (0.121 * np.sin(1.1 * middle) + 0.2738 * np.sin(3.7 * middle))
    force[t < hang] += 9.0
    return log_of(rate, x + np.random.default_rng(1).normal(0.0, 1e-6, len(t)), force)


def test_a_slow_log_is_fitted_with_test_functions_as_short_as_its_samples_allow():
    rate = 20.0
    shortest = LEAST_BLOCKS / rate
    result = fit(FREE_PLAIN, {"log": slow(rate, 20.0)})
    assert result.model.axes["x"].mass == pytest.approx(FREE_MASS, rel=0.01)
    assert result.datasets["x"].test_function_length == pytest.approx(max(0.2, shortest))
    with pytest.raises(InputError, match=f"give at least {shortest:g} s"):
        fit(FREE_PLAIN, {"log": slow(rate, 20.0)}, test_function=0.1)
    fit(FREE_PLAIN, {"log": slow(rate, 20.0)}, test_function=shortest)
    assert first_model({"log": slow(rate, 20.0)}, "new", CATALOGUE).axes["x"].mass > 0.0
    begun = datasets(FREE_PLAIN, {"log": slow(rate, 60.0, hang=0.3)}, {})["x"].begun
    assert 0.3 < begun["log"] < 0.3 + 2.0 * shortest
    least = f"log: it lasts 1.2 s, and identification needs {64 / rate:.3g} s at {rate:g} Hz"
    with pytest.raises(InputError, match=least):
        fit(FREE_PLAIN, {"log": slow(rate, 1.2)})
    compare(FREE_PLAIN, {"log": slow(rate, 64 / rate)})
