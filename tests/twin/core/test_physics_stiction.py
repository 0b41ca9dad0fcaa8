"""What holds at rest: Coulomb friction sticks exactly, LuGre yields elastically and drifts."""

import numpy as np
import pytest
from effect_runs import CATALOGUE

from twin.core.control import Controller
from twin.core.loop import POSITION_COLUMN, VELOCITY_COLUMN
from twin.experiments.trajectory import Setpoint
from twin.laws.trials import Array
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.simulator import MujocoSimulator, ReducedSimulator, run

RATE = 10_000.0
BOTH = pytest.mark.parametrize("stage", [MujocoSimulator, ReducedSimulator])
STICKING = Fitted.at_start(CATALOGUE["coulomb_viscous"], {"Fc": 0.8, "Fs": 1.0})


def pushed(
    effects: tuple[Fitted, ...],
    force: Array,
    stage: type[MujocoSimulator] | type[ReducedSimulator] = ReducedSimulator,
    mass: float = 2.0,
) -> Array:
    """True position m and velocity m/s of a mass (kg) under a force (n,) N, from rest; (n, 2)."""
    still = np.zeros((len(force), 1))
    model = MachineModel("mass", {"x": AxisModel(mass, effects=effects)}, sample_rate=RATE)
    done = run(
        model, Setpoint(still, still, still, force[:, None], RATE), np.random.default_rng(0),
        simulator=stage, controllers={"x": Controller()},
    )  # fmt: skip
    return done.signals[:, 0, [POSITION_COLUMN, VELOCITY_COLUMN]]


def time(duration: float) -> Array:
    return np.arange(round(duration * RATE)) / RATE


@BOTH
@pytest.mark.parametrize("share", [0.1, -0.5, 0.999])
def test_static_friction_holds_any_force_below_it(
    stage: type[MujocoSimulator] | type[ReducedSimulator], share: float
) -> None:
    still = pushed((STICKING,), np.full(10_000, share * STICKING.values["Fs"]), stage)
    assert np.abs(still[:, 0]).max() < 1e-15
    assert np.abs(still[:, 1]).max() < 1e-15


def test_asymmetric_friction_sticks_on_its_strong_side() -> None:
    """What rounding leaves of the speed of a stuck axis must not choose the direction."""
    effects = (
        Fitted.at_start(CATALOGUE["coulomb_viscous"], {"Fc": 1.0, "Fs": 1.0, "sigma2": 3.0}),
        Fitted.at_start(CATALOGUE["asymmetric_friction"], {"coulomb": 0.5}),
        Fitted.at_start(CATALOGUE["cogging"], {"a1": 0.1, "b1": 0.08}),
    )
    for seed in range(8):  # slide, stop, then push with 0.5 to 1.3 N, where it holds 1.5 N
        rng = np.random.default_rng(seed)
        force = np.r_[np.full(4000, 3.0), np.linspace(0.0, 1.3, 16_000)]
        force += rng.uniform(-0.01, 0.01, len(force))
        moved = pushed(effects, force, mass=rng.uniform(1.0, 20.0))
        assert np.ptp(moved[10_000:, 0]) < 1e-15
        assert moved[-1, 0] > 1e-3


@BOTH
def test_a_force_above_static_friction_breaks_it_away(
    stage: type[MujocoSimulator] | type[ReducedSimulator],
) -> None:
    force = 1.001 * STICKING.values["Fs"]
    moved = pushed((STICKING,), np.full(10_000, force), stage)
    acceleration = (force - STICKING.values["Fc"]) / 2.0  # once it slides
    t = time(1.0)
    np.testing.assert_allclose(moved[:, 0], acceleration * t**2 / 2, rtol=0, atol=1e-12)
