"""The force that an effect adds along an exemplary motion: its fingerprint."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.dataset.motion import Motion
from identify.dataset.prepared_log import total_force
from identify.experiment_design.planting import strength_for
from twin.effect import Effect, Kind
from twin.effects import Catalogue
from twin.model.machine import AxisModel, Fitted, axis_table
from twin.signals import rate

Array = NDArray[np.float64]

PERIOD = 1e-3  # s
REACH = 0.15  # m
FORCE = 0.1  # N RMS of the drawn effect
MASS = 10.0  # kg
VISCOUS = "sigma2"  # viscous friction, N s/m, of every friction of the catalogue


def exemplary_motion() -> Motion:
    """Passes over the travel in both directions, ever slower, with the command for 10 kg."""
    parts = []
    for half in (1.5, 3.0, 6.0):  # s for one way
        t = np.arange(0.0, 2.0 * half, PERIOD)
        parts.append(-REACH * np.cos(np.pi * t / half))
    position = np.concatenate(parts)
    velocity = rate(position, PERIOD)
    command = MASS * rate(velocity, PERIOD) + 0.3 * np.sign(velocity)
    others = np.zeros((3, len(position)))
    others[0] = 0.5 * np.roll(position, len(position) // 7)
    others[1] = rate(others[0], PERIOD)
    others[2] = rate(others[1], PERIOD)
    return Motion(
        name="exemplary", axis="x", signals=np.stack([position, velocity, command]), others=others,
        period=PERIOD, start=0.0, sample_period=PERIOD, position_noise=0.0,
        raw=np.stack([velocity, command]),
    )  # fmt: skip


def signature(effect: Effect, catalogue: Catalogue) -> tuple[Motion, Array]:
    """The exemplary motion, and the force (n,) N that the effect adds along it."""
    motion = exemplary_motion()
    axis = AxisModel(MASS)
    if effect.kind is not Kind.FRICTION:
        friction = next(e for e in catalogue.values() if e.kind is Kind.FRICTION)
        axis = axis.with_effect(Fitted.at_start(friction, {VISCOUS: 0.5}))
    base = total_force(axis_table({motion.axis: axis}), motion)

    def added(fitted: Fitted) -> Array:
        return total_force(axis_table({motion.axis: axis.with_effect(fitted)}), motion) - base

    if effect.kind is Kind.FRICTION:
        return motion, added(Fitted.at_start(effect))
    return motion, added(strength_for(effect, added, FORCE))
