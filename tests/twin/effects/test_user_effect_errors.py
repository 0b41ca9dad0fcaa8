"""Mistakes in a user's own effect: exit code 2, one line that says what to try, no traceback."""

import re
from pathlib import Path

import pytest
from cli_runs import twin

from twin.effects import load_catalogue
from twin.errors import InputError

SOURCE = Path(__file__).parents[3] / "examples" / "my_effect.py"
LAW_END = "io[OUT] = -p[0] * distance * exp(-ratio * ratio)"
STRENGTH = '"N/m", 0.0, -1e5, 1e5, "stiffness at the place"'
FAULTS = {
    "unit left empty": (STRENGTH, STRENGTH.replace("N/m", ""), "has no unit"),
    "unit forgotten": (STRENGTH, STRENGTH.replace('"N/m", ', ""), "name, unit, start, lower"),
    "start outside": (STRENGTH, STRENGTH.replace("0.0", "2e5"), "outside its bounds"),
    "one state too few": (
        "    law=law,", '    law=law,\n    states=("own",),', "s[1], but 1 states",
    ),
    "negative index": (LAW_END, LAW_END.replace("p[0]", "p[-1]"), "p[-1], but 3 parameters"),
    "io too far": (LAW_END, LAW_END.replace("io[OUT]", "io[99]"), "io[99], but it has"),
    "nothing at v = 0": (LAW_END, "io[OUT] = p[0] / io[V]", "no finite number at v = 0 m/s"),
    "domain": (LAW_END, "io[OUT] = p[0] * sqrt(io[V])", "no finite number at v = -1e-06 m/s"),
    "no result": (LAW_END, "distance = ratio", "its law writes no result; a force effect writes"),
    "not compiled": (LAW_END, 'io[OUT] = float("%g" % p[0])', "cannot be compiled"),
    "index far away": (LAW_END, f"{LAW_END} + (p[int(io[X])] if io[X] > 3.0 else 0.0)", "at x = "),
    "exit": ("EFFECT = ", "import sys\nsys.exit(0)\nEFFECT = ", "ended the program while it was"),
    "crash": ("EFFECT = ", "import ctypes\nctypes.string_at(0)\nEFFECT = ", "crashed .*SIGSEGV"),
    "loop in the law": (LAW_END, f"while io[V] > 0.05:\n        pass\n    {LAW_END}", "a loop"),
    "hunger": ("EFFECT = ", "bytearray(1 << 33)\nEFFECT = ", "as an effect: MemoryError"),
    "unknown name": (LAW_END, "io[OUT] = missing", "name 'missing' is not defined"),
}  # fmt: skip


ENDLESS = ("loop in the law",)  # ended after half a minute


@pytest.mark.parametrize(
    "fault", [pytest.param(f, marks=pytest.mark.slow) if f in ENDLESS else f for f in FAULTS]
)
def test_a_mistake_is_said_in_one_line(fault: str, tmp_path: Path) -> None:
    good, bad, message = FAULTS[fault]
    text = SOURCE.read_text(encoding="utf-8")
    assert good in text
    text = text.replace(good, bad).replace("import exp", "import exp, sqrt")
    text = text.replace("OUT, Effect", "OUT, V, Effect")
    if fault == "one state too few":
        text = text.replace(LAW_END, f"s[1] = distance\n    {LAW_END}")
    path = tmp_path / "bad.py"
    path.write_text(text, encoding="utf-8")
    done = twin("effects", "bad", "--effects", path, folder=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    (told,) = done.stderr.splitlines()
    assert re.search(message.replace("[", r"\["), told), told
    assert "bad" in told
    assert told.count(str(path)) <= 1


def test_the_example_itself_is_sound() -> None:
    done = twin("effects", SOURCE.stem, "--effects", SOURCE, folder=Path.cwd())
    assert done.returncode == 0
    assert "magnetic detent" in done.stdout


@pytest.mark.parametrize(
    ("name", "times"),
    [("cogging", 1), ("mine", 2), ("cogging_2", 1)],  # the second cogging of an axis
)
def test_the_name_of_another_effect_is_refused(name: str, times: int, tmp_path: Path) -> None:
    path = tmp_path / f"{name}.py"
    path.write_text(SOURCE.read_text(encoding="utf-8"), encoding="utf-8")
    with pytest.raises(InputError, match=f"there is an effect '{name}' already; give the file"):
        load_catalogue([path] * times)
