"""Each law gives the force that its source prints, worked out here in another way."""

import numpy as np
import pytest
from effect_runs import CATALOGUE

from twin.effect import DRY, OUT, VISCOUS, U
from twin.laws.motion import Array, Motion
from twin.laws.stepping import trace
from twin.laws.values import moderate

RANDOM = Motion.random(np.random.default_rng(51), samples=1000)


def law(name: str, seed: int, slot: int, motion: Motion = RANDOM) -> tuple[dict, Array]:
    """Drawn values of an effect, and what its law leaves in a slot of io, (n,)."""
    effect = CATALOGUE[name]
    values = moderate(effect, np.random.default_rng(seed))
    return values, trace(effect, values, motion).after[:, slot]


def require(found: Array, wanted: Array) -> None:
    assert np.abs(wanted).max() > 0.0
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


def test_cable_slab_is_its_polynomial() -> None:
    p, force = law("cable_slab", 1, OUT)
    require(force, -np.polynomial.Polynomial([p["offset"], p["k1"], p["k2"], p["k3"]])(RANDOM.x))


def test_cogging_is_its_fourier_series() -> None:
    p, force = law("cogging", 2, OUT)
    wanted = sum(
        np.real((p[f"b{k}"] - 1j * p[f"a{k}"]) * np.exp(2j * np.pi * k * RANDOM.x / p["p"]))
        for k in (1, 2, 3)
    )
    require(force, wanted)


def test_quadratic_drag_opposes_motion_with_a_power_of_speed() -> None:
    p, force = law("quadratic_drag", 3, OUT)
    assert p["n"] != CATALOGUE["quadratic_drag"].parameter("n").start == 2.0
    ratio = np.where(RANDOM.v, np.abs(RANDOM.v) / p["vc"], 1.0)
    require(force, -p["c"] * RANDOM.v * np.abs(RANDOM.v) * np.exp((p["n"] - 2) * np.log(ratio)))


@pytest.mark.parametrize("vc", [0.01, 0.1, 3.0])
def test_quadratic_drag_is_the_square_of_speed_by_design_whatever_its_speed(vc: float) -> None:
    effect = CATALOGUE["quadratic_drag"]
    values = {**effect.starts(), "c": 4.0, "vc": vc}
    force = trace(effect, values, RANDOM).after[:, OUT]
    require(force, -4.0 * np.sign(RANDOM.v) * RANDOM.v**2)


def test_constant_force_is_constant() -> None:
    p, force = law("constant_force", 4, OUT)
    require(force, np.full(len(RANDOM), p["F0"]))


def test_position_dependent_friction_scales_the_level_by_its_cosine_series() -> None:
    p, factor = law("position_dependent_friction", 5, DRY)
    along = np.pi * np.clip((RANDOM.x - p["start"]) / p["length"], 0.0, 1.0)
    profile = sum(p[f"c{k}"] * np.cos(k * along) for k in range(1, 6))
    require(factor, np.maximum(1.0 + profile, 0.01))


def test_asymmetric_friction_scales_each_direction() -> None:
    p, dry = law("asymmetric_friction", 6, DRY)
    _, viscous = law("asymmetric_friction", 6, VISCOUS)
    pushed = RANDOM.v / RANDOM.dt + RANDOM.u  # of 1 kg; at rest the push gives the direction
    direction = np.sign(np.where(RANDOM.v == 0.0, pushed, RANDOM.v))
    assert set(direction) == {-1.0, 1.0}
    require(dry, 1.0 + p["coulomb"] * direction)
    require(viscous, 1.0 + p["viscous"] * direction)


def test_coulomb_friction_slides_at_its_level() -> None:
    moving = Motion.cycles(0.1)
    fast = np.abs(moving.v) > 1e-2  # far from where the axis could stop within a sample
    p, friction = law("coulomb_viscous", 7, OUT, moving)
    require(friction[fast], (p["Fc"] * np.sign(moving.v) + p["sigma2"] * moving.v)[fast])


@pytest.mark.parametrize("samples", [0.0, 0.3, 1.0, 4.75, 37.5])
def test_actuator_delay_delays_the_impulse_of_the_held_command(samples: float) -> None:
    """Over every sample the same impulse arrives as if the held command came later by tau."""
    dt, tau = RANDOM.dt, samples * RANDOM.dt
    found = trace(CATALOGUE["actuator_delay"], {"tau": tau}, RANDOM).after[:, U]
    edges = dt * np.arange(-100, len(RANDOM) + 1)  # before the log the command was its first value
    held = np.concatenate([np.full(100, RANDOM.u[0]), RANDOM.u])
    impulse = np.concatenate([[0.0], np.cumsum(held)]) * dt
    wanted = np.diff(np.interp(edges[100:] - tau, edges, impulse)) / dt
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("direction", "height"), [(1.0, "ahead"), (-1.0, "behind")])
def test_a_roller_brakes_with_its_height_at_every_pitch(direction: float, height: str) -> None:
    p = {"pitch": 0.034, "width": 0.004, "phase": 0.006, "ahead": 0.4, "behind": 0.25}
    speed, dt = 1.0, 1e-4
    x = direction * (np.arange(3000) * speed * dt - 0.15)
    motion = Motion(dt, x, np.full(3000, direction * speed), np.zeros(3000))
    force = trace(CATALOGUE["roller_spikes"], p, motion).after[100:, OUT]  # once it has turned
    passed = x[100:]
    wanted = np.zeros_like(passed)
    for k in range(-6, 7):
        r = (passed - p["phase"] - k * p["pitch"]) / (p["width"] / 2.0)
        wanted -= direction * p[height] * np.where(np.abs(r) < 1.0, (1.0 - r**2) ** 2, 0.0)
    np.testing.assert_allclose(force, wanted, rtol=0, atol=1e-9)
    assert np.abs(force).max() == pytest.approx(p[height], rel=1e-2)
