"""A humanoid of 40 joints at 1 kHz for 5 minutes: `python -m benchmarks joints`.

Its torques are those of MuJoCo's inverse dynamics along sines, with friction on each joint, and on
three of them more than the model knows. The momentum form is timed on an arm of six joints.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from resource import getpagesize
from tempfile import TemporaryDirectory
from threading import Event, Thread
from time import perf_counter

import mujoco
import numpy as np

from benchmarks.figures import Figure, Target
from identify.analysis.first_model import first_model
from identify.workflow import fit
from twin.effects import load_catalogue
from twin.logs import ROTARY_UNITS, AxisLog, Log, read_log, write_log
from twin.mujoco.mechanism import mechanism_of
from twin.signals import Array

TITLE = "Forty joints of a MuJoCo model"
LIMBS = (8, 8, 8, 8, 4, 4)  # joints of each: legs, arms, neck, waist
RATE, DURATION = 1000.0, 300.0  # Hz, s
COULOMB, VISCOUS, NOISE = 0.6, 0.2, 1e-6  # N m, N m s/rad, rad
PLANTED: dict[int, Callable[[Array, Array], Array]] = {
    4: lambda q, v: 0.3 * np.sin(2.0 * np.pi * q / 0.2),  # cogging
    13: lambda q, v: 2.0 * np.sin(q),  # a counterbalance
    30: lambda q, v: 0.2 * v * np.abs(v),  # drag
}  # of position rad and velocity rad/s, N m


def tree(limbs: tuple[int, ...]) -> tuple[str, list[str]]:
    """The MJCF text of a trunk that is fixed, with limbs of hinges, and the names of these."""
    names, bodies = [], ""
    for limb, count in enumerate(limbs):
        chain = ""
        for k in range(count):
            names.append(f"limb{limb}_{k}")
            place = f"{0.2 * limb:g} 0 1" if k == 0 else "0 0 -0.12"
            axis = ("1 0 0", "0 1 0", "0 0 1")[k % 3]
            chain += (
                f'<body name="link{limb}_{k}" pos="{place}"><joint name="limb{limb}_{k}" '
                f'axis="{axis}"/><inertial pos="0.02 0.01 -0.06" mass="{2.0 / (k + 1):g}" '
                'diaginertia="0.01 0.01 0.005"/>'
            )
        bodies += chain + "</body>" * count
    return f"<mujoco><worldbody>{bodies}</worldbody></mujoco>", names


def motion(joints: int, samples: int) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration (joints, samples) of three sines each, rad and s."""
    rng = np.random.default_rng(1)
    t = np.arange(samples) / RATE
    out = np.zeros((3, joints, samples))
    for j in range(joints):
        for rate in 2.0 * np.pi * rng.uniform(0.1, 0.8, 3):
            size, at = rng.uniform(0.1, 0.4), rate * t + rng.uniform(0.0, 6.0)
            out[:, j] += size * np.stack([np.sin(at), rate * np.cos(at), -(rate**2) * np.sin(at)])
    return out[0], out[1], out[2]


def humanoid(text: str, names: list[str]) -> Log:
    """The log of the joints of a text; the torque of a sample holds until the next."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    q, v, a = motion(len(names), round(DURATION * RATE))
    between = [0.5 * (x + np.roll(x, -1, axis=1)) for x in (q, v, a)]
    torque = np.empty_like(q)
    for k in range(q.shape[1]):
        data.qpos[:], data.qvel[:], data.qacc[:] = (x[:, k] for x in between)
        mujoco.mj_inverse(model, data)
        torque[:, k] = data.qfrc_inverse
    middle, speed = between[:2]
    torque += COULOMB * np.sign(speed) + VISCOUS * speed
    for joint, force in PLANTED.items():
        torque[joint] += force(middle[joint], speed[joint])
    q += NOISE * np.random.default_rng(2).standard_normal(q.shape)
    columns = ({"position": q[i], "force": torque[i]} for i in range(len(names)))
    return Log(RATE, {n: AxisLog(c, ROTARY_UNITS) for n, c in zip(names, columns, strict=True)})


class Peak:
    """The most memory that this process held within a `with`, bytes beyond what it held before."""

    def __enter__(self) -> Peak:
        self.done = Event()
        self.before = self.most = _resident()
        self.watch = Thread(target=self._watched)
        self.watch.start()
        return self

    def _watched(self) -> None:
        while not self.done.wait(0.02):
            self.most = max(self.most, _resident())

    def __exit__(self, *_: object) -> None:
        self.done.set()
        self.watch.join()

    @property
    def taken(self) -> int:
        """Bytes."""
        return self.most - self.before


def _resident() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * getpagesize()


def measure() -> list[Figure]:
    """Seconds and memory of the fit, what it found, and the speed of the momentum form."""
    return [*_fitted(), _speed()]


def _fitted() -> Iterator[Figure]:
    text, names = tree(LIMBS)
    with TemporaryDirectory() as folder:
        path = Path(folder, "humanoid.mcap")
        write_log(humanoid(text, names), path)
        short = read_log(path).part(0, round(10.0 * RATE))
        model = first_model({"short": short}, "humanoid", load_catalogue(), ("humanoid.xml", text))
        fit(model, {"short": short})  # loads what is compiled
        with Peak() as peak:
            begun = perf_counter()
            log = read_log(path)
            found = fit(model, {"log": log})
            seconds = perf_counter() - begun
    size = sum(c.nbytes for axis in log.axes.values() for c in axis.columns.values())
    yield Figure("fit of 40 joints, 1 kHz, 5 minutes", seconds, "s", Target(high=60.0))
    yield Figure("memory over that of the log", peak.taken / size, "1", Target(high=3.0))
    plain = [n for i, n in enumerate(names) if i not in PLANTED]
    friction = [found.fits[n].axis["coulomb_viscous"].values["Fc"] for n in plain]
    off = float(np.max(np.abs(np.array(friction) / COULOMB - 1.0)))
    yield Figure("Coulomb friction, largest error", 100.0 * off, "%", Target(high=2.0))
    ratios = sorted(names, key=lambda n: -found.fits[n].ratio)
    first = ratios[: len(PLANTED)]
    right = len({names[i] for i in PLANTED} & {*first})
    yield Figure(
        "planted joints among those that leave most", float(right), "1", Target(low=len(PLANTED)),
        ", ".join(first),
    )  # fmt: skip


def _speed() -> Figure:
    text, names = tree((6,))
    mechanism = mechanism_of(text, "arm.xml", {n: n for n in names})
    position, velocity, _ = motion(len(names), 20_000)
    took = []
    for _ in range(5):
        begun = perf_counter()
        mechanism.along(position, velocity, velocity)
        took.append((perf_counter() - begun) / position.shape[1])
    return Figure("momentum and bias, six joints", 1e6 * min(took), "us/sample", Target(high=5.0))
