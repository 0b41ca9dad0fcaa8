"""A user's own effect: a mistake or a broken law is one line; its equation is read or refused."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from axis_runs import BOTH, Stepper, pushed
from cli_runs import refusal, twin

from twin.effects import load_catalogue
from twin.errors import InputError
from twin.laws.formula import NoFormula, formula
from twin.laws.verdict import LAWS
from twin.model.machine import Fitted

SOURCE = Path(__file__).parents[3] / "examples" / "my_effect.py"
LAW_END = "io[OUT] = -p[0] * distance * exp(-ratio * ratio)"
STRENGTH = '"N/m", 0.0, -1e5, 1e5, "stiffness at the place"'
MISTAKES = {
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
    "index far away": (LAW_END, f"{LAW_END} + (p[int(io[X])] if io[X] > 3.0 else 0.0)",
        "at x = .* m its law uses p.*, but 3 parameters are declared"),
    "exit": ("EFFECT = ", "import sys\nsys.exit(0)\nEFFECT = ", "ended the program while it was"),
    "crash": ("EFFECT = ", "import ctypes\nctypes.string_at(0)\nEFFECT = ", "crashed .*SIGSEGV"),
    "loop in the law": (LAW_END, f"while io[V] > 0.05:\n        pass\n    {LAW_END}", "a loop"),
    "hunger": ("EFFECT = ", "bytearray(1 << 33)\nEFFECT = ", "as an effect: MemoryError"),
    "unit of no SI": (STRENGTH, STRENGTH.replace("N/m", "N/mm"), "unit of k is 'N/mm', with 'mm'"),
    "another name of a slot": (LAW_END, f"{LAW_END} + 0.0 * io[OTHER]",
        "uses io[7] by another name; write io[X_OTHER]"),
    "a number for a slot": (LAW_END, f"{LAW_END} + 0.0 * io[86]",
        "uses io[86] by another name; write io[PRESSURE]"),
    "prints": (LAW_END, f"{LAW_END}\n    print(io[X])", "its law prints, at every sample"),
    "unknown name": (LAW_END, "io[OUT] = missing", "name 'missing' is not defined"),
}  # fmt: skip


ENDLESS = ("loop in the law",)  # ended after half a minute


@pytest.mark.parametrize(
    "fault", [pytest.param(f, marks=pytest.mark.slow) if f in ENDLESS else f for f in MISTAKES]
)
def test_a_mistake_is_said_in_one_line(fault: str, tmp_path: Path) -> None:
    good, bad, message = MISTAKES[fault]
    text = SOURCE.read_text(encoding="utf-8")
    assert good in text
    text = text.replace(good, bad).replace("import exp", "import exp, sqrt")
    text = text.replace("OUT, Effect", "OUT, V, X_OTHER as OTHER, Effect")
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


@pytest.mark.parametrize(
    ("name", "times"),
    [("cogging", 1), ("mine", 2), ("cogging_2", 1)],  # the second cogging of an axis
)
def test_the_name_of_another_effect_is_refused(name: str, times: int, tmp_path: Path) -> None:
    path = tmp_path / f"{name}.py"
    path.write_text(SOURCE.read_text(encoding="utf-8"), encoding="utf-8")
    with pytest.raises(InputError, match=f"there is an effect '{name}' already; give the file"):
        load_catalogue([path] * times)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1\n", "defines no EFFECT"),
        ("EFFECT = 3\n", "defines no EFFECT"),
        ("import no_such_module_anywhere\n", "cannot be loaded as an effect"),
        ("def law(:\n", "cannot be loaded as an effect"),
        (SOURCE.read_text(encoding="utf-8").replace('"place"', '"k"'), "used twice"),
        (None, "no such effect file"),
    ],
)
def test_a_file_that_is_no_effect_is_refused_in_one_line(text, message: str, tmp_path) -> None:
    path = tmp_path / "bad.py"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message) as caught:
        load_catalogue([path])
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("stage", BOTH)
def test_an_effect_acts_as_its_file_reads_now(stage: Stepper, tmp_path: Path) -> None:
    """Native code of the old text must not live on in a cache."""
    path = tmp_path / "mine.py"
    for sign, factor in (("-", 1.0), ("-2.0 * ", 2.0)):
        path.write_text(DRAG.format(sign=sign, equation="F = -c v"), encoding="utf-8")
        fitted = Fitted.at_start(load_catalogue([path])["mine"], {"c": 5.0})
        run = pushed(3.0, [fitted], np.full(500, 4.0), stage)
        np.testing.assert_allclose(run.of("mine"), -5.0 * factor * run.v, atol=1e-12)


BROKEN = {
    "a state that is not declared": (
        LAW_END, f"{LAW_END} + (p[0] * s[0] if p[0] > 9e4 else 0.0)",
        "uses only what it declares", "s[0], but 0 states are declared",
    ),
    "a wrong unit": (
        '"k", "N/m",', '"k", "N",', "is the same in other units",
        "check the units of its parameters",
    ),
    "a unit of its own": (
        "distance = io[X] - p[1]", "distance = io[X] - p[1] + 0.01", "is the same in other units",
        "numbers in the law that have a unit of their own",
    ),
    "a wrong sign": (
        "io[OUT] = -p[0]", "io[OUT] = p[0]", "is its equation", "the sign is the other one",
    ),
    "a power forgotten": (
        "exp(-ratio * ratio)", "exp(-ratio)", "is its equation", "correct the law or the equation",
    ),
    "never acts": (
        '"N/m", 0.0, -1e5, 1e5,', '"N/m", 0.0, -1e-5, 1e-5,', "acts within its bounds", "N rms",
    ),
}  # fmt: skip


def written(folder: Path, name: str, good: str = "", bad: str = "") -> Path:
    text = SOURCE.read_text(encoding="utf-8")
    assert good in text
    text = text.replace(good, bad) if good else text
    path = folder / f"{name}.py"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.short(2)
@pytest.mark.parametrize("fault", BROKEN)
def test_a_broken_law_is_said_in_one_line(fault: str, tmp_path: Path) -> None:
    """Where it reads what it has not, nothing else is tried: compiled, it would read anywhere."""
    good, bad, law, said = BROKEN[fault]
    path = written(tmp_path, "bad", good, bad)
    done = twin("effects", "bad", "--effects", path, "--check", folder=tmp_path)
    told = done.stdout.splitlines()
    failed = [line for line in told if "FAILED" in line]
    others = [line for line in told if line.startswith("bad: not tried: ")]
    assert len(others) == (len(told) - 1 if fault == "a state that is not declared" else 0)
    assert done.stderr == ""
    assert done.returncode == 1
    (line,) = [line for line in failed if law in line]
    assert line.startswith(f"bad: FAILED: {law}")
    assert said in line


def test_the_example_and_an_effect_of_the_catalogue_obey(tmp_path: Path) -> None:
    path = written(tmp_path, "mine")
    for asked in (("--effects", path), ("quadratic_drag",)):
        done = twin("effects", *asked, "--check", folder=tmp_path)
        assert done.returncode == 0, done.stdout
        lines = done.stdout.splitlines()
        assert all(": ok: " in line for line in lines)
        assert len(lines) == len(LAWS) - 1  # a force takes no energy as friction must


@pytest.mark.slow
def test_json_is_one_object_of_every_file(tmp_path: Path) -> None:
    good, bad = written(tmp_path, "mine"), written(tmp_path, "bad", *BROKEN["never acts"][:2])
    command = ("effects", "--effects", good, "--effects", bad, "--check", "--json")
    done = twin(*command, folder=tmp_path)
    answer = json.loads(done.stdout)
    assert (done.returncode, answer["ok"], list(answer["effects"])) == (1, False, ["mine", "bad"])
    assert all(law["holds"] and law["fault"] is None for law in answer["effects"]["mine"])
    (broken,) = [law for law in answer["effects"]["bad"] if not law["holds"]]
    assert broken["law"] == "acts within its bounds"
    assert "it does nothing" in broken["fault"]


def test_what_cannot_be_checked_is_refused(tmp_path: Path) -> None:
    assert "NAME" in refusal("effects", "--check", folder=tmp_path)
    assert "own" in refusal("effects", "cogging", "--check", "--plot", "c.png", folder=tmp_path)
    assert "'cogging'" in refusal("effects", "coging", "--check", folder=tmp_path)


DRAG = """
from twin.effect import OUT, Effect, Kind, Parameter, V


def law(p, s, io):
    io[OUT] = {sign}p[0] * io[V]


EFFECT = Effect(
    kind=Kind.FORCE, summary="eddy current brake", equation="{equation}", source="a test",
    parameters=(Parameter("c", "N s/m", 0.0, 0.0, 1e6, "braking", strength=True),),
    law=law, fingerprint="grows with speed", excited_by="fast passes",
)
"""
SPEED = {
    "equation in words": ("-", "a brake in proportion to speed", None),
    "sign, equation in words": ("", "a brake in proportion to speed", "gives no energy"),
    "sign in both": ("", "F = c v", "gives no energy"),
}


@pytest.mark.parametrize("case", SPEED)
def test_a_brake_that_drives_is_found(case: str, tmp_path: Path) -> None:
    sign, equation, law = SPEED[case]
    path = tmp_path / "brake.py"
    path.write_text(DRAG.format(sign=sign, equation=equation), encoding="utf-8")
    done = twin("effects", "brake", "--effects", path, "--check", folder=tmp_path)
    failed = [line for line in done.stdout.splitlines() if "FAILED" in line]
    assert done.returncode == (law is not None), done.stdout + done.stderr
    assert [law in line for line in failed] == [True] * (law is not None)


# The equation that an effect states is read as people write it, or refused as words


X, V = np.linspace(-0.3, 0.4, 50), np.linspace(0.5, -0.2, 50)
NAMES = {"k": 3.0, "w": 0.2, "c": 7.0, "n": 1.5, "place": 0.1}


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("F = -k d exp(-(d/w)^2),  d = x - place",
         -3.0 * (X - 0.1) * np.exp(-(((X - 0.1) / 0.2) ** 2))),
        ("F = -c |v/w|^n sgn(v);  with n = 2: drag", -7.0 * np.abs(V / 0.2) ** 1.5 * np.sign(V)),
        ("F = -c v |v|", -7.0 * V * np.abs(V)),
        ("F = -(k d + 2 d^3);  d = e/w, e = x - place",
         -(3.0 * (X - 0.1) / 0.2 + 2.0 * ((X - 0.1) / 0.2) ** 3)),
        ("F = k cos(2 pi x/w)", 3.0 * np.cos(2.0 * np.pi * X / 0.2)),
    ],
)  # fmt: skip
def test_it_is_computed_as_it_is_written(text, wanted):
    computed = formula(text, NAMES)
    np.testing.assert_allclose(computed({"x": X, "v": V, "t": 0.0 * X, **NAMES}), wanted)


@pytest.mark.parametrize(
    "text",
    ["a brake in proportion to speed", "F = sum_k a_k x", "F = -k x where it pushes", "F = k (x",
     "F = E(x) k", "F = -k x = -m g", "F = __import__(1)"],
)  # fmt: skip
def test_an_explanation_is_no_formula(text):
    with pytest.raises(NoFormula):
        formula(text, NAMES)({"x": X, "v": V, "t": X, **NAMES})


def test_effects_of_the_catalogue_are_among_what_is_compared():
    read = set()
    for effect in load_catalogue().values():
        try:
            formula(effect.equation, [p.name for p in effect.parameters])
        except NoFormula:
            continue
        read.add(effect.name)
    assert {"spring", "viscous_friction", "quadratic_drag", "constant_force"} <= read
