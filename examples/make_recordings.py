"""Write run1.csv, run2.csv and run3.csv: recordings as a drive would export them, to try out.

    python examples/make_recordings.py FOLDER

They are of a simulated machine (examples/drive.toml) at 2 kHz: time in s, position in mm, force in
N, setpoint in mm.
"""

import argparse
from pathlib import Path

import numpy as np

from twin.effects import load_catalogue
from twin.model.file import load_model
from twin.simulation.simulate import simulate

MACHINE = Path(__file__).parent / "drive.toml"
RUNS = (("moves", 1), ("tracking", 2), ("tracking", 3))  # experiment, seed
DURATION = 10.0  # s
RATE = 2000.0  # Hz


def main(folder: Path) -> None:
    machine = load_model(MACHINE, load_catalogue())
    every = max(1, round(machine.sample_rate / RATE))
    for number, (experiment, seed) in enumerate(RUNS, start=1):
        x = simulate(machine, experiment, seed=seed, duration=DURATION).axes["x"]
        columns = {
            "time_s": np.arange(len(x)) / machine.sample_rate,
            "position_mm": 1e3 * x.position,
            "force_N": x.force,
            "setpoint_mm": 1e3 * x.columns["setpoint_position"],
        }
        np.savetxt(
            folder / f"run{number}.csv", np.stack(list(columns.values()), axis=1)[::every],
            delimiter=",", header=",".join(columns), comments="",
            fmt=("%.4f", "%.6f", "%.5f", "%.6f"),
        )  # fmt: skip


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path())
    main(parser.parse_args().folder)
