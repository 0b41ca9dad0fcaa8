"""The faults that `make bench` puts into the product: drawn again alike, each one a real change."""

from __future__ import annotations

import ast
import shutil
from collections import Counter
from pathlib import Path

import pytest

pytest.importorskip("cosmic_ray", reason="comes with the extra `bench`")

from benchmarks.mutation.faults import (
    Fault,
    draw,
    faults_on,
    is_at_import,
    is_native,
    operators,
    shares,
)
from benchmarks.mutation.noticed import Trial, figures
from benchmarks.mutation.reach import Reach, teller

ROOT = Path(__file__).resolve().parents[2]


def test_the_same_seed_draws_the_same_faults_and_each_changes_the_code(tmp_path: Path) -> None:
    (tmp_path / "twin/effects").mkdir(parents=True)
    for name in ("twin/curve.py", "twin/effects/cogging.py", "twin/effects/wear.py"):
        shutil.copy(ROOT / name, tmp_path / name)
    (tmp_path / "identify").mkdir()
    drawn = draw(tmp_path, 7, seed=6, least=3)
    assert draw(tmp_path, 7, seed=6, least=3) == drawn
    assert len(drawn) == 7
    assert min(Counter(fault.folder for fault in drawn).values()) >= 3
    for fault in drawn:
        source = (tmp_path / fault.path).read_text()
        altered = fault.applied(source)
        assert ast.dump(ast.parse(altered)) != ast.dump(ast.parse(source)), fault


@pytest.mark.parametrize(
    ("count", "least", "expected"),
    [
        (10, 3, {"a": 4, "b": 3, "c": 3}),  # the rest goes to the largest
        (30, 3, {"a": 23, "b": 4, "c": 3}),  # by their lines, where these ask for more
        (7, 5, {"a": 3, "b": 2, "c": 2}),  # too few for five of each
        (500, 5, {"a": 80, "b": 15, "c": 5}),  # no more than there are lines
    ],
)
def test_each_folder_has_its_least_and_the_rest_by_its_lines(count, least, expected) -> None:
    assert shares({"a": 80, "b": 15, "c": 5}, count, least) == expected


@pytest.mark.parametrize(
    ("line", "kind", "expected"),
    [
        ("y = f(a, b)", "SwapArguments", {"y = f(b, a)"}),
        ("y = f(a, b, c)", "SwapArguments", {"y = f(b, a, c)", "y = f(a, c, b)"}),
        ("y = f(a, a)", "SwapArguments", set()),
        ("y = f(a, key=b)", "SwapArguments", set()),
        ("y = np.maximum(a, b)", "SwapArguments", set()),
        ("y = np.convolve(a, b, c)", "SwapArguments", {"y = np.convolve(a, c, b)"}),
        (
            "x: int | str = f(a | b)",
            "ReplaceBinaryOperator_BitOr_BitAnd",
            {"x: int | str = f(a & b)"},
        ),
        ("T = TypeVar('T', covariant=True)", "ReplaceTrueWithFalse", set()),
        ("y = zip(a, b, strict=True)", "ReplaceTrueWithFalse", set()),
        ("y = f(a, sure=True)", "ReplaceTrueWithFalse", {"y = f(a, sure=False)"}),
        ("y = a + b - c", "DropTerm", {"y = a - c", "y = a + b"}),
    ],
)
def test_own_kinds_of_fault_do_what_they_say(line: str, kind: str, expected: set[str]) -> None:
    found = [f for f in faults_on("x.py", line + "\n", 1) if f.kind == kind]
    assert {f.applied(line + "\n").strip() for f in found} == expected
    assert kind in operators()


def test_lines_without_effect_are_left_alone() -> None:
    source = (
        'import numpy as np\n\n\ndef f(x: int | str = 3) -> int:\n    """2 + 2."""\n    return x\n'
    )
    assert [f.line for n in range(1, 7) for f in faults_on("x.py", source, n)] == []


def test_tests_of_a_line_come_quickest_first_and_within_the_budget() -> None:
    known = Reach({"a": 3.0, "b": 1.0, "c": 2.0, "d": 0.5}, {"x.py": {7: frozenset("abc")}})
    assert known.tests_for(Fault("x.py", 7, "k", 0), 10.0) == ["b", "c", "a"]
    assert known.tests_for(Fault("x.py", 7, "k", 0), 3.5) == ["b", "c"]
    # What runs at import, or in a process of its own: those of the folder as well.
    assert known.tests_for(Fault("x.py", 9, "k", 0), 10.0) == ["d", "b", "c", "a"]
    assert known.tests_for(Fault("y.py", 1, "k", 0), 1.0) == ["d"]
    assert known.tests_for(Fault("x.py", 7, "k", 0), 1.0, native=True) == ["d"]
    assert known.tests_for(Fault("x.py", 7, "k", 0), 1.0, at_import=True) == ["d"]
    files = Reach({"a": 1.0, "b": 2.0}, {"x.py": {1: frozenset("a"), 7: frozenset("b")}})
    assert files.tests_for(Fault("x.py", 1, "k", 0), 10.0) == ["a"]
    assert files.tests_for(Fault("x.py", 1, "k", 0), 10.0, at_import=True) == ["a", "b"]
    shared = Reach({"t.py::a": 1.0, "t.py::b": 2.0, "c": 0.1}, {"x.py": {7: frozenset({"t.py"})}})
    assert shared.tests_for(Fault("x.py", 7, "k", 0), 10.0) == ["t.py::a", "t.py::b"]
    assert [teller(f"t.py::a|{phase}") for phase in ("run", "setup")] == ["t.py::a", "t.py"]
    rooms = Reach({"tests/a/t.py::x": 2.0, "tests/b/t.py::y": 1.0}, {})
    assert rooms.tests_for(Fault("a/m.py", 1, "k", 0), 2.5) == ["tests/a/t.py::x"]
    named = Reach({"a": 0.1, "b[gms]": 2.0}, {"gms.py": {1: frozenset({"a", "b[gms]"})}})
    assert named.tests_for(Fault("gms.py", 1, "k", 0), 9.0) == ["b[gms]", "a"]


def test_laws_and_compiled_functions_are_native() -> None:
    law = "def law(p, s, io):\n    io[0] = p[0]\n\n\ndef f(x):\n    return x\n"
    assert [is_native(law, n) for n in (2, 6)] == [True, False]
    core = "@compiled(inline=True)\ndef f(x):\n    return x\n"
    assert is_native(core, 3)
    assert is_native("@intrinsic\ndef f(t, a):\n    def codegen(c):\n        return c\n", 4)


def test_shares_are_counted_by_folder() -> None:
    done = [
        Trial(Fault(f"{folder}/m.py", 1, "k", 0), "", 1, noticed, "")
        for folder, noticed in [("twin", True), ("twin", False), ("identify", True)]
    ]
    found = {f.what: f.value for f in figures(done, 7)}
    assert found == {"all, seed 7": pytest.approx(2 / 3), "twin": 0.5, "identify": 1.0}
    assert Counter(f.passed for f in figures(done, 7)) == {False: 2, True: 1}


def test_what_runs_at_import_is_in_no_function() -> None:
    source = "A = 1\n\n\nclass B:\n    c = 2\n\n    def d(self, e=3):\n        return 4\n"
    assert [is_at_import(source, line) for line in (1, 5, 7, 8)] == [True, True, True, False]
