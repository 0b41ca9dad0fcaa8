"""The inertia of a body as a MuJoCo file writes it."""

from __future__ import annotations

from twin.signals import Array


def inertial(mass: float, centre: Array, inertia: Array) -> str:
    """The element of a body of that mass kg, centre (3,) m and inertia (3, 3) kg m^2 about it."""
    full = [*inertia.diagonal(), *inertia[[0, 0, 1], [1, 2, 2]]]
    pos, fullinertia = (" ".join(f"{v:.6g}" for v in values) for values in (centre, full))
    return f'<inertial mass="{mass:.6g}" pos="{pos}" fullinertia="{fullinertia}"/>'
