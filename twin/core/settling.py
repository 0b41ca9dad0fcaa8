"""What laws with memory hold at rest, where readings do not tell but the balance of forces does.

At rest the noise of a reading hides small turns, each of which a bristle remembers. What all laws
hold together is known there: it balances the force on the axis. So where readings leave it free,
the axis is moved in each sample by what makes them balance, but by no more than readings hide.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.core.compiled import borrow, compiled
from twin.core.native import Table, axis_force
from twin.core.walks import arrive, lent_io, structure_of
from twin.effect import WHEN, V

Array = NDArray[np.float64]

TRIES = 8  # of how far the axis is moved in a sample
BALANCED = 0.01  # of what was not, below which the force is balanced


def settle(
    table: Table, motion: Array, others: Array, pushed: Array, path: Array,
    free: NDArray[np.bool_], room: float, forgets: float, dt: float, time_origin: float,
) -> Array:  # fmt: skip
    """How far laws of a table's first axis are moved beside a path to balance at rest, (n,) m.

    motion (3 or more, n), others (3, n): as ``walk`` has them; pushed (n,): N, the force on the
    axis that the laws balance where it stands. path (n,): velocity m/s. free (n,): where readings
    tell no motion; room: m, how much of it they hide within a time of forgets (s).
    """
    first, last, at, _, _ = (int(i) for i in table.axes[0])
    io, moved = lent_io(dt, float(table.masses[0])), np.zeros(len(path))
    io[WHEN] = 1.0
    states = np.zeros((2, table.n_states))
    _settle(
        table.entries, first, structure_of(table.entries, first, last), table.parameters, states,
        at, motion, others, pushed, path, free, room, max(1.0 - dt / forgets, 0.0), dt, time_origin,
        io, np.zeros((2, len(table.entries))), moved,
    )  # fmt: skip
    return moved


@compiled(inline=True)
def _copy(states, to):
    """Put states (n,) into others, where an assignment of slices takes seconds to compile."""
    for i in range(states.shape[0]):
        to[i] = states[i]


@compiled(inline=True)
def _left(
    entries, first, last, parameters, states, at, motion, others, pushed, k, velocity, dt,
    time_origin, io, row,
):  # fmt: skip
    """Force (N) that is not balanced at the end of sample k by laws that go at a velocity (m/s)."""
    arrive(io, motion, others, k, 0, dt, time_origin)
    io[V] = velocity
    net, _ = axis_force(entries, first, last, parameters, states, at, borrow(io), borrow(row), 0)
    return net - motion[2, k] + pushed[k]


@compiled(nogil=True)
def _settle(
    entries, first, last, parameters, states, at, motion, others, pushed, path, free, room, kept,
    dt, time_origin, io, row, moved,
):  # fmt: skip
    now, before = states[0], states[1]
    gone = 0.0
    for k in range(path.shape[0]):
        gone = kept * gone if free[k] else 0.0
        _copy(now, before)
        left = _left(
            entries, first, last, parameters, now, at, motion, others, pushed, k, path[k], dt,
            time_origin, io, row,
        )  # fmt: skip
        if not free[k] or left == 0.0:
            continue
        # As far as there is room, and from there by false position ("Illinois") to the balance.
        near, near_left, far_left = 0.0, left, 0.0
        far = (room if left > 0.0 else -room) - gone
        step, then = far, left
        for i in range(TRIES):
            _copy(before, now)
            then = _left(
                entries, first, last, parameters, now, at, motion, others, pushed, k,
                path[k] + step / dt, dt, time_origin, io, row,
            )  # fmt: skip
            short = then * left > 0.0
            if abs(then) < BALANCED * abs(left) or i == TRIES - 1 or (i == 0 and short):
                break
            if i == 0:
                far_left = then
            elif short:
                near, near_left, far_left = step, then, 0.5 * far_left
            else:
                far, far_left, near_left = step, then, 0.5 * near_left
            step = (near * far_left - far * near_left) / (far_left - near_left)
        if abs(then) >= abs(left):  # no law answers
            step = 0.0
            _copy(before, now)
            _left(
                entries, first, last, parameters, now, at, motion, others, pushed, k, path[k], dt,
                time_origin, io, row,
            )  # fmt: skip
        moved[k] = step
        gone += step
