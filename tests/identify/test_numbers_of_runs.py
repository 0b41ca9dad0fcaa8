"""The numbers of small real runs are those that were read once.

What the laws of other tests leave open, such as a factor in a floor or the order of two arguments,
moves one of some thousand numbers here. They are written anew, to be read first, by
`PYTHONPATH=tests python tests/identify/test_numbers_of_runs.py`; whoever changes them says why.
"""

from __future__ import annotations

import json
import re
import sys
import tomllib
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import arms
import numpy as np
import pytest
from check_drive import drive
from fleet_cases import ingested, recorded, rows
from import_cases import write_csv
from machines import CATALOGUE, PROTON
from planted_logs import RATE, SLIDE, Ride, few, having, logged

import identify
from benchmarks.second_simulator.two_masses import TwoMasses, wandering
from identify.analysis.first_model import first_model
from identify.experiment_design.planting import other_machine
from identify.fleet.change_point import changes
from identify.output.answers import Answer, plain
from identify.output.answers.machine import info_answer
from identify.output.as_json import json_of
from identify.view.replay import replay
from twin.checks import check_log
from twin.checks.long import log_info
from twin.experiments.named import EXPERIMENTS
from twin.export import find_exporter
from twin.importers.guess import EVERY_COLUMN, propose, table_of
from twin.laws.trials import TrialMotion, acted, legal
from twin.logs import AxisLog, Log, write_log
from twin.model.file import format_model
from twin.model.machine import MachineModel
from twin.simulation.simulate import simulate

KEPT = Path(__file__).with_name("numbers_of_runs.json")
NEAR = 2e-3  # of a number: other processors round otherwise, and a fit ends a little elsewhere
BY_CHANCE = "stiffness"  # of two masses that nothing holds
SMALL = 1e-9  # of no unit: a number that is nothing but rounding
FEW = few("coulomb_viscous", "cogging", "spring", "constant_force", "quadratic_drag")
LATE = {
    "actuator_lag": {"tau": 4e-4},
    "flexible_mode": {"load": 0.2, "frequency": 90.0},
    "encoder_ripple": {"period": 2e-3, "a1": 2e-7},
}
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
SLIDER = MachineModel("m", {"x": SLIDE}, RATE)


@cache
def stage() -> list[dict[str, Log]]:
    """Logs of a stage of other values than its model has, one for each role."""
    rng = np.random.default_rng(5)
    axes = {name: other_machine(axis, rng) for name, axis in PROTON.axes.items()}
    machine = replace(PROTON, axes=axes)
    return [{f"{k}": simulate(machine, "moves", seed=k, duration=3.0)} for k in range(3)]


@cache
def slides() -> list[dict[str, Log]]:
    """Logs of a slide with cogging and a spring, one for each role."""
    true = having(having(SLIDE, "cogging", p=0.021, a1=0.9, b1=0.4), "spring", k1=40.0)
    return [{f"{k}": logged(true, Ride(k, 4.0))} for k in (1, 2, 3)]


@cache
def fit_of_stage() -> identify.FitResult:
    return identify.fit(PROTON, *stage())


@cache
def diagnosis_of_slide() -> identify.Diagnosis:
    return identify.diagnose(SLIDER, *slides(), catalogue=FEW)


def arm() -> identify.Diagnosis:
    """An arm whose fore arm is heavier than its file says."""
    heavier = arms.ARM.replace('mass="2"', 'mass="2.6"')
    logs = {name: arms.arm_log(k, text=heavier, duration=6.0) for k, name in enumerate("ab")}
    model = first_model(logs, "arm", CATALOGUE, ("arm.xml", arms.ARM))
    return identify.diagnose(model, {"a": logs["a"]}, {"b": logs["b"]}, catalogue=FEW)


def response() -> identify.FrequencyResponse:
    """Of two masses on a spring whose motor is late."""
    rng = np.random.default_rng(1)
    machine = TwoMasses(delay=0.4e-3)
    wanted = wandering(16_000, rng)
    done = machine.run(wanted, rng)
    columns = {"setpoint_position": wanted, "position": done.position, "force": done.force}
    return identify.frequency_response(Log(1.0 / machine.period, {"q": AxisLog(columns)}))


def stage_with(effects: dict[str, dict[str, float]]) -> MachineModel:
    """The x axis of the stage, with more effects than it has."""
    axis = PROTON.axes["x"]
    for name, values in effects.items():
        axis = having(axis, name, **values)
    return MachineModel("stage", {"x": axis}, PROTON.sample_rate)


def of_late_motor() -> identify.FitResult:
    """A stage whose motor lags, on a load that swings, read by an encoder with an error."""
    machine = stage_with(LATE)
    logs = {"a": simulate(machine, "moves", seed=4, duration=3.0)}
    return identify.fit(machine, logs)


def of_file() -> Any:
    """What a log shows: ranges, courses, and the faults that were put into it."""
    log = stage()[0]["0"]
    own = log.axes["x"]
    columns = {**own.columns, "position": own.position.copy(), "force": own.columns["force"] * 1.0}
    columns["position"][5000:5400] = columns["position"][5000]
    columns["force"][7000] += 60.0
    broken = replace(log, axes={**log.axes, "x": AxisLog(columns, own.units)})
    with TemporaryDirectory() as folder:
        path = Path(folder, "broken.mcap")
        write_log(broken, path)
        return info_answer({"broken": log_info(path)})


def of_nights() -> dict[str, Any]:
    """What a fleet keeps of two machines of one night."""
    with TemporaryDirectory() as folder:
        logs = recorded(Path(folder, "logs"), machines=2, nights=1)
        ingested(logs, Path(folder, "store"))
        return {str(k): plain(row) for k, row in enumerate(rows(Path(folder, "store")))}


def of_experiments() -> dict[str, Any]:
    """What the stage logs along an experiment of each kind, as little of it as says something."""
    runs = {name: simulate(PROTON, name, seed=3, duration=4.0) for name in EXPERIMENTS}
    return {
        name: {
            a: {n: c[::7].tolist() for n, c in own.columns.items()} for a, own in run.axes.items()
        }
        for name, run in runs.items()
    }


def numbers_in(text: str) -> list[float]:
    return [float(n) for n in NUMBER.findall(text) if abs(float(n)) < 1e100]  # what is no bound


def spoiled(name: str, where: slice, by: Callable[[np.ndarray], np.ndarray]) -> Any:
    """A change of one signal of a drive in a part of its time."""

    def change(columns: dict[str, np.ndarray]) -> None:
        columns[name] = columns[name].copy()
        columns[name][where] = by(columns[name][where])

    return change


SIGNALS = ("position", "velocity", "force", "current", "setpoint_position")
FAULTY: dict[str, dict[str, Any]] = {
    "late": {"late": {"force": 0.02}},
    "factor": {"signals": SIGNALS, "factor": {"velocity": 1.3}},
    "sign": {"factor": {"force": -1.0}},
    "held": {"change": spoiled("position", slice(900, 1000), lambda x: 0.0 * x + x[0])},
    "jump": {"change": spoiled("position", slice(2000, None), lambda x: x + 0.01)},
    "spike": {"change": spoiled("force", slice(1500, 1501), lambda x: x + 500.0)},
    "hole": {"change": spoiled("force", slice(700, 730), lambda x: np.nan * x)},
    "cut": {"change": spoiled("force", slice(None), lambda x: np.clip(x, -2.0, 2.0))},
    "coarse": {"change": spoiled("position", slice(None), lambda x: 1e-3 * np.round(1e3 * x))},
    "other unit": {"factor": {"position": 1e3}},
}


def of_exports() -> dict[str, Any]:
    """The numbers in the text of all files of a machine of many effects."""
    rich = {**LATE, "cogging": {"p": 0.024, "a1": 0.2, "b2": -0.05}}
    model = replace(stage_with(rich), name="rich")
    made = {}
    for form in ("c", "csv", "ros2_control", "twincat"):
        for file, text in find_exporter(form).export(model, stage()[0]).files.items():
            made[file] = numbers_in(str(text))
    return made


def of_faults() -> dict[str, Any]:
    """The numbers in what the check says of logs with one fault each."""
    said = {}
    for name, changed in FAULTY.items():
        found = check_log(drive(**changed)).findings
        texts = " ".join(f"{f.what}; {f.remedy}" for f in found)
        places = [at for f in found for at in (f.where.start, f.where.stop)]
        said[name] = [len(found), *numbers_in(texts), *places]
    return said


def of_columns() -> dict[str, Any]:
    """What is proposed of a file of two axes whose columns say little, and the proof of it."""
    log = drive(signals=("position", "velocity", "force", "setpoint_position"))
    own = log.axes["x"].columns
    other = {f"y {name}": -2.0 * column[::-1] for name, column in own.items()}
    columns = {"t [ms]": 1e3 * np.arange(len(log)) / log.sample_rate, **own, **other}
    with TemporaryDirectory() as folder:
        path = Path(folder, "two.csv")
        write_csv(path, columns)
        found = propose(path)
        return plain({"map": numbers_in(found.map_text({})), "rows": found.rows})


def finite(values: np.ndarray) -> list[float]:
    return values[np.isfinite(values)].tolist()


TABLES = {
    "comma": "time;pos [mm];force [N]\n0,000;1,5;-2,25\n0,001;1,75;-2,5\n0,002;2,0;-3,0\n",
    "units below": "t\tq\tu\ns\tmm\tA\n0.0\t1.0\t0.1\n0.5\t2.0\t0.2\n1.0\t4.0\t0.4\n",
    "settings above": "gain,15\nrate,1000\n\ntime,x,f\n0,1e-3,2\n0.001,2e-3,3\n0.002,4e-3,5\n",
    "bad first": "t,x,f\n0.0,--,--\n0.1,1.0,2\n0.2,2.0,3\n0.3,3.0,5\n0.4,5.0,8\n",
    "words apart": "  run time   motor torque\n  0.0        1.25\n  0.1   1.5\n  0.2   2.5\n",
    "no names": "0.0 1.0 2.0\n0.1 1.5 2.5\n0.2 2.5 4.5\n",
}


def of_tables() -> dict[str, Any]:
    """What text tables of several forms hold, and under which names."""
    held: dict[str, Any] = {}
    with TemporaryDirectory() as folder:
        for name, text in TABLES.items():
            path = Path(folder, f"{name}.csv")
            path.write_text(text, encoding="utf-8")
            table = table_of(path, EVERY_COLUMN)
            held[name] = {n: finite(np.asarray(c, float)) for n, c in table.columns.items()}
    return held


def of_laws() -> dict[str, Any]:
    """What every law of the catalogue does along one motion, each of its strengths at work."""
    motion = TrialMotion.cycles(0.02, samples=700)
    made: dict[str, Any] = {}
    for name, effect in CATALOGUE.items():
        given = {p.name: p.start or 0.3 if p.strength else p.start for p in effect.parameters}
        values = legal(effect, given)
        made[name] = {f"{k}": row.tolist() for k, row in enumerate(acted(effect, values, motion))}
    return made


def of_series() -> dict[str, Any]:
    """The changes of a series of nights: two steps, and a night that is off."""
    rng = np.random.default_rng(8)
    levels = np.repeat([1.0, 1.2, 0.9], [30, 20, 25]) + 0.02 * rng.standard_normal(75)
    levels[40] += 0.3
    told = changes(levels, np.full(75, 1e-5), 0.02, 4.0)
    return {str(k): asdict(change) for k, change in enumerate(told)}


def of_replay() -> dict[str, Any]:
    """What a viewer of a log and its model draws."""
    drawn = replay(fit_of_stage().model, stage()[2]["2"], "2")
    return {
        name: {
            "modelled": finite(axis.modelled),
            "forces": {n: finite(f) for n, f in axis.forces.items()},
            "strips": {s.label: [*map(finite, s.range)] for s in axis.strips},
        }
        for name, axis in drawn.axes.items()
    }


RUNS: dict[str, Callable[[], Any]] = {
    "fit of a stage": fit_of_stage,
    "comparison of a stage": lambda: identify.compare(fit_of_stage().model, stage()[2]),
    "feedforward of a stage": lambda: identify.feedforward(fit_of_stage().model, stage()[2]),
    "agreement of two fits": lambda: identify.agree(
        *(identify.fit(diagnosis_of_slide().model, logs) for logs in slides()[:2])
    ),
    "diagnosis of a slide": diagnosis_of_slide,
    "cogging added to a slide": lambda: identify.add("cogging", SLIDER, *slides()),
    "diagnosis of an arm": arm,
    "fit of a late motor": of_late_motor,
    "response of two masses": response,
    "what a log shows": of_file,
    "files of exports": of_exports,
    "faults of logs": of_faults,
    "columns of a file": of_columns,
    "logs of experiments": of_experiments,
    "records of a night": of_nights,
    "experiment that decides": lambda: identify.plan(stage_with({}), duration=2.0),
    "first model of a stage": lambda: identify.first_model(stage()[0]),
    "laws along a motion": of_laws,
    "tables of text": of_tables,
    "changes of a series": of_series,
    "what a viewer draws": of_replay,
    "friction taken out of a slide": lambda: identify.remove("coulomb_viscous", SLIDER, *slides()),
    "experiment by logs": lambda: identify.plan(SLIDER, slides()[0], catalogue=FEW, duration=2.0),
}


def numbers_of(answer: Any, at: str = "") -> dict[str, Any]:
    """Each number by its place; of a long list its length, mean, spread and first moment."""
    if isinstance(answer, dict):
        own = ((key, value) for key, value in answer.items() if key != BY_CHANCE)
        parts = [numbers_of(value, f"{at}/{key}") for key, value in own]
    elif isinstance(answer, list) and len(answer) > 8 and isinstance(answer[0], float):
        values = np.array([v for v in answer if v is not None])
        first = np.sum(values * np.linspace(0.0, 1.0, len(values)))
        return {at: [len(values), *map(float, (values.mean(), values.std(), first))]}
    elif isinstance(answer, list):
        parts = [numbers_of(value, f"{at}/{k}") for k, value in enumerate(answer)]
    else:
        return {at: answer} if isinstance(answer, (int, float)) else {}
    return {key: value for part in parts for key, value in part.items()}


def numbers_now(name: str) -> dict[str, Any]:
    """Of a run, those that it has in its JSON; of a model those of its file."""
    made = RUNS[name]()
    if isinstance(made, dict):
        return numbers_of(made)
    if isinstance(made, MachineModel):
        return numbers_of(tomllib.loads(format_model(made)))
    return numbers_of(made.entries() if isinstance(made, Answer) else json_of(made))


def near(one: Any, other: Any) -> bool:
    """Whether a number is as it was, or each of some."""
    if isinstance(other, list):
        return all(map(near, one, other)) and len(one) == len(other)
    return bool(one == pytest.approx(other, rel=NEAR, abs=SMALL))


@pytest.mark.parametrize("name", RUNS)
def test_the_numbers_are_as_they_were_read(name: str) -> None:
    now, kept = numbers_now(name), json.loads(KEPT.read_text())[name]
    assert now.keys() == kept.keys()
    moved = {at: (now[at], kept[at]) for at in kept if not near(now[at], kept[at])}
    assert not moved


if __name__ == "__main__":
    asked = sys.argv[1:] or [*RUNS]
    before = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    now = {name: numbers_now(name) for name in asked}
    now = json.loads(json.dumps(now), parse_float=lambda text: float(f"{float(text):.6g}"))
    KEPT.write_text(json.dumps({**before, **now}, indent=0) + "\n", encoding="utf-8")
