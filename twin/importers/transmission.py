"""Signals of motors brought to the joints that they drive through gears, which may be coupled.

    [axes.wrist]
    gear = {elbow = 32.0, wrist = 32.0}     # the wrist's motor turns with both joints

A motor turns by R q, with q the joints' positions and R a row of gear ratios for each motor; as no
power is lost in it, the forces at the joints are R^T times those of the motors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from twin.errors import InputError
from twin.logs.log import Array, AxisLog

Gears = Mapping[str, Mapping[str, float]]  # motor (named as its axis) -> joint -> ratio
FORCES = ("current", "force")


def at_joints(axes: Mapping[str, AxisLog], gears: Gears) -> dict[str, AxisLog]:
    """The axes with their motors' signals brought to the joints; gears: of those that have some.

    Raises InputError where the ratios cannot be inverted, and where a signal is there of one of two
    coupled axes alone.
    """
    if not gears:
        return dict(axes)
    names = list(axes)
    ratios = np.eye(len(names))
    for motor, row in gears.items():
        unknown = [joint for joint in row if joint not in axes]
        if unknown:
            raise InputError(
                f"axes.{motor}.gear: the map has no axis '{unknown[0]}'; it has {', '.join(names)}"
            )
        ratios[names.index(motor)] = [row.get(joint, 0.0) for joint in names]
    if abs(np.linalg.det(ratios / np.abs(ratios).max(axis=1, keepdims=True))) < 1e-9:
        raise InputError(
            "gear: the motors of the map do not tell all joints, as their ratios depend on each "
            "other; give each motor its own joint"
        )
    driven = {}
    for name, axis in axes.items():  # the force in the place of the current: forces are added
        columns = {f: c for f, c in axis.columns.items() if f not in FORCES}
        columns["force"] = axis.force
        driven[name] = replace(axis, columns=columns, force_constant=None)
    out: dict[str, dict[str, Array]] = {name: {} for name in names}
    for field in dict.fromkeys(f for axis in driven.values() for f in axis.columns):
        matrix = ratios.T if field in FORCES else np.linalg.inv(ratios)
        for i, name in enumerate(names):
            if field in driven[name].columns:
                out[name][field] = _sum(field, matrix[i], driven)
    return {name: replace(driven[name], columns=columns) for name, columns in out.items()}


def _sum(field: str, row: Array, axes: Mapping[str, AxisLog]) -> Array:
    parts = []
    for factor, (name, axis) in zip(row, axes.items(), strict=True):
        if abs(factor) > 1e-12 * np.abs(row).max():
            if field not in axis.columns:
                raise InputError(
                    f"axes.{name}: has no {field}, but is coupled by a gear to an axis that has; "
                    "map it, or leave it out of both"
                )
            parts.append(factor * axis.columns[field])
    return np.asarray(sum(parts))
