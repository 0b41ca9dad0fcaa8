"""The Leuven models against their equations solved by SciPy, and against LuGre."""

import numpy as np
from friction_runs import (
    ELEMENTS,
    PAPER,
    along,
    friction,
    level,
    rms,
    shares_and_springs,
    wavy,
)
from scipy.integrate import solve_ivp

from twin.laws.trials import Array


def bristle(p: dict[str, float], force: float, v: float, reach: float) -> float:
    """dz/dt of both Leuven models, m/s: force is that of the spring, reach what it tends to, N."""
    if v == 0.0:
        return 0.0
    r = force / reach
    return v * (1.0 - np.sign(r) * np.abs(r) ** p["m"])


def test_modified_leuven_converges_to_its_published_equations() -> None:
    shares, springs = shares_and_springs(5, 40.0, 1e5)
    limits = 1.2 * 1.5 * shares
    p = {**PAPER, "m": 4.0}

    def z_rate(t: float, f: Array) -> float:
        v = wavy(t)
        return bristle(p, f.sum(), v, level(v) * np.sign(v))

    def rate(t: float, f: Array) -> Array:
        z = z_rate(t, f)
        return np.where(f * np.sign(z) < limits, springs * z, 0.0)

    times = 1e-3 * (np.arange(600) + 0.5)
    f = solve_ivp(
        rate, (0.0, 0.6), np.zeros(5), method="RK45", t_eval=times, rtol=1e-8, atol=1e-10,
        max_step=5e-5,
    ).y  # fmt: skip
    z = np.array([z_rate(t, one) for t, one in zip(times, f.T, strict=True)])
    exact = f.sum(axis=0) + p["sigma1"] * z + p["sigma2"] * wavy(times)
    fitted = friction("modified_leuven", **ELEMENTS, m=4.0)

    def error(dt: float) -> float:
        t = dt * (np.arange(round(0.6 / dt)) + 0.5)
        every = round(1e-3 / dt)
        return rms(along(fitted, wavy(t), dt)[every // 2 :: every] - exact)

    coarse, fine = error(1e-3 / 3), error(1e-3 / 9)
    assert fine < 1e-3
    assert coarse / fine > 6.0


SWINGS = [(0.0, 0.2), (0.2, 0.35), (0.35, 0.45)]  # s; shrinking, so that no loop closes
FLAT = {**PAPER, "Fc": 1.5, "m": 4.0, "b": 1.5}


def swinging(t: float) -> float:
    """Velocity over those swings, m/s."""
    i, (begin, end) = next((i, s) for i, s in enumerate(SWINGS) if t <= s[1])
    return (-1) ** i * 1.2e-4 * np.sin(np.pi * (t - begin) / (end - begin))


def transition(z: float, first: bool) -> float:
    """The transition curve, N: on the first branch half as high and half as long."""
    scale = FLAT["Fs"] / FLAT["b"] * (1.0 if first else 2.0)
    return np.sign(z) * scale * np.log1p(FLAT["sigma0"] * abs(z) / scale)


def leuven_by_branches(times: Array) -> Array:
    """The model's friction at those times, N: integrated for z, one branch a swing."""
    exact, base = [], 0.0
    for i, (begin, end) in enumerate(SWINGS):
        inside = times[(times >= begin) & (times <= end)]
        reach = (-1) ** i * FLAT["Fs"] - base

        def z_rate(t: float, z: float, i: int = i, reach: float = reach) -> float:
            return bristle(FLAT, transition(z, i == 0), swinging(t), reach)

        z = solve_ivp(
            lambda t, z, z_rate=z_rate: [z_rate(t, z[0])], (begin, end), [0.0], method="LSODA",
            t_eval=[*inside, end], rtol=1e-11, atol=1e-16,
        ).y[0]  # fmt: skip
        exact += [
            base + transition(one, i == 0) + FLAT["sigma1"] * z_rate(t, one)
            + FLAT["sigma2"] * swinging(t)
            for t, one in zip(inside, z, strict=False)
        ]  # fmt: skip
        base += transition(z[-1], i == 0)
    return np.array(exact)


def test_leuven_converges_to_its_published_equations() -> None:
    exact = leuven_by_branches(1e-3 * (np.arange(450) + 0.5))
    fitted = friction("leuven", **{k: FLAT[k] for k in ("Fc", "m", "b")})

    def error(dt: float) -> float:
        every = round(1e-3 / dt)
        v = np.array([swinging(t) for t in dt * (np.arange(450 * every) + 0.5)])
        return rms(along(fitted, v, dt)[every // 2 :: every] - exact)

    coarse, fine = error(1e-3), error(1e-3 / 3)
    assert fine < 1e-4
    assert coarse / fine > 6.0
