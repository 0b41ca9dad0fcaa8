"""Sound logs, of which `twin check` must say nothing that is not so: `python -m benchmarks sound`.

Sixty of every kind that this repository makes, on machines whose effects are drawn, and those of
real machines. Each is as its recorder wrote it, with no fault. What a log does not excite is its
own: that the motion goes one way, an axis rests or an encoder is coarse is no fault of a recording.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks import real_machines
from benchmarks.drives import HIDDEN
from benchmarks.figures import Figure, Target, report
from benchmarks.second_simulator.drives import DRIVES, log_of
from benchmarks.second_simulator.servo_axes import MOTIONS, drawn
from benchmarks.withheld import DATA
from twin.checks import Fault, LogFinding, Severity, check_log
from twin.errors import CannotRun
from twin.experiments.experiment import Experiment
from twin.experiments.kinds import Rests, Steps, Sweep
from twin.experiments.named import EXPERIMENTS
from twin.importers import import_log, load_mapping
from twin.logs import AxisLog, Log
from twin.model.file import load_model
from twin.simulation.simulate import simulate

TITLE = "False alarms of a check on sound logs"
SEED = 4
SIMULATED = 60
# what a sound log may be
OWN = {Fault.WEAK_EXCITATION, Fault.COARSE_POSITION, Fault.NOISE, Fault.ASSUMED}
# Of these logs these are so: clocks of a PC, glitches of a laser, a rail of 24 m.
TRUE = {
    "servo axis": {Fault.LAG},  # the dead time that each of them has
    "laas": {Fault.UNEVEN, Fault.MISSING, Fault.OUTLIERS},
    "kinova": {Fault.UNEVEN, Fault.OUTLIERS, Fault.FLAT},
    "zillen": {Fault.OUTLIERS, Fault.UNEVEN},
    "silverbox": {Fault.OUTLIERS},  # between two of its realisations
    "tx40": {Fault.OUTLIERS},  # printed with fewer digits where numbers are large
    "frc": {Fault.UNIT, Fault.UNEVEN},
    "double pendulum": {Fault.UNEVEN, Fault.OUTLIERS},
}
# recordings without roles, and the maps that are right
KINOVA = "sample_rate = 1000.0\n" + "".join(
    f"""
[axes.joint_{n}]
position = {{column = "Position{n}", unit = "rad"}}
velocity = {{column = "Velocity{n}", unit = "rad/s"}}
force = {{column = "TorqueCur{n}", unit = "N m"}}
"""
    for n in range(1, 8)
)
FRC = """
resample = 200.0
time = {{column = "{0}[1]", unit = "s"}}

[axes.left]
position = {{column = "{0}[4]", unit = "m"}}
velocity = {{column = "{0}[6]", unit = "m/s"}}
force = {{column = "{0}[2]", unit = "V", scale = 10.0}}
"""
FRC_TESTS = ("slow-forward", "slow-backward", "fast-forward", "fast-backward")
Named = Iterator[tuple[str, Log]]


def simulated(seed: int) -> Named:
    """Sixty logs: the product's experiments, drives of other kinds, servo axes."""
    yield from _experiments(seed)
    kinds = list(HIDDEN.items())
    rng = np.random.default_rng(seed)
    for number, (name, drive) in enumerate((n, d) for n, d in DRIVES.items() for _ in range(4)):
        recorder = drive.recorders[number % len(drive.recorders)]
        hidden, (change, _) = kinds[int(rng.integers(len(kinds)))]
        log = log_of(drive, change(drive, recorder), recorder, 100 * seed + number)
        yield f"{name} with {hidden} at {recorder.rate} Hz", log
    for number in range(24):
        motion = list(MOTIONS)[number % len(MOTIONS)]
        axis = drawn(rng, number % 2 == 1, motion)
        elastic = ", elastic" if axis.resonance else ""
        yield f"servo axis, {motion}{elastic} at {axis.recorder.rate} Hz", axis.log(rng)


def _experiments(seed: int) -> Named:
    """The named ones on a gantry and a machine of one axis; sweeps, steps and rests."""
    gantry, single = load_model("proton_xy"), load_model("example_machine")
    for model in (gantry, single):
        axis = next(iter(model.axes))
        low, high = model.axes[axis].hardware.travel or (-0.1, 0.1)
        travel = high - low
        more: tuple[Experiment, ...] = (
            Steps(axis, 0.1 * travel, 0.01 * travel, (0.2, 0.5, 1.0)),
            Rests(axis, 0.3 * travel, 0.2 * travel, (0.1, 0.3, 1.0)),
            Sweep(axis, 0.3 * travel, 0.1 * travel, 2, 0.05, 2.0, 100.0, effort=0.5),
        )
        for name in EXPERIMENTS:
            yield f"{model.name}, {name}", simulate(model, name, seed=seed, duration=10.0)
        for experiment in more:
            with suppress(CannotRun):
                log = simulate(model, experiment, seed=seed)
                yield f"{model.name}, {type(experiment).__name__}", log


def real(data: Path) -> Named:
    """Logs of real machines, of those that are there."""
    yield from real_machines.whole(data).items()
    for path in sorted((data / "kinova").glob("*.csv")):
        yield f"kinova, {path.stem}", _imported(path, KINOVA)
    for test in FRC_TESTS:
        path = data / "frc" / "sysid_data.json"
        yield f"frc, {test}", _imported(path, FRC.format(test))
    for path in sorted((data / "own_csv").glob("*/*.csv")):
        yield f"own_csv, {path.stem}", import_log(path, load_mapping(path.parent / "map.toml"))
    for path in sorted((data / "zillen").glob("*.csv")):
        yield f"zillen, {path.stem}", _zillen(path)


def _imported(path: Path, text: str) -> Log:
    """A recording by the text of a map."""
    with TemporaryDirectory() as folder:
        mapping = Path(folder) / "map.toml"
        mapping.write_text(text, encoding="utf-8")
        return import_log(path, load_mapping(mapping))


def _zillen(path: Path) -> Log:
    """Every 10 ms but for the first interval: time ms, ..., position mm, pressure, force N."""
    table = np.loadtxt(path)[1:]
    time = 1e-3 * table[:, 0]
    even = np.arange(time[0], time[-1], 0.01)
    position, force = (np.interp(even, time, table[:, k]) for k in (4, 6))
    return Log(100.0, {"x": AxisLog({"position": 1e-3 * position, "force": force})})


def measure() -> list[Figure]:
    """The figures, and what is told of each log that is told of."""
    return figures(list(_check_findings(SEED)))


def _check_findings(seed: int) -> Iterator[tuple[str, str, tuple[LogFinding, ...]]]:
    for name, log in simulated(seed):
        yield "simulated", name, check_log(log).findings
    if DATA.is_dir():
        for name, log in real(DATA):
            yield "real", name, check_log(log).findings


def figures(told: Sequence[tuple[str, str, tuple[LogFinding, ...]]]) -> list[Figure]:
    """False errors and warnings, of simulated logs and of real ones."""
    out = []
    for kind in ("simulated", "real"):
        findings = [
            finding
            for k, name, of_log in told
            if k == kind
            for finding in of_log
            if finding.fault not in OWN | TRUE.get(name.partition(",")[0], set())
        ]
        count = sum(k == kind for k, *_ in told)
        errors = sum(f.severity is Severity.ERROR for f in findings)
        false = sum(f.severity is Severity.WARNING for f in findings)
        out += [
            Figure(f"false errors on {kind} sound logs", errors, "1", Target(high=0.0),
                   f"{count} logs"),
            Figure(f"false warnings on {kind} sound logs", false, "1", Target(high=3.0)),
        ]  # fmt: skip
    return out


def main(arguments: Sequence[str]) -> int:
    """Print what is told; 0 where every target is met."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks sound", description=__doc__)
    parser.add_argument("--seed", type=int, default=SEED)
    given = parser.parse_args(arguments)
    told = list(_check_findings(given.seed))
    for _, name, findings in told:
        for finding in findings:
            print(f"{name}: {finding.severity.value}: {finding}", flush=True)
    return report(figures(told))
