"""Logs of real machines by role, read from a folder that is not part of this tree.

The measurements belong to their authors. Each function takes the folder that holds one for each.

* EMPS: A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, 2019.
* LAAS: H. Andrade, laas_anti_cogging, public repository.
* ARTS: D. Coble et al., Dataset-Friction-Damper-with-Backlash, 2022, public repository.
* silverbox: J. Schoukens, L. Ljung, T. Wigren; public repository biaslab/nsi-silverbox.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from benchmarks.judgement import Logs
from twin.importers import import_log, load_mapping
from twin.logs import AxisLog, Log

EXAMPLES = Path(__file__).parents[1] / "examples"
INCH, KIP = 0.0254, 4448.2216152605  # m, N
ARTS_RATE, SILVERBOX_RATE = 1024.0, 1e7 / 2**14  # Hz
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


def _halves(log: Log) -> tuple[Log, Log]:
    middle = len(log) // 2
    return log.part(0, middle), log.part(middle, len(log))
