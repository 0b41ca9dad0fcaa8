"""Every law is the plain NumPy reference written from its printed equation, slot by slot.

The inputs are pairwise different, so that a swapped parameter, column or sign shows."""

from dataclasses import fields, replace

import numpy as np
import pytest
from machines import CATALOGUE
from reference_kit import Columns, Values
from references import REFERENCES

from twin import effect as slots
from twin.curve import Coordinate, Curve
from twin.effect import IO_SIZE, OUT, Effect, Excitation, Kind
from twin.laws.trials import compiled
from twin.signals import Array

SINGLE = ("dt", "when", "mass", "moved")
EVERY = pytest.mark.parametrize("name", REFERENCES)

# Where effects act on the motion below, and where the drawn values would be out of proportion.
SPECIAL = {
    "actuator_deadband": {"width": 0.7},
    "actuator_saturation": {"limit": 1.3, "loss": 0.6},
    "actuator_delay": {"tau": 3.3e-4},
    "actuator_lag": {"tau": 4e-4},
    "encoder_delay": {"tau": 2.7e-4},
    "encoder_quantization": {"step": 3e-3},
    "encoder_ripple": {"period": 0.013, "a1": 3e-5, "b1": -2e-5, "a2": 7e-6, "b2": 1.1e-5},
    "cable_hysteresis": {"reach": 9e-5, "f0": 0.2, "f1": 0.3, "f2": 0.5, "f3": 0.7},
    "asymmetric_friction": {"coulomb": 0.3, "viscous": -0.2},
    "dwell_stiction": {"growth": 1.7, "time": 2e-3, "slip": 3e-4},
    "load_dependent_friction": {"motor": 0.3, "corner": 0.05, "offset": -9.0},
    "position_dependent_friction": {
        "start": -0.11, "length": 0.23, "c1": 0.5, "c2": -0.3, "c3": 0.7, "c4": 0.2, "c5": -0.4,
    },
    "pressure_force": {"area": 0.3, "area_2": -0.2},
    "pressure_friction": {"growth": 0.3, "growth_2": 0.2},
    "temperature_friction": {"T0": 0.1, "dry": 2.0, "viscous": -1.5},
    "shear_thinning": {"loss": 0.6, "vt": 0.07},
    "thermal_drift": {"dry": 70.0, "viscous": 40.0, "tau": 0.2, "idle": 0.02},
    "wear": {"rate": 300.0},
    "free_curve": {"per_metre": 2.9, "offset": -0.375, "turn": 3e-6, "rest": 0.03},
    "end_stop": {"low": -0.05, "high": 0.07, "stiffness": 3e4, "relaxation": 3e-3},
    "roller_spikes": {"pitch": 0.03, "width": 0.025, "phase": 0.004, "ahead": 0.7, "behind": 0.3},
    "periodic_disturbance": {"f": 730.0, "a": 0.6, "b": -0.4},
    "payload_mass": {"ratio": 0.37},
    "friction_ripple": {"p": 0.027, "a1": 0.3, "b1": -0.2, "a2": 0.13, "b2": 0.07},
    "force_constant_ripple": {"p": 0.031, "a1": 0.3, "b1": -0.2, "a2": 0.13, "b2": 0.07},
    "position_dependent_force_constant": {
        "start": -0.11, "length": 0.23, "c1": 0.3, "c2": -0.2, "c3": 0.1, "c4": 0.2, "c5": -0.1,
    },
    "backlash": {"load": 0.3, "play": 3e-6, "frequency": 410.0, "damping": 0.21},
    "flexible_mode": {"load": 0.4, "frequency": 530.0, "damping": 0.13},
    "base_vibration": {"recoil": 0.35, "frequency": 97.0, "damping": 0.17},
}  # fmt: skip
CURVE = {"Fc": 1.0, "Fs": 1.4, "v0": 0.03, "sigma2": 2.3, "sigma0": 8e4, "sigma1": 3.0}
FRICTIONS = {
    "coulomb_viscous": {},
    "stribeck": {},
    "dahl": {"n": 1.6},
    "lugre": {},
    "gms": {"C": 900.0, "spread": 12.0},
    "leuven": {"m": 4.0, "b": 0.8},
    "modified_leuven": {"m": 4.0, "spread": 12.0},
}


def values_of(effect: Effect, n: float = 1.3) -> dict[str, float]:
    """Pairwise different values within the bounds; n: exponent of a Stribeck curve."""
    rng = np.random.default_rng(61)
    known = effect.starts()
    for p in effect.parameters:
        if p.strength:
            known[p.name] = float(rng.uniform(0.1, 0.9)) * (
                1 if p.lower == 0 else rng.choice([-1, 1])
            )
        elif p.name.startswith(("share_", "stiff_")):
            known[p.name] = float(rng.uniform(0.5, 2.0))
    own = SPECIAL.get(effect.name, {})
    if effect.name in FRICTIONS:
        own = {n: v for n, v in CURVE.items() if n in known} | FRICTIONS[effect.name]
    return {**known, **own, **({"n": n} if "v0" in known else {})}


def path(rng: np.random.Generator, n: int) -> Array:
    """Speeds with inner loops of some micrometres that close, long slides, rests, and creeping."""
    legs = [9, -6, 4, -2, 1, -4, 3, 12, -25, 14, -7, 3, -9, 40, 0, 8, -3, 30, -30]
    speeds = np.concatenate([np.sign(leg) * np.linspace(0.02, 0.05, abs(leg) + 1) for leg in legs])
    speeds = speeds[:n] * rng.uniform(0.8, 1.2, n)
    speeds[-4:] = 0.0, 1e-12, -1e-12, 0.3
    return speeds


def columns(when: float, friction: bool) -> Columns:
    """Unrelated inputs; the factors on a friction that remembers are held, as its level is."""
    rng = np.random.default_rng(62)
    n, dt = 180, 1e-4
    v = path(rng, n)
    own = {
        "time": 0.37 + dt * np.arange(n),
        "x": rng.uniform(-0.2, 0.2, n),
        "v": v,
        "u": rng.normal(0.0, 2.0, n),
        "hold": np.where(np.arange(n) % 7 < 3, rng.uniform(-3.0, 3.0, n), 40.0 * v / 0.03),
    }
    factors = {"dry": 0.8, "static": 1.15, "viscous": 1.7}
    for f in fields(Columns):
        if f.name not in SINGLE and f.name not in own:
            own[f.name] = rng.uniform(0.2, 1.8, n) * rng.choice([-1.0, 1.0], n)
    for name, value in factors.items():
        own[name] = np.full(n, value) if friction else rng.uniform(0.5, 1.5, n)
    own["reading"] = 0.1 * own["reading"]
    return Columns(dt=dt, when=when, mass=1.9, moved=3.1, **own)


def stepped(effect: Effect, values: Values, q: Columns) -> tuple[Array, Array]:
    """io before and after the law, (n, IO_SIZE) each, along the columns."""
    p, s = np.array([values[p.name] for p in effect.parameters]), np.zeros(len(effect.states) + 1)
    io = np.zeros(IO_SIZE)
    law = compiled(effect, p, s, io)
    before = np.zeros((len(q), IO_SIZE))
    for f in fields(Columns):
        before[:, getattr(slots, f.name.upper())] = getattr(q, f.name)
    before[:, slots.INDEX] = np.arange(len(q))
    after = np.empty_like(before)
    for k, row in enumerate(before):
        io[:] = row
        law()
        after[k] = io
    return before, after


def require_reference(effect: Effect, when: float, tolerance: float, dt: float = 1e-4) -> None:
    exponent = 2.0 if when == 1.0 else 1.3  # laws have a quicker way for the usual one
    values, q = values_of(effect, exponent), columns(when, effect.kind is Kind.FRICTION)
    q = replace(q, dt=dt)
    before, after = stepped(effect, values, q)
    results = REFERENCES[effect.name].results(values, q)
    written = np.flatnonzero(np.any(before != after, axis=0))
    assert set(written) <= set(results), "it writes a slot that its equation has no word about"
    for slot, wanted in results.items():
        assert np.ptp(wanted) > 0.0 or slot == OUT, "blind"
        assert not np.allclose(wanted, before[:, slot]), "blind"
        size = tolerance * np.abs(wanted - (before[:, slot] if slot != OUT else 0.0)).max()
        np.testing.assert_allclose(after[:, slot], wanted, rtol=0, atol=size)


def test_there_is_a_reference_for_every_effect_and_no_other() -> None:
    assert set(REFERENCES) == set(CATALOGUE)


@EVERY
def test_the_reference_was_written_from_the_equation_that_is_printed(name: str) -> None:
    assert REFERENCES[name].equation == CATALOGUE[name].equation


# Small steps within a sample leave an error, by period; all else agrees to rounding.
TOLERANCES = {
    1e-4: {"dahl": 1e-5, "lugre": 1e-5, "gms": 5e-5, "leuven": 1e-2, "modified_leuven": 2e-2},
    1e-5: {"dahl": 1e-7, "lugre": 1e-6, "gms": 1e-6, "leuven": 1e-3, "modified_leuven": 1e-3},
}
CASES = [(n, 1e-4, when) for n in REFERENCES for when in (1.0, 0.5)]
CASES += [(n, 1e-5, 1.0) for n in TOLERANCES[1e-5]]


@pytest.mark.parametrize(("name", "dt", "when"), CASES)
def test_the_law_is_its_equation(name: str, dt: float, when: float) -> None:
    require_reference(CATALOGUE[name], when, TOLERANCES[dt].get(name, 1e-9), dt=dt)


@pytest.mark.parametrize("name", TOLERANCES[1e-5])
def test_a_friction_without_a_level_is_viscous_and_forgets(name: str) -> None:
    """After samples without dry friction it goes on as from the start."""
    effect = CATALOGUE[name]
    values, q = values_of(effect), columns(1.0, True)
    gone, again = 30, 40
    dry = q.dry.copy()
    dry[gone:again] = 0.0
    _, found = stepped(effect, values, replace(q, dry=dry))
    wanted = values["sigma2"] * q.viscous * q.v
    np.testing.assert_allclose(found[gone:again, OUT], wanted[gone:again], rtol=1e-12)
    rest = {f.name: getattr(q, f.name)[again:] for f in fields(Columns) if f.name not in SINGLE}
    _, fresh = stepped(effect, values, replace(q, **rest))
    np.testing.assert_allclose(found[again:, OUT], fresh[:, OUT], rtol=1e-9, atol=1e-12)


# A free curve lies over the coordinate that a law declares, closed where the law repeats


FREE = next(e for e in CATALOGUE.values() if e.free_shape)
COVERED = Excitation(-0.1, 0.2, 0.25, 0.3, 10.0, 1e-3)
OVER = pytest.mark.parametrize(
    ("over", "period", "ends"),
    [
        (Coordinate.POSITION, None, (-0.1, 0.2)),
        (Coordinate.POSITION, 0.034, (0.0, 0.034)),
        (Coordinate.SPEED, None, (0.0, 0.25)),
    ],
)
CURVED = [(e, c) for e in CATALOGUE.values() for c in e.curves]


def laid(curve: Curve, period: float | None = None, *, lets_go: bool = False) -> dict[str, float]:
    return {**values_of(FREE), **FREE.free_shape.laid(curve, period, COVERED, lets_go)}


@pytest.mark.parametrize("lets_go", [False, True])
@OVER
def test_it_is_its_equation_over_every_coordinate(over, period, ends, lets_go) -> None:
    values = laid(Curve(over, by_direction=True), period, lets_go=lets_go)
    q = columns(0.5, friction=False)
    _, after = stepped(FREE, values, q)
    wanted = REFERENCES[FREE.name].results(values, q)[OUT]
    np.testing.assert_allclose(after[:, OUT], wanted, rtol=1e-9, atol=1e-12)


@OVER
def test_its_knots_are_where_the_law_has_them(over, period, ends) -> None:
    """At a knot, moving for long, the force is that of the knot, both ways."""
    values = laid(Curve(over, by_direction=True), period)
    where, index = FREE.free_shape.knots(values)
    assert (where[0], where[-1]) == pytest.approx(ends)
    assert index[0] == 0
    assert (index[-1] == 0) == (period is not None)
    inner, along = np.array(where[1:-1]), over is Coordinate.POSITION
    place, speed = (inner, 0.1 + inner**2) if along else (0.1 + inner**2, inner)
    for way in (1.0, -1.0):
        q = columns(1.0, friction=False)
        kept = {f.name: getattr(q, f.name)[: len(speed)] for f in fields(q) if f.name not in SINGLE}
        q = replace(q, **{**kept, "x": place, "v": way * speed})
        _, after = stepped(FREE, {**values, "turn": 1e-9}, q)
        wanted = [
            values[f"e_{i + 1}"] + way * values[f"o_{i + 1}"] for i in index[1:-1]
        ]  # fmt: skip
        np.testing.assert_allclose(after[:, OUT], wanted, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(("effect", "curve"), CURVED, ids=lambda c: getattr(c, "name", ""))
def test_a_curve_is_declared_over_what_the_law_has(effect: Effect, curve: Curve) -> None:
    assert curve.period is None or effect.parameter(curve.period).period
    assert curve.by_direction or not curve.rubs, "friction turns with the direction"
    assert not effect.is_nonparametric
