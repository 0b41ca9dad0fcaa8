"""The texts of results with made-up numbers, all different, are those of ``texts.txt``.

`PYTHONPATH=tests python tests/identify/output/test_texts.py` writes them anew, to be read before
they are committed: whatever has changed there has changed for a user.
"""

from __future__ import annotations

import html
import re
from collections.abc import Callable
from dataclasses import replace
from datetime import date
from pathlib import Path

import built_results as made
import numpy as np
import pytest
from built_fits import CATALOGUE, NOISE, built, built_fit, fitted, step

from identify.dataset.dataset import Role
from identify.estimation.confounded import Refit
from identify.estimation.fit import Outcome
from identify.estimation.found_shape import FoundCurve, FoundShape, FreeExponent
from identify.estimation.intervals import refusal
from identify.estimation.offered import RestsTooOften
from identify.experiment_design.candidate_experiments import NotRun
from identify.output.blocks import blocks_of
from identify.output.machine import check_text, effect_text, effects_text, laws_text
from identify.output.words import fleet as words
from identify.output.words.verdict import named_in_words
from identify.printed import Pictured, Printed
from identify.results.fleet import (
    Alarm,
    Floor,
    Ingested,
    KindParameter,
    LiveAlarm,
    LiveCause,
    LiveParameter,
    MachineState,
    Off,
    Scope,
)
from identify.results.grown import AllAdded, Removal
from identify.selection.diagnosis import Verdict
from identify.selection.findings import FindingKind
from identify.validation.agreement import Agreement
from twin.checks import CheckReport, Fault, LogFinding, Severity
from twin.checks.report import Place
from twin.curve import Coordinate
from twin.laws import verdict
from twin.model.machine import Hindrance

FILE = Path(__file__).parent / "texts.txt"
IN_NOTEBOOK = ("fit", "two", "plan", "addition")  # a comparison and a diagnosis show their tables


def refused_fit():
    """Without an interval for a reason that holds for all parameters, which is said once."""
    result = made.fit_result()
    own = replace(made.estimates(0.0)[1], reason=refusal(result.fits["x"]))
    return replace(result, estimates={"x": (own,), "y": made.estimates(0.0)})


def curve_fit():
    """Of a curve without a law: its parameters are one sentence."""
    effect = CATALOGUE["empirical_map"]
    strength = replace(made.estimates(0.0)[0], label=f"{effect.name}.{effect.strengths[0].name}")
    fit = built_fit(1.0, axis=made.axis_of(fitted(effect.name)))
    return replace(made.fit_result(), fits={"x": fit}, estimates={"x": (strength,)})


COGGING, LUGRE = made.FOUND
ALONE = replace(COGGING, tied=())
OTHER_VALUE = replace(
    LUGRE, kind=FindingKind.WRONG_VALUE, bend=FreeExponent("sigma2", 0.43, 0.71, "N s/m")
)
IN_TURN = replace(LUGRE.score, in_turn=LUGRE.score.training)
TRAINED = replace(made.DATASET, channel_delay=0.0, selection=())
SHAPE = FoundShape(
    Coordinate.SPEED, np.array([0.1, 0.2]), "m/s", None, True, "N",
    {"forwards": FoundCurve(np.array([1.0, 1.5]), np.array([1.2, 2.9]), np.array([0.31, 0.43]))},
)  # fmt: skip


def of(x, **changes: object):
    """A diagnosis of axis x alone, without the next experiment; changes: other results of it."""
    alone = replace(made.diagnosed(x), axes={"x": x}, next_experiments={})
    return replace(alone, **changes)


def pair():
    """Two effects that the logs prove together alone."""
    both = (replace(ALONE, together=("lugre",)), replace(LUGRE, together=("cogging",)))
    ranking = (made.WEAK, replace(made.LATER, score=None))
    return of(made.diagnosis_of(findings=both, ranking=ranking))


def with_test_logs():
    """With test logs, which contradict one finding."""
    against = replace(ALONE, tested=made.errors(2.17, 2.29, Role.TEST)[0])
    dataset = replace(made.DATASET, test=made.DATASET.selection)
    found = made.diagnosis_of(on=Role.TEST, dataset=dataset, findings=(LUGRE,))
    return of(replace(found, contradicted=(against,)))


def trained():
    """Without selection logs, from a fit that did not converge, to one at a bound."""
    found = replace(ALONE, chosen=replace(ALONE.chosen, on=Role.TRAINING), left=1.33)
    x = made.diagnosis_of(
        base=built_fit(2.0, outcome=Outcome.NOT_CONVERGED), repeat=made.REPEAT, on=Role.TRAINING,
        final=replace(made.FINAL, outcome=Outcome.AT_BOUND), findings=(found,), dataset=TRAINED,
    )  # fmt: skip
    return of(x, refits={})


def moved():
    """Parameters that moved with what was found; no experiment, and effects that were not tried."""
    result = of(made.diagnosis_of())
    away = (made.MOVED, replace(made.MOVED, label="b", collapsed=True))
    summaries = {**result.summaries, "x": replace(result.summaries["x"], moved=away)}
    why = {
        "axis_coupling": Hindrance.OTHER_AXIS, "load_dependent_friction": Hindrance.IMPOSED,
        "payload_mass": Hindrance.IMPOSED, "actuator_lag": Hindrance.NO_ROTOR,
        "stribeck": RestsTooOften(),
    }  # fmt: skip
    tried = {"not_tried": {"x": why}, "not_planned": {"x": "no travel"}}
    return replace(result, summaries=summaries, **tried)


def shaped(kind: FindingKind, **more: object):
    finding = replace(LUGRE, kind=kind, shape=SHAPE, **more)
    verdict_ = Verdict.WRONG_SHAPE if kind is FindingKind.WRONG_SHAPE else Verdict.MISSING_EFFECTS
    return of(made.diagnosis_of(verdict_, findings=(finding,)))


def beyond():
    """Nothing missing of the training logs, while the selection logs show something."""
    result = made.diagnosed()
    summaries = {"y": replace(result.summaries["y"], beyond={Role.SELECTION: 3.0, Role.TEST: 1.1})}
    quiet = {"axes": {"y": result.axes["y"]}, "refits": {"y": Refit(1.0, 1.0, ())}}
    return replace(result, summaries=summaries, **quiet)


DRAG, WITH_LUGRE = step(made.RIVAL), step(made.LATER)
WEAR = replace(made.addition(), step=made.STEPS[2])
STRANGE = replace(made.TRIALS[1], gain=91.0)
IMPOSSIBLE = replace(made.TRIALS[1], gain=0.0, not_run=NotRun(made.TRIALS[1].experiment, "too far"))
LAW = verdict.LawOutcome("law 0", True, "")
LAWS = [
    verdict.LawReport("a", (LAW,)),
    verdict.LawReport(
        "b", (replace(LAW, holds=False, fault="off by 3"), replace(LAW, holds=None, fault="later"))
    ),
]
LATE = LogFinding(Severity.WARNING, Fault.LAG, "y", "the what", Place(1.5, 2.0, 3), "the remedy")

ADDED = (
    replace(made.STEPS[0], action="body", effect="forearm"), *made.STEPS[:2], made.STEPS[2],
)  # fmt: skip
REMOVED = replace(made.STEPS[0], action="remove")
DAYS = [date(2026, 3, day) for day in range(1, 7)]
ALARM = Alarm(
    "m1", "x", "stage", "lugre.Fc", "N", DAYS[5], DAYS[3], DAYS[2], DAYS[4], before=1.3, after=1.7,
    size=0.4, half_width=0.03, strength=7.1, scope=Scope.MACHINE, trend=0.011, others=("mass",),
)  # fmt: skip
HALL = replace(
    ALARM, machine=None, parameter="force_error", after=0.9, size=-0.4, trend=None, others=()
)
OFF = Off("m2", "y", "lugre.Fc", "N", 2.3, 1.9, 4.7)
KIND = KindParameter("x", "lugre.Fc", "N", 1.37, 0.12, 9, 1.41, 0.05)
LIVE = LiveAlarm("x", 9.7, 8.3, 0.023, 0.041, "N")
CAUSES = (
    LiveCause("x", 8.3, ("cogging", "wear")), LiveCause("x", 8.3, ()),
    LiveCause("x", 8.3, (), failed="too few logs"),
)  # fmt: skip


def floor() -> Floor:
    """One machine with an alarm and bad logs, one that is off from its kind."""
    first = MachineState("m1", "stage", 5, DAYS[5], 2, 1.1, (ALARM,), ())
    second = MachineState("m2", "stage", 5, DAYS[5], 0, 1.0, (), (OFF,))
    return Floor(Path("store"), (first, second), (HALL,), {}, {ALARM: ("wear",)}, ())


TEXTS: dict[str, Callable[[], object]] = {
    "fit": made.fit_result,
    "fit, intervals refused": refused_fit,
    "fit of a curve": curve_fit,
    "fit of simulated motion": made.simulation_fit,
    "fit of simulated motion that made the others worse": lambda: made.simulation_fit(
        Outcome.NOT_CONVERGED, (4.3e-3, 6.1e-3)
    ),
    "fit of simulated motion without other logs": lambda: made.simulation_fit(held=None),
    "two fits": lambda: Agreement({"x": made.SAME, "y": made.OTHER}, ("z",)),
    "two fits without a cause": lambda: Agreement(
        {"y": replace(made.OTHER, causes=(), error_over_noise_floor=(1.1, 1.0))}
    ),
    "comparison": made.compared,
    "comparison without a region above noise": lambda: made.Comparison(
        made.MODEL, {"x": replace(made.comparison_of(), worst=[])}
    ),
    "plan between two": lambda: made.plan_of(
        "cogging", "wear", favoured_by_the_logs="wear", supposed=True
    ),
    "plan between two models": lambda: made.plan_of(
        "a.toml", "b.toml", supposed=True, excited_by={}
    ),
    "plan that decides nothing": lambda: made.plan_of(
        "cogging", "wear", ranking=(replace(made.TRIALS[0], gain=10.0),)
    ),
    "plan in order of evidence": lambda: made.plan_of(
        "cogging", "wear", ranking=(made.TRIALS[0], made.TRIALS[1], IMPOSSIBLE, STRANGE)
    ),
    "plan for one model": lambda: made.plan_of("the stage", supposed=True),
    "addition": made.addition,
    "addition that nothing proves": lambda: made.addition(False),
    "addition with a test log": lambda: replace(made.addition(), step=made.STEPS[1]),
    "addition without selection log": lambda: WEAR,
    "a shape given": lambda: replace(WEAR, step=replace(WEAR.step, action="shape")),
    "diagnosis": lambda: made.diagnosed(
        made.diagnosis_of(unexplained=made.STRUCTURE, repeat=made.REPEAT, also_seen=("wear", "gms"))
    ),
    "diagnosis: one effect": lambda: of(made.diagnosis_of(findings=(ALONE,))),
    "diagnosis: two effects": lambda: of(made.diagnosis_of(findings=(ALONE, LUGRE))),
    "diagnosis: a pair": pair,
    "diagnosis: contradicted by test logs": with_test_logs,
    "diagnosis: training logs alone": trained,
    "diagnosis: what moved, what was not tried": moved,
    "diagnosis: like a law of another shape": lambda: shaped(FindingKind.RESEMBLES),
    "diagnosis: a law of another shape": lambda: shaped(FindingKind.WRONG_SHAPE),
    "diagnosis: a law with another exponent": lambda: shaped(
        FindingKind.WRONG_SHAPE, bend=FreeExponent("n", 2.0, 0.66, "1")
    ),
    "diagnosis: one missing, one of another value": lambda: of(
        made.diagnosis_of(findings=(ALONE, OTHER_VALUE))
    ),
    "diagnosis: another value": lambda: of(made.diagnosis_of(findings=(OTHER_VALUE,))),
    "diagnosis: one of two by other logs in turn": lambda: of(
        made.diagnosis_of(findings=(ALONE, replace(LUGRE, score=IN_TURN)))
    ),
    "diagnosis: by other logs in turn": lambda: of(
        made.diagnosis_of(findings=(replace(LUGRE, score=IN_TURN),))
    ),
    "diagnosis: unexplained": lambda: of(
        made.diagnosis_of(Verdict.UNEXPLAINED, unexplained=made.STRUCTURE)
    ),
    "diagnosis: nothing missing but elsewhere": beyond,
    "diagnosis: noise": lambda: of(made.diagnosis_of(steps=(step(built(NOISE)),))),
    "diagnosis: steps that are not named": lambda: of(
        made.diagnosis_of(
            steps=(DRAG, replace(WITH_LUGRE, dropped=("quadratic_drag",))), findings=(LUGRE,)
        )
    ),
    "diagnosis: a tie told once": lambda: of(
        made.diagnosis_of(
            findings=(replace(COGGING, tied=("lugre",)), replace(LUGRE, tied=("cogging",)))
        )
    ),
    "all that was found added": lambda: AllAdded(made.MODEL, made.fit_result(), ADDED, True),
    "all that was found added, which nothing proves": lambda: AllAdded(
        made.MODEL, made.fit_result(), ADDED[1:], False
    ),
    "removal": lambda: Removal(made.MODEL, REMOVED, needed=False),
    "removal of what is needed": lambda: Removal(made.MODEL, REMOVED, needed=True),
    "feedforward": made.feedforward,
    "fleet: what became of logs": lambda: words.ingested_in_words(
        Ingested(Path("logs"), Path("store"), 12, 7, 3, 2, 0)
    ),
    "fleet: how machines stand": lambda: words.floor_in_words(floor()),
    "fleet: what a machine needs attention for": lambda: words.state_in_words(
        floor().machines[0]
    ),
    "fleet: a table": lambda: words.table_text(("machine", "Fc"), (("m1", 1.25), ("m12", None))),
    "fleet: a kind": lambda: words.kind_in_words("stage", [KIND], "m1"),
    "live": lambda: "\n".join(
        [
            words.live_in_words(LIVE),
            words.live_in_words(replace(LIVE, after=0.011)),
            *map(words.cause_in_words, CAUSES),
            words.parameter_in_words(LiveParameter("lugre.Fc", 1.5, 0.02, 1.31, "N")),
        ]
    ),
    "catalogue": lambda: effects_text([CATALOGUE["wear"], CATALOGUE["gms"]]),
    "effect": lambda: effect_text(CATALOGUE["coulomb_viscous"]),
    "laws": lambda: laws_text(LAWS),
    "check": lambda: check_text({"a": CheckReport((LATE,)), "b": CheckReport(())}),
}  # fmt: skip


def texts() -> dict[str, str]:
    made_now = {name: result() for name, result in TEXTS.items()}
    return {name: str(r) for name, r in made_now.items()}


def kept() -> dict[str, str]:
    parts = re.split(r"^== (.+)\n", FILE.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    return {n: text.rstrip("\n") for n, text in zip(parts[::2], parts[1::2], strict=True)}


def test_there_is_a_text_of_every_result() -> None:
    assert list(kept()) == list(TEXTS)


def test_every_kind_of_result_has_something_to_show() -> None:
    bare = [k for k in kinds(Printed) if blocks_of.dispatch(k) is blocks_of.dispatch(object)]
    assert bare == [Pictured]  # which is no result, but what several are


def kinds(of: type) -> list[type]:
    return [k for own in of.__subclasses__() for k in (own, *kinds(own))]


@pytest.mark.parametrize("name", TEXTS)
def test_a_text_is_as_it_was_read(name: str) -> None:
    result = TEXTS[name]()
    text = str(result)
    assert text.splitlines() == kept()[name].splitlines()


@pytest.mark.parametrize("name", [n for n in TEXTS if n.partition(" ")[0] in IN_NOTEBOOK])
def test_a_notebook_shows_every_number_of_the_text(name: str) -> None:
    result = TEXTS[name]()
    shown = re.sub(r"\s+", " ", re.sub("<.*?>", " ", html.unescape(result._repr_html_())))
    numbers = re.findall(r"\d+\.\d+", str(result))
    assert numbers
    assert not [n for n in numbers if n not in shown]


if __name__ == "__main__":
    FILE.write_text("".join(f"== {n}\n{text}\n\n" for n, text in texts().items()), encoding="utf-8")


def test_what_explains_next_to_nothing_is_told_behind_the_others() -> None:
    cogging, lugre = made.FOUND
    found = made.diagnosis_of(findings=(cogging, replace(lugre, explains=0.002)))
    assert named_in_words(found).endswith(", and for less than 1 % of the squared error lugre")
    assert named_in_words(made.diagnosis_of(findings=(replace(lugre, explains=0.002),))) == "lugre"
