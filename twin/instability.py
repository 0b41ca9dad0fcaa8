"""When a simulation has become unstable: at which sample, on which axis, by which effect."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.core.native import Table
from twin.errors import CannotRun
from twin.model.machine import MachineModel

Array = NDArray[np.float64]


def require_sound(
    signals: Array, forces: Array, model: MachineModel, table: Table, first: int = 0
) -> None:
    """Raise CannotRun where a signal is not finite, or huge; ``first``: number of sample 0.

    signals (n, n_axes, 4) and forces (n, n_entries) as in twin.simulator.Run.
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
            "raise sample_rate (Hz)"
        )
    own = [i for i, label in enumerate(table.labels) if label[0] == axis]
    named = ""
    if own:
        largest = max(own, key=lambda i: abs(forces[i]))
        named = f" (its largest force is that of {table.labels[largest][1]})"
    return (
        f"axis {axis}{named}; lower the bandwidth (Hz) or the damping parameters, or raise "
        "sample_rate (Hz)"
    )


def _bad(values: Array) -> NDArray[np.bool_]:
    huge = 1e10  # beyond it MuJoCo calls a state bad as well
    return ~(np.abs(values) <= huge)  # not (nan <= HUGE)
