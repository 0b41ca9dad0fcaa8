"""A model as plain arrays, and the forces on an axis at a sample.

Each law compiles by itself, once, and is cached on disk; a model is plain arrays of addresses,
offsets, parameters and states, so composing a model compiles nothing. The MuJoCo callback and the
reduced stepper walk the same table through ``axis_force``, so the two agree to rounding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.core.compiled import (
    ADDRESS,
    KIND,
    P_AT,
    S_AT,
    call_at,
    compiled,
    doubles_at,
    law_address,
)
from twin.effect import (
    ACC,
    DRY,
    DT,
    FRICTION,
    HOLD,
    LOAD,
    MASS,
    MOVED,
    NET,
    OUT,
    READING,
    STATIC,
    VISCOUS,
    WHEN,
    Effect,
    Kind,
    U,
    V,
)

LONGEST_STEP = 2e-4  # s, of attached masses along a measured motion


@compiled(inline=True)
def call_law(entries, i, p, s, io):
    """Call the law of entry i; p, s, io: addresses of all parameters, all states and io."""
    p_at, s_at = p + 8 * int(entries[i, P_AT]), s + 8 * int(entries[i, S_AT])
    call_at(int(entries[i, ADDRESS]), (p_at, s_at, io))


@compiled(inline=True)
def answer(entries, i, p, s, io, net, acceleration):
    """OUT (N) of a structure effect under these NET and ACC (m/s^2)."""
    io[OUT], io[NET], io[ACC] = 0.0, net, acceleration
    call_law(entries, i, p, s, io.ctypes.data)
    return io[OUT]


@compiled(inline=True)
def answers(entries, first, last, p, s, io):
    """Linear response of the structure effects in this sample: (pushed, riding, moved, yielding).

    Bodies on the axis push it with pushed + riding * acceleration (N, kg); the body that the axis
    stands on adds moved + yielding * NET (N, kg) to its motion.
    """
    pushed, riding, moved, yielding = 0.0, 0.0, 0.0, 0.0
    when = io[WHEN]
    io[WHEN] = 0.0
    for i in range(first, last):
        alone = answer(entries, i, p, s, io, 0.0, 0.0)
        by_force = answer(entries, i, p, s, io, 1.0, 0.0) - alone
        if by_force != 0.0:
            moved += alone
            yielding += by_force
        else:
            pushed += alone
            riding += answer(entries, i, p, s, io, 0.0, 1.0) - alone
    io[WHEN] = when
    return pushed, riding, moved, yielding


@compiled(inline=True)
def settle(entries, first, last, p, s, io, net, answered, rows, k):
    """Force (N) that the structure effects add under a net force; their states advance.

    With a the acceleration of the bodies on the axis, q'' that of the axis relative to its base:
    m a = net + pushed + riding a,  m q'' = m a + moved + yielding net/m, m the moved mass.
    """
    pushed, riding = answered[0], answered[1]
    mass = io[MOVED]
    ridden = (net + pushed) / (mass - riding)
    total = 0.0
    for i in range(first, last):
        rows[k, i] = answer(entries, i, p, s, io, net / mass, ridden)
        total += rows[k, i]
    return total


@compiled(inline=True)
def stands(entries, first, last, p, s, io):
    """Whether the axis stands on any of the structure effects, which yield to its net force."""
    return answers(entries, first, last, p, s, io)[3] != 0.0


def steps_of(entries, first, last, n_states, period):
    """Steps in which structure effects walk along a block of ``period`` s.

    Short enough for a contact; one where none of them has a state, as the mean of the block's
    acceleration is then all that they ask for. n_states: of the whole table.
    """
    begin = np.append(entries[:, S_AT], n_states)
    if begin[first] == begin[last]:
        return 1
    return int(np.ceil(period / LONGEST_STEP - 1e-9))


@compiled()
def along(entries, first, last, p, s, io, slopes, k, standing, steps, rows):
    """Force (N) of structure effects along block k of a measured motion; their states advance.

    slopes (n,) m/s^2: of the velocity, in the middle of each block. standing: as ``stands`` says
    of them. A block is walked in so many steps, as ``steps_of`` says, with the acceleration a
    parabola that has the means of the blocks around it. rows (2, n_entries): the first receives the
    block's mean, the second is overwritten.
    """
    block, now = io[DT], slopes[k]
    before, after = slopes[max(k - 1, 0)], slopes[min(k + 1, slopes.shape[0] - 1)]
    rise, bend = 0.5 * (after - before), 0.5 * (after - 2.0 * now + before)
    rows[0, first:last] = 0.0
    answered = (0.0, 0.0, 0.0, 0.0)
    if standing:  # the base is heavy and slow
        steps = 1
        answered = answers(entries, first, last, p, s, io)
    else:
        io[DT] = block / steps
    part = 1.0 / steps
    level = now + bend * (part * part - 1.0) / 12.0
    for j in range(steps):
        at = (j + 0.5) * part - 0.5
        measured = level + at * (rise + bend * at)
        net, ridden = 0.0, measured
        if standing:
            net, ridden = shared(answered, io[MOVED], measured)
        for i in range(first, last):
            rows[0, i] += answer(entries, i, p, s, io, net, ridden) * part
    io[DT] = block


@compiled(inline=True)
def shared(answered, mass, measured):
    """NET and ACC (m/s^2) for a measured acceleration of the axis relative to its base."""
    pushed, riding, moved, yielding = answered
    free = mass - riding
    net = (free * (measured - moved / mass) - pushed) / (1.0 + free * yielding / mass**2)
    return net / mass, (net + pushed) / free


@compiled()
def slopes_of(values, dt):
    """Derivatives (n,) of equally spaced means in the middle of each, of fourth order inside."""
    last, out = values.shape[0] - 1, np.empty(values.shape[0])
    for k in range(last + 1):
        if 2 <= k <= last - 2:
            near, far = values[k + 1] - values[k - 1], values[k + 2] - values[k - 2]
            out[k] = (8.0 * near - far) / (12.0 * dt)
        else:
            after, before = min(k + 1, last), max(k - 1, 0)
            out[k] = (values[after] - values[before]) / (max(after - before, 1) * dt)
    return out


# States every axis has before those of its effects.
LAST_FRICTION, LAST_VELOCITY, LAST_ACCELERATION, LAST_NET = range(4)

_FORCE = Kind.FORCE.value
_FRICTION = Kind.FRICTION.value
_STRUCTURE = Kind.STRUCTURE.value


@compiled(inline=True)
def axis_force(entries, first, last, parameters, states, at, io, rows, k):
    """Forces on one axis, N: (of actuator and effects, of its structure); states advance a sample.

    entries (n, 4); parameters, states, io: flat doubles; at: where this axis' states begin.
    io holds INDEX, TIME, DT, X, V, U, MASS, MOVED, LOAD, WHEN and the other axis on entry.
    rows[k, i] receives the force that entry i puts on the axis.
    """
    rate = 1.0 / io[DT]
    mass = io[MASS]
    stop = mass * io[V] * rate
    io[DRY] = 1.0
    io[STATIC] = 1.0
    io[VISCOUS] = 1.0
    p = parameters.ctypes.data
    s = states.ctypes.data
    w = io.ctypes.data
    own = doubles_at(s + 8 * at)
    io[FRICTION] = own[LAST_FRICTION]
    structure = last
    while structure > first and entries[structure - 1, KIND] == _STRUCTURE:
        structure -= 1
    answered = (0.0, 0.0, 0.0, 0.0)
    if structure < last:
        answered = answers(entries, structure, last, p, s, io)
        share = mass / (mass - answered[1])  # of a force, that moves the nominal mass
        moving = share + answered[3] / io[MOVED]
        stop += share * answered[0] + answered[2]
        stop /= moving
        io[MASS] = mass / moving
    stop -= io[LOAD]
    total = 0.0
    friction = 0.0
    for i in range(first, structure):
        kind = entries[i, KIND]
        before = io[U]
        io[HOLD] = stop + before + total
        io[OUT] = 0.0
        call_law(entries, i, p, s, w)
        if kind == _FORCE:
            rows[k, i] = io[OUT]
            total += io[OUT]
        elif kind == _FRICTION:
            friction = io[OUT]
            rows[k, i] = -friction
        else:
            rows[k, i] = io[U] - before
    io[MASS] = mass
    net = total - friction + io[U]
    added = 0.0
    if structure < last:
        added = settle(entries, structure, last, p, s, io, net, answered, rows, k)
    own[LAST_FRICTION] = friction
    own[LAST_NET] = net
    own[LAST_ACCELERATION] = (io[V] - own[LAST_VELOCITY]) * rate
    own[LAST_VELOCITY] = io[V]
    return net, added


@compiled(inline=True)
def sense(entries, first, last, parameters, states, io, position):
    """Encoder reading of a true position: the sensing effects in order."""
    io[READING] = position
    for i in range(first, last):
        call_law(entries, i, parameters.ctypes.data, states.ctypes.data, io.ctypes.data)
    return io[READING]


@dataclass(frozen=True)
class Table:
    """A model as plain arrays."""

    entries: NDArray[np.int64]
    """(n, 4), one row an effect: address of its law, kind, first parameter, first state."""
    parameters: NDArray[np.float64]
    """(n_p,) of all effects, one after the other."""
    axes: NDArray[np.int64]
    """(n_axes, 5): first entry, last entry, first state, first and last sensing entry."""
    bodiless: NDArray[np.int64]
    """(n_axes,) first entry of the structure effects that are no bodies of MuJoCo, up to the last
    entry of the axis."""
    masses: NDArray[np.float64]
    """(n_axes,) kg, moved."""
    n_states: int
    """How many states there are."""
    labels: tuple[tuple[str, str], ...]
    """(axis name, effect name) of each entry."""
    remembers: NDArray[np.bool_]
    """(n,) which laws follow the path: what remembers it, and what modifies such a friction."""
    reads_joints: bool = False
    """Whether a law reads the load or the velocities of a mechanism's joints."""


def build_table(
    axes: Mapping[str, Sequence[tuple[Effect, Sequence[float]]]], masses: Sequence[float]
) -> Table:
    """Table of a model: axis name -> its effects with their parameter values in catalogue order."""
    rows: list[tuple[int, int, int, int]] = []
    spans: list[tuple[int, int, int, int, int]] = []
    bodiless: list[int] = []
    parameters: list[float] = []
    labels: list[tuple[str, str]] = []
    remembers: list[bool] = []
    n_states = 0
    for axis, effects in axes.items():
        state_at = n_states
        n_states += 4  # of the axis itself, before those of its effects
        begin = len(rows)
        sensing = begin
        without = 0
        bristles = any(e.remembers for e, _ in effects if e.kind is Kind.FRICTION)
        for effect, values in sorted(effects, key=lambda e: e[0].turn):
            rows.append((law_address(effect), effect.kind.value, len(parameters), n_states))
            labels.append((axis, effect.name))
            remembers.append(effect.remembers or (bristles and effect.kind is Kind.MODIFIER))
            parameters.extend(values)
            n_states += len(effect.states)
            sensing += effect.kind is Kind.SENSING
            without += effect.kind is Kind.STRUCTURE and not effect.is_of_bodies
        bodiless.append(len(rows) - without)
        spans.append((sensing, len(rows), state_at, begin, sensing))
    return Table(
        entries=np.array(rows, dtype=np.int64).reshape(-1, 4),
        parameters=np.array([*parameters, 0.0]),
        axes=np.array(spans, dtype=np.int64),
        bodiless=np.array(bodiless, dtype=np.int64),
        masses=np.array(masses, dtype=float),
        n_states=n_states,
        labels=tuple(labels),
        remembers=np.array(remembers, dtype=bool),
        reads_joints=any(
            effect.reads("LOAD") or effect.reads("SPEEDS")
            for effects in axes.values()
            for effect, _ in effects
        ),
    )
