"""Effects of the second simulator, in and outside the catalogue; each grows from none with size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.second_simulator.kernel import (
    AHEAD,
    BEHIND,
    COULOMB,
    DAHL,
    FORCE,
    FRICTION,
    MOTOR,
    READING,
    SLIP_ELEMENTS,
    STRIBECK,
)
from benchmarks.second_simulator.machine import (  # fmt: skip
    PLACE,
    SPEED,
    Machine,
    gaussian,
    raised_cosine,
    train,
)

TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Planted:
    """An effect of the second simulator.

    make: (machine, size, generator) -> machine. right: catalogue names that say what it is. near:
    names whose law is close enough to be of use. shapes: laws of the model of which another shape
    says it. largest: size beyond which it is another machine. drop: effects taken out of the model,
    to be found again. fixed: it has no size.
    """

    make: Callable[[Machine, float, np.random.Generator], Machine]
    right: tuple[str, ...] = ()
    near: tuple[str, ...] = ()
    shapes: tuple[str, ...] = ()
    largest: float = 1.0
    start: float = 0.01
    drop: tuple[str, ...] = ()
    fixed: bool = False


def harmonics(rng, pitch, amplitudes):
    """Sum of sines over the track with random phases."""
    return sum(
        a * np.sin(TURN * (k + 1) * PLACE / pitch + rng.uniform(0.0, TURN))
        for k, a in enumerate(amplitudes)
    )


def cogging(m, size, rng):
    return m.plus(FORCE, size * harmonics(rng, rng.uniform(0.012, 0.03), (1.0, 0.4, 0.2)))


def motor_ripple(m, size, rng):
    return m.plus(MOTOR, size * harmonics(rng, rng.uniform(0.02, 0.05), (1.0, 0.3)))


def rollers(m, size, rng, bump=raised_cosine):
    shape = train(0.034, rng.uniform(0.0, 0.034), 0.004, bump)
    tables = m.tables.copy()
    tables[AHEAD], tables[BEHIND] = 1.5 * size * shape, size * shape
    return replace(m, tables=tables)


def asymmetric(m, size, rng):
    return m.having(asymmetry=size, viscous_asymmetry=0.5 * size)


def sloping_friction(m, size, rng):
    return m.plus(FRICTION, size * PLACE / 0.15)


def stepping_friction(m, size, rng):
    return m.plus(FRICTION, size * np.tanh((PLACE - rng.uniform(-0.05, 0.05)) / 0.02))


def periodic(m, size, rng):
    f, phase = rng.uniform(2.0, 25.0), rng.uniform(0.0, TURN)
    return replace(m, disturbance=lambda t, r: size * np.sin(TURN * f * (t + r.uniform()) + phase))


def flexible(m, size, rng):
    mass, omega = size * m.plant.mass, TURN * rng.uniform(35.0, 90.0)
    return m.having(mass2=mass, k2=mass * omega**2, c2=0.04 * mass * omega)


def play(m, size, rng):
    mass = 0.25 * m.plant.mass
    omega = TURN * 60.0
    return m.having(mass2=mass, k2=mass * omega**2, c2=0.6 * mass * omega, gap=size * 1e-3)


def frame(m, size, rng):
    mass, omega = m.plant.mass / size, TURN * rng.uniform(2.0, 6.0)
    damping = 2.0 * rng.uniform(0.05, 0.3) * mass * omega
    return m.having(frame_mass=mass, frame_k=mass * omega**2, frame_c=damping)


def stops(m, size, rng):
    return m.having(stop_high=0.09, stop_low=-0.09, stop_k=1e2 * size, stop_c=size)


def reading_ripple(m, size, rng):
    return m.plus(READING, 1e-3 * size * harmonics(rng, rng.uniform(0.5e-3, 4e-3), (1.0, 0.3)))


def beside(m, **values):
    """The machine with its other axis moving."""
    return replace(m, other=True).having(**values)


def value(name, scale=1.0):
    """An effect that is one constant of the plant."""
    return lambda m, size, rng: m.having(**{name: scale * size})


def of_kind(kind):
    return lambda m, size, rng: m.having(kind=kind)


INSIDE = {
    "cogging": Planted(cogging, ("cogging",)),
    "force_constant_ripple": Planted(motor_ripple, ("force_constant_ripple",), largest=0.3),
    "roller_spikes": Planted(rollers, ("roller_spikes",), drop=("roller_spikes",)),
    "roller_spikes (Gaussian)": Planted(
        lambda m, s, r: rollers(m, s, r, gaussian), ("roller_spikes",), drop=("roller_spikes",)
    ),
    "asymmetric_friction": Planted(asymmetric, ("asymmetric_friction",), largest=0.8),
    "position_dependent_friction (slope)": Planted(
        sloping_friction, ("position_dependent_friction",), largest=0.8
    ),
    "position_dependent_friction (step)": Planted(
        stepping_friction, ("position_dependent_friction",), largest=0.8
    ),
    "thermal_drift": Planted(
        lambda m, s, r: m.having(warm_gain=2.0 * s, warm_time=r.uniform(5.0, 30.0)),
        ("thermal_drift",), largest=3.0, start=0.05,
    ),
    "dwell_stiction": Planted(value("dwell_force"), ("dwell_stiction",), largest=0.5, start=0.05),
    "load_dependent_friction": Planted(
        lambda m, s, r: beside(m, load_gain=s), ("load_dependent_friction",)
    ),
    "wear": Planted(value("wear_rate"), ("wear",), largest=0.5),
    "cable_hysteresis": Planted(
        lambda m, s, r: m.having(loop_force=s, loop_length=10.0 ** r.uniform(-2.7, -2.0)),
        ("cable_hysteresis",), start=0.03,
    ),
    "constant_force": Planted(
        lambda m, s, r: m.plus(FORCE, s), ("constant_force",), largest=0.5, drop=()
    ),
    "quadratic_drag": Planted(
        lambda m, s, r: replace(m, drag=s * 30.0 * SPEED * abs(SPEED)), ("quadratic_drag",)
    ),
    "axis_coupling": Planted(
        lambda m, s, r: beside(m, couple_inertia=s, couple_viscous=0.3 * s), ("axis_coupling",)
    ),
    "periodic_disturbance": Planted(periodic, ("periodic_disturbance",)),
    "end_stop": Planted(stops, ("end_stop",), largest=10.0, start=0.03),
    "actuator_lag": Planted(
        value("lag", 5e-3), ("actuator_lag",), ("actuator_delay", "encoder_delay"), largest=1.0
    ),
    "actuator_delay": Planted(
        value("delay", 5e-3), ("actuator_delay", "encoder_delay"), ("actuator_lag",), largest=1.0
    ),
    "actuator_deadband": Planted(value("deadband"), ("actuator_deadband",)),
    "actuator_saturation": Planted(
        lambda m, s, r: m.having(saturation=m.plant.mass * (2.0 - s)),
        ("actuator_saturation",), start=0.3, largest=1.5,
    ),
    "base_vibration": Planted(frame, ("base_vibration",), largest=0.5),
    "flexible_mode": Planted(flexible, ("flexible_mode",), largest=0.5, start=0.05),
    "backlash": Planted(play, ("backlash",), ("flexible_mode",), start=0.05),
    "payload_mass": Planted(
        lambda m, s, r: m.having(mass=m.plant.mass * (1.0 + s)), ("payload_mass",), largest=0.5
    ),
    "encoder_ripple": Planted(reading_ripple, ("encoder_ripple",), largest=0.05, start=1e-3),
    "encoder_quantization": Planted(
        value("resolution", 1e-3), ("encoder_quantization",), largest=0.05, start=2e-3
    ),
    "encoder_delay": Planted(
        value("reading_delay", 5e-3), ("encoder_delay", "actuator_delay"), ("actuator_lag",)
    ),
    "friction: slip elements": Planted(
        of_kind(SLIP_ELEMENTS), ("gms",), ("leuven", "modified_leuven"), fixed=True
    ),
    "friction: Dahl": Planted(of_kind(DAHL), ("dahl",), fixed=True),
    "friction: Coulomb": Planted(
        of_kind(COULOMB), ("coulomb_viscous", "stribeck"), ("gms",), fixed=True
    ),
}  # fmt: skip


def sawtooth(m, size, rng):
    pitch = rng.uniform(0.015, 0.04)
    return m.plus(FORCE, size * (2.0 * ((PLACE / pitch + rng.uniform()) % 1.0) - 1.0))


def random_walk(m, size, rng):
    def push(t, r):
        return np.cumsum(r.standard_normal(len(t))) * np.sqrt(t[1]) * size

    return replace(m, disturbance=push)


def chirp(m, size, rng):
    f0, f1 = rng.uniform(0.5, 2.0), rng.uniform(5.0, 20.0)
    return replace(
        m, disturbance=lambda t, r: size * np.sin(TURN * (f0 + (f1 - f0) * t / t[-1] / 2.0) * t)
    )


def blow(m, size, rng):
    return replace(m, disturbance=lambda t, r: size * (t > t[-1] * r.uniform(0.2, 0.8)))


def single_bump(m, size, rng):
    return m.plus(FORCE, size * gaussian(PLACE - rng.uniform(-0.1, 0.1), 0.012))


# A force of speed alone is that of a friction whose curve over speed has another shape.
OUTSIDE = {
    "sawtooth force": Planted(sawtooth, near=("cogging",)),
    "cubic drag": Planted(
        lambda m, s, r: replace(m, drag=s * 100.0 * SPEED**3), near=("quadratic_drag",),
        shapes=("lugre",),
    ),
    "saturating drag": Planted(
        lambda m, s, r: replace(m, drag=s * np.tanh(SPEED / 0.06)), shapes=("lugre",)
    ),
    "random walk": Planted(random_walk),
    "force step in time": Planted(blow),
    "Stribeck speed by place": Planted(
        lambda m, s, r: m.plus(STRIBECK, s * PLACE / 0.16), near=("position_dependent_friction",),
        largest=0.8, start=0.2,
    ),
    "Stribeck exponent 1": Planted(
        lambda m, s, r: m.having(n=2.0 - s), shapes=("lugre",), largest=1.0, start=0.3
    ),
    "motor remanence": Planted(value("remanence")),
    "growing mass": Planted(value("mass_rate")),
    "chirp": Planted(chirp, near=("periodic_disturbance",)),
    "motor weaker with current": Planted(
        value("current_drop", 0.1), near=("actuator_saturation",), start=0.01
    ),
    "friction with own acceleration": Planted(
        value("accel_gain"), near=("load_dependent_friction",)
    ),
    "rate limit": Planted(lambda m, s, r: m.having(rate_limit=300.0 / s), start=0.1),
    "reading off by a square": Planted(
        lambda m, s, r: m.plus(READING, s * PLACE**2), largest=0.5
    ),
    "one bump": Planted(single_bump),
}  # fmt: skip
