"""Run an experiment on the twin, in MuJoCo or in the reduced model, and log it.

Of a run that becomes unstable is said at which sample, on which axis and by which effect.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from twin.core.compiled import S_AT
from twin.core.native import Table
from twin.errors import CannotRun, InputError
from twin.experiments.trajectory import AnySetpoint, Setpoint
from twin.model.machine import MachineModel
from twin.mujoco.callback import (
    USER_HEADER,
    attach,
    native_address,
    offsets,
    passive_callback,
)
from twin.simulation.loop import N_SIGNALS, Controller, gain_table, run_mujoco, run_reduced

Array = NDArray[np.float64]


CHUNK = 20_000  # samples that are run, reported and recorded at once
WATCHED_STATES = 8  # an effect with more states than this is not logged state by state

Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class Run:
    """The recorded signals of a simulation of n samples."""

    signals: Array
    """(n, n_axes, 4): encoder reading m, command N, true position m, true velocity m/s."""
    forces: Array
    """(n, n_entries): force of each effect, N, in the order of the table's labels."""
    states: Array
    """(n, n_watched): states of the effects that have few."""
    table: Table
    """The model that was run."""
    state_names: tuple[tuple[str, str], ...]
    """(axis, effect and state) of each watched state."""

    def __len__(self) -> int:
        return len(self.signals)

    @property
    def arrays(self) -> tuple[Array, Array, Array]:
        """What the compiled loop fills."""
        return self.signals, self.forces, self.states


class Stepper(Protocol):
    """A simulation that can be placed and run on by some samples."""

    def place(
        self, position: Array, velocity: Array, states: Array, first: int, origin: float = 0.0
    ) -> None:
        """Set the axes' motion (n_axes,) and the effects' states before sample ``first``.

        origin: s, when sample 0 was.
        """

    def run(self, first: int, shared: tuple, setpoints: Array, noise: Array, out: tuple) -> None:
        """Run setpoints.shape[0] samples and fill ``out``: signals, forces, states."""


class MujocoSimulator:
    """The machine in MuJoCo with its effects attached.

    MuJoCo is imported with the first, as most commands simulate nothing in it.
    """

    def __init__(self, model: MachineModel, table: Table) -> None:
        import mujoco

        from twin.model.bodies import mechanism_in
        from twin.simulation.spec import driven, jointed_spec, machine_spec, plain

        self._transmission = None
        if model.joints:
            spec, axes = jointed_spec(model), driven(model)
            self._transmission = mechanism_in(model).transmission
        else:
            spec = machine_spec(model)
            axes = plain(model, spec)
        self._own = attach(spec, table, model.period, axes)
        # A bad state stays bad, and is found, instead of starting again from zero.
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self.model = spec.compile()
        self._machine, self._table = model, table
        self.data = mujoco.MjData(self.model)
        self._attached = self._attached_joints()
        self._step = native_address("mj_step")

    def _attached_joints(self) -> NDArray[np.int64]:
        """For each joint that a structure effect built: qpos, dof, the effect's first state."""
        import mujoco

        from twin.simulation.spec import attached_joint

        rows, kind = [], mujoco.mjtObj.mjOBJ_JOINT
        for label, entry in zip(self._table.labels, self._table.entries, strict=True):
            joint = mujoco.mj_name2id(self.model, kind, attached_joint(*label))
            if joint >= 0:
                rows.append(
                    (self.model.jnt_qposadr[joint], self.model.jnt_dofadr[joint], entry[S_AT])
                )
        return np.array(rows, dtype=np.int64).reshape(-1, 3)

    def place(
        self, position: Array, velocity: Array, states: Array, first: int, origin: float = 0.0
    ) -> None:
        """See Stepper."""
        self.data.time = first * self.model.opt.timestep
        if (joints := self._transmission) is None:
            qpos, dof = self._own.parts[:, :2].astype(int).T
            self.data.qpos[qpos], self.data.qvel[dof] = position, velocity
        else:
            self.data.qpos[:] = joints.joints(position)
            self.data.qvel[:] = joints.by @ velocity
        self.data.qpos[self._attached[:, 0]] = states[self._attached[:, 2]]
        self.data.qvel[self._attached[:, 1]] = states[self._attached[:, 2] + 1]
        user = self.data.userdata[self._own.user_at :]
        user[:USER_HEADER] = self.data.time, origin
        user[USER_HEADER : USER_HEADER + 2 * len(states)] = np.tile(states, 2)

    def run(self, first: int, shared: tuple, setpoints: Array, noise: Array, out: tuple) -> None:
        """See Stepper."""
        from twin.mujoco.callback import collected_warnings

        with passive_callback(), collected_warnings(self.data) as warnings:
            run_mujoco(
                self._step, self.model._address, self.data._address, tuple(offsets()[3:7]),
                tuple(self._own), first, *shared[:-1], setpoints, noise, shared[-1], *out,
            )  # fmt: skip
        if warnings:
            require_sound(out[0], out[1], self._machine, self._table, first)
            raise CannotRun(
                f"MuJoCo ended the simulation at t = {warnings[0].time:.4f} s: {warnings[0].text} "
                f"Change {self._machine.mjcf_name or 'the model'}, or raise sample_rate (Hz)"
            )


class ReducedSimulator:
    """The reduced model: the axes as point masses, used for free runs and planned experiments."""

    substeps = 1  # integration steps a sample

    def __init__(self, model: MachineModel, table: Table) -> None:
        if model.joints:
            raise CannotRun(
                f"{model.name}: its axes are joints of {model.mjcf_name}, which move each other; "
                "such a machine is simulated in MuJoCo alone"
            )
        self._motion = np.zeros((len(model.axes), 2))
        self._states = np.zeros(table.n_states)
        self._masses = table.masses
        self._origin = 0.0

    def place(
        self, position: Array, velocity: Array, states: Array, first: int, origin: float = 0.0
    ) -> None:
        """See Stepper."""
        self._motion[:, 0] = position
        self._motion[:, 1] = velocity
        self._states[:] = states
        self._origin = origin

    def run(self, first: int, shared: tuple, setpoints: Array, noise: Array, out: tuple) -> None:
        """See Stepper."""
        run_reduced(
            self._motion, self._states, self._masses, self.substeps, first, self._origin,
            *shared[:-1],
            setpoints, noise, shared[-1], *out,
        )  # fmt: skip


Simulator = type[MujocoSimulator] | type[ReducedSimulator]


def quickest(model: MachineModel) -> Simulator:
    """The reduced model; MuJoCo where the axes are joints, which move each other."""
    return MujocoSimulator if model.joints else ReducedSimulator


class FineSimulator(ReducedSimulator):
    """Point masses stepped ten times a sample under a held command: finer than any analysis."""

    substeps = 10


def run(
    model: MachineModel,
    setpoint: AnySetpoint,
    rng: np.random.Generator,
    *,
    simulator: Simulator = MujocoSimulator,
    controllers: Mapping[str, Controller] | None = None,
    progress: Progress | None = None,
) -> Run:
    """Run a setpoint on the twin, from rest at its first position; raises CannotRun.

    rng draws the encoder noise. controllers: by axis; the model's own bandwidths where None. Raises
    CannotRun where the simulation breaks down.
    """
    whole: Run | None = None
    done = 0
    for part in run_parts(
        model, setpoint, rng, simulator=simulator, controllers=controllers, progress=progress
    ):
        whole = _empty(part, len(setpoint)) if whole is None else whole
        for column, new in zip(whole.arrays, part.arrays, strict=True):
            column[done : done + len(part)] = new
        done += len(part)
    assert whole is not None
    return whole


def run_parts(
    model: MachineModel,
    setpoint: AnySetpoint,
    rng: np.random.Generator,
    *,
    simulator: Simulator = MujocoSimulator,
    controllers: Mapping[str, Controller] | None = None,
    progress: Progress | None = None,
) -> Iterator[Run]:
    """``run`` in parts, one after the other, so that a long one need not be held in memory."""
    model.require_mass()
    table = model.table()
    n, n_axes = len(setpoint), len(model.axes)
    start = setpoint.part(0, 1).position
    if start.shape[1] != n_axes:
        raise InputError(f"the setpoint has {start.shape[1]} axes, the model {n_axes}")
    scale = np.array([a.hardware.encoder_noise for a in model.axes.values()])
    controllers = controllers or {a: Controller.for_axis(m) for a, m in model.axes.items()}
    watched, names = _watched(model, table)
    shared = (
        model.period,
        (table.entries, table.axes, table.parameters),
        np.zeros(table.n_states),
        gain_table(controllers, model.axes, model.period),
        np.zeros((n_axes, 3)),
        watched,
    )
    simulation: Stepper = simulator(model, table)
    simulation.place(start[0], np.zeros(n_axes), np.zeros(table.n_states), 0)
    before = Run(
        np.zeros((0, n_axes, N_SIGNALS)), np.zeros((0, len(table.entries))),
        np.zeros((0, len(watched))), table, names,
    )  # fmt: skip
    for first in range(0, n, CHUNK):
        wanted = setpoint.part(first, min(first + CHUNK, n))
        noise = rng.standard_normal((len(wanted), n_axes)) * scale
        part = _empty(before, len(wanted))
        force = wanted.force + _carried(model, wanted)
        columns = (wanted.position, wanted.velocity, wanted.acceleration, force)
        simulation.run(first, shared, np.stack(columns, axis=2), noise, part.arrays)
        require_sound(
            np.concatenate([before.signals[-1:], part.signals]),
            np.concatenate([before.forces[-1:], part.forces]),
            model, table, first - len(before.signals[-1:]),
        )  # fmt: skip
        yield part
        before = part
        if progress:
            progress(first + len(wanted), n)


def _carried(model: MachineModel, setpoint: Setpoint) -> Array | float:
    """Force (n, n_axes) N that joints take along a setpoint beyond mass times acceleration.

    As the mass of a plain axis, the weight and the inertia of bodies are fed forward.
    """
    if not model.joints:
        return 0.0
    from twin.model.bodies import mechanism_in

    mechanism = mechanism_in(model)
    bodies = mechanism.carried(setpoint.position.T, setpoint.acceleration.T).T
    return bodies - mechanism.inertia * setpoint.acceleration


def _empty(like: Run, samples: int) -> Run:
    """A run of so many samples, of the same axes and effects, its forces zero."""
    return replace(
        like,
        signals=np.empty((samples, *like.signals.shape[1:])),
        forces=np.zeros((samples, like.forces.shape[1])),
        states=np.empty((samples, like.states.shape[1])),
    )


def _watched(
    model: MachineModel, table: Table
) -> tuple[NDArray[np.int64], tuple[tuple[str, str], ...]]:
    effects = {(a, f.effect.name): f.effect for a, m in model.axes.items() for f in m.effects}
    indices: list[int] = []
    names: list[tuple[str, str]] = []
    for label, entry in zip(table.labels, table.entries, strict=True):
        states = effects[label].states
        if 0 < len(states) <= WATCHED_STATES:
            indices += [int(entry[S_AT]) + i for i in range(len(states))]
            names += [(label[0], f"{label[1]}_{s}") for s in states]
    return np.array(indices, dtype=np.int64), tuple(names)


def require_sound(
    signals: Array, forces: Array, model: MachineModel, table: Table, first: int = 0
) -> None:
    """Raise CannotRun where a signal is not finite, or huge; ``first``: number of sample 0.

    signals (n, n_axes, 4) and forces (n, n_entries) as in ``Run``.
    """
    bad = _bad(signals)
    samples = np.flatnonzero(bad.any(axis=(1, 2)))
    if not len(samples):
        return
    # The force of a sample moves the next one.
    sample = max(int(samples[0]) - 1, 0)
    if not _bad(forces[sample]).any():
        sample = int(samples[0])
    axis = list(model.axes)[int(np.argmax(bad[samples[0]].any(axis=1)))]
    raise CannotRun(
        f"the simulation became unstable at t = {(first + sample) * model.period:.4f} s on "
        f"{_culprit(forces[sample], model, table, axis)}"
    )


def _culprit(forces: Array, model: MachineModel, table: Table, axis: str) -> str:
    """The axis and the effect with a force that cannot be, and what to do."""
    bad = np.flatnonzero(_bad(forces))
    if len(bad):
        axis, effect = table.labels[bad[0]]
        return (
            f"axis {axis}: effect {effect} gives {forces[bad[0]]:.3g} "
            f"{model.axes[axis].units.force}; change its values (or its law, if it is yours), or "
            f"raise sample_rate (Hz){_without_rotor(model, axis)}"
        )
    own = [i for i, label in enumerate(table.labels) if label[0] == axis]
    named = ""
    if own:
        largest = max(own, key=lambda i: abs(forces[i]))
        named = f" (its largest force is that of {table.labels[largest][1]})"
    return (
        f"axis {axis}{named}; lower the bandwidth (Hz) or the damping parameters, or raise "
        f"sample_rate (Hz){_without_rotor(model, axis)}"
    )


def _without_rotor(model: MachineModel, axis: str) -> str:
    """The hint for a joint whose inertia is that of its link alone; empty for others."""
    own = model.axes[axis]
    attributes = [
        f.effect.joint_attributes(f.values) for f in own.effects if f.effect.joint_attributes
    ]
    if not own.joint or any("armature" in given for given in attributes):
        return ""
    return "; the joint lacks the inertia of its motor (armature)"


def _bad(values: Array) -> NDArray[np.bool_]:
    huge = 1e10  # beyond it MuJoCo calls a state bad as well
    return ~(np.abs(values) <= huge)  # not (nan <= HUGE)
