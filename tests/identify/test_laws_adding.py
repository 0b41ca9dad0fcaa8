"""An effect is added where it helps most, and what that did is recorded."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import built_results as made
import pytest
from built_fits import CATALOGUE, PLAIN, axis_of, built, built_fit, fitted

from identify import workflow
from identify.dataset.given_logs import Role
from identify.output.words.diagnosis import moved_in_words, notes_in_words
from identify.results import addition as adding
from identify.results.addition import addition
from identify.validation import free_run as free_runs
from identify.workflow import add
from twin.errors import InputError
from twin.model.machine import MachineModel


def test_an_effect_is_added_where_it_helps_most(monkeypatch):
    both = SimpleNamespace(
        fits={"x": built_fit(3.0), "y": built_fit(4.0)}, datasets={"x": "sx", "y": "sy"},
        model=made.MODEL,
    )  # fmt: skip
    tried = []

    def attempt(fit, dataset, effect):
        tried.append((fit, dataset, effect.name))
        return built(effect, after={"sx": 4.0, "sy": 2.0}[dataset], axis=dataset[1])

    seen = []
    monkeypatch.setattr(workflow, "fit", lambda *a, **k: seen.append((a, k)) or both)
    monkeypatch.setattr(workflow, "try_effect", attempt)
    monkeypatch.setattr(workflow, "addition", lambda best, base, *_: (best, base))
    monkeypatch.setattr(workflow, "_with_notes", lambda made, why_axis: (*made, why_axis))
    wear = CATALOGUE["wear"]
    best, base, why = add(wear, made.MODEL, "logs", "held", "test", test_function=0.07)
    assert (best.axis, base) == ("y", both.fits["y"])
    assert why == "of axes x, y, axis y has the most evidence for it"
    assert [t[1:] for t in tried] == [("sx", "wear"), ("sy", "wear")]
    assert [t[0] for t in tried] == list(both.fits.values())
    assert seen[0][0][1:] == ("logs", "held", "test")
    assert seen[0][1]["test_function"] == 0.07
    bars = []
    found = add(wear, made.MODEL, "logs", axis="x", progress=lambda *done: bars.append(done))
    assert (found[0].axis, bars) == ("x", [("adding", 0, 1)])
    with pytest.raises(InputError, match="already"):
        add(CATALOGUE["coulomb_viscous"], made.MODEL, "logs")
    with pytest.raises(InputError, match="no axis"):
        add(wear, made.MODEL, "logs", axis="z")
    both.fits.pop("y")
    with pytest.raises(InputError, match="does not move"):
        add(wear, made.MODEL, "logs", axis="y")


@pytest.mark.parametrize("kept", [True, False])
def test_an_addition_records_errors_before_and_after(monkeypatch, kept):
    base = built_fit(7.3)
    best = built(
        "cogging", fit=built_fit(2.9, axis=axis_of(fitted("cogging"))), t=9 if kept else 0.9
    )
    dataset = replace(made.DATASET, holdout=("held",), test=("test",))
    model = MachineModel("m", {"x": PLAIN, "y": replace(PLAIN, mass=3.0)})
    runs = []

    def run(model, logs, simulator="reduced"):
        effects = len(model.axes["x"].effects)
        runs.append((effects, logs, getattr(simulator, "__name__", simulator)))
        return effects, simulator

    errors = {(1, "reduced"): 5.1, (2, "reduced"): 1.7}
    monkeypatch.setattr(adding, "estimates", lambda fit: (fit,))
    monkeypatch.setattr(adding, "intervals_to_keep", lambda fit, found: (fit.error, found))
    monkeypatch.setattr(free_runs, "free_run", run)
    monkeypatch.setattr(free_runs, "rms_error", lambda r, axis: errors.get(r, 1.9))
    told = {Role.SELECTION: {7.3: 8.1, 2.9: 3.3}, Role.TEST: {7.3: 9.7, 2.9: 4.1}}
    monkeypatch.setattr(
        adding, "error_if_any", lambda role, fit, s: told[role][round(fit.error, 9)]
    )
    monkeypatch.setattr(
        adding,
        "moved_parameters",
        lambda a, b: (replace(made.MOVED, before=a.error, after=b.error),),
    )
    whole = model.with_axis("x", axis_of(fitted("empirical_map")))
    found = addition(best, base, {"x": dataset}, model, whole)
    step = found.step
    assert (step.action, step.effect, step.axis) == ("add", "cogging", "x")
    assert (step.fit_error_before, step.fit_error_after) == pytest.approx((7.3, 2.9))
    assert (step.holdout_error_before, step.holdout_error_after) == (8.1, 3.3)
    assert (step.test_error_before, step.test_error_after) == (9.7, 4.1)
    assert (found.position_error, found.replayed) == ((5.1, 1.7), 1.9)
    assert all(r[1] == {"x": dataset.fit[0]} for r in runs)
    assert [r[2] for r in runs].count("MujocoSimulator") == 1
    assert next(r[0] for r in runs if r[2] == "MujocoSimulator") == 2
    assert (found.moved[0].before, found.moved[0].after) == pytest.approx((7.3, 2.9))
    kept_notes, notes = notes_in_words(found)
    assert kept_notes[0] == moved_in_words(found.moved[0])
    assert notes == kept_notes, "test logs decided nothing, so nothing is said of them"
    assert found.set_aside == ("empirical_map",)
    assert "empirical_map was removed" in notes[1]
    assert found.model.axes["x"] is best.fit.axis
    assert found.model.history == (step,)
    assert found.position_log == dataset.fit[0].motion.name
    told = found.with_notes(kept_notes, ("because", *notes))
    assert told.step.notes == told.model.history[-1].notes == kept_notes
    assert told.notes == ("because", *notes)
    assert found.kept is kept
