"""The figures of the benchmarks: targets, files, and no NaN in JSON; what is counted and timed."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from benchmarks import figures
from benchmarks.figures import Figure, Origin, Target, kept_tables, write_results
from benchmarks.size import Code, at
from benchmarks.stages import STAGES
from twin.errors import InputError

RESULTS = Path(figures.__file__).parent


@pytest.mark.parametrize(
    ("target", "met", "missed", "words"),
    [
        (Target(low=2.0), (2.0, 9.0), (1.9,), "at least 2"),
        (Target(high=3.0), (3.0, -1.0), (3.1,), "at most 3"),
        (Target(2.0, 3.0), (2.0, 3.0), (1.9, 3.1), "at least 2 and at most 3"),
        (Target(), (-1e300, 1e300), (math.nan,), ""),
    ],
)
def test_a_target_is_an_interval_with_its_ends(target, met, missed, words):
    assert all(Figure("w", v, target=target).passed is True for v in met)
    assert all(Figure("w", v, target=target).passed is False for v in missed)
    assert str(target) == words
    assert [Figure("w", v, target=target).verdict for v in (met[0], missed[0])] == ["pass", "FAIL"]


def test_a_table_is_of_this_minor_version():
    now = Origin.now().minor
    tables = {title: Origin(**t["origin"]) for title, t in kept_tables(RESULTS).items()}
    assert not [title for title, origin in tables.items() if origin.minor < now]
    text = (RESULTS / "RESULTS.md").read_text(encoding="utf-8")
    assert all(f"## {title}\n\n{origin}\n" in text for title, origin in tables.items())


def test_figures_without_value_or_target_have_no_verdict():
    assert (Figure("w", None, target=Target()).passed, Figure("w", 1.0).passed) == (None, None)
    assert (Figure("w", None).verdict, Figure("w", 1.0).verdict) == ("skipped", "")


def strict(path):
    def refuse(constant):
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


def test_results_are_kept_for_what_was_not_run(tmp_path):
    old = [Figure("speed", 12.345, "ns", Target(high=20.0), "a note"), Figure("rate", None)]
    write_results({"first": old, "second": [Figure("x", 1.0)]}, tmp_path)
    write_results({"second": [Figure("y", np.float64(3.0), "s", Target(low=4.0))]}, tmp_path)
    tables = strict(tmp_path / "RESULTS.json")
    assert all(t["origin"]["commit"] and t["origin"]["date"] for t in tables.values())
    found = {title: t["figures"] for title, t in tables.items()}
    assert found["first"] == [
        {"figure": "speed", "value": 12.345, "unit": "ns", "target": "at most 20", "passed": True,
         "note": "a note"},
        {"figure": "rate", "value": None, "unit": "1", "target": None, "passed": None, "note": ""},
    ]  # fmt: skip
    assert [f["figure"] for f in found["second"]] == ["y"]
    text = (tmp_path / "RESULTS.md").read_text(encoding="utf-8")
    rows = [[c.strip() for c in line.split("|")[1:-1]] for line in text.splitlines() if "|" in line]
    assert ["speed", "12.3", "ns", "at most 20", "pass", "a note"] in rows
    assert ["rate", "", "1", "", "", ""] in rows
    assert ["y", "3", "s", "at least 4", "FAIL", ""] in rows
    assert sorted(p.name for p in tmp_path.iterdir()) == ["RESULTS.json", "RESULTS.md"]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_figure_that_is_no_number_is_null_in_the_file(tmp_path, value):
    write_results({"first": [Figure("speed", value, target=Target(low=0.0))]}, tmp_path)
    (row,) = strict(tmp_path / "RESULTS.json")["first"]["figures"]
    assert row["value"] is None


# What is counted of the code: lines, constants, patches, circles and private functions


CODE = Code({
    "twin/__init__.py": "",
    "twin/a.py": (
        "from twin.b import f\n"
        "LIMIT = 3.0  # m\n"
        "LOW, HIGH = -1, 2 * 5\n"
        "# Both ways.\n"
        "ENDS: tuple[int, ...] = (1, 2)\n"
        "NAME, SURE = 'x', True\n"
        "def _g(): ...\n"
    ),
    "twin/b.py": (
        "from typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n"
        "    import twin.a\n"
        "class C:\n"
        "    def __init__(self): ...\n"
        "def f(): ...\n"
    ),
    "twin/c.py": "from twin import b, a\n",
    "tests/test_a.py": (
        "def test(monkeypatch):\n"
        "    monkeypatch.setattr(a, 'f', 1)\n"
        "    monkeypatch.chdir('x')\n"
        "    with patch('a.f'), patch.object(a, 'f'):\n"
        "        Mock()\n"
    ),
})  # fmt: skip


def test_code_is_counted() -> None:
    package = CODE.below("twin")
    assert package.lines == [0, 7, 6, 1]
    assert package.constants == [(1, True), (2, False), (1, True)]
    assert package.circles == 1  # a and b, by a type alone
    assert package.private_share == pytest.approx(1 / 3)
    assert (package.patches, CODE.below("tests").patches) == (0, 4)


def test_a_revision_that_is_none_is_one_line() -> None:
    with pytest.raises(InputError, match=r"revision 'no such': git does not know it here \(.*\)"):
        at("no such")


# The stages that the benchmark of a diagnosis times are functions that a diagnosis calls


@pytest.mark.parametrize(
    ("module", "function"), [s[1:] for s in STAGES], ids=[s[0] for s in STAGES]
)
def test_exists(module, function):
    assert callable(getattr(module, function))


def test_lines_of_code_are_those_without_docstrings_blanks_and_comments():
    text = '"""What\nit is."""\n\nx = (  # why\n    1,\n)\n# alone\n'
    text += 'class A:\n    """A."""\n    y: int\n    """Of it."""\n'
    assert Code({"twin/a.py": text}).code_lines == 5
