"""Machine code kept on disk is never older than the source: not the function's own, nor what is
compiled into it."""

from pathlib import Path
from types import FunctionType

import numpy as np
import pytest

from twin.core.compiled import digest
from twin.effects import load_catalogue
from twin.laws.trials import TrialMotion, forces
from twin.model.machine import Fitted


def shifted(x):
    return x + SHIFT  # noqa: F821


def outer(x):
    return shifted(x) * SCALE + TABLE[0]  # noqa: F821


def with_globals(function, **names):
    """The same code, reading these globals."""
    return FunctionType(function.__code__, names)


def test_digest_differs_by_every_constant_callee_and_array_that_is_compiled_in() -> None:
    one, two = with_globals(shifted, SHIFT=1.0), with_globals(shifted, SHIFT=2.0)
    table, alike = np.arange(3.0), with_globals(shifted, SHIFT=1.0)
    variants = [
        with_globals(outer, shifted=one, SCALE=2.0, TABLE=table),
        with_globals(outer, shifted=two, SCALE=2.0, TABLE=table),
        with_globals(outer, shifted=one, SCALE=3.0, TABLE=table),
        with_globals(outer, shifted=one, SCALE=2.0, TABLE=table + 1.0),
        with_globals(shifted, SHIFT=1.0),
    ]
    assert len({digest(v) for v in variants}) == len(variants)
    again = with_globals(outer, shifted=alike, SCALE=2.0, TABLE=table.copy())
    assert digest(again) == digest(variants[0])


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
    v = np.array([1.0, -1.0, 0.0])
    found = forces(
        [Fitted.at_start(effect, {"force": 2.0})], TrialMotion(1e-3, 0.0 * v, v, 0.0 * v)
    )
    np.testing.assert_array_equal(found["steady"], [-2.0, 2.0, 0.0])
    assert effect.reads("OUT")
    assert effect.reads("copysign"), "by the function that its function calls"
    assert not effect.reads("U")
