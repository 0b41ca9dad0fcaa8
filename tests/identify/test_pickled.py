"""Results are plain: they go through pickle, and to another process and back."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import built_results as made
import numpy as np
import pytest
from built_fits import CATALOGUE
from report_cases import cogging_case

from identify import workflow
from identify.estimation.fit import fit_axis
from identify.output.as_json import json_of
from identify.selection.diagnosis import diagnose_axis
from twin.effects import Catalogue, load_catalogue
from twin.model.machine import Fitted, MachineModel

EXAMPLE = Path(__file__).parents[2] / "examples" / "my_effect.py"


def again(value):
    return pickle.loads(pickle.dumps(value))


@pytest.mark.parametrize("effect", CATALOGUE.values(), ids=lambda e: e.name)
def test_an_effect_comes_back_equal(effect):
    several = [effect.numbered(2)] if effect.several else []
    sized = [effect.of_size(7)] if effect.of_size else []
    assert [*map(again, (effect, *several, *sized))] == [effect, *several, *sized]


def with_own_effect() -> MachineModel:
    """A model with the law of a user's file."""
    own = load_catalogue([EXAMPLE])["my_effect"]
    axis = cogging_case().model.axes["x"]
    return cogging_case().model.with_axis("x", axis.with_effect(Fitted.at_start(own)))


def laws_of(model: MachineModel) -> list[str]:
    """As another process has them, which has read no user's file."""
    return [f.effect.summary for f in model.axes["x"].effects]


@pytest.mark.slow
def test_a_fit_in_another_process_is_the_same():
    case, own = cogging_case(), with_own_effect()
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        there = pool.submit(workflow.fit, case.model, case.fit, case.held)
        laws = pool.submit(laws_of, own)
        here = workflow.fit(case.model, case.fit, case.held)
        assert json_of(there.result()) == json_of(here)
        assert there.result().model == here.model
        assert laws.result() == laws_of(own)
    assert again(own) == own


@pytest.mark.short(3)
@pytest.mark.parametrize(
    "result",
    [made.fit_result, made.simulation_fit, made.compared, made.addition, made.diagnosed,
     lambda: made.plan_of("cogging", "wear"), lambda: cogging_case().diagnosis,
     lambda: cogging_case().addition,
     lambda: replace(made.diagnosed(), bodies=(made.wrong_body(),))],
)  # fmt: skip
def test_a_result_says_the_same_when_it_comes_back(result):
    given = result()
    found = again(given)
    assert json_of(found) == json_of(given)
    assert str(found) == str(given)


@pytest.mark.short(2)
def test_a_result_prints_in_a_process_that_has_asked_nothing_yet(tmp_path):
    """It told "print it to read it" when it was printed behind a pool of processes."""
    (tmp_path / "result").write_bytes(pickle.dumps(made.fit_result()))
    code = "import pickle, sys; print(pickle.load(open(sys.argv[1], 'rb')))"
    run = [sys.executable, "-c", code, str(tmp_path / "result")]
    there = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    said = subprocess.run(run, capture_output=True, check=True, encoding="utf-8", env=there)
    assert said.stdout == f"{made.fit_result()}\n"


@pytest.mark.slow
def test_what_comes_back_is_worked_with():
    """A fit and a dataset that were kept go on as those that they were."""
    case = cogging_case()
    kept = again(case.x)
    assert np.array_equal(kept.base.residual, case.x.base.residual)
    assert fit_axis(kept.final.axis, kept.dataset.training).axis.names == case.x.final.axis.names
    found = diagnose_axis(kept.base, kept.dataset, Catalogue([CATALOGUE["cogging"]]))
    assert found.named == case.x.named
