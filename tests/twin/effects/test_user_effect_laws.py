"""`twin effects --check`: what a user's own effect breaks is said in a line, and the exit code."""

import json
from pathlib import Path

import pytest
from cli_runs import refusal, twin

from twin.laws.verdict import LAWS

SOURCE = Path(__file__).parents[3] / "examples" / "my_effect.py"
LAW_END = "io[OUT] = -p[0] * distance * exp(-ratio * ratio)"
FAULTS = {
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


@pytest.mark.parametrize("fault", FAULTS)
def test_a_broken_law_is_said_in_one_line(fault: str, tmp_path: Path) -> None:
    """Where it reads what it has not, nothing else is tried: compiled, it would read anywhere."""
    good, bad, law, said = FAULTS[fault]
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


def test_json_is_one_object_of_every_file(tmp_path: Path) -> None:
    good, bad = written(tmp_path, "mine"), written(tmp_path, "bad", *FAULTS["never acts"][:2])
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
