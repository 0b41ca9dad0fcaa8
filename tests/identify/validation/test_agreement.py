"""Two fits: whether they agree, what differs, and which effect would make the difference."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from cli_runs import twin
from machines import CATALOGUE, PROTON

import identify
from identify.testing import assert_agree
from identify.validation.agreement import agreement
from twin.effects import Catalogue
from twin.errors import InputError
from twin.model.file import load_model, save_model
from twin.model.machine import AxisIntervals, AxisModel, Fitted, Hardware, MachineModel
from twin.model.parameters import free_parameters, read, write

OWN = ("coulomb_viscous", "cable_slab")
FEW = Catalogue([CATALOGUE[n] for n in (*OWN, "constant_force", "payload_mass", "wear")])


def fitted(width: float = 0.01, above: float = 1.1, **moved: float) -> MachineModel:
    """A slide whose parameters have intervals of this relative half width, some of them moved."""
    friction = Fitted.at_start(CATALOGUE["coulomb_viscous"], {"Fc": 0.3, "Fs": 0.3, "sigma2": 0.2})
    cable = Fitted.at_start(CATALOGUE["cable_slab"], {"offset": 0.1, "k1": 1.0})
    axis = AxisModel(10.0, Hardware(travel=(-0.15, 0.15)), (friction, cable))
    where = free_parameters(axis)
    values = dict(zip([c.label for c in where], read(axis, where), strict=True))
    values |= {name.replace("__", "."): v for name, v in moved.items()}
    axis = write(axis, where, list(values.values()))
    ends = {k: (v - width * abs(v) - 1e-4, v + width * abs(v) + 1e-4) for k, v in values.items()}
    return MachineModel("slide", {"x": axis}, 2000.0).with_intervals(
        "x", AxisIntervals(ends, above)
    )


def test_what_differs_is_named_with_its_size_and_the_effects_that_would_make_it() -> None:
    assert identify.agree(fitted(), fitted(coulomb_viscous__sigma2=0.202), catalogue=FEW).agree
    other = fitted(mass=10.5, cable_slab__offset=0.3)
    found = agreement(fitted(), other, FEW).axes["x"]
    assert set(found.differing) == {"mass", "cable_slab.offset"}
    mass = found.parameters["mass"]
    assert mass.difference == pytest.approx(0.5)
    assert mass.in_standard_errors == pytest.approx(0.5 / mass.standard_error)
    # Half widths of 1 % of 10 kg and of 10.5 kg, 1.714 standard errors each (Student's t of 23).
    assert mass.standard_error == pytest.approx((0.1001**2 + 0.1051**2) ** 0.5 / 1.714, rel=1e-3)
    assert {c.effect for c in found.causes} == {"payload_mass", "constant_force"}
    assert sum(c.share for c in found.causes) == pytest.approx(1.0, abs=1e-6)


def with_alone(effect: str, **values: float) -> MachineModel:
    """The slide with one effect more, whose last value alone has an interval."""
    axis = fitted().axes["x"].with_effect(Fitted.at_start(CATALOGUE[effect], values))
    *_, (name, value) = values.items()
    ends = {f"{effect}.{name}": (0.9 * value, 1.1 * value)}
    return fitted().with_axis("x", axis).with_intervals("x", AxisIntervals(ends, 1.0))


def test_an_effect_that_one_fit_has_alone_is_one_of_no_strength_in_the_other() -> None:
    found = agreement(fitted(), with_alone("constant_force", F0=0.2), FEW).axes["x"]
    assert found.only_in_b == ("constant_force",)
    assert found.differing == ["constant_force.F0"]


def test_what_makes_no_force_where_the_axis_moves_has_no_cause() -> None:
    """Two stiffnesses of an end stop beyond the travel."""
    ends = {"low": -0.5, "high": 0.5}
    both = (with_alone("end_stop", **ends, stiffness=k) for k in (1e3, 5e3))
    found = agreement(*both, FEW).axes["x"]
    assert found.differing == ["end_stop.stiffness"]
    assert (found.force, found.causes) == (0.0, ())


def test_intervals_travel_with_the_file_and_leave_with_what_they_belong_to(tmp_path: Path) -> None:
    path = tmp_path / "fitted.toml"
    save_model(fitted(), path)
    read_back = load_model(path, CATALOGUE)
    assert read_back.intervals == fitted().intervals
    edited = path.read_text().replace("mass = 10.0", "mass = 12.0")
    path.write_text(edited)
    assert "mass" not in load_model(path, CATALOGUE).intervals["x"].ends
    changed = read_back.with_axis("x", replace(read_back.axes["x"], mass=9.0))
    assert "x" not in changed.intervals
    start = edited.split("[intervals")[0]
    for entry in (
        'x."gms.k9" = [1, 2]',
        "x.mass = [3, 2]",
        'x.above_floor = "a"',
        'x.mass = "wide"',
        "z.mass = [1, 2]",
    ):
        path.write_text(f"{start}\n[intervals]\n{entry}\n")
        with pytest.raises(InputError, match="intervals"):
            load_model(path, CATALOGUE)


def test_the_helper_for_other_peoples_tests_says_what_differs(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    save_model(fitted(), path)
    assert_agree(path, fitted(), catalogue=FEW)
    with pytest.raises(AssertionError, match=r"mass differs by 1.00 kg.*\n.*RMS"):
        assert_agree(str(path), fitted(mass=11.0), catalogue=FEW)
    with pytest.raises(AssertionError, match="the model is wrong"):
        assert_agree(path, fitted(above=9.0, mass=11.0), catalogue=FEW)
    with pytest.raises(InputError, match="nothing can be compared"):
        assert_agree(path, PROTON, catalogue=FEW)


def test_the_command_ends_with_1_where_the_fits_differ(tmp_path: Path) -> None:
    save_model(fitted(), tmp_path / "a.toml")
    save_model(fitted(mass=12.0), tmp_path / "c.toml")
    assert twin("agree", "a.toml", "a.toml", folder=tmp_path).returncode == 0
    done = twin("agree", "a.toml", "c.toml", "--json", folder=tmp_path)
    assert done.returncode == 1
    found = json.loads(done.stdout)
    assert not found["agree"]
    assert found["axes"]["x"]["differing"] == ["mass"]
