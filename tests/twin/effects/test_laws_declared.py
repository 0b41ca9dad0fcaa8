"""What effects declare: bounds that follow from a parameter's unit and meaning, names, elements.

What a declaration refuses is tried on both sides of each bound."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from effect_runs import FRICTIONS, LOG
from machines import CATALOGUE, PROTON

from twin.curve import Coordinate, Curve, Part
from twin.effect import ELEMENTS, Effect, Kind, Parameter, V
from twin.errors import InputError
from twin.model.file import load_model, save_model
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.model.parameters import free_parameters
from twin.model.units import Scale, has_size

PARAMETERS = [(e, p) for e in CATALOGUE.values() for p in e.parameters]
PLACES_AND_TIMES = (
    "start", "middle", "low", "high", "phase", "tau", "relaxation", "b", "n", "turns", "joint",
)  # fmt: skip


def test_bounds_follow_from_what_a_parameter_is() -> None:
    for effect, p in PARAMETERS:
        name = f"{effect.name}.{p.name}"
        assert effect.parameter(p.name) is p
        if p.strength:
            assert p.lower in (0.0, -p.upper) or p.name == "ratio", f"{name}: one sign, or both"
            assert p.start == 0.0 or (effect.kind is Kind.FRICTION and p.dry), name
        elif not effect.free_shape and p.name not in PLACES_AND_TIMES:
            assert p.lower > 0.0, f"{name}: a scale is positive"
        if not p.strength and p.lower > 0.0 and p.unit != "1":  # decades of room on both sides
            assert p.lower <= 0.2 * p.start, name
            assert p.upper >= 3.0 * p.start, name


MACHINES = [Scale(f, x, t) for f in (1e-3, 1e4) for x in (1e-3, 1e3) for t in (0.1, 10.0)]


def test_no_bound_is_a_size_of_some_machine() -> None:
    """From the stage of a microscope to a press and a spindle: what is usual is far within."""
    for effect, p in PARAMETERS:
        if has_size(p.unit):
            for machine in MACHINES:
                usual = machine.size(p.unit)
                assert p.lower <= 0.0 or p.lower < 1e-2 * usual, f"{effect.name}.{p.name}"
                assert 1e2 * usual < p.upper, f"{effect.name}.{p.name}"


RATIOS = ("ratio", "load", "recoil", "damping", "loss", "coulomb", "viscous")


def test_a_part_of_a_whole_stays_below_the_whole() -> None:
    """Mass and friction stay positive; a force alone can be lost altogether, within its bounds."""
    for _, p in PARAMETERS:
        if p.unit == "1" and p.name in RATIOS:
            assert p.lower > -1.0
            assert p.upper < 1.0 or p.name == "ratio" or (p.name == "loss" and p.upper > 1.0)


def test_what_reads_joints_is_of_joints_and_what_reads_another_axis_is_not() -> None:
    for effect in (e for e in CATALOGUE.values() if not e.is_nonparametric):
        if effect.reads("LOAD") or effect.reads("SPEEDS"):
            assert effect.of_joints, effect.name
        if effect.reads_other_axis:
            assert effect.of_joints is False, effect.name


def test_all_but_a_friction_is_absent_at_its_start() -> None:
    for effect in CATALOGUE.values():
        friction = effect.kind is Kind.FRICTION
        assert friction or not effect.sticks
        assert effect.is_present(effect.starts()) == friction
        read_off = effect.name == "encoder_quantization"  # the step of the readings
        assert effect.is_present(effect.starts(LOG)) == (friction or read_off)


def law(p, s, io):
    io[0] = io[V]


def declared(*parameters: Parameter) -> Effect:
    return Effect(Kind.FORCE, "s", "F", "none", parameters, law, "f", "e")


def number(name: str, start: float, low: float, high: float, **how: object) -> Parameter:
    return Parameter(name, "N", start, low, high, "m", **how)


BAD = {
    "start below": (number("a", -2.1, -2.0, 3.0),),
    "never absent above": (number("a", 1.0, 0.5, 3.0, strength=True),),
    "twice": (number("a", 1.0, 0.0, 3.0), number("a", 1.0, 0.0, 3.0)),
    "unknown floor": (number("a", 1.0, 0.0, 3.0, at_least="b"),),
    "no unit": (Parameter("a", "", 1.0, 0.0, 3.0, "m"),),
}


@pytest.mark.parametrize("fault", BAD)
def test_a_declaration_that_makes_no_sense_is_refused(fault: str) -> None:
    with pytest.raises(ValueError, match="effect test_laws_declared"):
        declared(*BAD[fault])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"kind": "force"}, "its kind is 'force'; give one of Kind.SENSING, "),
        ({"law": None}, "the law of an effect is None; give a function"),
    ],
)
def test_a_kind_in_words_and_no_law_are_refused(given: dict[str, object], said: str) -> None:
    """A kind in words passed every law, and a diagnosis ended in ValueError."""
    with pytest.raises(ValueError, match=said):
        replace(declared(), **given)


def test_a_curve_is_bent_by_what_the_effect_holds() -> None:
    bent = Curve(Coordinate.SPEED, rubs=True, bent_by="n")
    held = declared(number("n", 2.0, 0.5, 4.0, fixed=True))
    assert replace(held, curves=(bent,)).curves == (bent,)
    for other in (number("n", 2.0, 0.5, 4.0), number("k", 2.0, 0.5, 4.0, fixed=True)):
        with pytest.raises(ValueError, match="bent by n"):
            replace(declared(other), curves=(bent,))


def test_starts_from_a_log_stay_within_bounds() -> None:
    rule = number("a", 0.5, -2.0, 3.0, start_rule=lambda e: e.force_max)
    effect = declared(rule, number("b", 0.3, 0.0, 1.0, strength=True), number("c", 0.2, 0.0, 1.0))
    assert effect.starts() == {"a": 0.5, "b": 0.3, "c": 0.2}
    for force, wanted in ((2.5, 2.5), (3.5, 3.0), (-2.5, -2.0)):
        starts = effect.starts(replace(LOG, force_max=force))
        assert starts == {"a": wanted, "b": 0.3, "c": 0.2}
    assert [p.name for p in effect.strengths] == ["b"]
    assert effect.is_present({"a": 0.0, "b": -0.1, "c": 0.0})
    assert not effect.is_present({"a": 1.0, "b": 0.0, "c": 1.0})
    two = declared(*(number(n, 0.0, -1.0, 1.0, strength=True) for n in "ab"))
    assert two.is_present({"a": 0.0, "b": 1.0}), "one strength is enough"
    with pytest.raises(KeyError):
        effect.parameter("d")
    assert not effect.is_nonparametric
    assert replace(effect, parts=(Part("p", ("b",), "c", np.eye),)).is_nonparametric


def test_several_of_one_effect_have_a_number_each() -> None:
    first, second = CATALOGUE["cogging"], CATALOGUE["cogging_2"]
    assert (second.name, second.law) == ("cogging_2", first.law)
    assert all(f"cogging_{k}" in CATALOGUE for k in range(2, 11)), "ten, as motors have"
    assert not any(n in CATALOGUE for n in ("cogging_1", "cogging_01", "cogging_99", "lugre_2"))
    names = [e.name for e in CATALOGUE.after({"cogging", "cogging_2", "lugre"})]
    assert "cogging_3" in names
    assert not {"cogging", "cogging_2", "lugre"} & set(names)
    assert len(names) == len(CATALOGUE) - 1


# A diagnosis offers each law once, by the name that fits the axis and what it has already


CABLE = {"cable_slab", "cable_hysteresis"}
GENERAL = {"spring", "presliding_hysteresis"}
BARE = AxisModel(1.0)


def offered(axis: AxisModel) -> set[str]:
    return {e.name for e in CATALOGUE.after(axis.names) if axis.can_have(e)}


def having(*names: str, rotary: bool = False) -> AxisModel:
    fitted = tuple(Fitted.at_start(CATALOGUE[n]) for n in names)
    return AxisModel(1.0, effects=fitted, rotary=rotary)


def test_a_machine_without_a_cable_is_offered_no_cable() -> None:
    assert offered(BARE) >= GENERAL
    assert not CABLE & offered(BARE)
    for name in CABLE:
        beside = offered(having(name))
        assert not GENERAL & beside
        assert CABLE - {name} <= beside
    assert not CABLE & offered(having("spring"))


def test_viscous_friction_is_offered_where_no_friction_has_it() -> None:
    assert "viscous_friction" in offered(BARE)
    assert "viscous_friction" in offered(having("cogging"))
    for friction in FRICTIONS:
        assert "viscous_friction" not in offered(having(friction.name))


def test_gravity_is_offered_where_the_axis_turns() -> None:
    assert "gravity" in offered(having(rotary=True))
    assert "gravity" not in offered(BARE)
    assert "constant_force" in offered(BARE), "the weight of a tilted slide"


def test_the_stage_with_a_cable_keeps_its_names() -> None:
    stage = PROTON
    for axis in stage.axes.values():
        assert not GENERAL & offered(axis)
        assert "cable_hysteresis" in offered(axis)


# Frictions of any number of elements, given in the model file


SIZED = [e for e in FRICTIONS if e.of_size is not None]
EVERY = pytest.mark.parametrize("effect", SIZED, ids=lambda e: e.name)
FILE = """
name = "one axis"
[axes.x]
mass = 2.0\ntravel = [-0.1, 0.1]
[axes.x.effects.{name}]
{lines}
"""


def loaded(folder: Path, name: str, lines: str) -> MachineModel:
    path = folder / "stage.toml"
    path.write_text(FILE.format(name=name, lines=lines))
    return load_model(path, CATALOGUE)


@EVERY
@pytest.mark.parametrize("count", [1, 4])
def test_the_model_file_says_how_many_elements(effect: Effect, count: int, tmp_path: Path) -> None:
    fitted = loaded(tmp_path, effect.name, f"elements = {count}").axes["x"][effect.name]
    assert fitted.effect.name == effect.name
    assert fitted.values[ELEMENTS] == count
    assert fitted.values[f"share_{count}"] == 1.0
    assert len(fitted.effect.states) in (count, 2 * count)
    assert f"share_{count + 1}" not in fitted.values


@EVERY
def test_elements_and_their_own_values_survive_saving(effect: Effect, tmp_path: Path) -> None:
    lines = "elements = 7\nFc = 0.2\nFs = 0.25\nstiff_7 = 0.125\nshare_2 = 3.0\nfixed = []"
    model = loaded(tmp_path, effect.name, lines)
    save_model(model, tmp_path / "again.toml")
    again = load_model(tmp_path / "again.toml", CATALOGUE)
    assert again.axes["x"][effect.name].values == model.axes["x"][effect.name].values
    assert again.axes["x"][effect.name].effect is model.axes["x"][effect.name].effect


@EVERY
def test_their_number_is_never_fitted_and_few_numbers_are_unless_asked(effect, tmp_path):
    def fitted(lines: str) -> set[str]:
        free = free_parameters(loaded(tmp_path, effect.name, lines).axes["x"])
        return {c.parameter.name for c in free}

    assert "stiff_2" in fitted("elements = 2\nfixed = []")
    assert ELEMENTS not in fitted("elements = 2\nfixed = []")
    assert {"Fc", "Fs", "v0", "sigma2", "sigma0", "spread"} <= fitted("elements = 2")
    assert len(fitted("elements = 2")) <= 8, "the mass too"


@EVERY
@pytest.mark.parametrize("count", ["0", "2.5", "1001", '"six"'])
def test_a_bad_number_of_elements_is_refused(effect: Effect, count: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"whole number of elements from 1 to 1000"):
        loaded(tmp_path, effect.name, f"elements = {count}")


def test_a_law_of_no_file_is_refused() -> None:
    """In a notebook an effect was called <ipython-input-1-...>, by which no model is read again."""
    place: dict[str, Any] = {}
    exec(compile("def law(p, s, io):\n    io[0] = io[1]", "<ipython-input-1-14ed>", "exec"), place)
    with pytest.raises(ValueError, match=r"defined in <ipython-input-1-14ed>, .*; write it to a P"):
        Effect(Kind.FORCE, "s", "F", "none", (number("a", 1.0, 0.0, 3.0),), place["law"], "f", "e")
