"""A second simulator of one axis, on its own equations: stepped at 100 kHz, sampled by its control.

It shares no code with the product. Whatever depends on position, speed or time alone is a table;
what has a memory is written out here.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

STEP = 1e-5  # s
LUGRE, DAHL, SLIP_ELEMENTS, COULOMB = range(4)
FORCE, AHEAD, BEHIND, FRICTION, STRIBECK, MOTOR, READING = range(7)  # rows of the position tables
HALF_SPAN, PLACES = 0.25, 50001  # m, and number, of the position tables
TOP_SPEED, SPEEDS = 1.0, 20001  # m/s, and number, of the drag table
SMOOTH_SIGN = 5e-4  # m/s, over which direction changes
HISTORY = 4096  # true positions kept for the delayed reading
STATES = 14  # what has a memory, beside the slip elements:
LAGGED, LAST, REMANENCE = range(3)  # drive: N, N of the actual force, 1
BRISTLE, HEAT, REST, DWELT, DISTANCE = range(3, 8)  # friction: m or N, J, s, 1, m
LOOP, SIDE = range(8, 10)  # cable's loop and side of a bump, 1
X2, V2, XF, VF = range(10, 14)  # second mass and frame, m and m/s


class Plant(NamedTuple):
    """Constants of a machine in SI units; what is zero is absent."""

    mass: float
    Fc: float
    Fs: float
    v0: float
    s2: float
    s0: float
    s1: float
    n: float = 2.0
    kind: int = LUGRE
    slip_rate: float = 8.0  # N/s, of the slip elements
    asymmetry: float = 0.0  # of Coulomb friction by direction
    viscous_asymmetry: float = 0.0
    warm_gain: float = 0.0  # 1/J, logarithmic loss of friction with heat
    warm_time: float = 20.0
    dwell_force: float = 0.0
    dwell_time: float = 0.2
    load_gain: float = 0.0  # s^2/m, of friction with the other axis' acceleration
    wear_rate: float = 0.0  # 1/m
    accel_gain: float = 0.0  # s^2/m
    loop_force: float = 0.0  # N, cable hysteresis
    loop_length: float = 2e-3
    lag: float = 0.0
    delay: float = 0.0
    deadband: float = 0.0
    saturation: float = 1e9
    current_drop: float = 0.0  # 1/N
    remanence: float = 0.0  # N, of the motor with the history of its current
    remanence_width: float = 2.0  # N
    rate_limit: float = 1e12  # N/s
    mass_rate: float = 0.0  # kg/s
    mass2: float = 0.0
    k2: float = 0.0
    c2: float = 0.0
    gap: float = 0.0
    frame_mass: float = 0.0
    frame_k: float = 0.0
    frame_c: float = 0.0
    stop_low: float = -1.0
    stop_high: float = 1.0
    stop_k: float = 2e3
    stop_c: float = 20.0
    couple_inertia: float = 0.0
    couple_viscous: float = 0.0
    reading_delay: float = 0.0
    resolution: float = 0.0
    turn: float = 5e-5  # m of travel that turns a bump's braking round; 0: it is gone at rest


class Gains(NamedTuple):
    """Cascaded control: position P, speed PI on a filtered difference, feedforward."""

    position: float  # 1/s
    speed: float  # N s/m
    integral: float  # N/m
    filter: float  # 1, share of the new difference
    mass: float  # kg
    friction: float  # N
    limit: float  # N


# Only `_simulated` is called from Python: wrappers of the parts would take half of the compilation.
part = njit(no_cpython_wrapper=True, no_cfunc_wrapper=True)  # pyrefly: ignore[no-matching-overload]


@part
def look_up(table, half_span, at):
    place = (at + half_span) / (2.0 * half_span) * (table.size - 1)
    i = min(max(int(place), 0), table.size - 2)
    return table[i] + (place - i) * (table[i + 1] - table[i])


@part
def friction_rate(p, z, v, g):
    """Rate of the bristle (m/s) or of the force (N/s, Dahl)."""
    if p.kind == LUGRE:
        return v - p.s0 * abs(v) * z / g
    return p.s0 * (v - abs(v) * z / g)


@part
def friction_force(p, z, elements, v, g, h):
    """Advance the friction's memory over one step; force opposing motion less the viscous part."""
    if p.kind == COULOMB:
        return z, g * np.tanh(v / 1e-4)
    if p.kind == SLIP_ELEMENTS:
        total, share = 0.0, 1.0 / elements.size
        for i in range(elements.size):
            stiffness = p.s0 * 2.0 * (elements.size - i) * share / (elements.size + 1)
            trial = elements[i] + stiffness * v * h
            if abs(trial) > share * g and trial * v > 0.0:
                target = share * g * np.sign(v)
                trial = elements[i] + h * p.slip_rate * (target - elements[i]) / g
                if abs(elements[i]) < abs(target) * 0.999:
                    trial = target
            elements[i] = trial
            total += trial
        return z, total
    first = friction_rate(p, z, v, g)
    second = friction_rate(p, z + h * first, v, g)
    z += 0.5 * h * (first + second)
    if p.kind == LUGRE:
        return z, p.s0 * z + p.s1 * friction_rate(p, z, v, g)
    return z, z


@part
def command_of(gains, s, reading, target, rate):
    """Command (N) of the cascade; s holds the last reading, filtered speed and integral."""
    s[1] += gains.filter * ((reading - s[0]) * rate - s[1])
    s[0] = reading
    wanted = target[1] + gains.position * (target[0] - reading)
    s[2] += gains.integral * (wanted - s[1]) / rate
    command = gains.speed * (wanted - s[1]) + s[2] + gains.mass * target[2]
    command += gains.friction * np.tanh(target[1] / 2e-3)
    return min(max(command, -gains.limit), gains.limit)


@part
def drive_force(p, s, u, h):
    """Force (N) for a command: dead zone, rate, lag, limit, then the motor's own faults."""
    u = np.sign(u) * max(abs(u) - p.deadband, 0.0)
    u = s[LAGGED] + min(max(u - s[LAGGED], -p.rate_limit * h), p.rate_limit * h)
    if p.lag > 0.0:
        s[LAGGED] += (1.0 - np.exp(-h / p.lag)) * (u - s[LAGGED])
    else:
        s[LAGGED] = u
    actual = min(max(s[LAGGED], -p.saturation), p.saturation)
    change, s[LAST] = actual - s[LAST], actual
    grown = min(abs(change) / p.remanence_width, 1.0)
    s[REMANENCE] += (np.sign(change) - s[REMANENCE]) * grown
    return actual + p.remanence * s[REMANENCE] - p.current_drop * actual * abs(actual)


@part
def dwelt(p, s, v, h):
    """Part of the dwell force that rest has built up and motion has not yet worn off."""
    if p.dwell_force == 0.0:
        return 0.0
    if abs(v) < 2e-4:
        s[REST] += h
        s[DWELT] = max(s[DWELT], 1.0 - np.exp(-s[REST] / p.dwell_time))
    else:
        s[REST] = 0.0
        s[DWELT] *= np.exp(-abs(v) * h / 5e-4)
    return s[DWELT]


@part
def friction(p, s, elements, tables, x, v, a, other_a, h):
    """Friction with its memory and the viscous part, both N, opposing motion."""
    sign = np.tanh(v / SMOOTH_SIGN)
    level = look_up(tables[FRICTION], HALF_SPAN, x) * (1.0 + p.asymmetry * sign)
    level *= 1.0 + p.load_gain * abs(other_a) + p.wear_rate * s[DISTANCE]
    level *= 1.0 + p.accel_gain * abs(a)
    cold = np.exp(-p.warm_gain * s[HEAT])
    v0 = p.v0 * look_up(tables[STRIBECK], HALF_SPAN, x)
    curve = p.Fc + (p.Fs - p.Fc) * np.exp(-((abs(v) / v0) ** p.n))
    g = (curve * cold + p.dwell_force * dwelt(p, s, v, h)) * level
    s[BRISTLE], held = friction_force(p, s[BRISTLE], elements, v, g, h)
    viscous = p.s2 * cold * (1.0 + p.viscous_asymmetry * sign) * v
    s[HEAT] += h * ((held + viscous) * v - s[HEAT] / p.warm_time)
    s[DISTANCE] += abs(v) * h
    return held, viscous


@part
def track_force(p, s, tables, drag, x, v, h):
    """Force (N) of cable, track, air, bumps and stops."""
    rub = 1.0 - abs(s[LOOP]) * (0.5 + 0.5 * np.sign(v * s[LOOP]))
    s[LOOP] += v * h / p.loop_length * rub
    force = look_up(tables[FORCE], HALF_SPAN, x) - look_up(drag, TOP_SPEED, v)
    force -= p.loop_force * s[LOOP]
    if p.turn > 0.0:
        s[SIDE] = min(max(s[SIDE] + 2.0 * v * h / p.turn, -1.0), 1.0)
    else:
        s[SIDE] = np.tanh(v / SMOOTH_SIGN)
    force -= s[SIDE] * look_up(tables[AHEAD if s[SIDE] > 0.0 else BEHIND], HALF_SPAN, x)
    if x > p.stop_high:
        force -= p.stop_k * (x - p.stop_high) + p.stop_c * v
    elif x < p.stop_low:
        force -= p.stop_k * (x - p.stop_low) + p.stop_c * v
    return force


@part
def acceleration(p, s, x, v, force, mass, h):
    """Acceleration (m/s^2) over the frame, which with the second mass goes one step on."""
    link, shake = 0.0, 0.0
    if p.mass2 > 0.0:
        apart = s[X2] - x
        squeeze = np.sign(apart) * max(abs(apart) - p.gap, 0.0)
        if squeeze != 0.0 or p.gap == 0.0:
            link = p.k2 * squeeze + p.c2 * (s[V2] - v)
    if p.frame_mass > 0.0:
        shake = (-force - p.frame_k * s[XF] - p.frame_c * s[VF]) / p.frame_mass
        s[VF] += h * shake
        s[XF] += h * s[VF]
    if p.mass2 > 0.0:
        s[V2] += h * (-link / p.mass2 - shake)
        s[X2] += h * s[V2]
    return (force + link) / mass - shake


def simulate(plant, gains, setpoint, other, tables, drag, disturbance, noise, rate):
    """Run under control; (n, 4): reading m, command N, true position m, true speed m/s.

    setpoint (n, 3), other (n, 2: speed, acceleration of the other axis), disturbance (n,) N and
    noise (n,) m are sampled at the control's rate (Hz).
    """
    # As records, which the parts take by address: some fifty numbers each by value compile slowly.
    p, control = (np.array(tuple(c), [(f, float) for f in c._fields])[()] for c in (plant, gains))
    return _simulated(p, control, setpoint, other, tables, drag, disturbance, noise, rate)


@njit(cache=True)
def _simulated(p, gains, setpoint, other, tables, drag, disturbance, noise, rate):
    n, h = len(setpoint), STEP
    inner, late = round(1.0 / (rate * h)), round(p.reading_delay / h)
    out = np.zeros((n, 4))
    history, elements = np.full(HISTORY, setpoint[0, 0]), np.zeros(4)
    x, v, a, fine = setpoint[0, 0], 0.0, 0.0, 0
    s, loop = np.zeros(STATES), np.array([x, 0.0, 0.0])
    s[X2] = x
    for k in range(n):
        history[fine % HISTORY] = x
        seen = history[(fine - late) % HISTORY] if fine >= late else history[0]
        reading = seen + look_up(tables[READING], HALF_SPAN, seen) + noise[k]
        if p.resolution > 0.0:
            reading = np.floor(reading / p.resolution + 0.5) * p.resolution
        if k == 0:
            loop[0] = reading
        out[k] = reading, command_of(gains, loop, reading, setpoint[k], rate), x, v
        k1 = min(k + 1, n - 1)
        for i in range(inner):
            history[fine % HISTORY] = x
            fine += 1
            since = (i + 0.5) * h * rate
            j = k + int(np.floor(since - p.delay * rate))
            other_v = other[k, 0] + since * (other[k1, 0] - other[k, 0])
            other_a = other[k, 1] + since * (other[k1, 1] - other[k, 1])
            force = drive_force(p, s, 0.0 if j < 0 else out[j, 1], h)
            force *= look_up(tables[MOTOR], HALF_SPAN, x)
            held, viscous = friction(p, s, elements, tables, x, v, a, other_a, h)
            force += track_force(p, s, tables, drag, x, v, h) - held - viscous
            force += disturbance[k] + since * (disturbance[k1] - disturbance[k])
            force -= p.couple_inertia * other_a + p.couple_viscous * other_v
            mass = p.mass - p.mass2 + p.mass_rate * (k + since) / rate
            a = acceleration(p, s, x, v, force, mass, h)
            x += h * (v + 0.5 * h * a)
            v += h * a
    return out
