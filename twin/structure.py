"""Masses attached to an axis, coupled with its motion within one sample.

A structure effect answers linearly: what rides on the axis pushes it with a force that depends on
its acceleration in space, what the axis stands on recoils from the net force on it. Together with
the axis' own equation of motion that is a small linear system, solved here exactly; MuJoCo solves
the same one for the bodies that the effects build there.
"""

from __future__ import annotations

import numba

from twin.calling import ADDRESS, P_AT, S_AT, call_law
from twin.effect import ACC, MOVED, NET, OUT, WHEN


@numba.njit(cache=True, inline="always", error_model="numpy")
def answer(entry, p, s, io, net, acceleration):
    """OUT (N) of a structure effect under these NET and ACC (m/s^2)."""
    io[OUT], io[NET], io[ACC] = 0.0, net, acceleration
    own_p, own_s = p + 8 * int(entry[P_AT]), s + 8 * int(entry[S_AT])
    call_law(int(entry[ADDRESS]), own_p, own_s, io.ctypes.data)
    return io[OUT]


@numba.njit(cache=True, inline="always", error_model="numpy")
def answers(entries, first, last, p, s, io):
    """How the structure effects would answer in this sample: (pushed, riding, moved, yielding).

    What rides on the axis pushes it with pushed + riding * acceleration (N, kg); what it stands on
    adds moved + yielding * NET (N, kg) to its motion.
    """
    pushed, riding, moved, yielding = 0.0, 0.0, 0.0, 0.0
    when = io[WHEN]
    io[WHEN] = 0.0
    for i in range(first, last):
        alone = answer(entries[i], p, s, io, 0.0, 0.0)
        by_force = answer(entries[i], p, s, io, 1.0, 0.0) - alone
        if by_force != 0.0:
            moved += alone
            yielding += by_force
        else:
            pushed += alone
            riding += answer(entries[i], p, s, io, 0.0, 1.0) - alone
    io[WHEN] = when
    return pushed, riding, moved, yielding


@numba.njit(cache=True, inline="always", error_model="numpy")
def settle(entries, first, last, p, s, io, net, measured, answered, rows, k):
    """Force (N) that the structure effects add under a net force; their states advance.

    With a the acceleration of what rides on the axis, q'' that of the axis over what it stands on:
    m a = net + pushed + riding a,  m q'' = m a + moved + yielding net/m, m the moved mass.
    Along a measured motion q'' is known and net is the force that it takes.
    """
    pushed, riding, moved, yielding = answered
    mass, free = io[MOVED], io[MOVED] - riding
    if io[WHEN] < 1.0:
        net = (free * (measured - moved / mass) - pushed) / (1.0 + free * yielding / mass**2)
    total = 0.0
    for i in range(first, last):
        rows[k, i] = answer(entries[i], p, s, io, net / mass, (net + pushed) / free)
        total += rows[k, i]
    return total


@numba.njit(cache=True, inline="always", error_model="numpy")
def slope(values, k, dt):
    """Derivative of equally spaced means in the middle of number k, of fourth order inside."""
    last = values.shape[0] - 1
    if 2 <= k <= last - 2:
        near, far = values[k + 1] - values[k - 1], values[k + 2] - values[k - 2]
        return (8.0 * near - far) / (12.0 * dt)
    after, before = min(k + 1, last), max(k - 1, 0)
    return (values[after] - values[before]) / (max(after - before, 1) * dt)
