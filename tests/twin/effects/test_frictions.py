"""Frictions in motion: rest, pre-sliding with a memory, stick-slip as a stiff solver gives it.

That a law is its equation is in test_laws_effects.py.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from axis_runs import BOTH, effect
from axis_runs import pushed as pushed_at
from machines import CATALOGUE
from scipy.integrate import solve_ivp

from twin.core.walks import walk
from twin.laws.trials import TrialMotion, forces
from twin.model.machine import AxisModel, Fitted, axis_table
from twin.signals import Array

# Table I of C. Canudas de Wit et al., IEEE TAC 40 (1995), as A. Manurung's reconstruction of that
# paper's simulations gives it (github.com/auralius/LuGre, demo2.m); the paper itself could not be
# opened. For every model that has the parameter.
PAPER = {
    "Fc": 1.0, "Fs": 1.5, "v0": 1e-3, "sigma0": 1e5, "sigma1": 1e5**0.5, "sigma2": 0.4
}  # fmt: skip
RATE = 10_000.0  # Hz


def friction(name: str, **values: float) -> Fitted:
    """That friction with the paper's values, or those given, where it has such a parameter."""
    known = {p.name: PAPER[p.name] for p in CATALOGUE[name].parameters if p.name in PAPER}
    return effect(name, **{**known, **values})


def along(fitted: Fitted, v: Array, dt: float) -> Array:
    """Friction on a measured velocity (n,) m/s, in the middle of each sample, (n,) N."""
    still = np.zeros_like(v)
    return -forces([fitted], TrialMotion(dt, still, v, still))[fitted.effect.name]


def at_turns(fitted: Fitted, turns: Sequence[float], speed: float = 1e-4, leg: int = 500) -> Array:
    """Friction (n,) N at each of the turns: dragged from 0 m to one after the other, at one speed.

    Each leg takes ``leg`` samples; after it comes one sample at rest.
    """
    table = axis_table({"x": AxisModel(1.0, effects=(fitted,))})
    states, found = np.zeros(table.n_states), []
    for begin, end in zip((0.0, *turns), turns, strict=False):
        motion, rows = np.zeros((3, leg + 1)), np.zeros((1, leg + 1))
        motion[1, :leg] = np.sign(end - begin) * speed
        walk(
            table.entries, 0, 1, table.parameters, states, table.axes[0][2], motion,
            np.zeros_like(motion), abs(end - begin) / leg / speed, 1, rows,
        )  # fmt: skip
        found.append(-rows[0, -1])
    return np.array(found)


def time(duration: float) -> Array:
    """Sample instants, s."""
    return np.arange(round(duration * RATE)) / RATE


pushed = partial(pushed_at, rate=RATE)


@pytest.mark.parametrize("stage", BOTH)
@pytest.mark.parametrize("share", [-0.5, 0.999])
@pytest.mark.parametrize("name", ["coulomb_viscous", "stribeck"])
def test_a_friction_that_sticks_does_not_creep_below_breakaway(name, share, stage):
    assert friction(name).effect.sticks
    run = pushed(1.0, [friction(name)], np.full(5000, share * 1.5), stage)
    assert np.abs(run.x).max() < 1e-15
    assert np.abs(run.v).max() < 1e-15
    np.testing.assert_allclose(-run.of(name), share * 1.5, rtol=1e-12)


def test_asymmetric_friction_sticks_on_its_strong_side() -> None:
    """What rounding leaves of the speed of a stuck axis must not choose the direction."""
    effects = (
        effect("coulomb_viscous", Fc=1.0, Fs=1.0, sigma2=3.0),
        effect("asymmetric_friction", coulomb=0.5),
        effect("cogging", a1=0.1, b1=0.08),
    )
    for seed in range(8):  # slide, stop, then push with 0.5 to 1.3 N, where it holds 1.5 N
        rng = np.random.default_rng(seed)
        force = np.r_[np.full(4000, 3.0), np.linspace(0.0, 1.3, 16_000)]
        force += rng.uniform(-0.01, 0.01, len(force))
        run = pushed(rng.uniform(1.0, 20.0), effects, force)
        assert np.ptp(run.x[10_000:]) < 1e-15
        assert run.x[-1] > 1e-3


@pytest.mark.parametrize("name", ["gms", "leuven", "modified_leuven", "stribeck"])
def test_a_level_that_falls_to_nothing_leaves_a_force_that_is_a_number(name) -> None:
    """Without Coulomb friction, far beyond the Stribeck velocity, it falls below what divides."""
    steps = np.linspace(36.0, 40.0, 4000)
    speed = np.where(np.arange(len(steps)) % 4 < 2, 2.8, steps)  # m/s
    law = effect(name, Fc=0.0, Fs=1e-9, v0=1.44, sigma2=0.0)
    force = along(law, speed, 1.6e-3)
    assert np.isfinite(force).all()


def breakaway(name: str, rate: float) -> float:
    """Highest friction before the mass runs away under a force growing at that rate (N/s)."""
    run = pushed(1.0, [friction(name)], rate * time(2.0 / rate + 0.05))
    return float(-run.of(name)[: np.flatnonzero(run.v > 5e-3)[0]].min())


@pytest.mark.parametrize("name", ["lugre", "leuven", "modified_leuven", "gms"])
def test_breakaway_force_falls_with_the_rate_of_force(name: str) -> None:
    """Canudas de Wit et al. 1995, section on the varying break-away force, for LuGre."""
    found = [breakaway(name, rate) for rate in (0.5, 2.0, 10.0, 50.0)]
    assert np.all(np.diff(found) < 0.0)
    assert 1.45 < found[0] < 1.5  # slowly: nearly Fs
    assert found[-1] < 0.9 * found[0]
    assert found[-1] > 0.99  # never below Fc


SHARP = {"Fc": 1.5, "Fs": 1.5, "b": 1.5, "m": 50.0}  # z follows x but close to sliding
TURNS = 16  # that the stack holds


def madelung(turns: list[float]) -> list[float]:
    """Force at each turn by Madelung's rules, with the list of all turns, on the law's curve."""
    scale = SHARP["Fs"] / SHARP["b"]

    def curve(z: float) -> float:
        return scale * np.log1p(PAPER["sigma0"] * z / scale)

    kept: list[tuple[float, float]] = []
    out, before = [], 0.0
    for x in turns:
        way = 1 if x > before else -1
        while kept and way * x >= way * (kept[-2][0] if len(kept) > 1 else -kept[-1][0]):
            del kept[-2:]
        if kept:
            at, force = kept[-1]
            out.append(force + way * 2.0 * curve(way * (x - at) / 2.0))
        else:
            out.append(way * curve(way * x))
        kept.append((x, out[-1]))
        before = x
    return out


def spiral(turns: int, shrink: float = 0.8) -> list[float]:
    """Ever smaller swings, none of which closes a loop, and back to where they began."""
    return [*(1e-5 * shrink**i * (-1) ** i for i in range(turns)), 1e-5]


@pytest.mark.parametrize("turns", [16, 40])
def test_leuvens_stack_drops_the_smallest_loops_when_it_is_full(turns: int) -> None:
    found = at_turns(friction("leuven", **SHARP), spiral(turns), leg=200)
    kept = min(turns, TURNS)
    np.testing.assert_allclose(found[:kept], madelung(spiral(turns))[:kept], atol=2e-4)
    assert np.all(np.abs(found) < SHARP["Fs"])
    assert found[-1] == pytest.approx(found[0], abs=5e-4)  # the outermost loop closes


def test_leuvens_loops_close_nearly_where_large_ones_had_to_be_dropped() -> None:
    """Forty swings that hardly shrink: the force errs by less than the smallest loop is high."""
    found = at_turns(friction("leuven", **SHARP), spiral(40, shrink=0.97), leg=200)
    assert abs(found[-1] - found[0]) < 0.1 * np.ptp(found[-3:-1])


# The stage of the thesis; the stiff one of the paper; a soft one with exponent 1.
STAGE = {
    "Fc": 0.285, "Fs": 0.335, "v0": 0.01, "sigma2": 0.018, "sigma0": 260.0, "sigma1": 0.6, "n": 2.0
}  # fmt: skip
STIFF = {**PAPER, "n": 2.0}
SOFT = {
    "Fc": 0.2, "Fs": 0.5, "v0": 5e-3, "sigma2": 0.1, "sigma0": 2e3, "sigma1": 5.0, "n": 1.0
}  # fmt: skip


def rms(a: Array) -> float:
    return float(np.sqrt(np.mean(a**2)))


@pytest.mark.parametrize(
    ("p", "mass", "spring", "speed", "duration", "slips"),
    [(STAGE, 1.0, 5.0, 0.005, 4.0, 0),
     (STIFF, 1.0, 2.0, 0.1, 16.0, 2),  # stick-slip of the 1995 paper, by the same reconstruction
     (SOFT, 0.5, 50.0, 0.02, 3.0, 4)],
    ids=["stage", "paper", "soft"],
)  # fmt: skip
def test_lugre_converges_to_the_stiff_solver_on_a_mass_pulled_by_a_spring(
    p, mass, spring, speed, duration, slips
):
    """The spring's far end moves at a speed. The error halves with the step."""

    def rates(t: float, y: Array) -> list[float]:
        x, v, z = y
        level = p["Fc"] + (p["Fs"] - p["Fc"]) * np.exp(-(abs(v / p["v0"]) ** p["n"]))
        dz = v - p["sigma0"] * abs(v) * z / level
        force = p["sigma0"] * z + p["sigma1"] * dz + p["sigma2"] * v
        return [v, (spring * (speed * t - x) - force) / mass, dz]

    times = np.arange(0.0, duration, 2e-3)
    exact = solve_ivp(
        rates, (0.0, duration), [0.0, 0.0, 0.0], method="LSODA", t_eval=times, rtol=1e-10,
        atol=1e-13,
    ).y  # fmt: skip
    assert np.sum((exact[1, 1:] > speed) & (exact[1, :-1] <= speed)) == slips
    effects, errors = (effect("lugre", **p), effect("cable_slab", k1=spring)), []
    for dt in (2e-4, 1e-4, 5e-5):
        pull = spring * speed * dt * np.arange(round(duration / dt))
        run, every = pushed(mass, effects, pull, rate=1.0 / dt), round(2e-3 / dt)
        errors.append([rms(run.x[::every] - exact[0]), rms(run.v[::every] - exact[1])])
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 2.0, rtol=0.03)


@pytest.mark.parametrize("name", ["dahl", "lugre", "gms", "leuven", "modified_leuven"])
def test_a_hundredth_of_a_change_makes_a_hundredth_of_the_force(name: str) -> None:
    """Sliding, where rounding must not decide what is remembered: a fit follows derivatives."""
    rng, t = np.random.default_rng(8), time(1.0)
    slow = sum(a * np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for a, f in ((1, 2), (1, 7)))
    law = friction(name)
    free = [p.name for p in law.effect.parameters if law.values[p.name] and not p.fixed]

    def change(parameter: str, part: float) -> np.ndarray:
        more = replace(law, values={**law.values, parameter: law.values[parameter] * (1 + part)})
        return along(more, 5e-3 * slow, 1e-4) - along(law, 5e-3 * slow, 1e-4)

    for parameter in free:
        large, small = change(parameter, 1e-5), change(parameter, 1e-7)
        assert np.linalg.norm(small) < 0.02 * np.linalg.norm(large) + 1e-12, parameter
