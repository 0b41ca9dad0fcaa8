"""The self-test as a command: what it runs, says, draws and refuses."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from benchmarks.__main__ import main
from benchmarks.selftest import chosen, parser
from benchmarks.selftest.design import FULL, QUICK, release_seed, run_all
from benchmarks.selftest.machines import Case
from benchmarks.selftest.trial import Answer, Held, TrialResult
from benchmarks.selftest.words import (
    confusion_matrix,
    reliability_diagram,
    save,
    selftest_json,
    selftest_text,
)
from identify.selection.findings import FindingKind

SURE = Answer(("a",), FindingKind.MISSING, True, 1.0, 0.95)
NAMED = TrialResult(Case(("a",), 5.0, 1), "MISSING_EFFECTS", (SURE,), ratio=5.0, left=1.0)
WRONG = replace(NAMED, answers=(replace(SURE, names=("b",), right=False, confidence=0.55),))
QUIET = TrialResult(Case((), 0.0, 2), "NOTHING_MISSING", held=(Held("mass", 0.3, True),))
EVERY = [NAMED, WRONG, QUIET]


def test_the_text_tells_the_seed_the_strata_confidence_and_what_failed():
    text = selftest_text(EVERY, 17)
    lines = [line.strip() for line in text.splitlines()]
    assert lines[0] == "seed 17, 3 machines"
    assert "plain, named at 5: 1 of 2 (50 %, 95 % interval 1 to 99 %)" in lines
    assert any(line.startswith("confidence: stated 95 % on average, right 90 to") for line in lines)
    assert lines[-1] == "wrong: python -m benchmarks selftest --case a@5/plain/1: b (55 %)"


def test_the_json_holds_every_trial():
    found = json.loads(json.dumps(selftest_json(EVERY, 17), allow_nan=False))
    assert found["seed"] == 17
    assert [t["case"] for t in found["trials"]] == [str(o.case) for o in EVERY]
    assert found["trials"][1]["answers"][0]["names"] == ["b"]
    assert [(t["stated"], t["count"], t["trials"]) for t in found["reliability"]] == [
        (0.55, 0, 1), (0.95, 1, 1),
    ]  # fmt: skip


# --- pictures --------------------------------------------------------------------------------


@pytest.mark.parametrize("picture", [confusion_matrix, reliability_diagram])
def test_the_pictures_are_drawn(tmp_path, picture):
    save(picture(EVERY), tmp_path / "picture.svg")
    assert "<svg" in (tmp_path / "picture.svg").read_text(encoding="utf-8")


def test_the_share_of_an_answer_stands_in_its_row_and_column():
    lost = TrialResult(Case(("a",), 5.0, 2), "UNEXPLAINED")
    other = replace(WRONG, case=Case(("b",), 5.0, 3), answers=(replace(SURE, names=("c",)),))
    figure = confusion_matrix([NAMED, lost, QUIET, NAMED, lost, other, NAMED])
    (axes,) = figure.axes
    rows = [t.get_text() for t in axes.get_yticklabels()]
    columns = [t.get_text() for t in axes.get_xticklabels()]
    assert rows == ["a", "b", "nothing"]
    assert columns == [
        "a", "b", "c", "ambiguous with it", "wrong shape", "unexplained", "nothing",
    ]  # fmt: skip
    found = {(rows[y], columns[x]): t.get_text() for t in axes.texts for x, y in [t.get_position()]}
    assert found == {
        ("a", "a"): "60", ("a", "unexplained"): "40", ("b", "c"): "100",
        ("nothing", "nothing"): "100",
    }  # fmt: skip
    shares = axes.get_images()[0].get_array()
    assert (shares[0, 0], shares[0, 5], shares[1, 2], shares[2, 6]) == (0.6, 0.4, 1.0, 1.0)


# --- the command -----------------------------------------------------------------------------


def test_the_machines_are_those_asked_for():
    def asked(*options):
        return chosen(parser().parse_args(options))

    assert asked() == (1, QUICK.cases(1))
    assert asked("--seed", "4", "--only", "wear") == (4, QUICK.cases(4, ["wear"]))
    assert asked("--full") == (release_seed(), FULL.cases(release_seed()))
    again = asked("--case", "wear@5/bumps/17", "--case", "nothing@0/plain/3")[1]
    assert again == [Case(("wear",), 5.0, 17, "bumps"), Case((), 0.0, 3)]


@pytest.mark.slow
def test_a_failing_machine_is_named():
    with pytest.raises(RuntimeError, match="no such effect"):
        run_all([Case(("no such effect",), 5.0, 1)], workers=1)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["--only", "coging"], "did you mean 'cogging'?"),
        (["-o", "no/m.png"], "no/m.png: its folder does not exist"),
        (["-o", "m.txt"], "m.txt: give a name that ends in .png, .svg, .pdf"),
        (["--reliability", "no/m.png"], "no/m.png: its folder does not exist"),
        (["--seed", "-1"], "seed -1: is not allowed"),
        (["--case", "cogging"], "give EFFECT@STRENGTH/VARIATION/SEED"),
        (["--case", "cogging@5/cabel/17"], "no variation 'cabel'; there are plain, bumps, cable,"),
    ],
)
def test_bad_input_is_one_line(given, said, capsys):
    assert main(["selftest", *given]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert said in err


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["emps", "empss"], "no benchmark empss; there are simulation, "),
        (["emps", "--seed", "3"], "benchmarks.emps has no options; give its name alone"),
    ],
)
def test_a_benchmark_that_is_none_or_has_no_options_is_one_line(given, said, capsys):
    assert main(given) == 2
    assert said in capsys.readouterr().err
