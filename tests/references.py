"""Every effect of the catalogue once more, in plain NumPy, from its printed equation and docstring.

Nothing here is taken from the laws: sums instead of recurrences, poles instead of half angles,
quadrature and small steps instead of closed forms. A function takes the values by name and the
columns of a motion, and returns what the law is to leave in each slot of io it writes. Frictions
are in tests/reference_frictions.py.
"""

from __future__ import annotations

import numpy as np
import reference_frictions  # noqa: F401  (registers its own)
from numpy.polynomial import Chebyshev, Polynomial
from reference_kit import (
    REFERENCES,
    Columns,
    Results,
    Values,
    followed,
    fourier,
    numbered,
    written_from,
)

from twin.effect import DRY, OUT, READING, STATIC, VISCOUS, U

__all__ = ["REFERENCES"]

# --- actuation and sensing ------------------------------------------------------------------------


@written_from("u_actual = 0 for |u| <= width, else u - width sgn u")
def actuator_deadband(p: Values, q: Columns) -> Results:
    return {U: np.where(np.abs(q.u) <= p["width"], 0.0, q.u - p["width"] * np.sign(q.u))}


@written_from("u_actual = u - loss (u - clip(u, -limit, limit))")
def actuator_saturation(p: Values, q: Columns) -> Results:
    above = np.sign(q.u) * np.maximum(np.abs(q.u) - p["limit"], 0.0)
    return {U: q.u - p["loss"] * above}


@written_from("u_actual = u (1 + error)")
def torque_constant(p: Values, q: Columns) -> Results:
    return {U: q.u + p["error"] * q.u}


@written_from("u_actual(t) = u(t - tau)")
def actuator_delay(p: Values, q: Columns) -> Results:
    """The impulse of the held command, tau later; before the log it was its first value."""
    edges = q.dt * np.arange(-80, len(q) + 1)
    impulse = q.dt * np.cumsum(np.r_[0.0, np.full(80, q.u[0]), q.u])
    return {U: np.diff(np.interp(edges[80:] - p["tau"], edges, impulse)) / q.dt}


@written_from("tau du_actual/dt = u - u_actual")
def actuator_lag(p: Values, q: Columns) -> Results:
    """The mean over each sample, by quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    within = 0.5 * q.dt * (1.0 + nodes)
    force, seen = q.u[0], np.empty(len(q))
    for k, u in enumerate(q.u):
        seen[k] = 0.5 * weights @ (u + (force - u) * np.exp(-within / p["tau"]))
        force = u + (force - u) * np.exp(-q.dt / p["tau"])
    return {U: seen}


@written_from("u_actual = u (1 + sum_{k=1,2} a_k sin(2 pi k x/p) + b_k cos(2 pi k x/p))")
def force_constant_ripple(p: Values, q: Columns) -> Results:
    return {U: q.u * (1.0 + fourier(p, q.x / p["p"]))}


@written_from("u_actual = u (1 + P(x));  P(x) = sum_k c_k cos(k pi (x - start)/length)")
def position_dependent_force_constant(p: Values, q: Columns) -> Results:
    along = np.clip((q.x - p["start"]) / p["length"], 0.0, 1.0)
    return {U: q.u * (1.0 + np.cos(np.pi * np.outer(along, np.arange(1, 6))) @ numbered(p, "c"))}


@written_from("Fc, Fs -> (1 + sum_{k=1,2} a_k sin(2 pi k x/p) + b_k cos(2 pi k x/p)) Fc, Fs")
def friction_ripple(p: Values, q: Columns) -> Results:
    return {DRY: q.dry * (1.0 + fourier(p, q.x / p["p"]))}


@written_from("reading(t) = x(t - tau)")
def encoder_delay(p: Values, q: Columns) -> Results:
    """A straight line between samples; before the log the axis stood at its first position."""
    t = q.dt * np.arange(len(q))
    return {READING: np.interp(t - p["tau"], t, q.reading)}


@written_from("reading = step floor(x/step + 1/2)")
def encoder_quantization(p: Values, q: Columns) -> Results:
    return {READING: q.reading - (np.mod(q.reading / p["step"] + 0.5, 1.0) - 0.5) * p["step"]}


@written_from("reading = x + sum_{k=1,2} a_k sin(2 pi k x/period) + b_k cos(2 pi k x/period)")
def encoder_ripple(p: Values, q: Columns) -> Results:
    return {READING: q.reading + fourier(p, q.reading / p["period"])}


# --- forces ---------------------------------------------------------------------------------------


@written_from("F = -(mass a_other + damping v_other)")
def axis_coupling(p: Values, q: Columns) -> Results:
    return {OUT: -np.stack([q.a_other, q.v_other], 1) @ [p["mass"], p["damping"]]}


@written_from("F = stiffness (x_other - x) + damping (v_other - v)")
def skew_stiffness(p: Values, q: Columns) -> Results:
    apart = np.stack([q.x_other - q.x, q.v_other - q.v], axis=1)
    return {OUT: apart @ [p["stiffness"], p["damping"]]}


@written_from(
    "F = -sum_i f_i e_i/d_i;  e_i follows x within +-d_i;  d_i = reach (1, 1/2, 1/4, 1/8)"
)
def cable_hysteresis(p: Values, q: Columns) -> Results:
    """In 64 small steps a sample, of which the law's instant is one."""
    d = p["reach"] / np.array([1.0, 2.0, 4.0, 8.0])
    f = np.array([p[f"f{i}"] for i in range(4)])
    e, seen = np.zeros(4), np.empty(len(q))
    for k, v in enumerate(q.v):
        for j in range(1, 65):
            e = np.clip(e + v * q.dt / 64, -d, d)
            if j == round(64 * q.when):
                seen[k] = -f @ (e / d)
    return {OUT: seen}


@written_from(
    "F = -sum_i f_i e_i/d_i;  e_i follows x within +-d_i;  d_i = reach (1, 1/2, 1/4, 1/8)"
)
def presliding_hysteresis(p: Values, q: Columns) -> Results:
    """Play operators: what each element has slipped is where x pushed it last."""
    path = np.cumsum(np.repeat(q.v * q.dt / 64, 64))
    force = np.zeros(len(path))
    for i in range(4):
        reach, slipped = p["reach"] / 2**i, 0.0
        for k, x in enumerate(path):
            slipped = min(max(slipped, x - reach), x + reach)
            force[k] -= p[f"f{i}"] * (x - slipped) / reach
    return {OUT: force[np.arange(len(q)) * 64 + round(64 * q.when) - 1]}


@written_from("F = -(offset + k1 x + k2 x^2 + k3 x^3)")
def cable_slab(p: Values, q: Columns) -> Results:
    return {OUT: -Polynomial([p["offset"], p["k1"], p["k2"], p["k3"]])(q.x)}


@written_from("F = -(offset + k1 d + k2 d^2 + k3 d^3);  d = x - middle")
def spring(p: Values, q: Columns) -> Results:
    about = Polynomial([-p["middle"], 1.0])
    return {OUT: -Polynomial([p["offset"], p["k1"], p["k2"], p["k3"]])(about)(q.x)}


@written_from("F = -c v")
def viscous_friction(p: Values, q: Columns) -> Results:
    return {OUT: -p["c"] * q.v}


@written_from("F = -(sine sin q + cosine cos q) = -m g l sin(q - q0)")
def gravity(p: Values, q: Columns) -> Results:
    """The imaginary part of a pointer that hangs at q0."""
    return {OUT: -np.imag((p["sine"] + 1j * p["cosine"]) * np.exp(1j * q.x))}


@written_from("F = -(sine sin(q/gear) + cosine cos(q/gear))")
def unbalance(p: Values, q: Columns) -> Results:
    """The same behind a gear."""
    return {OUT: -np.imag((p["sine"] + 1j * p["cosine"]) * np.exp(1j * q.x / p["gear"]))}


@written_from("F = sum_{k=1..3} a_k sin(2 pi k x/p) + b_k cos(2 pi k x/p)")
def cogging(p: Values, q: Columns) -> Results:
    return {OUT: fourier(p, q.x / p["p"])}


@written_from("F = F0")
def constant_force(p: Values, q: Columns) -> Results:
    return {OUT: np.full(len(q), p["F0"])}


@written_from("F = A(x) + z D(x) + v/speed E(x) + B(v) + C(t/T);  dz/dt = (v - |v| z)/turn")
def empirical_map(p: Values, q: Columns) -> Results:
    count, place = int(p["elements"]), (q.x - p["start"]) / p["length"]
    grid = np.linspace(0.0, 1.0, count + 1)
    a, d, e = (np.interp(place, grid, numbered(p, key)) for key in "xde")
    fade = np.interp(place, [-1.0 / count, 0.0, 1.0, 1.0 + 1.0 / count], [0.0, 1.0, 1.0, 0.0])
    relative = np.clip(q.v / p["speed"], -1.0, 1.0)
    bent = np.sign(relative) * np.sqrt(np.abs(relative))
    b = np.interp(bent, np.linspace(-1.0, 1.0, 17), numbered(p, "v"))
    c = np.interp(q.time / p["T"], np.arange(12) / 12.0, numbered(p, "t"), period=1.0)
    return {OUT: fade * (a + followed(q, p["turn"]) * d + relative * e) + b + c}


@written_from("F = -stiffness (d + relaxation v) where it pushes back;  d = x - high, x - low")
def end_stop(p: Values, q: Columns) -> Results:
    """The force that the depth at the end of the step gives, v the speed it then has."""
    d = np.where(q.x > p["high"], q.x - p["high"], np.where(q.x < p["low"], q.x - p["low"], 0.0))
    k, c = p["stiffness"], p["stiffness"] * p["relaxation"]
    # F = -k (d + h h F/m) - c (v + h F/m), as the fixed point of a contraction
    force = np.zeros(len(q))
    for _ in range(60):
        force = -k * (d + q.dt**2 * force / q.mass) - c * (q.v + q.dt * force / q.mass)
    return {OUT: np.where(force * d < 0.0, force, 0.0)}


@written_from(
    "F = sum c_ijab cos(pi i q) T_j(v/speed) z1^a z2^b,  "
    "(1+i)(1+j)(1+a)(1+b) <= 24;  dz/dt = (v - |v| z)/reach"
)
def learned_residual(p: Values, q: Columns) -> Results:
    place = (q.x - p["start"]) / p["length"]
    speed = np.clip(q.v / p["speed"], -1.0, 1.0)
    memory = followed(q, p["reach1"]), followed(q, p["reach2"])
    cross = [
        (i, j, a, b) for i in range(24) for j in range(4) for a in (0, 1) for b in (0, 1)
        if (1 + i) * (1 + j) * (1 + a) * (1 + b) <= 24
    ]  # fmt: skip
    assert sum(name.startswith("c_") for name in p) == len(cross)
    force = np.zeros(len(q))
    for name, value in p.items():
        if name.startswith("c_"):
            i, j, a, b = term = tuple(map(int, name.split("_")[1:]))
            assert term in cross
            wave = np.cos(np.pi * i * np.clip(place, 0.0, 1.0)) * Chebyshev.basis(j)(speed)
            force += value * wave * memory[0] ** a * memory[1] ** b
    edge = 1.0 / 24.0
    return {OUT: force * np.interp(place, [-edge, 0.0, 1.0, 1.0 + edge], [0.0, 1.0, 1.0, 0.0])}


@written_from("F = a sin(2 pi f t) + b cos(2 pi f t)")
def periodic_disturbance(p: Values, q: Columns) -> Results:
    """The mean over the sample, by quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    angle = 2.0 * np.pi * p["f"] * (q.time[:, None] + 0.5 * q.dt * (1.0 + nodes))
    return {OUT: (p["a"] * np.sin(angle) + p["b"] * np.cos(angle)) @ weights / 2.0}


@written_from("F = -c vc^2 |v/vc|^n sgn(v);  with n = 2: -c v |v|")
def quadratic_drag(p: Values, q: Columns) -> Results:
    return {OUT: -p["c"] * q.v * np.abs(q.v) * np.abs(q.v / p["vc"]) ** (p["n"] - 2.0)}


@written_from(
    "F = -[(ahead + behind)/2 d + (ahead - behind)/2] b(x);  b = (1 - r^2)^2, "
    "r = 2 (x - phase - k pitch)/width"
)
def roller_spikes(p: Values, q: Columns) -> Results:
    """d follows the direction within a 200th of the width; the sum runs over every roller."""
    bump = np.zeros(len(q))
    for k in range(-60, 61):
        r = 2.0 * (q.x - p["phase"] - k * p["pitch"]) / p["width"]
        bump += np.where(np.abs(r) < 1.0, (1.0 - r**2) ** 2, 0.0)
    d = followed(q, p["width"] / 200.0)
    return {OUT: -(p["ahead"] * (1.0 + d) / 2.0 - p["behind"] * (1.0 - d) / 2.0) * bump}


@written_from(
    "F = w (E(q) + d O(q)),  q = x per_metre + sqrt(|v| per_speed) - offset;  w = min(|v|/rest, 1)"
)
def free_curve(p: Values, q: Columns) -> Results:
    """Of a closed curve the last knot is the first."""
    place = q.x * p["per_metre"] + np.sqrt(np.abs(q.v) * p["per_speed"]) - p["offset"]
    even, odd = numbered(p, "e_"), numbered(p, "o_")
    if p["closed"]:
        place, even, odd = np.mod(place, 1.0), np.r_[even[:-1], even[0]], np.r_[odd[:-1], odd[0]]
    grid = np.linspace(0.0, 1.0, int(p["elements"]) + 1)
    force = np.interp(place, grid, even) + followed(q, p["turn"]) * np.interp(place, grid, odd)
    return {OUT: force * (np.clip(np.abs(q.v) / p["rest"], 0.0, 1.0) if p["rest"] else 1.0)}


# --- modifiers ------------------------------------------------------------------------------------


@written_from("Fc -> Fc (1 + coulomb sgn v);  sigma2 -> sigma2 (1 + viscous sgn v)")
def asymmetric_friction(p: Values, q: Columns) -> Results:
    """At rest, but for rounding, the direction is that of the push."""
    rests = np.abs(q.mass * q.v / q.dt) <= 1e-9 * np.abs(q.hold)
    way = np.sign(np.where(rests, q.hold, q.v))
    return {
        DRY: q.dry * (1.0 + p["coulomb"] * way),
        VISCOUS: q.viscous * (1.0 + p["viscous"] * way),
    }


@written_from("Fs -> Fs (1 + growth a/(a + time));  da/dt = 1 - |v| a/slip")
def dwell_stiction(p: Values, q: Columns) -> Results:
    """The age as each sample begins; it tends to slip/|v|."""
    age, seen = 0.0, np.empty(len(q))
    for k, v in enumerate(np.abs(q.v)):
        seen[k] = 1.0 + p["growth"] / (1.0 + p["time"] / age) if age else 1.0
        end = p["slip"] / max(v, 1e-300)
        creeps = q.dt < 1e-9 * end  # where the difference below would lose its digits
        age = age + q.dt if creeps else end + (age - end) * np.exp(-q.dt / end)
    return {STATIC: q.static * seen}


@written_from("Fc, Fs -> Fc, Fs (1 + motor |u| + corner |a_other| + offset x_other)")
def load_dependent_friction(p: Values, q: Columns) -> Results:
    loads = np.stack([np.abs(q.u), np.abs(q.a_other), q.x_other], 1)
    factor = 1.0 + loads @ [p["motor"], p["corner"], p["offset"]]
    return {DRY: q.dry * np.where(factor < 0.01, 0.01, factor)}


@written_from("F = area p + area_2 p_2")
def pressure_force(p: Values, q: Columns) -> Results:
    return {OUT: np.stack([q.pressure, q.pressure_2], 1) @ [p["area"], p["area_2"]]}


@written_from("Fc, Fs -> Fc, Fs (1 + growth |p| + growth_2 |p_2|)")
def pressure_friction(p: Values, q: Columns) -> Results:
    factor = 1.0 + np.abs(np.stack([q.pressure, q.pressure_2], 1)) @ [p["growth"], p["growth_2"]]
    return {DRY: q.dry * np.where(factor < 0.01, 0.01, factor)}


@written_from("Fc, Fs -> Fc, Fs (1 - dry (T - T0));  sigma2 -> sigma2 (1 - viscous (T - T0))")
def temperature_friction(p: Values, q: Columns) -> Results:
    kept = [1.0 - p[n] * (q.temperature - p["T0"]) for n in ("dry", "viscous")]
    dry, viscous = (np.where(k < 0.01, 0.01, k) for k in kept)
    return {DRY: q.dry * dry, VISCOUS: q.viscous * viscous}


@written_from("sigma2 -> sigma2 (1 - loss |v|/(vt + |v|))")
def shear_thinning(p: Values, q: Columns) -> Results:
    moved = np.abs(q.v) > 0.0
    high = np.divide(1.0, 1.0 + p["vt"] / np.where(moved, np.abs(q.v), 1.0))
    return {VISCOUS: q.viscous * (1.0 - p["loss"] * moved * high)}


@written_from("Fc, Fs -> Fc, Fs (1 + growth |load|)")
def joint_load_friction(p: Values, q: Columns) -> Results:
    return {DRY: q.dry + q.dry * np.sqrt((p["growth"] * q.load) ** 2)}


@written_from("F = -(Fc sgn w + sigma2 w),  w = v + turns v_joint")
def transmission_coupling(p: Values, q: Columns) -> Results:
    """With joint 0 as the other one."""
    both = np.stack([q.v, q.speeds], 1) @ [1.0, p["turns"]]
    return {OUT: -p["Fc"] * np.sign(both) - p["sigma2"] * both}


@written_from("F = -inertia a")
def rotor_inertia(p: Values, q: Columns) -> Results:
    return {OUT: -(p["inertia"] * q.acc)}


@written_from("Fc, Fs -> (1 + P(x)) Fc, Fs;  P(x) = sum_k c_k cos(k pi (x - start)/length)")
def position_dependent_friction(p: Values, q: Columns) -> Results:
    along = np.clip((q.x - p["start"]) / p["length"], 0.0, 1.0)
    profile = np.cos(np.pi * np.outer(along, np.arange(1, 6))) @ numbered(p, "c")
    return {DRY: q.dry * np.where(profile < -0.99, 0.01, 1.0 + profile)}


@written_from(
    "dE/dt = |F v| + idle - E/tau;  Fc, Fs -> exp(-dry E) Fc, Fs;  sigma2 -> exp(-viscous E) sigma2"
)
def thermal_drift(p: Values, q: Columns) -> Results:
    """The heat as each sample begins; a twentieth of the friction stays."""
    heat = np.zeros(len(q))
    for k in range(len(q) - 1):
        end = (abs(q.friction[k] * q.v[k]) + p["idle"]) * p["tau"]
        heat[k + 1] = end + (heat[k] - end) * np.exp(-q.dt / p["tau"])
    kept = [np.maximum(np.exp(-p[n] * heat), np.exp(-3.0)) for n in ("dry", "viscous")]
    return {DRY: q.dry * kept[0], VISCOUS: q.viscous * kept[1]}


@written_from("Fc, Fs -> (1 + rate s) Fc, Fs;  ds/dt = |v|")
def wear(p: Values, q: Columns) -> Results:
    path = np.abs(q.v) * q.dt
    return {DRY: q.dry * (1.0 + p["rate"] * (np.cumsum(path) - (1.0 - q.when) * path))}


# --- attached masses ------------------------------------------------------------------------------


def oscillator(frequency: float, ratio: float, h: float) -> tuple[float, float]:
    """Spring (1/s^2) and damper (1/s) whose step has the poles of the exact motion.

    v' = (v - h k x)/(1 + h c), x' = x + h v' has determinant 1/(1 + h c) and trace
    1 + (1 - h^2 k)/(1 + h c); both are known from the poles exp(h (-ratio w +- i w_d)).
    """
    w = 2.0 * np.pi * frequency
    pole = np.exp(h * w * (-ratio + 1j * np.sqrt(1.0 - ratio**2)))
    grown = 1.0 / np.abs(pole) ** 2
    return (1.0 - grown * (2.0 * pole.real - 1.0)) / h**2, (grown - 1.0) / h


def hung(p: Values, q: Columns, play: float) -> Results:
    """A load on a spring: s'' + c s' + k (s - clip(s, +-play/2)) = -a."""
    spring, damper = oscillator(p["frequency"], p["damping"], q.dt)
    s, speed, force = 0.0, 0.0, np.empty(len(q))
    for k, a in enumerate(q.acc):
        pull = spring * np.sign(s) * max(abs(s) - play / 2.0, 0.0)
        new = (speed - q.dt * (pull + a)) / (1.0 + q.dt * damper)
        force[k] = -p["load"] * q.moved * (new - speed) / q.dt
        s, speed = s + q.dt * new, new
    return {OUT: force}


@written_from("s'' + 2 damping w s' + w^2 s = -a;  F = -load m s'';  w = 2 pi frequency")
def flexible_mode(p: Values, q: Columns) -> Results:
    return hung(p, q, 0.0)


@written_from("s'' + 2 damping w s' + w^2 (s - clip(s, -play/2, play/2)) = -a;  F = -load m s''")
def backlash(p: Values, q: Columns) -> Results:
    return hung(p, q, p["play"])


@written_from("b'' + 2 damping w b' + w^2 b = -recoil q'';  F = -m b'';  w = 2 pi frequency")
def base_vibration(p: Values, q: Columns) -> Results:
    """q'' = NET - b'', for m (q'' + b'') is the force."""
    spring, damper = oscillator(p["frequency"], p["damping"], q.dt)
    b, speed, force = 0.0, 0.0, np.empty(len(q))
    for k, net in enumerate(q.net):
        # b'' + damper (speed + h b'') + spring b = -recoil (net - b'')
        left = 1.0 + q.dt * damper - p["recoil"]
        acceleration = (-p["recoil"] * net - damper * speed - spring * b) / left
        force[k] = -q.moved * acceleration
        speed += q.dt * acceleration
        b += q.dt * speed
    return {OUT: force}


@written_from("(1 + ratio) m a = F")
def payload_mass(p: Values, q: Columns) -> Results:
    """F = m a + ratio m a: what the payload takes for itself is missing."""
    return {OUT: q.moved * q.acc - (1.0 + p["ratio"]) * q.moved * q.acc}


@written_from(
    "F = -m (J(x) a + J'(x) v^2/2);  J = sum_{k=1,2,3} a_k sin(2 pi k x/p) + b_k cos(2 pi k x/p)"
)
def varying_inertia(p: Values, q: Columns) -> Results:
    """By Lagrange: d/dt (m J v) - m J' v^2/2, J' from the waves of J a quarter further."""
    inertia = fourier(p, q.x / p["p"])
    steeper = {n: v * int(n[1:]) for n, v in p.items() if n[0] in "ab"}
    quarter = {f"b{n[1:]}" if n[0] == "a" else f"a{n[1:]}": v for n, v in steeper.items()}
    rising = {n: -v if n[0] == "a" else v for n, v in quarter.items()}
    slope = 2.0 * np.pi / p["p"] * fourier(rising, q.x / p["p"])
    return {OUT: -q.moved * (inertia * q.acc + slope * q.v**2 - 0.5 * slope * q.v**2)}
