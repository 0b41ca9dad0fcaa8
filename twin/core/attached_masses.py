"""Masses attached to an axis, coupled with its motion within one sample.

A structure effect answers linearly: what rides on the axis pushes it with a force that depends on
its acceleration in space, what the axis stands on recoils from the net force on it. Together with
the axis' own equation of motion that is a small linear system, solved here exactly; MuJoCo solves
the same one for the bodies that the effects build there.
"""

from __future__ import annotations

import numpy as np

from twin.core.calling import ADDRESS, P_AT, S_AT, call_law
from twin.core.compiled import compiled
from twin.effect import ACC, DT, MOVED, NET, OUT, WHEN

LONGEST_STEP = 2e-4  # s, of attached masses along a measured motion


@compiled(inline=True)
def answer(entry, p, s, io, net, acceleration):
    """OUT (N) of a structure effect under these NET and ACC (m/s^2)."""
    io[OUT], io[NET], io[ACC] = 0.0, net, acceleration
    own_p, own_s = p + 8 * int(entry[P_AT]), s + 8 * int(entry[S_AT])
    call_law(int(entry[ADDRESS]), own_p, own_s, io.ctypes.data)
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
        rows[k, i] = answer(entries[i], p, s, io, net / mass, ridden)
        total += rows[k, i]
    return total


@compiled(inline=True)
def stands(entries, first, last, p, s, io):
    """Whether the axis stands on any of the structure effects, which yield to its net force."""
    return answers(entries, first, last, p, s, io)[3] != 0.0


@compiled()
def along(entries, first, last, p, s, io, velocity, k, standing, rows):
    """Force (N) of structure effects along block k of a measured motion; their states advance.

    velocity (n,) m/s: means of blocks of DT s. standing: as ``stands`` says of them. A block is
    walked in steps short enough for a contact, with the acceleration a parabola that has the means
    of the blocks around it. rows (2, n_entries): the first receives the block's mean, the second is
    overwritten.
    """
    block, ended = io[DT], velocity.shape[0] - 1
    steps = int(np.ceil(block / LONGEST_STEP - 1e-9))
    now = slope(velocity, k, block)
    before, after = slope(velocity, max(k - 1, 0), block), slope(velocity, min(k + 1, ended), block)
    rise, bend = 0.5 * (after - before), 0.5 * (after - 2.0 * now + before)
    rows[0, first:last] = 0.0
    answered = (0.0, 0.0, 0.0, 0.0)
    if standing:  # the base is heavy and slow
        steps = 1
        answered = answers(entries, first, last, p, s, io)
    else:
        io[DT] = block / steps
    for j in range(steps):
        at = (j + 0.5) / steps - 0.5
        measured = now + rise * at + bend * (at * at + (1.0 / steps**2 - 1.0) / 12.0)
        net, ridden = 0.0, measured
        if standing:
            net, ridden = shared(answered, io[MOVED], measured)
        for i in range(first, last):
            rows[0, i] += answer(entries[i], p, s, io, net, ridden) / steps
    io[DT] = block


@compiled(inline=True)
def shared(answered, mass, measured):
    """NET and ACC (m/s^2) for a measured acceleration of the axis relative to its base."""
    pushed, riding, moved, yielding = answered
    free = mass - riding
    net = (free * (measured - moved / mass) - pushed) / (1.0 + free * yielding / mass**2)
    return net / mass, (net + pushed) / free


@compiled(inline=True)
def slope(values, k, dt):
    """Derivative of equally spaced means in the middle of number k, of fourth order inside."""
    last = values.shape[0] - 1
    if 2 <= k <= last - 2:
        near, far = values[k + 1] - values[k - 1], values[k + 2] - values[k - 2]
        return (8.0 * near - far) / (12.0 * dt)
    after, before = min(k + 1, last), max(k - 1, 0)
    return (values[after] - values[before]) / (max(after - before, 1) * dt)
