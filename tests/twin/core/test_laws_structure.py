"""Attached masses and their axis: Newton's second law, for all and for each part.

Where a friction holds the axis, it is at rest after the sample whatever is attached. A payload is
mass. The momentum of all parts is the impulse of what pushes from outside. The way back, from a
motion to the forces along it, gives the forces of the way there.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from axis_runs import BOTH, RATE, Pushed, Stepper, effect, pushed, shoves
from machines import CATALOGUE
from scipy.integrate import solve_ivp

from twin.laws.trials import TrialMotion, forces
from twin.signals import Array

EACH = pytest.mark.parametrize("stage", BOTH)
MASS = 3.7  # kg
H = 1.0 / RATE
N = 1800
STICKS = effect("stribeck", Fc=2.0, Fs=2.7, v0=0.02, sigma2=1.3)
ASYMMETRY = effect("asymmetric_friction", coulomb=0.2, viscous=-0.3)
CABLE = effect("cable_slab", offset=0.6, k1=7.0, k2=-3.0)
DEADBAND = effect("actuator_deadband", width=0.35)
PARTS = {
    "payload_mass": effect("payload_mass", ratio=0.43),
    "rotor_inertia": effect("rotor_inertia", inertia=0.43 * MASS),
    "flexible_mode": effect("flexible_mode", load=0.23, frequency=31.0, damping=0.07),
    "backlash": effect("backlash", load=0.17, play=4e-5, frequency=83.0, damping=0.2),
    "base_vibration": effect("base_vibration", recoil=0.29, frequency=6.1, damping=0.11),
}
TOGETHER = {
    "payload": ("payload_mass",),
    "light": ("payload_mass", "flexible_mode"),
    "base": ("base_vibration",),
    "base and payload": ("payload_mass", "base_vibration"),
    "base and load": ("flexible_mode", "base_vibration"),
    "hung twice": ("flexible_mode", "backlash"),
    "all": tuple(PARTS),
}
SETS = pytest.mark.parametrize("names", TOGETHER.values(), ids=TOGETHER)
SHOVES = shoves(N, 3.0)
AROUND = (STICKS, ASYMMETRY, CABLE, DEADBAND)


@cache
def shoved(names: tuple[str, ...], stage: Stepper) -> Pushed:
    """The axis with these parts, and what holds and rubs it, under the shoves."""
    return pushed(MASS, (*AROUND, *(PARTS[n] for n in names)), SHOVES, stage)


@EACH
@pytest.mark.parametrize("name", ["flexible_mode", "base_vibration"])
@pytest.mark.parametrize("stiffness", [1e5, 1e9])
def test_an_end_stop_of_any_stiffness_is_stable_whatever_is_attached(name, stiffness, stage):
    """It stops what it stops: no deeper than a step of the fastest motion."""
    share = {"flexible_mode": "load", "base_vibration": "recoil"}[name]
    part = effect(name, frequency=20.0, **{share: 0.9})
    stop = effect("end_stop", low=-1.1e-3, high=2e-3, stiffness=stiffness, relaxation=0.0)
    run = pushed(MASS, (stop, part), shoves(600, 20.0), stage)
    assert np.abs(run.v).max() < 1.5
    assert run.x.max() < 2e-3 + 1.5 * H + 60.0 / 1e5


@pytest.mark.parametrize("load", [0.2, 0.8])
def test_a_spring_beyond_the_sampling_rate_is_stable_and_the_same_in_both_simulations(load):
    part = effect("flexible_mode", load=load, frequency=2000.0, damping=1e-3)
    runs = [pushed(MASS, (part,), shoves(600, 20.0), stage) for stage in BOTH]
    assert np.abs(runs[0].v).max() < 1.5
    np.testing.assert_allclose(runs[1].x, runs[0].x, rtol=0, atol=1e-10 * np.ptp(runs[0].x))


@EACH
@SETS
def test_logged_forces_and_command_are_mass_times_acceleration(names, stage):
    """Of the nominal mass: what the attached parts take or give is among the forces."""
    run = shoved(names, stage)
    total = SHOVES + run.of(*run.rows)
    wanted = MASS * np.diff(run.v) / H
    np.testing.assert_allclose(total[:-1], wanted, rtol=0, atol=1e-8 * np.abs(wanted).max())
    assert all(np.ptp(run.rows[n]) > 0.01 for n in names), "blind"


@EACH
@SETS
def test_what_friction_holds_is_at_rest(names: tuple[str, ...], stage: Stepper) -> None:
    run = shoved(names, stage)
    held = run.states["stribeck_at_rest"][:-1] > 0.5
    assert 0.1 < held.mean() < 0.9
    fast = np.abs(run.v).max()
    assert np.abs(run.v[1:][held]).max() < 1e-12 * fast
    assert np.median(np.abs(run.v[1:][~held])) > 1e-3 * fast, "blind"


@EACH
@SETS
def test_momentum_of_all_parts_is_the_impulse_from_outside(names, stage):
    """Parts on the axis are pushed by it alone: m v + loads' own momentum, in space."""
    run = shoved(names, stage)
    outside = SHOVES + run.of("stribeck", "cable_slab", "actuator_deadband")
    base = np.r_[0.0, run.states.get("base_vibration_speed", np.zeros(N))[:-1]]
    momentum = MASS * (run.v + base)
    for name in names:
        values = PARTS[name].values
        if name in ("payload_mass", "rotor_inertia"):
            momentum += values.get("inertia", values.get("ratio", 0.0) * MASS) * (run.v + base)
        elif name != "base_vibration":  # its own part of the mass moves with the axis and swings
            momentum += values["load"] * MASS * np.r_[0.0, run.states[f"{name}_speed"][:-1]]
    impulse = np.r_[0.0, np.cumsum(outside)[:-1]] * H
    np.testing.assert_allclose(momentum, impulse, rtol=0, atol=1e-9 * np.abs(impulse).max())


@SETS
def test_the_way_back_gives_the_forces_of_the_way_there(names: tuple[str, ...]) -> None:
    """Blocks of eight samples of a smooth run: their mean speeds tell the mean forces."""
    t = np.arange(4000) * H
    force = 9.0 * np.sin(2.0 * np.pi * 9.0 * t) * np.sin(2.0 * np.pi * 0.7 * t) ** 2
    parts = tuple(
        p for n, p in PARTS.items() if n in names and n not in ("backlash", "rotor_inertia")
    )
    run = pushed(MASS, parts, force)
    block = 8
    mean = 0.5 * (run.v[1:] + run.v[:-1])[:3992].reshape(-1, block).mean(axis=1)
    still = np.zeros_like(mean)
    back = forces(parts, TrialMotion(block * H, still, mean, still))  # of 1 kg
    for name in (p.effect.name for p in parts):
        wanted = run.rows[name][:3992].reshape(-1, block).mean(axis=1)
        error = np.abs(MASS * back[name] - wanted)[2:-2]
        # a base is stepped once a block: first order in its w h; what rides is of higher order
        assert error.max() < (0.015 if "base_vibration" in names else 2e-4) * np.abs(wanted).max()


CONTINUOUS = {
    "flexible_mode": {"load": 0.3, "frequency": 20.0, "damping": 0.05},
    "base_vibration": {"recoil": 0.2, "frequency": 5.0, "damping": 0.1},
    "backlash": {"load": 0.3, "play": 2e-3, "frequency": 25.0, "damping": 0.1},
    "payload_mass": {"ratio": 0.4},
    "rotor_inertia": {"inertia": 0.4 * MASS},
}


def shaken(t: Array | float) -> Array | float:
    """A force, N."""
    return 8.0 * np.sin(2.0 * np.pi * 3.0 * t) + 5.0 * np.sin(2.0 * np.pi * 11.0 * t + 0.4)


def equations(name: str) -> Callable[[float, Array], tuple]:
    """Right side of the continuous equations of position, attached displacement and speeds."""
    p = CONTINUOUS[name]
    if name in ("payload_mass", "rotor_inertia"):
        moved = MASS * (1.0 + p["ratio"]) if name == "payload_mass" else MASS + p["inertia"]
        return lambda t, z: (z[2], 0.0, shaken(t) / moved, 0.0)
    w, share = 2.0 * np.pi * p["frequency"], p.get("load", p.get("recoil"))

    def right(t: float, z: Array) -> tuple:
        half = 0.5 * p.get("play", 0.0)
        pull = w**2 * (z[1] - np.clip(z[1], -half, half)) + 2.0 * p["damping"] * w * z[3]
        if name == "base_vibration":  # m (q'' + b'') = F; the rest, m/share - m, feels -F - K b
            carriage = shaken(t) / MASS
            frame = (-shaken(t) - MASS / share * pull) / (MASS / share - MASS)
            return z[2], z[3], carriage - frame, frame
        motor = (shaken(t) + share * MASS * pull) / ((1.0 - share) * MASS)
        return z[2], z[3], motor, -pull - motor

    return right


@pytest.mark.parametrize("name", CONTINUOUS)
def test_it_converges_to_the_continuous_equations(name: str) -> None:
    t = np.arange(1, 101) * 5e-3
    exact = solve_ivp(
        equations(name), (0.0, t[-1]), np.zeros(4), "DOP853", t, rtol=1e-11, atol=1e-14,
        max_step=1e-3,
    ).y[0]  # fmt: skip

    def error(rate: float, **changed: float) -> float:
        """Largest error of the position, m; the force is held at its mean."""
        points, weights = np.polynomial.legendre.leggauss(5)
        begins = np.arange(round(t[-1] * rate) + 1) / rate
        force = 0.5 * shaken(begins[:, None] + 0.5 * (1.0 + points) / rate) @ weights
        part = effect(name, **{**CONTINUOUS[name], **changed})
        found = pushed(MASS, (part,), force, rate=rate).x
        return float(np.abs(found[np.rint(t * rate).astype(int)] - exact).max())

    coarse, fine = error(2000.0), error(8000.0)
    assert fine < 1e-4 * np.ptp(exact)
    assert fine < 0.4 * coarse or coarse < 1e-9 * np.ptp(exact)
    off = {
        p: 1.1 * v for p, v in CONTINUOUS[name].items() if p in ("frequency", "ratio", "inertia")
    }
    assert error(8000.0, **off) > 4.0 * fine, "blind"


def test_no_attached_part_is_left_out_of_the_tests() -> None:
    structures = {e.name for e in CATALOGUE.values() if e.attach or e.added_mass}
    assert structures == set(PARTS) == set(CONTINUOUS)
