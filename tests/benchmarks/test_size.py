"""What is counted of the code: lines, constants, patches, circles and private functions."""

from __future__ import annotations

import pytest

from benchmarks.size import Code, at
from twin.errors import InputError

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
