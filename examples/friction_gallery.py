"""How the friction models differ: one picture for each behaviour.

    python examples/friction_gallery.py FOLDER

The values are those of C. Canudas de Wit et al., IEEE TAC 40 (1995), table I, for every model that
has the parameter.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from twin.core.walks import walk
from twin.effects import load_catalogue
from twin.experiments.trajectory import Setpoint
from twin.model.machine import AxisModel, Fitted, MachineModel, axis_table
from twin.simulation.loop import POSITION_COLUMN, VELOCITY_COLUMN, Controller
from twin.simulation.simulators import ReducedSimulator, run

matplotlib.use("Agg")
from matplotlib import pyplot as plt

Array = NDArray[np.float64]

CATALOGUE = load_catalogue()
PAPER = {
    "Fc": 1.0, "Fs": 1.5, "v0": 1e-3, "sigma0": 1e5, "sigma1": 1e5**0.5, "sigma2": 0.4
}  # fmt: skip
NAMES = ("coulomb_viscous", "stribeck", "dahl", "lugre", "leuven", "modified_leuven", "gms")
DYNAMIC = NAMES[2:]
COLOURS = {name: f"C{i}" for i, name in enumerate(NAMES)}
RATE = 10_000.0  # Hz


def friction(name: str, **values: float) -> Fitted:
    """That friction with the paper's values, or those given."""
    effect = CATALOGUE[name]
    known = {p.name: PAPER[p.name] for p in effect.parameters if p.name in PAPER}
    return Fitted.at_start(effect, {**known, **values})


def along(fitted: Fitted, v: Array, dt: float) -> Array:
    """Friction (n,) N along a given velocity (n,) m/s."""
    table = axis_table({"x": AxisModel(1.0, effects=(fitted,))})
    rows = np.zeros((1, len(v)))
    motion = np.stack([np.cumsum(v) * dt, v, np.zeros_like(v)])
    walk(
        table.entries, 0, 1, table.parameters, np.zeros(table.n_states), table.axes[0][2], motion,
        np.zeros_like(motion), dt, 0, rows,
    )  # fmt: skip
    return -rows[0]


def pushed(fitted: Fitted, force: Array, spring: float = 0.0) -> tuple[Array, Array, Array]:
    """Position m, velocity m/s and friction N of 1 kg under a force (n,) N and a spring (N/m)."""
    hung = Fitted.at_start(CATALOGUE["cable_slab"], {"k1": spring})
    still = np.zeros((len(force), 1))
    model = MachineModel("mass", {"x": AxisModel(1.0, effects=(fitted, hung))}, sample_rate=RATE)
    done = run(
        model, Setpoint(still, still, still, force[:, None], RATE), np.random.default_rng(0),
        simulator=ReducedSimulator, controllers={"x": Controller()},
    )  # fmt: skip
    row = [effect for _, effect in done.table.labels].index(fitted.effect.name)
    motion = done.signals[:, 0]
    return motion[:, POSITION_COLUMN], motion[:, VELOCITY_COLUMN], -done.forces[:, row]


def seconds(duration: float) -> Array:
    """Sample instants, s."""
    return np.arange(round(duration * RATE)) / RATE


def stribeck_curve() -> Figure:
    """Steady friction against speed."""
    figure, axes = plt.subplots(figsize=(7, 4.5))
    speeds = np.geomspace(1e-5, 1.0, 60)
    for i, name in enumerate(NAMES):
        steady = [
            along(friction(name), np.full(1000, v), max(2e-3 / v, 2.0) / 1000)[-1] for v in speeds
        ]
        axes.semilogx(speeds, steady, color=COLOURS[name], lw=9 - i, alpha=0.8, label=name)
    axes.set(xlabel="speed (m/s)", ylabel="steady friction (N)", ylim=(0.9, 1.6))
    axes.legend(fontsize=8)
    return figure


def hysteresis() -> Figure:
    """Pre-sliding with an inner loop: closed where the model remembers, open where it forgets."""
    figure, grid = plt.subplots(1, len(DYNAMIC), figsize=(15, 3.8), sharey=True)
    turns = np.array([0.0, 20.0, -20.0, 9.0, -3.0, 9.0, 20.0]) * 1e-6  # m
    x = np.concatenate([np.linspace(a, b, 800) for a, b in pairwise(turns)])
    v = np.diff(x, append=x[-1])
    ends = [3 * 800 - 1, 5 * 800 - 1]  # at 9 um, before and after the inner loop
    for axes, name in zip(grid, DYNAMIC, strict=True):
        force = along(friction(name), v / 1e-3, 1e-3)
        axes.plot(1e6 * x, force, color=COLOURS[name])
        axes.plot(1e6 * x[ends], force[ends], "ko", ms=4)
        gap = 1e3 * abs(np.diff(force[ends]).item())
        axes.set(title=f"{name}\nloop open by {gap:.0f} mN", xlabel="position (um)")
    grid[0].set_ylabel("friction (N)")
    return figure


def breakaway() -> Figure:
    """Highest friction before the mass runs away, against the rate of the force."""
    figure, axes = plt.subplots(figsize=(7, 4.5))
    rates = np.geomspace(0.5, 50.0, 13)
    for name in NAMES:
        found = []
        for rate in rates:
            _, v, held = pushed(friction(name), rate * seconds(2.0 / rate + 0.05))
            found.append(held[: np.flatnonzero(v > 5e-3)[0]].max())
        axes.semilogx(rates, found, "o-", ms=3, color=COLOURS[name], label=name)
    axes.set(xlabel="rate of force (N/s)", ylabel="breakaway force (N)", ylim=(0.95, 1.55))
    axes.legend(fontsize=8)
    return figure


def frictional_lag() -> Figure:
    """Friction while the speed swings without changing sign (bristle damping left out)."""
    figure, grid = plt.subplots(1, 6, figsize=(16, 3.6), sharey=True)
    for axes, name in zip(grid, NAMES[1:], strict=True):
        damped = any(p.name == "sigma1" for p in CATALOGUE[name].parameters)
        undamped = {"sigma1": 1e-6} if damped else {}
        for hertz, style in ((0.5, "-"), (5.0, "--"), (50.0, ":")):
            dt = 1.0 / hertz / 4000
            t = dt * np.arange(round(max(1.0, 3.0 / hertz) / dt))
            v = 2e-3 + 1.5e-3 * np.sin(2.0 * np.pi * hertz * t)
            force = along(friction(name, **undamped), v, dt)
            axes.plot(1e3 * v[-4000:], force[-4000:], style, c=COLOURS[name], label=f"{hertz:g} Hz")
        axes.set(title=name, xlabel="speed (mm/s)")
        axes.legend(fontsize=7)
    grid[0].set_ylabel("friction (N)")
    return figure


def stick_slip() -> Figure:
    """A mass of 1 kg on a spring of 100 N/m whose far end moves at 10 mm/s."""
    figure, grid = plt.subplots(len(NAMES), 1, figsize=(7, 11), sharex=True)
    t = seconds(6.0)
    for axes, name in zip(grid, NAMES, strict=True):
        x, _, _ = pushed(friction(name), 100.0 * 0.01 * t, spring=100.0)
        axes.plot(t, 10.0 * t, color="0.7", lw=1)
        axes.plot(t, 1e3 * x, color=COLOURS[name])
        axes.set_title(name, fontsize=9, loc="left")
    grid[len(NAMES) // 2].set_ylabel("position of the mass, and of the spring's end (mm)")
    grid[-1].set_xlabel("time (s)")
    return figure


def drift() -> Figure:
    """A biased vibration of 10 Hz that never reaches the breakaway force."""
    figure, (axes, close) = plt.subplots(2, 1, figsize=(7, 7), sharex=True)
    t = seconds(4.0)
    force = np.minimum(t, 1.0) * (0.5 + 0.45 * np.sin(2.0 * np.pi * 10.0 * t))
    for name in NAMES:
        x, _, _ = pushed(friction(name), force)
        for one in (axes, close):
            one.plot(t[::10], 1e6 * x[::10], color=COLOURS[name], lw=0.8, label=name)
    close.set(ylim=(-2, 22), xlabel="time (s)", ylabel="position (um), enlarged")
    axes.set(ylabel="position (um)")
    axes.legend(fontsize=8)
    return figure


PICTURES: dict[str, Callable[[], Figure]] = {
    "stribeck_curve": stribeck_curve,
    "hysteresis": hysteresis,
    "breakaway": breakaway,
    "frictional_lag": frictional_lag,
    "stick_slip": stick_slip,
    "drift": drift,
}


def main() -> None:
    """Draw every picture into the folder that was given."""
    parser = argparse.ArgumentParser(description="Draw how the friction models differ.")
    parser.add_argument("folder", type=Path, help="where to save the pictures; made if missing")
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    for name, picture in PICTURES.items():
        figure = picture()
        figure.suptitle((picture.__doc__ or name).rstrip("."), fontsize=10)
        figure.tight_layout()
        path = folder / f"{name}.png"
        figure.savefig(path, dpi=110)
        plt.close(figure)
        print(path)


if __name__ == "__main__":
    main()
