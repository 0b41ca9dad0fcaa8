"""The frictions of the catalogue in plain NumPy, from their printed equations and docstrings.

Those with a memory are integrated in small steps of the path within every sample, whose speed and
friction level are held.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from reference_kit import Array, Columns, Results, Values, numbered, written_from

from twin.effect import OUT

STEPS = 100  # small steps a sample; even, so that its middle is one of them


def stribeck_curve(p: Values, q: Columns) -> Array:
    """g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n), under the factors of the modifiers, N."""
    fall = np.exp(-(np.abs(q.v / p["v0"]) ** p["n"]))
    return q.dry * (p["Fc"] * (1.0 - fall) + p["Fs"] * q.static * fall)


def viscous(p: Values, q: Columns) -> Array:
    return p["sigma2"] * q.viscous * q.v


def midpoint(rate: Callable[[float], float], value: float, step: float) -> float:
    """One step of the midpoint rule of d value/d z = rate(value)."""
    return value + step * rate(value + 0.5 * step * rate(value))


def sticks(p: Values, q: Columns, sliding: Array, holding: Array) -> Results:
    """What stops the axis in this sample where that is within the level, else the level.

    holding (n, 2): the level after a sample that slid, and after one that held.
    """
    left, held = q.hold - viscous(p, q), np.empty(len(q), dtype=bool)
    for k in range(len(q)):
        held[k] = abs(left[k]) <= holding[k, int(k == 0 or held[k - 1])]
    return {OUT: np.where(held, q.hold, sliding * np.sign(left) + viscous(p, q))}


@written_from("F = Fc sgn(v) + sigma2 v;  |F| <= Fs at rest")
def coulomb_viscous(p: Values, q: Columns) -> Results:
    coulomb = p["Fc"] * q.dry
    static = np.maximum(coulomb, p["Fs"] * q.dry * q.static)
    return sticks(p, q, coulomb, np.stack([coulomb, static], 1))


@written_from(
    "F = g(v) sgn(v) + sigma2 v;  g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n);  |F| <= Fs at rest"
)
def stribeck(p: Values, q: Columns) -> Results:
    g = stribeck_curve(p, q)
    return sticks(p, q, g, np.stack([g, g], 1))


def bristle(p: Values, q: Columns, rate: Callable, spring: float, damping: float) -> Results:
    """spring z + damping dz/dt + sigma2 v, with dz = rate(z, way, k) |dx| along the path."""
    z, force = 0.0, np.empty(len(q))
    for k, v in enumerate(q.v):
        way, began, seen = np.sign(v), z, z
        for j in range(1, STEPS + 1):
            z = midpoint(lambda z, k=k, way=way: rate(z, way, k), z, abs(v) * q.dt / STEPS)
            seen = z if j == STEPS // 2 else seen
        wanted = z if q.when == 1.0 else began + q.when * (z - began)
        force[k] = spring * wanted + damping * (z - began) / q.dt
    return {OUT: force + viscous(p, q)}


@written_from("dF/dx = sigma0 sgn(r) |r|^n,  r = 1 - F sgn(v)/Fc;  friction = F + sigma2 v")
def dahl(p: Values, q: Columns) -> Results:
    def rate(force: float, way: float, k: int) -> float:
        r = 1.0 - force * way / (p["Fc"] * q.dry[k])
        return way * p["sigma0"] * np.sign(r) * abs(r) ** p["n"]

    return bristle(p, q, rate, 1.0, 0.0)


@written_from(
    "dz/dt = v - sigma0 |v| z / g(v);  F = sigma0 z + sigma1 dz/dt + sigma2 v;  "
    "g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n)"
)
def lugre(p: Values, q: Columns) -> Results:
    g = stribeck_curve(p, q)
    return bristle(p, q, lambda z, way, k: way - p["sigma0"] * z / g[k], p["sigma0"], p["sigma1"])


def taper(p: Values) -> tuple[Array, Array]:
    """Parts of the force, and stiffnesses k_i (N/m), of the elements."""
    shares, stiff = numbered(p, "share"), numbered(p, "stiff")
    falling = stiff * np.geomspace(1.0, 1.0 / p["spread"], len(stiff))
    return shares / shares.sum(), p["sigma0"] * falling / falling.sum()


@written_from(
    "stick: dF_i/dt = k_i v until |F_i| = a_i g(v);  "
    "slip: dF_i/dt = C (a_i sgn v - F_i/g(v));  F = sum F_i + sigma2 v;  "
    "g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n)"
)
def gms(p: Values, q: Columns) -> Results:
    """Slip ends where v passes zero; a slipping force rises no faster than its spring's."""
    a, springs = taper(p)
    g, h = stribeck_curve(p, q), q.dt / STEPS
    f, slipping = np.zeros(len(a)), np.zeros(len(a), dtype=bool)
    before, force = 0.0, np.empty(len(q))
    for k, v in enumerate(q.v):
        way, began = np.sign(v), f.copy()
        slipping &= way == before
        before = way
        for _ in range(STEPS if way else 0):
            slipping |= way * f >= a * g[k]
            slip = way * p["C"] * (a - way * f / g[k])
            slip = way * np.minimum(way * slip, springs * abs(v))
            f = f + h * np.where(slipping, slip, springs * v)
            f = np.where(~slipping & (way * f > a * g[k]), way * a * g[k], f)
        force[k] = np.sum(began + q.when * (f - began))
    return {OUT: force + viscous(p, q)}


@written_from(
    "dz/dt = v (1 - sgn(r) |r|^m), r = F_h/(g(v) sgn v);  F_h = sum F_i, "
    "dF_i/dz = k_i until |F_i| = W_i;  F = F_h + sigma1 dz/dt + sigma2 v;  "
    "g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n)"
)
def modified_leuven(p: Values, q: Columns) -> Results:
    parts, springs = taper(p)
    g = stribeck_curve(p, q)
    f, force = np.zeros(len(parts)), np.empty(len(q))
    for k, v in enumerate(q.v):
        most = p["reserve"] * parts * q.dry[k] * max(p["Fs"] * q.static[k], p["Fc"])
        f = np.clip(f, -most, most)
        way, began, deflected = np.sign(v), f.sum(), 0.0
        for _ in range(STEPS):
            r = way * f.sum() / g[k]
            dz = v * q.dt / STEPS * (1.0 - np.sign(r) * abs(r) ** p["m"])
            f = np.clip(f + springs * dz, -most, most)
            deflected += dz
        force[k] = began + q.when * (f.sum() - began) + p["sigma1"] * deflected / q.dt
    return {OUT: force + viscous(p, q)}


@written_from(
    "dz/dt = v (1 - sgn(r) |r|^m), r = F_d/(g(v) sgn v - F_b);  F_h = F_b + F_d(z), "
    "dF_d/dz = sigma0 exp(-b |F_d|/2 Fs);  F = F_h + sigma1 dz/dt + sigma2 v;  "
    "g(v) = Fc + (Fs - Fc) exp(-|v/v0|^n)"
)
def leuven(p: Values, q: Columns) -> Results:
    """turns: where F_h turned; a branch from rest or sliding, F_b = 0, softens twice as fast."""
    g = stribeck_curve(p, q)
    turns: list[float] = []
    f, last, force = 0.0, 0.0, np.empty(len(q))
    for k, v in enumerate(q.v):
        way, began, deflected = np.sign(v), f, 0.0
        if way and last == -way:
            turns.append(f)
        last = way or last
        static = q.dry[k] * max(p["Fs"] * q.static[k], p["Fc"])
        for _ in range(STEPS if way else 0):
            if way * f >= g[k]:
                turns = []
            base = turns[-1] if turns else 0.0
            r = (f - base) / (way * g[k] - base)
            dz = v * q.dt / STEPS * (1.0 - np.sign(r) * abs(r) ** p["m"])
            softening = p["b"] * abs(f - base) / static * (0.5 if turns else 1.0)
            f += p["sigma0"] * np.exp(-softening) * dz
            deflected += dz
            closing = (turns[-2] if len(turns) > 1 else -base) if turns else way * np.inf
            if turns and way * (f - closing) >= 0.0:
                f, turns = closing, turns[:-2]
        force[k] = began + q.when * (f - began) + p["sigma1"] * deflected / q.dt
    return {OUT: force + viscous(p, q)}
