"""A picture of the force that an effect adds: the fingerprint it leaves when it is missing."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.dataset.motion import Motion
from twin.effect import Effect
from twin.errors import InputError
from twin.files import write_atomically

Array = NDArray[np.float64]

FORMATS = ("png", "svg", "pdf")


def draw(effect: Effect, motion: Motion, force: Array, path: Path) -> None:
    """Write the picture of the effect's force (n,) N along a motion, over time, place and speed.

    Raises InputError for another ending than .png, .svg or .pdf.
    """
    import matplotlib

    kind = path.suffix.lstrip(".")
    if kind not in FORMATS:
        raise InputError(f"{path}: cannot draw '{path.suffix}'; end the name in .png, .svg or .pdf")

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(11.0, 3.6), sharey=True, layout="constrained")
    across = (
        (motion.time, "Time (s)"),
        (1e3 * motion.position, "Position (mm)"),
        (1e3 * motion.velocity, "Speed (mm/s)"),
    )
    for panel, (values, label) in zip(axes, across, strict=True):
        panel.plot(values, force, linewidth=0.8, color="#2b6cb0")
        panel.set_xlabel(label)
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("Added force (N)")
    figure.suptitle(f"{effect.name}: {effect.fingerprint}", fontsize=10)
    content = io.BytesIO()
    figure.savefig(content, format=kind, dpi=130)
    plt.close(figure)
    write_atomically(path, content.getvalue())
