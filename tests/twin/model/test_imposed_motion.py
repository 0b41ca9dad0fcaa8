"""A motion that is imposed: no mass to move, and the force that the motion takes is measured."""

from dataclasses import replace

import numpy as np
import pytest
from machines import CATALOGUE

from identify import adding, workflow
from twin.effect import Kind
from twin.effects import Catalogue
from twin.errors import CannotRun, InputError
from twin.logs import AxisLog, Log
from twin.model.file import format_model, load_model, save_model
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.simulation.simulate import simulate

RATE = 1000.0  # Hz
YIELDS = {"Fc": 9e5, "sigma2": 2e5, "sigma0": 4e8}  # of a large damper


def sine(frequency: float, force) -> Log:
    """A sine of 20 mm at a frequency (Hz) and the force (position, velocity) -> N that it takes."""
    time = np.arange(6.0 * RATE) / RATE
    position = 0.02 * np.sin(2 * np.pi * frequency * time)
    velocity = 0.04 * np.pi * frequency * np.cos(2 * np.pi * frequency * (time + 0.5 / RATE))
    noise = 500.0 * np.random.default_rng(7).standard_normal(len(time))
    return Log(
        RATE, {"x": AxisLog({"position": position, "force": force(position, velocity) + noise})}
    )


def dahl(position, velocity):
    """Dahl's equation for n = 1, exact from sample to sample."""
    level, force = YIELDS["Fc"], np.zeros(len(position))
    for i, step in enumerate(np.diff(position)):
        to = np.copysign(level, step)
        force[i + 1] = to + (force[i] - to) * np.exp(-YIELDS["sigma0"] / level * abs(step))
    return 0.5 * (force + np.append(force[1:], force[-1])) + YIELDS["sigma2"] * velocity


def damper(effect: str, **values: float) -> MachineModel:
    effects = (Fitted.at_start(CATALOGUE[effect], values),)
    return MachineModel(
        "damper", {"x": AxisModel(0.0, Hardware(travel=(-0.03, 0.03)), effects)}, RATE
    )


@pytest.fixture(scope="module")
def logs():
    return {"slow": sine(0.5, dahl)}, {"fast": sine(1.0, dahl)}


def test_the_friction_of_an_imposed_motion_is_found_without_a_mass(logs) -> None:
    added = adding.add(CATALOGUE["dahl"], damper("coulomb_viscous"), *logs)
    found = added.model.axes["x"]
    assert added.kept
    assert found.mass == 0.0
    for name, value in YIELDS.items():
        assert found["dahl"].values[name] == pytest.approx(value, rel=0.02)
    assert (added.position_error, added.position_error_in_mujoco) == (None, None)
    assert "position" not in str(added)
    compared = workflow.compare(added.model, logs[1])
    assert "position error" not in str(compared)
    assert compared.axes["x"].ratio < 1.3


def test_what_needs_a_mass_or_a_motor_is_refused_and_never_tried(logs) -> None:
    axis = damper("dahl").axes["x"]
    for effect in CATALOGUE.values():
        through_motor = effect.kind in (Kind.ACTUATION, Kind.SENSING, Kind.STRUCTURE)
        acts = not through_motor and not effect.reads("U")
        assert axis.can_have(replace(effect, suits=None, of_joints=None)) == acts
    for name in ("payload_mass", "load_dependent_friction", "actuator_lag"):
        with pytest.raises(InputError, match=f"{name} acts through .* imposed"):
            axis.with_effect(Fitted.at_start(CATALOGUE[name]))
    few = Catalogue(CATALOGUE[n] for n in ("constant_force", "payload_mass", "encoder_ripple"))
    found = workflow.diagnose(damper("coulomb_viscous"), *logs, catalogue=few)  # above the floor
    assert [c.effect.name for c in found.leading.ranking] == ["constant_force"]


def test_it_cannot_be_simulated_and_a_file_says_so_with_a_zero(tmp_path) -> None:
    model = damper("dahl", **YIELDS)
    save_model(model, tmp_path / "damper.toml")
    assert load_model(tmp_path / "damper.toml", CATALOGUE).axes["x"].is_imposed
    with pytest.raises(CannotRun, match="mass = 0 kg says that its motion is imposed"):
        simulate(model, "moves", seed=1, duration=1.0)
    text = format_model(model)
    (tmp_path / "small.toml").write_text(text.replace("mass = 0.0", "mass = 1e-16"))
    with pytest.raises(InputError, match="or 0, where the motion is imposed"):
        load_model(tmp_path / "small.toml", CATALOGUE)
    with pytest.raises(InputError, match="or 0 where the motion is imposed"):
        AxisModel(-1.0)
