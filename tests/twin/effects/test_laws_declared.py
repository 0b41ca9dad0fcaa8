"""What effects declare: bounds that follow from the unit and the meaning of a parameter.

Parameters of one name in several frictions are one parameter. What a declaration refuses is
tried on both sides of each bound.
"""

from dataclasses import replace

import numpy as np
import pytest
from effect_runs import CATALOGUE, FRICTIONS

from twin.curve import Coordinate, Curve, Part
from twin.effect import Effect, Excitation, Kind, Parameter, V
from twin.model.units import Scale, has_size

LOG = Excitation(
    position_low=-0.13, position_high=0.21, speed_max=0.37, dry_level=0.83, duration=47.0,
    period=2.5e-4, force_max=11.0, lines=(53.0, 17.0), ripples=(3.1e-5, 1.7e-5), resolution=2.3e-7,
)  # fmt: skip
PARAMETERS = [(e, p) for e in CATALOGUE.values() for p in e.parameters]
EVERY = pytest.mark.parametrize(
    ("effect", "p"), PARAMETERS[:], ids=[f"{e.name}-{p.name}" for e, p in PARAMETERS]
)

PLACES_AND_TIMES = ("start", "middle", "low", "high", "phase", "tau", "relaxation", "b", "n")


@pytest.mark.parametrize("effect", CATALOGUE.values(), ids=list(CATALOGUE))
def test_only_a_friction_holds_an_axis_at_rest(effect: Effect) -> None:
    assert not effect.sticks or effect.kind is Kind.FRICTION
    assert not effect.several or effect.numbered(2).name == f"{effect.name}_2"


# --- bounds ---------------------------------------------------------------------------------------


@EVERY
def test_bounds_follow_from_what_a_parameter_is(effect: Effect, p: Parameter) -> None:
    if p.strength:
        assert p.lower in (0.0, -p.upper) or p.name == "ratio", "one sign, or both alike"
        assert p.start == 0.0 or (effect.kind is Kind.FRICTION and p.name in ("Fc", "Fs"))
        assert p.upper > 0.0
    elif not effect.free_shape and p.name not in PLACES_AND_TIMES:
        assert p.lower > 0.0, "a scale is positive"
    if p.unit == "m" and p.lower < 0.0 and not p.strength:
        assert p.lower == -p.upper
    if not p.strength and p.lower > 0.0 and p.unit != "1":  # decades of room on both sides
        assert p.lower <= 0.2 * p.start
        assert p.upper >= 3.0 * p.start
    for bound in (p.lower, p.upper):  # a round number: one or two digits
        assert bound == 0.0 or f"{bound:.1e}" == f"{bound:.6e}".replace("00000e", "e")


MACHINES = [Scale(f, x, t) for f in (1e-3, 1e4) for x in (1e-3, 1e3) for t in (0.1, 10.0)]


@EVERY
def test_no_bound_is_a_size_of_some_machine(effect: Effect, p: Parameter) -> None:
    """From the stage of a microscope to a press and a spindle: what is usual is far within."""
    if has_size(p.unit):
        for machine in MACHINES:
            usual = machine.size(p.unit)
            assert p.lower <= 0.0 or p.lower < 1e-2 * usual
            assert p.lower in (0.0, -p.upper) or p.lower > 0.0
            assert 1e2 * usual < p.upper


RATIOS = {"ratio", "load", "recoil", "damping", "loss", "coulomb", "viscous"}


def test_a_part_of_a_whole_stays_below_the_whole() -> None:
    for effect, p in PARAMETERS:
        if p.unit == "1" and p.name in RATIOS:
            assert p.lower > -1.0, "mass and friction stay positive"
            assert p.upper <= 1.0 or p.name == "ratio"
            assert (p.upper == 1.0) == (p.name == "loss"), "only a force can be lost altogether"
        assert effect.parameter(p.name) is p


def shared(effects: tuple[Effect, ...]) -> list[tuple[Effect, Effect, str]]:
    return [
        (a, b, p.name)
        for i, a in enumerate(effects)
        for b in effects[i + 1 :]
        for p in a.parameters
        if p.name in [q.name for q in b.parameters] and not p.name.startswith("elements")
    ]


# By kind of a static friction: without a Stribeck curve Fs is a detail.
DIFFERENT = {("coulomb_viscous", "Fs"), ("dahl", "n")}
SAME = [
    t
    for t in shared(FRICTIONS)
    if not {(t[0].name, t[2]), (t[1].name, t[2])} & DIFFERENT
]  # fmt: skip


@pytest.mark.parametrize(
    ("a", "b", "name"), SAME, ids=[f"{a.name}-{b.name}-{n}" for a, b, n in SAME]
)
def test_a_parameter_of_several_frictions_is_one(a: Effect, b: Effect, name: str) -> None:
    one, other = a.parameter(name), b.parameter(name)
    plain = [replace(p, meaning="", start_rule=None, scan=None) for p in (one, other)]
    assert plain[0] == plain[1]
    assert one.start_from(LOG) == other.start_from(LOG)
    if name != "sigma0" and "stribeck" not in (a.name, b.name):
        assert (one.scan and one.scan(LOG)) == (other.scan and other.scan(LOG))


ALIKE = [
    ("cogging", "force_constant_ripple", "p"),
    ("flexible_mode", "backlash", "load"),
    ("base_vibration", "flexible_mode", "damping"),
    ("actuator_delay", "encoder_delay", "tau"),
    ("empirical_map", "learned_residual", "start"),
    ("empirical_map", "learned_residual", "length"),
    ("empirical_map", "learned_residual", "speed"),
]


@pytest.mark.parametrize(("one", "other", "name"), ALIKE)
def test_bounds_of_one_quantity_are_the_same_in_two_effects(
    one: str, other: str, name: str
) -> None:
    a, b = CATALOGUE[one].parameter(name), CATALOGUE[other].parameter(name)
    assert (a.unit, a.lower, a.upper, a.fixed) == (b.unit, b.lower, b.upper, b.fixed)
    assert a.start_from(LOG) == b.start_from(LOG) or name == "damping"


def test_all_but_a_friction_is_absent_at_its_start() -> None:
    for effect in CATALOGUE.values():
        friction = effect.kind is Kind.FRICTION
        assert effect.is_present(effect.starts()) == friction
        read_off = effect.name == "encoder_quantization"  # the step of the readings
        assert effect.is_present(effect.starts(LOG)) == (friction or read_off)


# --- the declaration itself ----------------------------------------------------------------------


def law(p, s, io):
    io[0] = io[V]


def declared(*parameters: Parameter) -> Effect:
    return Effect(Kind.FORCE, "s", "F", "none", parameters, law, "f", "e")


def number(name: str, start: float, low: float, high: float, **how: object) -> Parameter:
    return Parameter(name, "N", start, low, high, "m", **how)


@pytest.mark.parametrize("start", [-2.0, 0.5, 3.0])
def test_a_start_on_or_within_its_bounds_is_allowed(start: float) -> None:
    assert declared(number("a", start, -2.0, 3.0)).starts() == {"a": start}


BAD = {
    "start below": (number("a", -2.1, -2.0, 3.0),),
    "start above": (number("a", 3.1, -2.0, 3.0),),
    "never absent above": (number("a", 1.0, 0.5, 3.0, strength=True),),
    "never absent below": (number("a", -1.0, -3.0, -0.5, strength=True),),
    "twice": (number("a", 1.0, 0.0, 3.0), number("a", 1.0, 0.0, 3.0)),
    "unknown floor": (number("a", 1.0, 0.0, 3.0, at_least="b"),),
    "no unit": (Parameter("a", "", 1.0, 0.0, 3.0, "m"),),
    "number for a unit": (Parameter("a", 1.0, 1.0, 0.0, 3.0, "m"),),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("fault", BAD)
def test_a_declaration_that_makes_no_sense_is_refused(fault: str) -> None:
    with pytest.raises(ValueError, match="effect test_laws_declared"):
        declared(*BAD[fault])


def test_a_curve_is_bent_by_what_the_effect_holds() -> None:
    bent = Curve(Coordinate.SPEED, rubs=True, bent_by="n")
    held = declared(number("n", 2.0, 0.5, 4.0, fixed=True))
    assert replace(held, curves=(bent,)).curves == (bent,)
    for other in (number("n", 2.0, 0.5, 4.0), number("k", 2.0, 0.5, 4.0, fixed=True)):
        with pytest.raises(ValueError, match="bent by n"):
            replace(declared(other), curves=(bent,))


def test_starts_from_a_log_stay_within_bounds() -> None:
    rule = number("a", 0.5, -2.0, 3.0, start_rule=lambda e: e.force_max)
    for force, wanted in ((2.5, 2.5), (3.5, 3.0), (-2.5, -2.0)):
        assert rule.start_from(replace(LOG, force_max=force)) == wanted
    effect = declared(rule, number("b", 0.3, 0.0, 1.0, strength=True), number("c", 0.2, 0.0, 1.0))
    assert effect.starts() == {"a": 0.5, "b": 0.3, "c": 0.2}
    assert effect.starts(replace(LOG, force_max=1.5)) == {"a": 1.5, "b": 0.3, "c": 0.2}
    assert [p.name for p in effect.strengths] == ["b"]
    assert effect.is_present({"a": 0.0, "b": -0.1, "c": 0.0})
    assert not effect.is_present({"a": 1.0, "b": 0.0, "c": 1.0})
    two = declared(*(number(n, 0.0, -1.0, 1.0, strength=True) for n in "ab"))
    assert two.is_present({"a": 0.0, "b": 1.0}), "one strength is enough"
    with pytest.raises(KeyError):
        effect.parameter("d")
    assert LOG.travel == pytest.approx(0.34)
    assert not effect.is_nonparametric
    assert replace(effect, parts=(Part("p", ("b",), "c", np.eye),)).is_nonparametric


def test_several_of_one_effect_have_a_number_each() -> None:
    first, second = CATALOGUE["cogging"], CATALOGUE["cogging_2"]
    assert second.name == "cogging_2"
    assert second.law is first.law
    assert "lugre_2" not in CATALOGUE
    assert "cogging_1" not in CATALOGUE
    names = [e.name for e in CATALOGUE.after({"cogging", "cogging_2", "lugre"})]
    assert "cogging_3" in names
    assert not {"cogging", "cogging_2", "lugre"} & set(names)
    assert len(names) == len(CATALOGUE) - 1


def test_of_harmonics_the_first_alone_is_screened() -> None:
    """A scan tries every shape with the screened strengths; the others come with the best."""
    numbered = [
        (f"{e.name}.{p.name}", p.screened, int(p.name[1:]))
        for e, p in PARAMETERS
        if not all(q.screened for q in e.strengths) and p in e.strengths
    ]
    assert {number for _, _, number in numbered} >= {1, 2}
    for name, screened, number in numbered:
        assert screened == (number == 1), name
