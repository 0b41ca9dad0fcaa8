"""MuJoCo's side of the native core: the passive-force callback, how it finds its model, warnings.

The table of a machine is stored in the mjModel itself, as the last custom numeric, so model copies
and worker threads need nothing else. Its last number is a magic value; the callback
returns at once for any other model. The states live in userdata: those at the start of the
sample and those after it. The callback commits the second to the first when time has moved on,
so a sample counts once however often MuJoCo evaluates its forces. MuJoCo's time counts from the
first sample, as INDEX is computed from it; the time origin is beside the states in userdata.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import carray, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from twin.core.compiled import callback, compiled, doubles_at
from twin.core.native import LAST_ACCELERATION, LAST_NET, LAST_VELOCITY, Table, axis_force
from twin.effect import (
    A_OTHER,
    DT,
    INDEX,
    IO_SIZE,
    LOAD,
    MASS,
    MOVED,
    SPEEDS,
    TIME,
    V_OTHER,
    WHEN,
    X_OTHER,
    U,
    V,
    X,
)
from twin.signals import Array
from twin.threads import entered_once

if TYPE_CHECKING:
    import mujoco

UNKNOWN_LAYOUT = "this MuJoCo lays out its structs in an unknown way; report its version"
NUMERIC = "proton_twin_table"
MAGIC = 0.3401950653e77  # no model holds this by chance
HEADER = 7  # period, axes, states, entries, parameters, first userdata, parts
USER_HEADER = 2  # time of the last call, s; time origin, s; then the states
# First part, last part, actuator, first entry, last entry, state, mass, rotor, first bodiless
# entry, the base's dof.
AXIS_COLUMNS = 10
PART_COLUMNS = 3  # of a joint that is part of an axis: qpos, dof, ratio


class Offsets(NamedTuple):
    """Byte offsets of fields in mjModel (first two) and mjData."""

    n_numeric_data: int
    numeric_data: int
    time: int
    userdata: int
    qpos: int
    qvel: int
    ctrl: int
    qfrc_passive: int


@cache
def library() -> ctypes.CDLL:
    """The MuJoCo library that the Python package has loaded."""
    import mujoco

    folder = Path(mujoco.__file__).parent
    names = [p for p in folder.iterdir() if p.name.startswith(("libmujoco", "mujoco.dll"))]
    return ctypes.CDLL(str(names[0]))


def native_address(name: str) -> int:
    """Address of a function of MuJoCo, for compiled loops."""
    address = ctypes.cast(getattr(library(), name), ctypes.c_void_p).value
    assert address is not None
    return address


def _probe(numeric: int, userdata: int, neighbours: bool) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A small model; with neighbours, the arrays beside those sought are not empty."""
    import mujoco

    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body()
    body.add_joint(name="q", type=mujoco.mjtJoint.mjJNT_SLIDE)
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.1, 0, 0])
    actuator = spec.add_actuator(name="u", target="q", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    if neighbours:
        actuator.dyntype = mujoco.mjtDyn.mjDYN_INTEGRATOR
        spec.worldbody.add_body(mocap=True)
    spec.add_numeric(name="probe", data=[1.0] * numeric, size=numeric)
    spec.nuserdata = userdata
    model = spec.compile()
    data = mujoco.MjData(model)
    data.time = 1234.5678 + numeric
    return model, data


def _word_at(address: int, offset: int) -> int:
    return ctypes.c_uint64.from_address(address + offset).value


def _find(address: int, wanted: int) -> int:
    """Offset of a word; an empty array before the one sought has the same address, so the last."""
    for offset in range(0, 1 << 19, 8):  # bytes
        if _word_at(address, offset) == wanted:
            return max(o for o in range(offset, offset + 64, 8) if _word_at(address, o) == wanted)
    raise RuntimeError(UNKNOWN_LAYOUT)


def _fields(model: mujoco.MjModel, data: mujoco.MjData) -> list[tuple[int, int]]:
    """Of each field of Offsets the address of its struct, and the 8-byte word that it holds."""
    in_model = (model.nnumericdata, model.numeric_data.ctypes.data)
    arrays = (data.userdata, data.qpos, data.qvel, data.ctrl, data.qfrc_passive)
    in_data = (int(np.float64(data.time).view(np.uint64)), *(a.ctypes.data for a in arrays))
    return [*((model._address, w) for w in in_model), *((data._address, w) for w in in_data)]


@cache
def offsets() -> Offsets:
    """Struct offsets, found in one live object and verified in another."""
    probe = _probe(numeric=977, userdata=3, neighbours=False)
    found = Offsets(*(_find(address, word) for address, word in _fields(*probe)))
    probe = _probe(numeric=1013, userdata=5, neighbours=True)
    for offset, (address, word) in zip(found, _fields(*probe), strict=True):
        if _word_at(address, offset) != word:
            raise RuntimeError(UNKNOWN_LAYOUT)
    return found


@intrinsic
def word_at(typingctx, address):
    """The 8-byte word at an address."""

    def codegen(context, builder, signature, args):
        word = context.get_value_type(types.int64).as_pointer()
        return builder.load(builder.inttoptr(args[0], word))

    return types.int64(types.int64), codegen


@compiled(inline=True)
def view(address, shape):
    """Array of the doubles at an address, which MuJoCo owns."""
    return carray(doubles_at(address), shape)


@compiled(inline=True)
def summed(axis, parts, column, values):
    """Sum of the joints' values that an axis is; axis: first and last part; column: addresses."""
    total = 0.0
    for i in range(int(axis[0]), int(axis[1])):
        total += parts[i, 2] * values[int(parts[i, column])]
    return total


@compiled(inline=True)
def in_space(axis, rows, passive):
    """Force (N) of an axis' structure effects that are no bodies, put on its base as well.

    It acts in space: what the axis stands on takes no counterforce.
    """
    total = 0.0
    for i in range(int(axis[8]), int(axis[4])):
        total += rows[0, i]
    if axis[9] >= 0.0:
        passive[int(axis[9])] += total
    return total


@compiled(inline=True)
def begin_sample(time, committed, start, after):
    """Make ``start`` the states at the start of this sample, and ``after`` a copy of them.

    committed[0]: time of the last call. Forwards, what came after that sample is what this one
    starts from; backwards, the simulation begins anew from zero.
    """
    forwards = time > committed[0]
    backwards = time < committed[0]
    committed[0] = time
    for i in range(start.shape[0]):
        if forwards:
            start[i] = after[i]
        elif backwards:
            start[i] = 0.0
        after[i] = start[i]


@compiled(inline=True)
def passive_forces(block, data, off):
    """Add the effects' forces of every axis to qfrc_passive (see the module's docstring).

    block: address of the table's numbers, in the order of ``attach``.
    """
    header = doubles_at(block)
    dt = header[0]
    n_axes = int(header[1])
    n_states = int(header[2])
    n_entries = int(header[3])
    n_parts = int(header[6])
    table = HEADER + AXIS_COLUMNS * n_axes + PART_COLUMNS * n_parts
    axes = view(block + 8 * HEADER, (n_axes, AXIS_COLUMNS))
    parts = view(block + 8 * (HEADER + AXIS_COLUMNS * n_axes), (n_parts, PART_COLUMNS))
    entries = view(block + 8 * table, (n_entries, 4))
    parameters = view(block + 8 * (table + 4 * n_entries), int(header[4]))
    user = word_at(data + off[1]) + 8 * int(header[5])
    states = user + 8 * USER_HEADER
    start = view(states, n_states)
    after = view(states + 8 * n_states, n_states)
    rows = view(states + 8 * 2 * n_states, (1, n_entries))
    io = view(states + 8 * (2 * n_states + n_entries), IO_SIZE)
    qpos = doubles_at(word_at(data + off[2]))
    qvel = doubles_at(word_at(data + off[3]))
    ctrl = doubles_at(word_at(data + off[4]))
    passive = doubles_at(word_at(data + off[5]))
    time = doubles_at(data + off[0])[0]
    begin_sample(time, doubles_at(user), start, after)
    io[INDEX] = np.rint(time / dt)
    io[TIME] = doubles_at(user)[1] + time
    io[DT] = dt
    io[WHEN] = 1.0
    for a in range(n_axes):
        if axes[a, 7] >= 0.0:
            io[SPEEDS + a] = summed(axes[a], parts, 1, qvel)
    for a in range(n_axes):
        own = int(axes[a, 5])
        io[X] = summed(axes[a], parts, 0, qpos)
        io[V] = summed(axes[a], parts, 1, qvel)
        if axes[a, 7] >= 0.0:  # what the bodies took: all forces of the sample before, less rotor's
            gained = (io[V] - start[own + LAST_VELOCITY]) / dt
            io[LOAD] = start[own + LAST_NET] - axes[a, 7] * gained
        command = ctrl[int(axes[a, 2])]
        io[U] = command
        io[MASS] = axes[a, 6]
        io[MOVED] = axes[a, 6]
        if n_axes == 2:  # no law of a larger machine reads them (MachineModel)
            b = 1 - a
            io[X_OTHER] = summed(axes[b], parts, 0, qpos)
            io[V_OTHER] = summed(axes[b], parts, 1, qvel)
            io[A_OTHER] = start[int(axes[b, 5]) + LAST_ACCELERATION]
        # What bodies add is known for the log; MuJoCo's own put it on the axis.
        force, _ = axis_force(
            entries, int(axes[a, 3]), int(axes[a, 4]), parameters, after, own, io, rows, 0
        )
        force += in_space(axes[a], rows, passive)
        for i in range(int(axes[a, 0]), int(axes[a, 1])):  # MuJoCo adds the command
            passive[int(parts[i, 1])] += parts[i, 2] * (force - command)


@cache
def _callback(off: Offsets) -> Any:
    # The offsets are a closure variable because numba keys its disk cache on those: another
    # MuJoCo version compiles anew instead of reading the wrong fields.
    model_offsets, data_offsets = tuple(off[:2]), tuple(off[2:])

    def passive(model, data):
        size = word_at(model + model_offsets[0])
        if size < HEADER + AXIS_COLUMNS:
            return
        numbers = doubles_at(word_at(model + model_offsets[1]))
        if numbers[size - 1] != MAGIC:
            return
        length = int(numbers[size - 2])
        block = word_at(model + model_offsets[1]) + 8 * (size - length)
        passive_forces(block, data, data_offsets)

    return callback(passive, types.void(types.int64, types.int64))


class DrivenAxis(NamedTuple):
    """An axis in a spec: its joint or fixed tendon, its motor, and the mass (kg) of its friction.

    rotor: kg, of its own inertia beside the bodies of a mechanism; below 0 on a plain axis.
    base: the joint along the axis of what it stands on; empty where that is the world.
    """

    joint: str
    motor: str
    mass: float
    rotor: float = -1.0
    base: str = ""


Parts = list[tuple[int, float]]  # joints and ratios, by which they add up to an axis


def parts_of(model: mujoco.MjModel, name: str) -> Parts:
    """The joint of that name, or those of the fixed tendon; none of a spatial one."""
    import mujoco

    joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
    return [(joint, 1.0)] if joint >= 0 else tendon_parts(model, model.tendon(name).id)


def tendon_parts(model: mujoco.MjModel, tendon: int) -> Parts:
    """The joints that a fixed tendon is a sum of; none of a spatial one."""
    import mujoco

    first = model.tendon_adr[tendon]
    own = slice(first, first + model.tendon_num[tendon])
    is_fixed = np.all(model.wrap_type[own] == mujoco.mjtWrap.mjWRAP_JOINT)
    pairs = zip(model.wrap_objid[own].tolist(), model.wrap_prm[own].tolist(), strict=True)
    return list(pairs) if is_fixed else []


class Attached(NamedTuple):
    """Where a table's axes are in a model. user_at: where its userdata begins.

    axes (n_axes, 3): first and last part, actuator; parts (n_parts, 3): qpos, dof and ratio of the
    joints whose sum an axis is.
    """

    user_at: int
    axes: NDArray[np.int64]
    parts: Array


def attach(
    spec: mujoco.MjSpec, table: Table, period: float, axes: Sequence[DrivenAxis]
) -> Attached:
    """Write the table into the spec; axes: in the table's order."""
    model = spec.compile()
    own = [parts_of(model, axis.joint) for axis in axes]
    ends = np.cumsum([0, *map(len, own)])
    motors = [model.actuator(axis.motor).id for axis in axes]
    where = np.column_stack([ends[:-1], ends[1:], motors])
    joints, ratios = np.transpose([part for parts in own for part in parts])
    at = joints.astype(np.int64)
    parts = np.column_stack([model.jnt_qposadr[at], model.jnt_dofadr[at], ratios])
    spans = [
        (*place, *entry[:3], axis.mass, axis.rotor, bodiless, _dof(model, axis.base))
        for axis, place, entry, bodiless in zip(
            axes, where, table.axes, table.bodiless, strict=True
        )
    ]
    # Doubles hold any address below 2^53 exactly, so that a table can travel in an mjModel.
    numbers = [
        period, len(axes), table.n_states, len(table.entries), len(table.parameters),
        model.nuserdata, len(parts), *np.ravel(spans), *parts.ravel(), *table.entries.ravel(),
        *table.parameters,
    ]  # fmt: skip
    numbers += [len(numbers) + 2, MAGIC]
    spec.add_numeric(name=NUMERIC, data=numbers, size=len(numbers))
    size = USER_HEADER + 2 * table.n_states + len(table.entries) + IO_SIZE
    spec.nuserdata = model.nuserdata + size
    return Attached(model.nuserdata, where, parts)


def _dof(model: mujoco.MjModel, joint: str) -> int:
    return model.jnt_dofadr[model.joint(joint).id] if joint else -1


@entered_once
@contextmanager
def passive_callback() -> Iterator[None]:
    """Install the native callback while any thread simulates, then restore what was there before.

    Meanwhile MuJoCo's own timers stand still (``mjData.timer``): it reads the clock some twenty
    times a step, for a quarter of the step's time.
    """
    import mujoco

    before = mujoco.get_mjcb_passive()
    clock = ctypes.c_void_p.in_dll(library(), "mjcb_time")
    ticking = clock.value
    mujoco.set_mjcb_passive(_callback(offsets()).ctypes)
    clock.value = None
    try:
        yield
    finally:
        clock.value = ticking
        mujoco.set_mjcb_passive(before)


# --- warnings: left alone MuJoCo resets a bad state to zero, goes on, and writes a file -----------


class Warned(NamedTuple):
    """A warning: what MuJoCo says, and the simulated time, s."""

    text: str
    time: float


# Of this thread's simulation.
_KEEP: ContextVar[Callable[[str], None] | None] = ContextVar("keep", default=None)


@contextmanager
def collected_warnings(data: mujoco.MjData) -> Iterator[list[Warned]]:
    """The warnings of one simulation while it runs, instead of MUJOCO_LOG.TXT."""
    found: list[Warned] = []

    def keep(text: str) -> None:
        found.append(Warned(" ".join(text.split()), float(data.time)))

    with _handler():
        token = _KEEP.set(keep)
        try:
            yield found
        finally:
            _KEEP.reset(token)


@entered_once
@contextmanager
def _handler() -> Iterator[None]:
    """Hand each warning to the simulation of its thread; MuJoCo has one handler for all.

    One of a thread that simulates nothing of ours goes to the handler that was there before.
    """
    import mujoco

    before = mujoco.get_mju_user_warning()

    def hand_on(text: str) -> None:
        keep = _KEEP.get() or before
        if keep is not None:
            keep(text)

    mujoco.set_mju_user_warning(hand_on)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
