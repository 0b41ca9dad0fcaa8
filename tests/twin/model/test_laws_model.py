"""Laws of the stage model: bounds, one friction, history, and coordinates read as written."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from twin.effect import Effect, Kind, Parameter
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.model.machine import AxisModel, Fitted, Hardware, HistoryStep, MachineModel
from twin.model.parameters import free_parameters, read, write

CATALOGUE = load_catalogue()


def law(p, s, io):  # never run here
    io[16] = p[0]


def effect_of(name: str, kind: Kind, *parameters: Parameter) -> Effect:
    made = Effect(kind, "s", "e", "s", parameters, law, "f", "e")
    made.__dict__["name"] = name
    return made


LOW = Parameter("low", "N", 2.0, 1.0, 9.0, "the lower")
HIGH = Parameter("high", "N", 4.0, 0.5, 20.0, "the higher", at_least="low")
HELD = Parameter("held", "m", 5.0, -7.0, 30.0, "held by design", fixed=True)
STUCK = Parameter("stuck", "1", 3.0, 3.0, 3.0, "one value only")
PAIR = effect_of("pair", Kind.FORCE, LOW, HIGH, HELD, STUCK)
FRICTION = effect_of("slide", Kind.FRICTION, Parameter("Fc", "N", 1.5, 0.0, 50.0, "level"))
OTHER = effect_of("glide", Kind.FRICTION, Parameter("Fc", "N", 2.5, 0.0, 50.0, "level"))
SPRING = effect_of(
    "spring",
    Kind.FORCE,
    Parameter("k", "N/m", 11.0, 0.0, 1e4, "stiffness"),
    Parameter("x0", "m", -0.25, -1.0, 1.0, "rest"),
)


def axis() -> AxisModel:
    effects = tuple(Fitted.at_start(e) for e in (PAIR, FRICTION, SPRING))
    return AxisModel(6.25, Hardware(travel=(-0.1, 0.3), jerk=77.0), effects)


def test_every_bound_of_the_catalogue_is_kept_on_both_sides():
    """All parameters of an effect at once within; the first ones and the last beyond."""
    for name in CATALOGUE:
        effect = CATALOGUE[name]
        own = [p for p in effect.parameters if effect.of_size is None or p.name != "elements"]
        for side, outward in (("lower", -math.inf), ("upper", math.inf)):
            bounds = {p.name: getattr(p, side) for p in own if math.isfinite(getattr(p, side))}
            assert bounds.items() <= dict(Fitted.at_start(effect, bounds).values).items()
            for p in [q for q in (*own[:4], own[-1]) if q.name in bounds]:
                beyond = math.nextafter(bounds[p.name], outward)
                allowed = f"outside [{p.lower:g}, {p.upper:g}] {p.unit} ("
                with pytest.raises(InputError, match=re.escape(allowed)) as told:
                    Fitted.at_start(effect, {p.name: beyond})
                assert str(told.value).startswith(f"{name}.{p.name} = ")


@pytest.mark.parametrize("mass", [-5e-324, math.inf])
def test_a_mass_is_finite_and_not_below_zero(mass):
    with pytest.raises(InputError, match="must be a positive number of kg"):
        AxisModel(mass)
    assert AxisModel(5e-324).mass > 0.0


def test_a_friction_takes_the_place_of_the_friction_that_was_there_and_of_nothing_else():
    swapped = axis().with_effect(Fitted.at_start(OTHER))
    assert swapped.names == ("pair", "spring", "glide")
    with pytest.raises(InputError, match="one friction model, given slide and glide"):
        AxisModel(1.0, effects=(Fitted.at_start(FRICTION), Fitted.at_start(OTHER)))
    assert axis().with_effect(Fitted.at_start(SPRING, {"k": 5.0})).names[1] == "slide"


@pytest.mark.parametrize("name", ["pair", "spring"])
def test_without_takes_away_one_effect_and_undoes_with_effect(name):
    model = axis()
    less = model.without(name)
    assert less.names == tuple(n for n in model.names if n != name)
    assert all(less[n] is model[n] for n in less.names)
    assert less.with_effect(model[name]).names == (*less.names, name)
    assert less.with_effect(model[name]).without(name) == less
    with pytest.raises(InputError, match=f"no effect '{name}' to remove; it has "):
        less.without(name)


def test_reading_is_the_inverse_of_writing_in_any_order():
    rng = np.random.default_rng(3)
    where = free_parameters(axis())
    values = np.array([3.5, 1.25, 6.5, 8.75, 123.0, 0.5])
    for _ in range(5):
        order = rng.permutation(len(where))
        picked = [where[k] for k in order]
        written = write(axis(), picked, values[order])
        np.testing.assert_array_equal(read(written, picked), values[order])
        np.testing.assert_array_equal(read(written, where), values)
        assert written["pair"].vector() == [1.25, 6.5, 5.0, 3.0]
        assert written.hardware == axis().hardware
        assert [f.fixed for f in written.effects] == [f.fixed for f in axis().effects]
    np.testing.assert_array_equal(read(axis(), where), [6.25, 2.0, 4.0, 1.5, 11.0, -0.25])
    same = write(axis(), where, read(axis(), where))
    assert same == axis()


@pytest.mark.parametrize(("low", "high"), [(3.0, 5.0), (5.0, 3.0)])
def test_a_value_may_not_fall_below_the_one_it_is_tied_to(low, high):
    """The one it is tied to stays as it is written."""
    where = [c for c in free_parameters(axis()) if c.effect == "pair"]
    written = write(axis(), where, [low, high])["pair"].values
    assert (written["low"], written["high"]) == (low, max(low, high))


def test_every_tie_of_the_catalogue_is_kept_by_writing():
    ties = 0
    for name in CATALOGUE:
        for p in CATALOGUE[name].parameters:
            if not p.at_least:
                continue
            ties += 1
            model = AxisModel(1.0, effects=(Fitted.at_start(CATALOGUE[name]),))
            floor = CATALOGUE[name].parameter(p.at_least)
            top = min(0.5 * (floor.lower + min(floor.upper, 100.0)) + 1.0, floor.upper)
            where = [c for c in free_parameters(model) if c.parameter.name in (p.name, p.at_least)]
            values = [top if c.parameter.name == p.at_least else p.lower for c in where]
            written = write(model, where, values)[name].values
            assert written[p.name] == written[p.at_least] == top
    assert ties


def step(number: int) -> HistoryStep:
    return HistoryStep("add", f"effect{number}", "x", 5.0 + number, 4.0, None, 2.0)


@pytest.mark.parametrize(
    ("static", "held", "then"), [(2.0, True, 1.5), (2.5, True, 2.5), (2.0, False, 2.0)]
)
def test_a_static_friction_that_is_held_at_the_dry_one_follows_it(
    static: float, held: bool, then: float
) -> None:
    law = Fitted.at_start(CATALOGUE["coulomb_viscous"], {"Fc": 2.0, "Fs": static})
    axis = AxisModel(1.0, effects=(replace(law, fixed=frozenset({"Fs"} if held else ())),))
    dry = [c for c in free_parameters(axis) if c.parameter.name == "Fc"]
    assert write(axis, dry, [1.5])["coulomb_viscous"].values["Fs"] == then


def test_history_grows_at_its_end_and_nothing_else_changes():
    stage = MachineModel("s", {"x": axis(), "y": AxisModel(3.0)}, 2500.0, "<x/>", "x.xml")
    grown = stage.with_history(step(1)).with_history(step(2))
    assert grown.history == (step(1), step(2))
    assert stage.history == ()
    assert grown.with_axis("y", AxisModel(4.0)).history == grown.history
    exchanged = grown.with_axis("y", AxisModel(4.0))
    assert list(exchanged.axes) == ["x", "y"]
    assert exchanged.axes["x"] is stage.axes["x"]
    assert (exchanged.axis("y").mass, stage.axis("y").mass) == (4.0, 3.0)
    assert (exchanged.name, exchanged.sample_rate, exchanged.mjcf) == ("s", 2500.0, "<x/>")
    assert stage.period == 1.0 / 2500.0
    with pytest.raises(InputError, match="no axis 'z'; it has x, y"):
        stage.axis("z")
