"""Examples to begin with: files, simulated data, and the commands to type."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from twin.errors import InputError, near
from twin.files import make_folder, write_atomically

SECONDS = 10.0  # of each log
RECORDING_MAP = """\
# Map of recording.csv: what each column is, in which unit
time = {column = "t [s]", unit = "s"}

[axes.x]
position = {column = "encoder x [mm]", unit = "mm"}
current = {column = "motor x [A]", unit = "A"}
force_constant = 53.4 # N/A
# not used: encoder y [mm]
"""


@dataclass(frozen=True)
class Example:
    """One example. files: of the package; make: writes simulated data into a folder.

    data: where measurements come from that are others' to give; None where there are none.
    """

    summary: str
    commands: tuple[str, ...]
    files: tuple[str, ...] = ()
    make: Callable[[Path], None] | None = None
    data: str | None = None


def examples_folder() -> Path:
    """Folder of the example files, of an installation or of the source."""
    package = Path(__file__).parent
    installed = package / "example_files"
    return installed if installed.is_dir() else package.parent / "examples"


def write_example(name: str, folder: Path) -> tuple[Example, list[Path]]:
    """Write the files of an example into a folder that is new or empty; and which they are.

    Raises InputError for an unknown example, and where the folder holds something.
    """
    if name not in EXAMPLES:
        hint = near(name, EXAMPLES)
        raise InputError(f"unknown example '{name}'; {hint}there are {', '.join(EXAMPLES)}")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: exists and is not an empty folder; give another with -o")
    make_folder(folder)
    example = EXAMPLES[name]
    for file in example.files:
        shutil.copyfile(examples_folder() / file, folder / file)
    if example.make is not None:
        example.make(folder)
    return example, sorted(folder.iterdir())


def _hidden_effect(folder: Path) -> None:
    from twin.logs import write_log
    from twin.model.file import load_model
    from twin.simulation.simulate import simulate

    machine = load_model("example_machine")
    runs = (("fit", "moves"), ("held", "tracking"), ("test", "moves"))
    for seed, (role, run) in enumerate(runs, start=1):
        log = simulate(machine, run, seed=seed, duration=SECONDS)
        write_log(log, folder / f"{role}.mcap")


def _recording(folder: Path) -> None:
    from twin.model.file import load_model
    from twin.simulation.simulate import simulate

    recorded = 2000.0  # Hz, of the recording as CSV
    machine = replace(load_model("example_machine"), sample_rate=recorded)
    log = simulate(machine, "tracking", seed=1, duration=SECONDS)
    x, y = log.axes["x"].columns, log.axes["y"].columns
    rows = zip(log.time, 1e3 * x["position"], x["current"], 1e3 * y["position"], strict=True)
    lines = ["t [s],encoder x [mm],motor x [A],encoder y [mm]"]
    lines += [",".join(f"{value:.9g}" for value in row) for row in rows]
    write_atomically(folder / "recording.csv", ("\n".join(lines) + "\n").encode())
    write_atomically(folder / "map.toml", RECORDING_MAP.encode())


EXAMPLES: Mapping[str, Example] = {
    "hidden_effect": Example(
        "logs of a simulated machine with an effect that the model lacks",
        (
            "twin fit proton_xy fit.mcap --holdout held.mcap -o fitted.toml",
            "twin diagnose fitted.toml fit.mcap --holdout held.mcap --test test.mcap -o found.html",
        ),
        make=_hidden_effect,
    ),
    "recording": Example(
        "a simulated recording as CSV with its map: import, check, first model",
        (
            "twin import recording.csv --map map.toml -o run.mcap",
            "twin check run.mcap",
            "twin new run.mcap -o model.toml",
            "twin fit model.toml run.mcap -o fitted.toml",
        ),
        make=_recording,
    ),
    "drive": Example(
        "a simulated drive with cogging, and a script that writes three recordings of it as CSV",
        (
            "python make_recordings.py .",
            "twin import --guess run1.csv -o map.toml",
            "twin simulate moves --model drive.toml -o moves.mcap",
        ),
        ("drive.toml", "make_recordings.py"),
    ),
    "own_effect": Example(
        "an effect of your own, a magnetic detent, in one Python file",
        (
            "twin effects --effects my_effect.py my_effect",
            "twin effects --effects my_effect.py --check",
        ),
        ("my_effect.py",),
    ),
    "emps": Example(
        "map and model of a ball screw drive, a public benchmark",
        (
            "twin import DATA_EMPS.mat --map import_emps.toml -o run.mcap",
            "twin import DATA_EMPS_PULSES.mat --map import_emps.toml -o pulses.mcap",
            "twin diagnose emps.toml run.mcap --holdout pulses.mcap --test-function 0.2",
        ),
        ("emps.toml", "import_emps.toml"),
        data="DATA_EMPS.mat and DATA_EMPS_PULSES.mat are their authors' to give: the EMPS "
        "benchmark of nonlinearbenchmark.org",
    ),
    "laas": Example(
        "map and model of a small motor with cogging",
        (
            "twin import speed_test.txt --map import_laas.toml -o speed.mcap",
            "twin diagnose laas.toml speed.mcap",
        ),
        ("laas.toml", "import_laas.toml"),
        data="speed_test.txt is in the public repository laas_anti_cogging of H. Andrade",
    ),
    "two_files": Example(
        "a map for a motion that two programs recorded",
        ("twin import encoder.csv drive.csv --map import_two_files.toml -o run.mcap",),
        ("import_two_files.toml",),
        data="encoder.csv and drive.csv stand for your own recordings",
    ),
    "viewer": Example(
        "a layout of Foxglove for logs and comparisons",
        ("twin simulate moves -o run.mcap",),
        ("foxglove.json",),
    ),
    "friction": Example(
        "a script that draws the friction models side by side",
        ("python friction_gallery.py .",),
        ("friction_gallery.py",),
    ),
}
