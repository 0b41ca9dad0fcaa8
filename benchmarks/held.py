"""Machines with several things wrong, one of them held: `python -m benchmarks held [--seed N]`.

Each is a drive of the second simulator that hides one or two effects, and whose model holds a value
that is wrong: its inertia, the force constant of its logs, the step of its encoder, or a dead time.
Asked is whether the answer is whole: every law of the final model belongs to a finding; the model
that is written leaves the error that was told; and who follows each ``next:`` comes as far.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from time import process_time

import numpy as np

from benchmarks.drives import CATALOGUE, HIDDEN, KNOWN
from benchmarks.figures import Figure, Target, report
from benchmarks.judgement import Expected, Row, judged, row_of, stated_wrong
from benchmarks.second_simulator.drives import DRIVES, Plant, Recorder, log_of
from identify.adding import add
from identify.analysis.first_model import first_model
from identify.estimation.errors import error_in
from identify.output.words.next_step import next_commands
from identify.results.results import Diagnosis
from identify.workflow import diagnose, fit
from twin.logs import AxisLog, Log
from twin.model.file import load_model, save_model
from twin.model.machine import AxisModel, Fitted, MachineModel

TITLE = "Machines with two or three things wrong, one of them held"
SEED, MACHINES = 71, 40
MOST_STEPS = 6  # commands that are followed at most
AXIS = "q"
PAIRS = ("cogging", "gravity", "hysteresis", "asymmetry", "ripple", "spring", "lag", "stribeck")


@dataclass(frozen=True)
class Held:
    """What a model holds wrongly: what it does to model and logs, and what is right to say of it.

    model: of the axis. log: of its force, by a factor.
    """

    model: Callable[[AxisModel], AxisModel]
    log: float = 1.0
    expected: Expected = field(default_factory=Expected)


def inertia(times: float) -> Held:
    """An inertia that is held at so many times the true one."""
    known = ("payload_mass", "rotor_inertia")
    return Held(lambda a: replace(a, mass=times * a.mass, mass_fixed=True), 1.0, Expected(known))


def constant(times: float) -> Held:
    """Logs whose force is so many times the true one, beside an inertia that was weighed."""
    known = ("payload_mass", "rotor_inertia", "torque_constant")
    return Held(lambda a: replace(a, mass_fixed=True), times, Expected(known))


def encoder(times: float) -> Held:
    """A model whose encoder has another step than that of the logs."""

    def model(a: AxisModel) -> AxisModel:
        step = times * a.hardware.encoder_resolution
        return replace(a, hardware=replace(a.hardware, encoder_resolution=step))

    return Held(model)


def delay(seconds: float) -> Held:
    """A dead time that is held, and that the machine does not have."""

    def model(a: AxisModel) -> AxisModel:
        law = Fitted.at_start(CATALOGUE["actuator_delay"], {"tau": seconds})
        return a.with_effect(replace(law, fixed=law.fixed | {*law.values}))

    return Held(model, 1.0, Expected(("encoder_delay", "actuator_lag")))


@dataclass(frozen=True)
class Case:
    """A drive, how it is logged, what it hides, and what its model holds wrongly."""

    drive: str
    recorder: Recorder
    hidden: tuple[str, ...]
    fault: str
    times: float
    seed: int

    def __str__(self) -> str:
        wrong = f"{self.fault} {self.times:.2g}"
        return f"{self.drive} at {self.recorder.rate} Hz, {' + '.join(self.hidden)}, {wrong} held"

    @property
    def held(self) -> Held:
        """What its model holds."""
        makers = {"inertia": inertia, "constant": constant, "encoder": encoder, "delay": delay}
        return makers[self.fault](self.times)

    @property
    def plant(self) -> Plant:
        """The drive with what it hides."""
        drive, plant = DRIVES[self.drive], DRIVES[self.drive].plant
        for name in self.hidden:
            plant = HIDDEN[name][0](replace(drive, plant=plant), self.recorder)
        return plant

    @property
    def expected(self) -> Expected:
        """What is right to say: of what it hides, and of what is held."""
        each = [HIDDEN[name][1] for name in self.hidden] + [self.held.expected]

        def all_of(part: str) -> tuple[str, ...]:
            return tuple(dict.fromkeys(n for e in each for n in getattr(e, part)))

        shapes = (*all_of("shapes"), "coulomb_viscous")
        return Expected(all_of("right"), all_of("equivalent"), shapes, KNOWN, KNOWN)

    def logs(self) -> list[Log]:
        """To fit, to choose, to test, the force as the fault has it."""
        drive = DRIVES[self.drive]
        logs = (log_of(drive, self.plant, self.recorder, 3 * self.seed + i) for i in range(3))
        return [_scaled(log, self.held.log) for log in logs]


def _scaled(log: Log, times: float) -> Log:
    own = log.axes[AXIS]
    columns = {**own.columns, "force": times * own.columns["force"]}
    return replace(log, axes={AXIS: AxisLog(columns, own.units)})


def cases(seed: int, machines: int) -> list[Case]:
    """The machines of a seed."""
    rng = np.random.default_rng(seed)
    out = []
    for i in range(machines):
        name = str(rng.choice([*DRIVES]))
        recorders = DRIVES[name].recorders
        recorder = recorders[int(rng.integers(len(recorders)))]
        count = 1 + int(rng.integers(2))
        hidden = tuple(map(str, rng.choice(PAIRS, count, replace=False)))
        fault = ("inertia", "constant", "inertia", "encoder", "delay")[i % 5]
        times = float(np.exp(rng.uniform(np.log(0.3), np.log(3.0))))
        if fault == "delay":
            times = min(float(rng.uniform(1.0, 3.0)) / recorder.rate, 5e-3)
        out.append(Case(name, recorder, hidden, fault, times, 1000 * seed + i))
    return out


def row(case: Case) -> Row:
    """One machine diagnosed, with how whole the answer is."""
    training, selection, test = case.logs()
    model = first_model({"training": training}, case.drive, CATALOGUE)
    model = model.with_axis(AXIS, case.held.model(model.axes[AXIS]))
    logs = {"training": training}, {"selection": selection}, {"test": test}
    begun = process_time()
    found = diagnose(model, *logs, catalogue=CATALOGUE)
    spent = process_time() - begun
    own = found.axes[AXIS]
    out = row_of(str(case), case.expected, own, spent)
    told = own.tested.after
    out["unnamed"] = unnamed(found)
    out["written"] = _written(found, *logs) / told
    out["followed"] = _followed(found, model, *logs) / told
    return out


def unnamed(found: Diagnosis) -> list[str]:
    """Laws, and values set free, that the final model has beyond the base and no finding names."""
    own = found.axes[AXIS]
    base, final = own.base.axis, own.final.axis
    named = {f.effect for f in own.findings} | {"free_curve"}
    more = [f.effect.name for f in final.effects if f.effect.name not in base.names]
    freed = [n for n in base.names if n in final.names and base[n].fixed - final[n].fixed]
    return [name for name in (*more, *freed) if name not in named]


def _written(found: Diagnosis, *logs: Mapping[str, Log]) -> float:
    """The test error (N) of the model that is written, fitted by who reads it."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "better.toml"
        save_model(found.model, file)
        again = fit(load_model(file, CATALOGUE), *logs, catalogue=CATALOGUE)
    return float(again.test_error[AXIS] or np.nan)


def _followed(found: Diagnosis, model: MachineModel, *logs: Mapping[str, Log]) -> float:
    """The test error (N) after each command that is proposed was done."""
    error = np.nan
    for _ in range(MOST_STEPS):
        own = found.axes[AXIS]
        error = error_in(own.dataset.tested_on, own.base, own.dataset)
        commands = [c.split() for c in next_commands(own)]
        names = [words[2] for words in commands if words[:2] == ["twin", "add"]]
        if "--model" in " ".join(" ".join(c) for c in commands):
            model = found.model
        elif names and names[0] != "empirical_map" and "--shape" not in names:
            for name in names:
                model = add(CATALOGUE[name], model, *logs, axis=AXIS).model
        else:
            break
        found = diagnose(model, *logs, catalogue=CATALOGUE)
    return error


def jobs_of(seed: int, machines: int) -> dict[str, Callable[[], Row]]:
    """A job for each machine."""
    return {str(case): partial(row, case) for case in cases(seed, machines)}


def measure() -> list[Figure]:
    """Rates on a seed that decided nothing."""
    return figures(judged(jobs_of(SEED, MACHINES), None))


def figures(rows: Sequence[Row]) -> list[Figure]:
    """How whole the answers are."""
    count = len(rows)

    def of(name: str, good: list[bool], least: float) -> Figure:
        return Figure(name, sum(good) / count, "1", Target(low=least), f"{sum(good)} of {count}")

    stated = stated_wrong(rows)
    named = sum(r["named"] for r in rows)
    return [
        of("every law of the final model belongs to a finding", [not r["unnamed"] for r in rows],
           1.0),
        of("the model that is written leaves the told error to 1 %",
           [abs(r["written"] - 1.0) < 0.01 for r in rows], 1.0),
        of("who follows each next step ends within 10 % of it",
           [r["followed"] < 1.1 for r in rows], 0.9),
        Figure("what is wrong, named", named / count, "1", note=f"{named} of {count}"),
        Figure("wrong names stated at 90 % or more", len(stated) / count, "1",
               Target(high=1.0 / 40), "; ".join(stated) or "none"),
    ]  # fmt: skip


def main(arguments: Sequence[str]) -> int:
    """Judge the machines of a seed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks held", description=__doc__)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--machines", type=int, default=MACHINES)
    parser.add_argument("-o", "--out", type=Path)
    given = parser.parse_args(arguments)
    return report(figures(judged(jobs_of(given.seed, given.machines), given.out)))
