"""The self-test in small: what is planted is named, and a machine can be made again."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from cli_runs import refusal

from identify.output.machine import plain
from identify.output.selftest import selftest_json, selftest_text
from identify.selection.findings import FindingKind
from identify.selftest import Case, TrialResult, draw, draw_reliability, run_all
from identify.selftest.design import plantable
from identify.selftest.trial import STAGE, Answer, Held, run
from twin.effects import Catalogue, load_catalogue
from twin.model.file import load_model

SLOW = pytest.mark.slow


@SLOW  # tests/test_hidden_effects.py hides one
@pytest.mark.parametrize("effect", ["cogging", "thermal_drift", "asymmetric_friction"])
def test_what_is_planted_is_named_on_most_machines(effect):
    """At 95 % right, fewer than four of five are one case in 50."""
    assert sum(run(Case((effect,), 5.0, seed)).right for seed in range(1, 6)) >= 4


@SLOW
@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
def test_nothing_planted_nothing_named(seed):
    found = run(Case((), 0.0, seed))
    assert not found.answers
    assert any(h.given for h in found.held)


@pytest.fixture
def small(monkeypatch):
    """Trials on logs of 5 s at a low rate, among five effects beside the stage's own."""
    every = load_catalogue()
    rivals = ("cogging", "quadratic_drag", "actuator_delay", "coulomb_viscous", "wear")
    own = {n for axis in load_model(STAGE, every).axes.values() for n in axis.names}
    few = Catalogue([e for n, e in every.items() if n in own.union(rivals)])
    slower = replace(load_model(STAGE, few), sample_rate=2500.0)
    monkeypatch.setattr("identify.selftest.trial.load_catalogue", lambda: few)
    monkeypatch.setattr("identify.selftest.trial.load_model", lambda name, catalogue: slower)
    monkeypatch.setattr("identify.selftest.cases.DURATION", 5.0)


def test_trials_in_small_name_what_is_planted_and_nothing_else(small):
    """One machine of each kind that the self-test counts; many of each are in the long set."""
    # Twenty times the floor: far above what a log of 5 s needs, so any seed will do.
    hidden = run(Case(("quadratic_drag",), 20.0, 1))
    assert hidden.right
    assert hidden.left < 1.3 < 5.0 < hidden.ratio
    assert hidden.tested > 0.8  # noise is left on any log
    assert hidden.held
    unknown = run(Case(("quadratic_drag",), 20.0, 1, known=False))
    assert not unknown.named


def test_a_design_plants_every_physical_effect_the_stage_lacks():
    catalogue = load_catalogue()
    axis = load_model(STAGE, catalogue).axes["x"]
    described = [n for n, e in catalogue.items() if e.is_nonparametric]
    # A second name of what the stage has or is offered: spring, hysteresis, viscous; and gravity.
    unfit = [n for n, e in catalogue.items() if n not in axis.names and not axis.can_have(e)]
    assert sorted([*plantable(catalogue), *axis.names, *described, *unfit]) == list(catalogue)
    assert not {"spring", "presliding_hysteresis"} & set(plantable(catalogue))
    assert "cable_hysteresis" in plantable(catalogue)


# --- what is shown, of invented outcomes ------------------------------------------------------

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
    assert lines[-1] == "wrong: twin selftest --case a@5/plain/1: b (55 %)"


def test_the_json_holds_every_trial():
    found = json.loads(json.dumps(plain(selftest_json(EVERY, 17))))
    assert found["seed"] == 17
    assert [t["case"] for t in found["trials"]] == [str(o.case) for o in EVERY]
    assert found["trials"][1]["answers"][0]["names"] == ["b"]
    assert [(t["stated"], t["count"], t["trials"]) for t in found["reliability"]] == [
        (0.55, 0, 1), (0.95, 1, 1),
    ]  # fmt: skip


@pytest.mark.parametrize("drawing", [draw, draw_reliability])
def test_the_pictures_are_drawn(tmp_path, drawing):
    drawing(EVERY, tmp_path / "picture.svg")
    assert "<svg" in (tmp_path / "picture.svg").read_text(encoding="utf-8")


def test_a_failing_machine_is_named():
    with pytest.raises(RuntimeError, match="no such effect"):
        run_all([Case(("no such effect",), 5.0, 1)], workers=1)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["--only", "coging"], "did you mean 'cogging'?"),
        (["-o", "no/m.png"], "folder does not exist"),
        (["--reliability", "no/m.png"], "folder does not exist"),
        (["--case", "cogging"], "give EFFECT@STRENGTH/VARIATION/SEED"),
        (["--case", "cogging@5/cabel/17"], "no variation 'cabel'; there are plain, bumps, cable,"),
    ],
)
def test_bad_input_is_one_line(given, said, tmp_path):
    assert said in refusal("selftest", *given, folder=tmp_path)
