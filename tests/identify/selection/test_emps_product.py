"""The product's own path on the EMPS measurements: import, fit, diagnose, add, stop.

A. Janot, M. Gautier, M. Brunot, "Data Set and Reference Models of EMPS", Workshop on Nonlinear
System Identification Benchmarks, 2019.
"""

from pathlib import Path

import emps_published
import numpy as np
import pytest
from emps_published import direction_dependent, identify, prediction_error, symmetric
from machines import CATALOGUE

from identify.adding import add
from identify.output.words.diagnosis import remarks_on
from identify.selection.diagnosis import Verdict
from identify.workflow import diagnose
from twin.effects import Catalogue
from twin.importers import import_log, load_mapping
from twin.logs import read_log, write_log
from twin.model.file import load_model

EXAMPLES = Path(__file__).parents[3] / "examples"
WINDOW = 0.2  # s


@pytest.fixture(scope="module")
def emps(shared_data, tmp_path_factory):
    folder = tmp_path_factory.mktemp("emps")
    mapping = load_mapping(EXAMPLES / "import_emps.toml")
    logs = {}
    for name in ("DATA_EMPS", "DATA_EMPS_PULSES"):
        imported = import_log(shared_data / "emps" / f"{name}.mat", mapping)
        write_log(imported, folder / f"{name}.mcap")
        logs[name] = read_log(folder / f"{name}.mcap")
    return {"run": logs["DATA_EMPS"]}, {"pulses": logs["DATA_EMPS_PULSES"]}


@pytest.fixture(scope="module")
def model():
    return load_model(EXAMPLES / "emps.toml", CATALOGUE)


# Other explanations of a friction that differs by direction, and of what repeats along the screw.
RIVALS = Catalogue(
    CATALOGUE[name]
    for name in ("asymmetric_friction", "position_dependent_friction", "quadratic_drag", "wear")
)


@pytest.fixture(scope="module")
def found(model, emps):
    return diagnose(model, *emps, catalogue=RIVALS, test_function=WINDOW)


@pytest.fixture(scope="module")
def added(found, emps):
    return add(CATALOGUE["asymmetric_friction"], found.fitted, *emps, test_function=WINDOW)


@pytest.mark.slow
def test_the_four_parameter_fit_is_near_the_published_one(found):
    axis = found.fitted.axes["x"]
    assert axis.mass == pytest.approx(95.1089, rel=0.015)
    assert axis["coulomb_viscous"].values["sigma2"] == pytest.approx(203.5034, rel=0.015)
    assert axis["coulomb_viscous"].values["Fc"] == pytest.approx(20.3935, rel=0.015)
    assert axis["constant_force"].values["F0"] == pytest.approx(3.1648, rel=0.05)


def test_direction_dependent_friction_is_named_first(found):
    assert found.leading.verdict is Verdict.MISSING_EFFECTS
    assert found.effect is not None
    assert found.effect.name == "asymmetric_friction"


def test_the_held_out_error_falls_as_between_the_published_models(added, shared_data):
    """By as many N^2: the friction of a direction lasts for seconds, which windows of 0.2 s pass.

    What they average out is in both errors, so that these are smaller than the published ones.
    """
    assert added.kept
    run, pulses = (
        emps_published.load(shared_data / "emps" / f"{name}.mat")
        for name in ("DATA_EMPS", "DATA_EMPS_PULSES")
    )
    force = np.sqrt(np.mean(pulses.force**2))
    before, after = (
        force * prediction_error(pulses, law, identify(run, law).parameters)
        for law in (symmetric, direction_dependent)
    )
    step = added.step
    fall = step.holdout_error_before**2 - step.holdout_error_after**2
    assert fall == pytest.approx(before**2 - after**2, rel=0.25)
    assert step.holdout_error_before < before
    assert step.holdout_error_after < after


def test_the_constant_force_is_said_to_have_collapsed(added):
    notes = [n for n in added.notes if n.startswith("constant_force.F0 collapsed")]
    assert len(notes) == 1
    # The published levels forwards and backwards, fitted without any constant force, differ by
    # less than this: more is not left for one beside them.
    left = abs(added.model.axes["x"]["constant_force"].values["F0"])
    assert left < 20.6277 - 20.1440


def test_it_adds_nothing_more(found):
    assert found.leading.named == ("asymmetric_friction",)
    assert found.leading.unexplained is not None


@pytest.mark.slow
def test_then_it_stops_adding(added, emps):
    again = diagnose(added.model, *emps, catalogue=CATALOGUE, test_function=WINDOW)
    assert again.effect is None
    assert again.leading.verdict is Verdict.UNEXPLAINED


@pytest.mark.slow
def test_the_answer_among_the_whole_catalogue_is_the_same(model, emps, found):
    whole = diagnose(model, *emps, catalogue=CATALOGUE, test_function=WINDOW)
    assert whole.leading.verdict is found.leading.verdict
    assert whole.leading.named == found.leading.named
    assert whole.leading.unexplained is not None


@pytest.mark.slow
def test_without_a_window_the_answer_is_the_same(model, emps):
    assert diagnose(model, *emps, catalogue=CATALOGUE).effect is CATALOGUE["asymmetric_friction"]


def test_the_term_of_a_screw_turn_is_present_in_each_run_but_not_general(found):
    repeat = found.leading.repeat
    assert repeat is not None
    assert repeat.period == pytest.approx(2.5e-3, rel=0.005)
    # Its RMS a/sqrt(2) is within the error of its run, and that within sqrt(2) times both runs'.
    final = found.leading.final
    for amplitude in repeat.amplitude.values():
        assert final.floor < amplitude < 2.0 * final.error
    assert any("no function of position" in note for note in remarks_on(found, "x"))
