"""Machine code kept on disk is never older than the source: not the function's own, nor what is
compiled into it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import FunctionType

import numpy as np
import pytest

from twin.core import compiled
from twin.core.compiled import digest
from twin.core.walks import walk
from twin.effects import load_catalogue
from twin.model.machine import AxisModel, Fitted, axis_table

PACKAGE = Path(compiled.__file__).parent.parent

SCRIPT = """
import json
import numpy as np
from twin.effects import load_catalogue
from twin.experiments.named import simulate
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel, axis_table
from twin.core.walks import walk
from twin.simulator import ReducedSimulator

catalogue = load_catalogue()

def along(name, **values):
    fitted = Fitted.at_start(catalogue[name], values)
    table = axis_table({"": AxisModel(3.0, Hardware(), (fitted,))})
    n = 40
    motion = np.stack([0.01 * np.arange(n), np.sin(np.arange(n)), np.ones(n)])
    rows = np.zeros((1, n))
    first, last, state, _, _ = table.axes[0]
    walk(table.entries, first, last, table.parameters, np.zeros(table.n_states), state, motion,
         np.zeros_like(motion), 1e-3, 0, rows, 3.0)
    return float(np.abs(rows).sum())

free = MachineModel("free", {"x": AxisModel(3.0, Hardware(travel=(-0.2, 0.2)), ())})
log = simulate(free, "moves", seed=1, duration=0.3, simulator=ReducedSimulator)
print(json.dumps({
    "law": along("quadratic_drag", c=2.0),
    "structure": along("flexible_mode", load=0.2, frequency=30.0, damping=0.1),
    "control": float(np.abs(log.axes["x"].force).sum()),
}))
"""

CHANGES = {
    "effects/quadratic_drag.py": ("io[OUT] = -", "io[OUT] = -2.0 * "),
    "core/native.py": (
        "now = slope(velocity, k, block)",
        "now = 2.0 * slope(velocity, k, block)",
    ),
    "core/control.py": ("gains[KP] *", "2.0 * gains[KP] *"),
}


def run(folder: Path) -> dict[str, float]:
    """Numbers of the copied package, from a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(folder), "NUMBA_OPT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_a_change_of_law_structure_or_controller_is_seen_by_the_next_process(
    tmp_path: Path,
) -> None:
    # Times of change are copied too, so the copy begins with the caches that the suite has filled.
    shutil.copytree(PACKAGE, tmp_path / "twin")
    shutil.copytree(PACKAGE.parent / "models", tmp_path / "models")
    before = run(tmp_path)
    for name, (old, new) in CHANGES.items():
        path = tmp_path / "twin" / name
        text = path.read_text()
        assert text.count(old) == 1, name
        path.write_text(text.replace(old, new))
    after = run(tmp_path)
    for what, value in before.items():
        assert value > 0.0, what
        assert abs(after[what] / value - 1.0) > 1e-6, f"{what}: the old code ran"


# --- what a digest knows -------------------------------------------------------------------------


def shifted(x):
    return x + SHIFT  # noqa: F821


def outer(x):
    return shifted(x) * SCALE + TABLE[0]  # noqa: F821


def with_globals(function, **names):
    """The same code, reading these globals."""
    return FunctionType(function.__code__, names)


def test_digest_differs_by_every_constant_callee_and_array_that_is_compiled_in() -> None:
    one, two = with_globals(shifted, SHIFT=1.0), with_globals(shifted, SHIFT=2.0)
    table = np.arange(3.0)
    variants = [
        with_globals(outer, shifted=one, SCALE=2.0, TABLE=table),
        with_globals(outer, shifted=two, SCALE=2.0, TABLE=table),
        with_globals(outer, shifted=one, SCALE=3.0, TABLE=table),
        with_globals(outer, shifted=one, SCALE=2.0, TABLE=table + 1.0),
        with_globals(shifted, SHIFT=1.0),
    ]
    assert len({digest(v) for v in variants}) == len(variants)


def test_digest_is_the_same_for_the_same_code() -> None:
    one, two = (
        with_globals(outer, shifted=with_globals(shifted, SHIFT=1.0), SCALE=2.0, TABLE=np.ones(2))
        for _ in range(2)
    )
    assert one is not two
    assert digest(one) == digest(two)


# --- the plain functions that a law calls --------------------------------------------------------

LAW = """
from math import copysign
{before}
from twin.effect import OUT, Effect, Kind, Parameter, V

{mark}
def inner(force, v):
    return force * copysign(1.0, v)

{mark}
def outer(p, v):
    return inner(p[0], v) if v != 0.0 else 0.0

def law(p, s, io):
    io[OUT] = -outer(p, io[V])

EFFECT = Effect(
    kind=Kind.FORCE, summary="", equation="", source="", law=law, fingerprint="", excited_by="",
    parameters=(Parameter("force", "N", 0.0, -1e3, 1e3, "force", strength=True),),
)
"""


@pytest.mark.parametrize(
    ("before", "mark"),
    [("", ""), ("from numba.extending import register_jitable", "@register_jitable")],
)  # fmt: skip
def test_a_law_may_call_functions_of_its_own_file(before, mark, tmp_path: Path) -> None:
    path = tmp_path / "steady.py"
    path.write_text(LAW.format(before=before, mark=mark))
    effect = load_catalogue([path])["steady"]
    table = axis_table({"": AxisModel(1.0, effects=(Fitted.at_start(effect, {"force": 2.0}),))})
    motion = np.array([[0.0, 0.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 0.0]])
    rows = np.zeros((1, 3))
    walk(
        table.entries, 0, 1, table.parameters, np.zeros(table.n_states), 0, motion,
        np.zeros_like(motion), 1e-3, 0, rows,
    )  # fmt: skip
    np.testing.assert_array_equal(rows, [[-2.0, 2.0, 0.0]])
    assert effect.reads("OUT")
    assert effect.reads("copysign"), "by the function that its function calls"
    assert not effect.reads("U")
