"""Axes on stiff contacts, micrometres to the bristle, that rest between moves: noisy readings.

One moved mass under a sampled position loop; the contact is stepped exactly at constant speed. No
law is shared with the product.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from twin.logs import AxisLog, Log
from twin.model.units import LINEAR

LUGRE, DAHL, GMS, LAYERS = "lugre", "dahl", "gms", "presliding_hysteresis"
KINDS = (LUGRE, DAHL, GMS, LAYERS)
STEPS = 40  # of the simulation in a sample
DURATION = 16.0  # s of each log
LOWPASS = 0.3  # of each new speed, that the controller takes
SLIPS = 4  # elements of a contact that slip one after another


@dataclass(frozen=True)
class Contact:
    """A moved mass (kg) on a contact with Fc and Fs (N), stiffness (N/m), and so on, SI units.

    kind: which law. noise: m rms, of a reading. slip: m/s, Stribeck speed. damping: N s/m, of the
    bristle. loop: rad/s. rate: Hz. shares, springs (SLIPS,): parts of the force and of the
    stiffness of the elements. asymmetry: part by which Fc and Fs of a bristle are larger upwards
    than in the mean. weight: N, against the position, which the controller knows. step: m, of the
    encoder; 0 of one that only has noise.
    """

    kind: str
    mass: float
    coulomb: float
    static: float
    stiffness: float
    slip: float
    damping: float
    viscous: float
    noise: float
    loop: float
    rate: float
    shares: tuple[float, ...]
    springs: tuple[float, ...]
    asymmetry: float = 0.0
    weight: float = 0.0
    step: float = 0.0


def drawn(kind: str, noise: float, rng: np.random.Generator) -> Contact:
    """A contact of a kind whose readings have noise of so much of its bristle, Fc/stiffness.

    The mass is such that it swings on the contact at some 40 to 120 Hz, twelve samples or more.
    """
    coulomb, reach = rng.uniform(2.0, 40.0), 10.0 ** rng.uniform(-5.7, -4.7)  # 2 to 20 um
    stiffness = coulomb / reach
    mass = stiffness / (2.0 * np.pi * rng.uniform(40.0, 120.0)) ** 2
    bristle = kind == LUGRE
    layers = np.array([0.5**i for i in range(SLIPS)])  # places where they slip, of the last's
    parts = rng.uniform(0.5, 1.5, SLIPS)
    shares = parts / parts.sum()
    springs = shares / (layers if kind == LAYERS else 10.0 ** np.linspace(-1.0, 0.0, SLIPS))
    return Contact(
        kind, mass, coulomb,
        coulomb * (rng.uniform(1.1, 1.4) if kind in (LUGRE, GMS) else 1.0),
        stiffness, rng.uniform(5e-3, 2e-2),
        2.0 * rng.uniform(0.1, 0.4) * np.sqrt(stiffness * mass) if bristle else 0.0,
        coulomb * rng.uniform(0.2, 1.0), noise * reach, rng.uniform(60.0, 120.0),
        float(rng.choice([1000.0, 2000.0])), tuple(shares), tuple(springs / springs.sum()),
    )  # fmt: skip


def log_of(contact: Contact, rng: np.random.Generator) -> Log:
    """A log of moves of fifth order between random places, with rests."""
    path = _moves(contact.rate, rng)
    noise = contact.noise * rng.standard_normal(len(path))
    kind = KINDS.index(contact.kind)
    values = np.array([
        contact.mass, contact.coulomb, contact.static, contact.stiffness, contact.slip,
        contact.damping, contact.viscous, contact.loop, contact.asymmetry, contact.weight,
        contact.step,
    ])  # fmt: skip
    read, command = _simulate(
        kind, values, np.array(contact.shares), np.array(contact.springs), path,
        np.gradient(path) * contact.rate, noise, 1.0 / contact.rate,
    )  # fmt: skip
    units = {"position": LINEAR.position, "force": LINEAR.force}
    return Log(contact.rate, {"q": AxisLog({"position": read, "force": command}, units)})


def _moves(rate: float, rng: np.random.Generator) -> np.ndarray:
    """Positions (n,) m."""
    path, at, here = np.zeros(round(DURATION * rate)), 0, 0.0
    while at < len(path):
        there, taken = rng.uniform(-0.05, 0.05), rng.uniform(0.3, 1.2)
        rest = rng.uniform(0.3, 0.9)
        s = np.minimum(np.arange(round((taken + rest) * rate)) / rate / taken, 1.0)
        piece = here + (there - here) * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)
        path[at : at + len(piece)] = piece[: len(path) - at]
        at, here = at + len(piece), there
    return path


@numba.njit(cache=True)
def _simulate(kind, values, shares, springs, path, speed, noise, period):  # pragma: no cover
    """Readings m and commands N, a sample each; the command is held over the sample."""
    mass, coulomb, static, stiffness, slip, damping, viscous, loop, asymmetry, weight, step = values
    read, command = np.zeros(len(path)), np.zeros(len(path))
    x, v, z, h = path[0], 0.0, 0.0, period / STEPS
    f, seen, last = np.zeros(len(shares)), 0.0, path[0]
    for k in range(len(path)):
        read[k] = x + noise[k]
        if step > 0.0:
            read[k] = np.round(read[k] / step) * step
        seen += LOWPASS * ((read[k] - last) / period - seen)
        last = read[k]
        wanted = loop * (path[k] - read[k]) + 1.2 * (speed[k] - seen)
        command[k] = mass * loop * wanted + weight
        for _ in range(STEPS):
            g = coulomb + (static - coulomb) * np.exp(-((v / slip) ** 2))
            force = viscous * v
            if kind <= 1:  # LuGre, Dahl
                way = 1.0 if v > 0.0 else -1.0
                g *= 1.0 + way * asymmetry
                change = (way * g / stiffness - z) * -np.expm1(-stiffness * abs(v) * h / g)
                z += change
                force += stiffness * z + damping * change / h
            else:
                for i in range(len(shares)):
                    most = shares[i] * g
                    f[i] = min(max(f[i] + stiffness * springs[i] * v * h, -most), most)
                    force += f[i]
            v += h * (command[k] - force - weight) / mass
            x += h * v
    return read, command
