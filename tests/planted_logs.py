"""Logs of machines whose motion is written down: what they command is what their laws ask for.

Nothing is simulated, so a log takes no time, and what is hidden in it is known exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from built_fits import CATALOGUE
from constructed import log_of
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset
from identify.dataset.motion import motion_of
from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import on_blocks, total_force
from identify.estimation.fit import Fit, fit_axis
from identify.selection.diagnosis import AxisDiagnosis, diagnose_axis
from twin.effects import Catalogue
from twin.logs import AxisLog, Log
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel

Array = NDArray[np.float64]

RATE = 1000.0  # Hz
NOISE = 5e-3  # N of the command, white
ROUNDS = 4  # after which a friction under the motor's load agrees with the command
PAUSE = 0.15  # s of a soft stop and start


@dataclass(frozen=True)
class Ride:
    """Moves that pause, of random places and speeds: positions (m) at the samples' ends.

    fast: m/s. back: speeds of the way back over those ahead.
    """

    seed: int
    seconds: float = 6.0
    reach: float = 0.06
    fast: float = 0.3
    back: float = 1.0

    def speed(self) -> Array:
        """(n,) m/s at the middle of each sample."""
        rng, place, out = np.random.default_rng(self.seed), 0.0, [np.zeros(200)]
        while sum(map(len, out)) < self.seconds * RATE:
            goal = rng.uniform(0.2, 1.0) * self.reach * (-1.0 if place > 0.0 else 1.0)
            top = self.fast * rng.uniform(0.15, 1.0) * (self.back if goal < place else 1.0)
            hold = max(round(abs(goal - place) / top * RATE), 1)
            out += [np.full(hold, (goal - place) / hold * RATE), np.zeros(rng.integers(150, 400))]
            place = goal
        window = np.hanning(round(PAUSE * RATE))
        return np.convolve(np.concatenate(out), window / window.sum(), "same")[
            : round(self.seconds * RATE)
        ]


FIRST = Ride(1)


def logged(
    axis: AxisModel,
    ride: Ride,
    beside: Callable[[Array, Array], Array] | None = None,
    noise: float = NOISE,
) -> Log:
    """A log of that motion; beside: (position, velocity) -> N, a force that no law makes.

    noise: N of the command, white.
    """
    rng = np.random.default_rng([ride.seed, 7])
    speed = ride.speed()
    x = np.concatenate([[0.0], np.cumsum(speed)[:-1]]) / RATE
    a = np.gradient(np.concatenate([[0.0], speed]))[1:] * RATE
    free = axis.mass * a - (beside(x + 0.5 * speed / RATE, speed) if beside else 0.0)
    u = free
    for _ in range(ROUNDS):
        motion = motion_of(log_of(RATE, x, u), "x", "ride", ripples=())
        u = free - np.append(total_force(on_blocks(axis), motion), 0.0)
    u = u + noise * rng.standard_normal(len(x))
    return log_of(RATE, x + 1e-9 * rng.standard_normal(len(x)), u)


def with_force(log: Log, change: Callable[[Array], Array]) -> Log:
    """The log with another force."""
    own = log.axes["x"]
    columns = {**own.columns, "force": change(own.columns["force"].copy())}
    return replace(log, axes={"x": AxisLog(columns, own.units)})


HARDWARE = Hardware(
    travel=(-0.1, 0.1), encoder_noise=1e-9, current_noise=NOISE, velocity=0.3, jerk=100.0
)
RUBS = Fitted.at_start(CATALOGUE["coulomb_viscous"], {"Fc": 0.31, "Fs": 0.31, "sigma2": 0.53})
SLIDE = AxisModel(5.3, HARDWARE, (RUBS,))


def having(axis: AxisModel, effect: str, **values: float) -> AxisModel:
    """The axis with an effect of the catalogue."""
    return axis.with_effect(Fitted.at_start(CATALOGUE[effect], values))


def few(*names: str) -> Catalogue:
    """A small catalogue: a search among few is quick."""
    return Catalogue([CATALOGUE[n] for n in names])


def begun(
    axis: AxisModel, logs: Mapping[str, Log], held: Mapping[str, Log], test: Mapping[str, Log] = {}
) -> tuple[Fit, Dataset]:
    """The axis fitted to these logs, and their dataset."""
    dataset = datasets(MachineModel("m", {"x": axis}, RATE), logs, held, test=test)["x"]
    return fit_axis(axis, dataset.training), dataset


def asked(
    base: AxisModel,
    true: AxisModel,
    catalogue: Catalogue,
    beside: Callable[[Array, Array], Array] | None = None,
    ride: Ride = FIRST,
) -> AxisDiagnosis:
    """The diagnosis of a base from two logs of another machine, and one held out."""
    rides = [replace(ride, seed=ride.seed + i) for i in range(3)]
    one, two, held = (logged(true, ride, beside) for ride in rides)
    return diagnose_axis(*begun(base, {"one": one, "two": two}, {"held": held}), catalogue)
