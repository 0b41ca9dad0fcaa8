"""A model as feedforward: C against the laws, its time a call, and what it gains on machines.

Each machine departs from the stage in its values and in one hidden effect; the diagnosis has to
name it before its feedforward can be any better.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from contextlib import suppress
from pathlib import Path
from time import thread_time

import numpy as np

from benchmarks.figures import Figure, Target
from identify import workflow
from identify.demo import DURATION, SELECTION, TEST, TRAINING, hidden_machine
from twin.effect import Effect
from twin.effects import Catalogue, load_catalogue
from twin.errors import InputError
from twin.export.formats.c import CSource, c_source
from twin.feedforward import feedforward
from twin.laws.trials import companion, moderate
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.signals import Array
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator

TITLE = "A model as feedforward"
STRICT = ("-Wall", "-Wextra", "-Werror", "-std=c99", "-O2")
PERIOD, SECONDS = 1e-4, 10.0
HIDDEN = (
    "cogging", "force_constant_ripple", "position_dependent_friction", "actuator_lag",
    "axis_coupling", "load_dependent_friction",
)  # fmt: skip
SEED = 11
DRAWN = 8  # machines at most, until an effect shows


def measure() -> list[Figure]:
    """The figures of the C function, then those of the machines."""
    return [*_in_c(), *(_gain(effect, SEED + i) for i, effect in enumerate(HIDDEN))]


def _in_c() -> list[Figure]:
    what = "C, largest difference from the model over 10 s, over the largest force, worst effect"
    compiler = shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return [Figure(what, None, note="neither gcc nor clang is installed")]
    catalogue, rng = load_catalogue(), np.random.default_rng(SEED)
    rubbing = companion(catalogue["lugre"])
    axes = {}
    for effect in catalogue.values():
        own = Fitted.at_start(effect, moderate(effect, rng))
        beside = () if "FRICTION" in str(effect.kind) else (rubbing,)
        if not (effect.reads_other_axis or effect.channels):
            axes[effect.name] = AxisModel(3.0, effects=(*beside, own))
    made = c_source(MachineModel("all", axes, 1.0 / PERIOD))
    stage = c_source(load_model("proton_xy", catalogue))
    t = PERIOD * np.arange(round(SECONDS / PERIOD))
    x, v = (size * np.sin(3.7 * t + k) for size, k in ((0.05, 0.0), (0.05 * 3.7, 0.5 * np.pi)))
    a = np.gradient(v, PERIOD)  # as the walk takes it of a velocity, of fourth order inside
    a[2:-2] = (8.0 * (v[3:-1] - v[1:-3]) - v[4:] + v[:-4]) / (12.0 * PERIOD)
    motion = np.stack([x, v, a])
    with tempfile.TemporaryDirectory() as folder:
        code, of_stage = (_compiled(compiler, s, Path(folder) / s.name) for s in (made, stage))
        worst, slowest = (0.0, ""), (0.0, "")
        for name, axis in axes.items():
            found, spent = _run(code, f"all_{name}", motion)
            wanted = feedforward(axis, motion, np.zeros_like(motion), PERIOD)
            part = float(np.abs(found - wanted).max() / np.abs(wanted).max())
            worst, slowest = max(worst, (part, name)), max(slowest, (spent, name))
        _, spent = _run(of_stage, f"{stage.name}_x", motion)
    return [
        Figure(what, worst[0], target=Target(high=1e-9), note=worst[1]),
        Figure(
            "C, a call for axis x of the stage, CPU time", 1e9 * spent, "ns", Target(high=200.0)
        ),
        Figure("C, a call with the slowest effect", 1e9 * slowest[0], "ns", note=slowest[1]),
    ]


def _compiled(compiler: str, made: CSource, folder: Path) -> ctypes.CDLL:
    """The functions of a machine, each with a loop over a motion."""
    folder.mkdir()
    given = "int n, double *out, const double *x, const double *v, const double *a"
    loops = "".join(
        f"void run_{a.prefix}({given});\nvoid run_{a.prefix}({given}) {{\n"
        f"{a.prefix}_state state = {{0}};\n"
        f"for (int k = 0; k < n; k++) out[k] = {a.prefix}_force(&state, x[k], v[k], a[k]);\n}}\n"
        for a in made.axes
    )
    (folder / f"{made.name}.h").write_text(made.header)
    (folder / f"{made.name}.c").write_text(made.source)
    (folder / "run.c").write_text(f'#include "{made.name}.h"\n{loops}')
    command = [
        compiler,
        *STRICT,
        "-shared",
        "-fPIC",
        f"{made.name}.c",
        "run.c",
        "-o",
        "made",
        "-lm",
    ]
    subprocess.run(command, cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "made"))


def _run(code: ctypes.CDLL, name: str, motion: Array) -> tuple[Array, float]:
    """Force (n,) N along a motion, and the least CPU time of five for a call, s."""
    out, columns = np.zeros(motion.shape[1]), [column.copy() for column in motion]
    pointers = [a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in (out, *columns)]
    spent = []
    for _ in range(5):
        begun = thread_time()
        getattr(code, f"run_{name}")(len(out), *pointers)
        spent.append((thread_time() - begun) / len(out))
    return out, min(spent)


def _machine(model: MachineModel, effect: Effect, rng: np.random.Generator) -> MachineModel:
    """A machine in whose motion the effect shows, of some that are drawn."""
    for _ in range(DRAWN - 1):
        with suppress(InputError):
            return hidden_machine(model, Catalogue([effect]), rng)[0]
    return hidden_machine(model, Catalogue([effect]), rng)[0]


def _gain(effect: str, seed: int) -> Figure:
    """Tracking error with the diagnosed feedforward over that without the hidden effect."""
    catalogue, model = load_catalogue(), load_model("proton_xy")
    machine = _machine(model, catalogue[effect], np.random.default_rng(seed))
    logs = [
        {f"{i}": simulate(machine, name, seed=seed + 1000 * i, duration=DURATION,
                          simulator=ReducedSimulator)}
        for i, name in enumerate((*TRAINING, SELECTION, TEST))
    ]  # fmt: skip
    training = {name: log for one in logs[: len(TRAINING)] for name, log in one.items()}
    held, test = logs[-2:]
    found = workflow.diagnose(model, training, held, test, catalogue=catalogue)
    what = f"tracking error with the diagnosed feedforward over that without, {effect}"
    named = found.effect.name if found.effect else "nothing"
    if found.effect is None:
        return Figure(what, 1.0, target=Target(high=1 / 3), note=f"named {named}")
    worth = workflow.feedforward(found.model, test, found.fitted, machine=machine)
    axis = worth.axes[found.leading.dataset.axis]
    assert axis.before is not None
    note = (
        f"{1e6 * axis.before.rms:.3g} um to {1e6 * axis.diagnosed.rms:.3g} um; feedback alone "
        f"{1e6 * axis.without.rms:.3g} um; named {named}"
    )
    return Figure(what, axis.diagnosed.rms / axis.before.rms, target=Target(high=1 / 3), note=note)
