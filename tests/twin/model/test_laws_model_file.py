"""Laws of model files: what is written is what is read, every field with a value of its own."""

import tomllib
from contextlib import chdir
from dataclasses import fields, replace

import pytest

from twin.effects import load_catalogue
from twin.errors import InputError
from twin.model.file import (
    HARDWARE_UNITS,
    find_model,
    format_model,
    load_model,
    models_folder,
    parse_model,
    save_model,
)
from twin.model.machine import AxisModel, Fitted, Hardware, HistoryStep, MachineModel

CATALOGUE = load_catalogue()
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


def test_every_value_stands_under_its_own_name_with_its_unit():
    text = format_model(stage())
    document = tomllib.loads(text)
    x = document["axes"]["x"]
    assert set(HARDWARE_UNITS) == {f.name for f in fields(Hardware)}
    for field in fields(Hardware):
        value = getattr(HARDWARE, field.name)
        assert x[field.name] == (list(value) if field.name == "travel" else value)
        line = next(row for row in text.splitlines() if row.startswith(f"{field.name} = "))
        assert line.partition("# ")[2].split(",")[0] == HARDWARE_UNITS[field.name].split(",")[0]
    for fitted in stage().axes["x"].effects:
        entry = x["effects"][fitted.effect.name]
        assert {k: v for k, v in entry.items() if k != "fixed"} == dict(fitted.values)
    assert x["mass"] == 6.125
    assert x["fixed"] == ["mass"]
    assert "fixed" not in document["axes"]["y"]
    assert "travel" not in document["axes"]["y"]
    assert document["sample_rate"] == 3210.5


def test_an_mjcf_that_is_there_already_is_left_as_it_is(tmp_path):
    (tmp_path / "b.xml").write_text("<older/>")
    save_model(stage(), tmp_path / "a.toml")
    assert (tmp_path / "b.xml").read_text() == "<older/>"
    assert load_model(tmp_path / "a.toml", CATALOGUE).mjcf == "<older/>"
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
