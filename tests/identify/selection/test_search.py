"""The search on planted machines, and whether a law that it finds is itself."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from built_fits import built, built_fit, tried
from machines import CATALOGUE, PROTON, tracked
from planted_logs import SLIDE, Ride, asked, begun, few, having

from benchmarks.second_simulator.drives import DRIVES as MACHINES
from benchmarks.second_simulator.recordings import recordings
from benchmarks.silence import cases
from identify import diagnose
from identify.analysis.first_model import first_model
from identify.dataset.preparation import datasets
from identify.estimation.fit import fit_axis
from identify.estimation.variable_projection import absent_effects
from identify.selection.diagnosis import AxisDiagnosis, diagnose_axis
from identify.selection.findings import FindingKind
from identify.selection.refusal import Instead
from identify.selection.search import Step, simplest
from identify.selection.trying import try_effect
from twin import simulate
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel

COGGING = {"p": 0.021, "a1": 0.03, "b1": 0.02}
OFFSET = {"F0": 0.05}
BOTH = {
    "cogging": tuple(COGGING.items()),
    "periodic_disturbance": (("f", 3.1), ("a", 0.03), ("b", 0.02)),
}


@cache
def searched(catalogue: tuple[str, ...], **planted: tuple[tuple[str, float], ...]) -> AxisDiagnosis:
    """The diagnosis of a machine with these effects among those of the catalogue."""
    true = SLIDE
    for name, values in planted.items():
        true = having(true, name, **dict(values))
    return asked(SLIDE, true, few(*catalogue), ride=Ride(1, 5.0))


def named_in(steps: tuple[Step, ...]) -> tuple[str, ...]:
    return tuple(s.change.name for s in steps)


def test_of_level_changes_the_one_with_fewest_parameters_is_named_and_the_others_told() -> None:
    """A spring has an offset of its own, and is no better for three parameters more."""
    found = searched(("spring", "constant_force", "cogging"), constant_force=tuple(OFFSET.items()))
    assert found.answers == (("constant_force", "spring"),)
    assert found.ambiguous_with == ("spring",)
    (step,) = found.steps
    own, (rival,) = step.tried.judged, step.tied
    assert own.parameters < rival.judged.parameters


@pytest.mark.parametrize(
    ("fitted", "held", "named"),
    [
        (1.0, 1.0, "gravity"),  # the logs do not tell them apart
        (1.0, 0.5, "cogging"),  # the logs that were not fitted ask for the larger one
        (2.0, 0.5, "gravity"),  # but those that were fitted refuse it
    ],
)
def test_selection_logs_may_ask_for_the_larger_of_tied_changes(fitted, held, named) -> None:
    """Errors of cogging over those of gravity, which has fewer parameters, on logs of a role."""
    noise = 10.0 * np.random.default_rng(8).standard_normal(2400)

    def change(name: str, parameters: float, fitted: float, held: float):
        made = tried(built(name, fit=built_fit(1.0, residual=fitted * noise)))
        own = {"other": held * noise, "other_floor": 1.0, "parameters": parameters}
        made.judged.__dict__.update(own)
        return made

    few, many = change("gravity", 6.0, 1.0, 1.0), change("cogging", 9.0, fitted, held)
    assert simplest((many, few)).change.name == named


def test_what_imitated_another_is_dropped_when_that_is_there() -> None:
    """An offset takes most of an asymmetric friction, until wear leaves more of it to see."""
    found = searched(
        ("constant_force", "asymmetric_friction", "wear", "quadratic_drag"),
        asymmetric_friction=(("coulomb", 0.1),), wear=(("rate", 0.2),),
    )  # fmt: skip
    assert named_in(found.steps) == ("constant_force", "wear", "asymmetric_friction")
    assert found.steps[-1].dropped == ("constant_force",)
    assert set(found.named) == {"wear", "asymmetric_friction"}
    assert "constant_force" not in found.final.axis.names
    assert found.final.at_floor


@pytest.mark.slow  # 3 s
def test_two_that_distort_each_other_are_found_together() -> None:
    """Neither is accepted alone: each leaves what the other makes of the motion."""
    catalogue = (*BOTH, "quadratic_drag", "spring")
    found = searched(catalogue, **BOTH)
    assert set(found.named) == set(BOTH)
    assert all(step.with_others for step in found.steps)
    for finding in found.findings:
        (other,) = set(BOTH) - {finding.effect}
        assert finding.together == (other,)
    assert not any(c.supported for c in found.ranking)
    assert found.final.at_floor


def test_two_laws_are_asked_together_before_a_free_curve_takes_both() -> None:
    wavy = {"c1": 0.2, "c2": -0.1, "c3": 0.2, "c4": 0.1, "c5": -0.2}
    both = {"constant_force": OFFSET, "position_dependent_friction": wavy}
    found = searched((*both, "spring"), **{name: tuple(v.items()) for name, v in both.items()})
    assert set(found.named) == set(both)


def test_a_law_that_became_another_is_tried_from_its_other_starts() -> None:
    """One period near the reach follows two short ones best, and is no period any more."""

    def two(x: np.ndarray, _: np.ndarray) -> np.ndarray:
        return 0.2 * np.sin(2 * np.pi * x / 0.012) + 0.17 * np.cos(2 * np.pi * x / 0.0071)

    ride = Ride(1, 5.0, reach=0.016)
    found = asked(SLIDE, SLIDE, few("cogging", "quadratic_drag"), two, ride)
    assert found.named == ("cogging", "cogging_2")
    assert not found.ranking[0].doubt


# Whether a law that was found is itself: its exponent, its values at a bound


RIDE = Ride(3, 5.0)


def with_drag(power: float, size: float) -> AxisDiagnosis:
    """A machine with a drag of a power of the speed, size: N at 0.3 m/s."""

    def drag(x: np.ndarray, v: np.ndarray) -> np.ndarray:
        return -size * np.sign(v) * np.abs(v / 0.3) ** power

    return asked(SLIDE, SLIDE, few("quadratic_drag", "wear", "cogging"), drag, RIDE)


@pytest.mark.slow  # 3 s
@pytest.mark.parametrize("size", [0.02, 0.2])
def test_a_drag_of_another_power_is_told_as_such_even_where_the_law_reaches_the_noise(size):
    (finding,) = with_drag(3.0, size).findings
    assert (finding.effect, finding.kind) == ("quadratic_drag", FindingKind.RESEMBLES)
    assert finding.bend is not None
    assert finding.bend.found == pytest.approx(3.0, rel=0.2)
    (true,) = with_drag(2.0, size).findings
    assert (true.effect, true.kind, true.bend) == ("quadratic_drag", FindingKind.MISSING, None)


def test_a_hard_current_limit_is_named_with_all_of_the_force_above_it_lost():
    stage = PROTON
    stage = MachineModel(stage.name, {"x": stage.axes["x"]}, stage.sample_rate)
    log = partial(simulate, experiment="tracking", duration=4.0)
    most = np.abs(log(stage, seed=1).axes["x"].force).max()
    limited = stage.with_axis(
        "x", having(stage.axes["x"], "actuator_saturation", limit=0.8 * most, loss=1.0)
    )
    one, two = (log(limited, seed=i) for i in (1, 2))
    found = diagnose(stage, one, two, catalogue=few("actuator_saturation", "wear", "cogging"))
    (finding,) = found.leading.findings
    assert finding.effect == "actuator_saturation"
    assert finding.parameters["loss"] == pytest.approx(1.0, abs=0.1)
    assert finding.parameters["limit"] == pytest.approx(0.8 * most, rel=0.02)


def test_an_effect_stands_without_a_strength_that_ended_at_its_bound():
    """Viscous friction that differs by more than the law allows, beside dry friction that does."""

    def beside(x: np.ndarray, v: np.ndarray) -> np.ndarray:
        return -0.15 * (v != 0.0) - 1.2 * 0.53 * np.abs(v)

    found = asked(SLIDE, SLIDE, few("asymmetric_friction", "wear", "cogging"), beside, RIDE)
    assert found.named == ("asymmetric_friction",)
    assert found.findings[0].parameters["viscous"] == 0.0
    assert found.findings[0].parameters["coulomb"] > 0.3


# A friction with a memory is told with those as good, not as a hysteresis beside friction


def with_friction(law: str, **values: float) -> AxisModel:
    """The slide with another friction, of the same level and bristle."""
    alike = {"Fc": 0.3, "v0": 0.01, "sigma2": 0.5, "sigma0": 300.0, "n": 0.8}
    bare = replace(SLIDE, effects=())
    return bare.with_effect(Fitted.at_start(CATALOGUE[law], {**alike, **values}))


@pytest.mark.slow
def test_of_a_friction_those_that_explain_as_much_are_told_with_the_same_values_free() -> None:
    """The exponent is another than the laws hold: it is free in the one found, so in all."""
    true = with_friction("modified_leuven", Fs=0.4, sigma1=0.7, spread=8.0, reserve=3.0)
    short = Ride(1, 5.0)  # longer logs ask for the true one
    found = asked(SLIDE, true, few("dahl", "leuven", "modified_leuven"), ride=short)
    assert {*found.answers[0]} == {"leuven", "modified_leuven"}
    assert found.findings[0].bend is not None


@pytest.mark.slow
def test_a_hysteresis_that_leaves_no_friction_is_another_friction() -> None:
    true = with_friction("gms", Fs=0.3, spread=4.0, C=68.0)
    found = asked(SLIDE, true, few("presliding_hysteresis"))
    refused = next(c.refused for c in found.ranking if c.effect.name == "presliding_hysteresis")
    assert refused is Instead.FRICTION
    assert "presliding_hysteresis" not in found.named
    assert asked(SLIDE, true, few("presliding_hysteresis", "gms")).named == ("gms",)


# Laws of any machine come back with their values, on the axis that each is offered to


STAGE = Hardware(travel=(-0.17, 0.17), encoder_noise=1e-9, current_noise=2e-4, jerk=100.0)
JOINT = Hardware(
    travel=(-1.7, 1.7), encoder_noise=1e-8, current_noise=2e-4, velocity=2.5, acceleration=20.0,
    jerk=1000.0,
)  # fmt: skip
MOTOR = replace(JOINT, travel=(-40.0, 40.0), velocity=50.0, acceleration=400.0, jerk=2e4)
SLIDES = Fitted.at_start(CATALOGUE["coulomb_viscous"], {"Fc": 0.3, "Fs": 0.3, "sigma2": 0.5})
FREE = AxisModel(15.0, STAGE)
RUBS = AxisModel(15.0, STAGE, (SLIDES,))
TURNS = AxisModel(0.4, JOINT, (SLIDES,), rotary=True)
DRIVES = AxisModel(
    0.01,
    MOTOR,
    (Fitted.at_start(CATALOGUE["coulomb_viscous"], {"Fc": 0.3, "Fs": 0.3}),),
    rotary=True,
)
PLANTED = {
    "viscous_friction": (FREE, {"c": 1.7}),
    "spring": (RUBS, {"middle": 0.0, "offset": 0.3, "k1": 4.0, "k2": -9.0, "k3": 150.0}),
    "presliding_hysteresis": (RUBS, {"reach": 0.006, "f0": 0.2, "f1": 0.1, "f2": 0.1, "f3": 0.05}),
    "gravity": (TURNS, {"sine": 1.3, "cosine": -0.4}),
}


@pytest.mark.parametrize("name", PLANTED)
def test_a_law_of_any_machine_is_found_with_its_values(name: str) -> None:
    axis, values = PLANTED[name]
    effect = CATALOGUE[name]
    true = MachineModel("m", {"x": axis.with_effect(Fitted.at_start(effect, values))}, 2000.0)
    log = tracked(true, 3, 6.0)
    dataset = datasets(true.with_axis("x", axis), {"log": log}, {})["x"]
    base = fit_axis(axis, dataset.training)
    assert effect in absent_effects(axis, CATALOGUE)
    found = try_effect(base, dataset, effect)
    assert found.supported
    assert found.fit.ratio < 1.5 < base.ratio
    for key, value in values.items():
        assert found.fit.axis[name].values[key] == pytest.approx(value, rel=0.05, abs=0.02)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("unbalance", {"gear": 7.0, "sine": 0.9, "cosine": -0.4}),
        ("spring", {"offset": 0.1, "k1": 0.02, "k3": 2e-5}),
        ("cogging", {"p": 0.9, "a1": 0.2, "b1": 0.1}),
    ],
)
def test_a_load_that_turns_behind_a_gear_is_told_from_a_spring_and_from_cogging(
    name: str, values: dict[str, float]
) -> None:
    law = Fitted.at_start(CATALOGUE[name], values)
    true = MachineModel("m", {"x": DRIVES.with_effect(law)}, 1000.0)
    logs = [{f"{seed}": tracked(true, seed, 6.0)} for seed in (1, 2)]
    known = few("unbalance", "spring", "cogging", "gravity", "constant_force")
    found = diagnose_axis(*begun(DRIVES, *logs), known)
    assert found.named == (name,)
    if name == "unbalance":
        assert found.final.axis[name].values == pytest.approx(values, rel=0.02)


@pytest.mark.slow  # 10 s
def test_a_law_is_proved_together_with_a_force_of_position_that_may_be_any() -> None:
    """Two coggings, the longer of less than three cycles: at 137 floors nothing was named."""
    case = cases(110, 5)[4]
    logs = recordings(MACHINES[case.drive], case.plants[1], case.recorder, case.seed, None, "moves")
    one, other, test = ({name: logs[name]} for name in ("moves", "sines", "again"))
    catalogue = few("coulomb_viscous", "cogging", "spring", "force_constant_ripple", "lugre")
    model = first_model(one, "drive", catalogue)
    found = diagnose(model, one, other, test, catalogue=catalogue).axes["q"]
    assert found.named == ("cogging", "cogging_2")
    assert all(f.kind is FindingKind.RESEMBLES for f in found.findings)
    periods = sorted(f.parameters["p"] for f in found.findings)
    assert periods == pytest.approx([np.pi / 6.0, 2.0 * np.pi / 7.0], rel=1e-3)
    assert found.final.error < 0.05 * found.base.error
