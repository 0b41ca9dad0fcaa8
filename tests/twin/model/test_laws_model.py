"""Laws of the stage model and its file: bounds, one friction, history; read as it is written."""

import math
import re
import tomllib
from contextlib import chdir
from dataclasses import fields, replace

import numpy as np
import pytest
from machines import CATALOGUE

from twin.effect import Effect, Kind, Parameter
from twin.errors import InputError
from twin.model.file import (
    find_model,
    format_model,
    load_model,
    models_folder,
    parse_model,
    save_model,
)
from twin.model.machine import AxisModel, Fitted, Hardware, HistoryStep, MachineModel
from twin.model.parameters import free_parameters, read, write
from twin.model.units import Scale, has_size


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


# Laws of model files: what is written is what is read, every field with a value of its own


HARDWARE = Hardware(
    travel=(-0.11, 0.37),
    force_constant=53.5,
    force_limit=211.0,
    encoder_resolution=1.25e-7,
    encoder_noise=3.5e-9,
    current_noise=0.0021,
    velocity=0.75,
    acceleration=4.5,
    jerk=330.0,
    bandwidth=41.0,
)


def inner(effect) -> dict[str, float]:
    """A value of its own for every parameter, within its bounds."""
    values = {}
    for k, p in enumerate(effect.parameters):
        if p.lower == p.upper:
            continue
        low = max(p.lower, p.start - 1.0)
        high = min(p.upper, p.start + 1.0)
        values[p.name] = low + (high - low) * (0.31 + 0.37 * k / (1 + len(effect.parameters)))
    return values


def stage() -> MachineModel:
    # A machine of three axes has no effect of the other axis.
    beside = ("X_OTHER", "V_OTHER", "A_OTHER")
    names = [n for n, e in CATALOGUE.items() if e.of_size is None and not any(map(e.reads, beside))]
    frictions = [n for n in names if CATALOGUE[n].kind.name == "FRICTION"]
    others = [n for n in names if n not in frictions]
    all_effects = tuple(Fitted.at_start(CATALOGUE[n], inner(CATALOGUE[n])) for n in others)
    x = AxisModel(6.125, HARDWARE, all_effects[::-1], mass_fixed=True)
    one = Fitted.at_start(CATALOGUE[frictions[0]], inner(CATALOGUE[frictions[0]]))
    first = next(iter(one.values))
    y = AxisModel(2.375, replace(HARDWARE, travel=None), (replace(one, fixed=frozenset({first})),))
    z = AxisModel(1.5)
    history = (
        HistoryStep("add", "cable", "x", 5.5, 4.25, None, 3.125, "N m", ("why", "and how")),
        HistoryStep("remove", "cogging", "y", 2.5, 2.25, 1.75, None),
    )
    return MachineModel("a stage", {"x": x, "z": z, "y": y}, 3210.5, "<mujoco/>", "b.xml", history)


def same(got: MachineModel, want: MachineModel) -> None:
    for field in fields(MachineModel):
        if field.name != "axes":
            assert getattr(got, field.name) == getattr(want, field.name), field.name
    assert list(got.axes) == list(want.axes)
    for name, axis in want.axes.items():
        other = got.axes[name]
        assert (other.mass, other.mass_fixed) == (axis.mass, axis.mass_fixed)
        assert other.hardware == axis.hardware
        assert other.names == axis.names
        for one, two in zip(other.effects, axis.effects, strict=True):
            assert one.vector() == two.vector()
            assert one.fixed == two.fixed


def test_a_model_saved_is_the_model_loaded_field_by_field(tmp_path):
    values = [getattr(HARDWARE, f.name) for f in fields(Hardware)]
    assert len(set(values)) == len(values)
    assert all(getattr(HARDWARE, f.name) != f.default for f in fields(Hardware))
    save_model(stage(), tmp_path / "a.toml")
    same(load_model(tmp_path / "a.toml", CATALOGUE), stage())
    assert (tmp_path / "b.xml").read_text() == "<mujoco/>"
    assert {p.name for p in tmp_path.iterdir()} == {"a.toml", "b.xml"}
    text = (tmp_path / "a.toml").read_text()
    assert format_model(load_model(tmp_path / "a.toml", CATALOGUE)) == text


@pytest.mark.parametrize("path", sorted(p.name for p in models_folder().glob("*.toml")))
def test_a_model_of_the_package_survives_a_round_trip(tmp_path, path):
    model = load_model(path.removesuffix(".toml"), CATALOGUE)
    save_model(model, tmp_path / path)
    same(load_model(tmp_path / path, CATALOGUE), model)


COMMENTS = {
    "travel": "m", "force_constant": "N/A", "force_limit": "N", "encoder_resolution": "m",
    "encoder_noise": "m rms", "current_noise": "A rms", "velocity": "m/s, fastest move",
    "acceleration": "m/s^2, fastest move", "jerk": "m/s^3, fastest move",
    "bandwidth": "Hz, position loop",
}  # fmt: skip


def test_every_value_stands_under_its_own_name_with_its_unit():
    text = format_model(stage())
    document = tomllib.loads(text)
    x = document["axes"]["x"]
    for field in fields(Hardware):
        value = getattr(HARDWARE, field.name)
        assert x[field.name] == (list(value) if field.name == "travel" else value)
        line = next(row for row in text.splitlines() if row.startswith(f"{field.name} = "))
        assert line.partition("# ")[2] == COMMENTS[field.name]
    for fitted in stage().axes["x"].effects:
        entry = x["effects"][fitted.effect.name]
        assert {k: v for k, v in entry.items() if k != "fixed"} == dict(fitted.values)
    assert x["mass"] == 6.125
    assert x["fixed"] == ["mass"]
    assert "fixed" not in document["axes"]["y"]
    assert "travel" not in document["axes"]["y"]
    assert document["sample_rate"] == 3210.5


SIZES = {"N": 20.0, "m": 0.5, "m/s": 0.25, "N/m": 40.0, "N s/m": 80.0, "kg": 160.0, "J": 10.0,
         "kg m^2": 40.0, "N m": 10.0, "1/m": 2.0, "m/s^2": 0.125, "N s^2/m^2": 320.0,
         "s": 2.0, "Hz": 0.5, "1": 1.0}  # fmt: skip


@pytest.mark.parametrize("unit", SIZES)
def test_the_size_of_a_quantity_is_that_of_the_force_the_travel_and_the_time(unit):
    """20 N, 0.5 m and 2 s; what has neither force nor length is as large on any machine."""
    assert Scale(20.0, 0.5, 2.0).size(unit) == pytest.approx(SIZES[unit], rel=1e-12)
    assert has_size(unit) is (unit not in ("s", "Hz", "1"))


def test_a_model_of_python_has_the_rate_of_one_of_a_file():
    assert MachineModel("m", {"x": AxisModel(1.0)}).sample_rate == 10_000.0


def test_an_mjcf_that_is_there_already_is_left_as_it_is(tmp_path):
    """A model beside another one's bodies would be read with these."""
    (tmp_path / "b.xml").write_text("<older/>")
    with pytest.raises(InputError, match=r"beside it is another b\.xml, which is kept"):
        save_model(stage(), tmp_path / "a.toml")
    assert (tmp_path / "b.xml").read_text() == "<older/>"
    assert not (tmp_path / "a.toml").exists()
    (tmp_path / "b.xml").unlink()
    for _ in range(2):  # its own is none in the way
        save_model(stage(), tmp_path / "a.toml")
        assert load_model(tmp_path / "a.toml", CATALOGUE).mjcf == stage().mjcf
    (tmp_path / "b.xml").unlink()
    with pytest.raises(InputError, match=r"mujoco = 'b\.xml' is not beside it"):
        load_model(tmp_path / "a.toml", CATALOGUE)
    save_model(replace(stage(), mjcf=None, mjcf_name=None), tmp_path / "c.toml")
    assert load_model(tmp_path / "c.toml", CATALOGUE).mjcf is None
    assert not (tmp_path / "b.xml").exists()
    with pytest.raises(InputError, match="its folder does not exist"):
        save_model(stage(), tmp_path / "none" / "a.toml")


def parsed(**axis) -> MachineModel:
    return parse_model({"axes": {"x": {"mass": 2.0, **axis}}}, CATALOGUE, None, "dir/some.toml")


def test_what_is_left_out_is_the_default():
    model = parsed()
    assert (model.name, model.sample_rate, model.history) == ("some", 10_000.0, ())
    assert model.axes["x"] == AxisModel(2.0)
    entry = {"action": "add", "effect": "e", "axis": "x", "fit_error_before": 2.0,
             "fit_error_after": 1.0, "later": "unknown to this version"}  # fmt: skip
    document = {"axes": {"x": {"mass": 1.0}}, "history": [entry]}
    (step,) = parse_model(document, CATALOGUE, None, "a.toml").history
    assert step == HistoryStep("add", "e", "x", 2.0, 1.0, None, None)


NAME = "cogging"
PARAMETERS = [p.name for p in CATALOGUE[NAME].parameters]


def test_what_is_fixed_is_what_the_file_names_and_the_design_where_it_does_not():
    design = {p.name for p in CATALOGUE[NAME].parameters if p.fixed}
    assert parsed(effects={NAME: {}}).axes["x"][NAME].fixed == design
    for fixed in ([], PARAMETERS[:1], PARAMETERS):
        assert parsed(effects={NAME: {"fixed": fixed}}).axes["x"][NAME].fixed == set(fixed)
    with pytest.raises(InputError, match=f"effect '{NAME}': fixed names unknown nothing"):
        parsed(effects={NAME: {"fixed": ["nothing"]}})
    assert parsed(fixed=["mass"]).axes["x"].mass_fixed
    assert not parsed(fixed=[]).axes["x"].mass_fixed


def test_a_name_without_a_folder_is_that_of_the_package_and_a_file_goes_first(tmp_path):
    own = sorted(models_folder().glob("*.toml"))[0]
    with chdir(tmp_path):
        for name in (own.name, own.stem, f"models/{own.name}", f"models/{own.stem}"):
            assert find_model(name) == own
        for name in (f"other/{own.name}", f"{tmp_path}/{own.name}"):
            with pytest.raises(InputError, match=f"no such model file; the package has {own.name}"):
                find_model(name)
        (tmp_path / own.name).write_text("name = 1")
        assert find_model(own.name).read_text() == "name = 1"
        with pytest.raises(InputError) as caught:
            find_model("qqqqqqqq.xyz")
    assert "the package has" not in str(caught.value)
