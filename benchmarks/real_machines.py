"""Logs of real machines by role, read from a folder that is not part of this tree.

The measurements belong to their authors. Each function takes the folder that holds one for each.

* EMPS: A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, 2019.
* LAAS: H. Andrade, laas_anti_cogging, public repository.
* ARTS: D. Coble et al., Dataset-Friction-Damper-with-Backlash, 2022, public repository.
* silverbox: J. Schoukens, L. Ljung, T. Wigren; public repository biaslab/nsi-silverbox.
* TX40: public repository thanhndv212/figaroh-examples, examples/staubli_TX40.
* double pendulum: public repository dfki-ric-underactuated-lab/double_pendulum, design A.0.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from benchmarks.judgement import Logs
from twin.importers import import_log, load_mapping
from twin.importers.importer import at_joints
from twin.logs import ROTARY_UNITS, AxisLog, Log

EXAMPLES = Path(__file__).parents[1] / "examples"
INCH, KIP = 0.0254, 4448.2216152605  # m, N
ARTS_RATE, SILVERBOX_RATE = 1024.0, 1e7 / 2**14  # Hz
TX40_RATE, PENDULUM_RATE = 5000.0, 300.0  # Hz
TX40_JOINTS = tuple(f"joint_{i}" for i in range(1, 7))
PENDULUM_JOINTS = ("first", "second")
Given = tuple[Logs, Logs, Logs]  # training, selection, test


def emps(folder: Path) -> Given:
    """The record to train on; of that with pulses the first half chooses, the second tests."""
    mapping = load_mapping(EXAMPLES / "import_emps.toml")
    run, pulses = (
        import_log(folder / "emps" / f"{name}.mat", mapping)
        for name in ("DATA_EMPS", "DATA_EMPS_PULSES")
    )
    first, second = _halves(pulses)
    return {"run": run}, {"pulses, first half": first}, {"pulses, second half": second}


def laas_speed(folder: Path) -> Given:
    """One speed: 0.5 to 10 s trains, 10 to 15 s chooses."""
    log = _laas(folder, "speed_test")
    return {"0.5 to 10 s": log.part(500, 10_000)}, {"10 to 15 s": log.part(10_000, 15_000)}, {}


def laas_accelerations(folder: Path) -> Given:
    """Reversals between 150 rad/s and -150: 14 s train, 7 s choose, the rest tests."""
    log = _laas(folder, "acc_current")
    return (
        {"first 14 s": log.part(0, 14_000)},
        {"14 to 21 s": log.part(14_000, 21_000)},
        {"from 21 s": log.part(21_000, len(log))},
    )


def _laas(folder: Path, name: str) -> Log:
    mapping = load_mapping(EXAMPLES / "import_laas.toml")
    return import_log(folder / "laas" / f"{name}.txt", mapping)


def arts(folder: Path) -> Given:
    """Sines of 0.25 and 0.5 Hz train; of 1 Hz the first half chooses, the second tests."""
    slow, middle, fast = (
        _arts_log(folder / "arts" / f"{hertz}Hz30lbtension1amplitude.json")
        for hertz in ("0.25", "0.5", "1")
    )
    first, second = _halves(fast)
    return (
        {"0.25 Hz": slow, "0.5 Hz": middle},
        {"1 Hz, first half": first},
        {"1 Hz, second half": second},
    )


def _arts_log(path: Path) -> Log:
    """Columns of the file: time s, displacement in, force kip, and others."""
    _, inches, kips, *_ = np.array(json.loads(path.read_text(encoding="utf-8"))["data"]).T
    columns = {"position": INCH * inches, "force": KIP * kips}
    return Log(ARTS_RATE, {"x": AxisLog(columns)})


def silverbox(folder: Path) -> Given:
    """Random excitation: parts of the realisations train and choose, of the rising noise tests."""
    path = folder / "silverbox" / "SNLS80mV.csv"
    data = np.genfromtxt(path, delimiter=",", skip_header=1, usecols=(0, 1))
    rows = {"training": (40_650, 55_650), "selection": (92_000, 102_000), "test": (20_000, 30_000)}
    training, selection, test = (
        {name: _silverbox_log(data[first:stop])} for name, (first, stop) in rows.items()
    )
    return training, selection, test


def _silverbox_log(data: np.ndarray) -> Log:
    """Volts (n, 2) in and out, taken for N and m."""
    columns = {"position": data[:, 1].copy(), "force": data[:, 0].copy()}
    return Log(SILVERBOX_RATE, {"x": AxisLog(columns)})


def whole(folder: Path) -> dict[str, Log]:
    """Each recording from end to end."""
    mapping = load_mapping(EXAMPLES / "import_emps.toml")
    path = folder / "silverbox" / "SNLS80mV.csv"
    volts = np.genfromtxt(path, delimiter=",", skip_header=1, usecols=(0, 1))
    return {
        **{f"emps, {p.stem}": import_log(p, mapping) for p in (folder / "emps").glob("*.mat")},
        **{f"laas, {name}": _laas(folder, name) for name in ("speed_test", "acc_current")},
        **{f"arts, {p.stem}": _arts_log(p) for p in (folder / "arts").glob("*.json")},
        "silverbox": _silverbox_log(volts),
        "tx40": _tx40_log(folder),
        "double pendulum": _pendulum(folder)[0],
    }


def tx40(folder: Path) -> Given:
    """An arm of six joints, whose motors were recorded: 13 parts of 0.6 s, as published."""
    log, part = _tx40_log(folder), 3000
    training, selection, test = (
        {f"from part {a}": log.part(a * part, b * part) for a, b in parts}
        for parts in (
            ((0, 2), (3, 5), (6, 8), (9, 11), (12, 13)), ((2, 3), (8, 9)), ((5, 6), (11, 12)),
        )
    )  # fmt: skip
    return training, selection, test


def _tx40_log(folder: Path) -> Log:
    position, torque = (
        np.genfromtxt(folder / "tx40" / f"{name}_data.csv", delimiter=",", skip_header=1)
        for name in ("pos_read", "curr")
    )
    ratios = dict(zip(TX40_JOINTS, (32.0, 32.0, 45.0, -48.0, 45.0, 32.0), strict=True))
    gears = {j: {j: r} for j, r in ratios.items()} | {"joint_6": {"joint_5": 32.0, "joint_6": 32.0}}
    position[:, 1] -= 16.0 * np.pi  # where the joints of the file begin
    position[:, 2] += 22.5 * np.pi
    motors = {
        j: AxisLog({"position": position[:, i], "force": torque[:, i]}, ROTARY_UNITS)
        for i, j in enumerate(TX40_JOINTS)
    }
    return Log(TX40_RATE, at_joints(motors, gears))


def double_pendulum(folder: Path) -> Given:
    """Sampled at about 300 Hz, brought to it; parts train, choose and test as published."""
    log, edges = _pendulum(folder)
    spans = {"first": (0, edges[0]), "next": (edges[0], edges[1]), "last": (edges[1], len(log))}
    training, selection, test = ({n: log.part(*s)} for n, s in spans.items())
    return training, selection, test


def _pendulum(folder: Path) -> tuple[Log, tuple[int, int]]:
    """The log, and at which samples its published parts begin."""
    path = folder / "double_pendulum" / "sys_id_061157.csv"
    time, *columns = np.genfromtxt(path, delimiter=",", skip_header=1).T
    even = np.arange(time[0], time[-1], 1.0 / PENDULUM_RATE)
    signals = np.reshape([np.interp(even, time, c) for c in columns], (3, 2, -1))
    axes = {
        name: AxisLog(dict(zip(("position", "velocity", "force"), own, strict=True)), ROTARY_UNITS)
        for name, own in zip(PENDULUM_JOINTS, signals.swapaxes(0, 1), strict=True)
    }
    first, second = (int(np.searchsorted(even, time[k])) for k in (12_000, 16_500))
    return Log(PENDULUM_RATE, axes), (first, second)


def _halves(log: Log) -> tuple[Log, Log]:
    middle = len(log) // 2
    return log.part(0, middle), log.part(middle, len(log))
