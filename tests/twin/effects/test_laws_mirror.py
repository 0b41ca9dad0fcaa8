"""Space has no preferred direction: seen in a mirror, an effect with mirrored parameters is itself.

Positions, speeds, accelerations and forces change sign; a factor does not. So do whole runs of the
stage, in both simulations, and setpoints.
"""

from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np
import pytest
from axis_runs import BOTH, Stepper
from effect_runs import CATALOGUE
from reference_kit import Columns, Values
from test_laws_effects import columns, stepped, values_of

from twin.effect import DRY, OUT, READING, STATIC, VISCOUS, Kind, U
from twin.experiments.trajectory import (
    Limits,
    constant_speed_passes,
    micro_reversals,
    point_to_point,
    velocity_staircase,
)
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.simulator import run

VECTORS = ("x", "v", "u", "x_other", "v_other", "a_other", "friction", "hold", "reading", "net",
           "acc")  # fmt: skip


def negated(*names: str) -> Callable[[Values], dict[str, float]]:
    return lambda p: {n: -v if n in names else v for n, v in p.items()}


def mirrored_track(p: Values) -> dict[str, float]:
    """cos(k pi (1 - s)) = (-1)^k cos(k pi s)."""
    odd = {f"c{k}": -p[f"c{k}"] for k in (1, 3, 5)}
    return {**p, **odd, "start": -p["start"] - p["length"]}


def mirrored_map(p: Values) -> dict[str, float]:
    """A, B and C change sign; D and E, which go with the direction, do not; knots turn round."""
    turned = {**p, "start": -p["start"] - p["length"]}
    for key, sign in (("x", -1.0), ("d", 1.0), ("e", 1.0), ("v", -1.0)):
        names = [n for n in p if n.startswith(f"{key}_")]
        turned |= {n: sign * p[m] for n, m in zip(names, names[::-1], strict=True)}
    return turned | {n: -v for n, v in p.items() if n.startswith("t_")}


def mirrored_residual(p: Values) -> dict[str, float]:
    """Each term is odd or even in place, speed and each memory."""
    turned = {**p, "start": -p["start"] - p["length"]}
    for n, v in p.items():
        if n.startswith("c_"):
            turned[n] = v * -((-1.0) ** sum(map(int, n.split("_")[1:])))
    return turned


def mirrored_curve(p: Values) -> dict[str, float]:
    """E changes sign, O goes with the direction and does not; the knots turn round."""
    turned = {**p, "offset": -p["offset"] - 1.0}
    for key, sign in (("e", -1.0), ("o", 1.0)):
        names = [n for n in p if n.startswith(f"{key}_")]
        turned |= {n: sign * p[m] for n, m in zip(names, names[::-1], strict=True)}
    return turned


# What a mirror does to the parameters; nothing where the effect is not listed.
MIRRORS = {
    "asymmetric_friction": negated("coulomb", "viscous"),
    "cable_slab": negated("offset", "k2"),
    "cogging": negated("b1", "b2", "b3"),
    "constant_force": negated("F0"),
    "encoder_ripple": negated("b1", "b2"),
    "force_constant_ripple": negated("a1", "a2"),
    "gravity": negated("cosine"),
    "load_dependent_friction": negated("offset"),
    "periodic_disturbance": negated("a", "b"),
    "spring": negated("middle", "offset", "k2"),
    "end_stop": lambda p: {**p, "low": -p["high"], "high": -p["low"]},
    "roller_spikes": lambda p: {
        **p, "phase": -p["phase"], "ahead": p["behind"], "behind": p["ahead"],
    },
    "position_dependent_friction": mirrored_track,
    "empirical_map": mirrored_map,
    "free_curve": mirrored_curve,
    "learned_residual": mirrored_residual,
}  # fmt: skip
# At exact halves of a step rounding is upwards on both sides; no other law knows its direction.
SIGNS = {OUT: -1.0, U: -1.0, READING: -1.0, DRY: 1.0, STATIC: 1.0, VISCOUS: 1.0}


def mirrored(name: str, values: Values) -> dict[str, float]:
    return MIRRORS.get(name, dict)(values)


@pytest.mark.parametrize("name", CATALOGUE)
def test_a_mirrored_law_gives_the_mirrored_force(name: str) -> None:
    effect = CATALOGUE[name]
    q = columns(0.5, effect.kind is Kind.FRICTION)
    seen = replace(q, **{f.name: -getattr(q, f.name) for f in fields(Columns) if f.name in VECTORS})
    values = values_of(effect)
    turned = mirrored(name, values)
    assert mirrored(name, turned) == values, "a mirror's mirror"
    _, one = stepped(effect, values, q)
    _, other = stepped(effect, turned, seen)
    for slot, sign in SIGNS.items():
        size = 1e-12 * np.abs(one[:, slot]).max()
        np.testing.assert_allclose(other[:, slot], sign * one[:, slot], rtol=0, atol=size)
    if name in MIRRORS:  # its parameters do matter
        _, plain = stepped(effect, values, seen)
        assert any(not np.allclose(plain[:, s], SIGNS[s] * one[:, s]) for s in SIGNS), "blind"


# Of the kinds that come before friction, those that act within a short run at any place.
CHOSEN = (
    *("asymmetric_friction", "cable_slab", "cogging", "constant_force", "load_dependent_friction"),
    *("force_constant_ripple", "axis_coupling", "actuator_deadband", "actuator_lag"),
    *("encoder_ripple", "stribeck", "flexible_mode", "payload_mass", "base_vibration"),
)
LIMITS = [Limits((-0.1, 0.15), 0.4, 5.0, 300.0), Limits((-0.12, 0.08), 0.3, 4.0, 200.0)]
TURNED = [replace(limit, travel=(-limit.travel[1], -limit.travel[0])) for limit in LIMITS]


def machine_model(turn: Callable[[str, Values], Values]) -> MachineModel:
    axes = {}
    for axis, mass in (("x", 3.1), ("y", 4.7)):
        chosen = tuple(
            Fitted.at_start(CATALOGUE[n], turn(n, modest(n, values_of(CATALOGUE[n]))))
            for n in CHOSEN
        )
        axes[axis] = AxisModel(mass, Hardware(force_limit=25.0), chosen)
    return MachineModel("mirror", axes, sample_rate=2000.0)


def modest(name: str, values: dict[str, float]) -> dict[str, float]:
    """Values with which a position loop keeps the axis."""
    if name in ("cable_slab", "cogging", "constant_force", "axis_coupling"):
        return {n: 0.4 * np.sign(v) if CATALOGUE[name].parameter(n).strength else v
                for n, v in values.items()}  # fmt: skip
    frequency = {"flexible_mode": 150.0, "base_vibration": 4.0}
    return {**values, "frequency": frequency[name]} if name in frequency else values


@pytest.mark.parametrize("stage", BOTH)
def test_a_mirrored_stage_makes_the_mirrored_motion(stage: Stepper) -> None:
    runs = []
    for limits, sign, turn in ((LIMITS, 1.0, lambda _, v: v), (TURNED, -1.0, mirrored)):
        way = sign * np.array([[0.0, 0.0], [0.06, -0.05], [0.02, 0.03]])
        setpoint = point_to_point(limits, way, dwell=0.05, sample_rate=2000.0)
        runs.append(run(machine_model(turn), setpoint, np.random.default_rng(0), simulator=stage))
    one, other = runs
    for found, wanted in ((other.signals, one.signals), (other.forces, one.forces)):
        assert np.all(np.abs(found + wanted) <= 1e-8 * np.abs(wanted).max(axis=0))
    acted = {name for i, (_, name) in enumerate(one.table.labels) if one.forces[:, i].any()}
    assert acted == {n for n in CHOSEN if CATALOGUE[n].kind not in (Kind.SENSING, Kind.MODIFIER)}


WAYS = {
    "moves": lambda lim, s: point_to_point(
        lim, s * np.array([[0.0, 0.05], [0.07, -0.1], [-0.03, 0.0]]), sample_rate=500.0
    ),
    "passes": lambda lim, s: constant_speed_passes(
        lim, 1, span=0.1 * s, speed=0.1, repeats=2, at=(s * 0.03, s * -0.02), sample_rate=500.0
    ),
    "reversals": lambda lim, s: micro_reversals(
        lim, 0, amplitude=s * 1e-4, repeats=3, at=(s * 0.03, s * 0.01), sample_rate=500.0
    ),
    "staircase": lambda lim, s: velocity_staircase(
        lim, 0, (0.02, 0.1), span=s * 0.05, at=(s * 0.03, s * 0.01), sample_rate=500.0
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WAYS)
def test_a_mirrored_setpoint_is_the_mirrored_motion(name: str) -> None:
    """Passes begin at their lower end, so theirs are mirrored by the order of the legs."""
    if name == "moves":
        one, other = WAYS[name](LIMITS, 1.0), WAYS[name](TURNED, -1.0)
        for array in ("position", "velocity", "acceleration"):
            np.testing.assert_allclose(getattr(other, array), -getattr(one, array), atol=1e-12)
        return
    setpoint = WAYS[name](LIMITS, 1.0)
    axis = 1 if name == "passes" else 0
    place = {"passes": -0.02}.get(name, 0.03)
    x, v = setpoint.position[:, axis] - place, setpoint.velocity[:, axis]
    assert x.max() == pytest.approx(-x.min(), rel=1e-9), "not centred on its place"
    assert v.max() == pytest.approx(-v.min(), rel=0.02), "not alike both ways"
    assert np.ptp(setpoint.position[:, 1 - axis]) == 0.0
    assert setpoint.position[0, 1 - axis] == {"passes": 0.03}.get(name, 0.01)
