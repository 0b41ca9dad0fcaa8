"""Draw the stage and a replay for the site: python docs/pictures.py (needs EGL or OSMesa)."""

from __future__ import annotations

import os
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
import numpy as np
from matplotlib import image

from identify.view.replay import replay
from identify.view.video import pictures
from twin import load_model, simulate

HERE = Path(__file__).parent
AT = (0.06, -0.05)  # m, where the axes stand
WIDTH, HEIGHT = 1200, 800  # pixels, the largest that the model allows
ROWS, COLUMNS = slice(130, 730), slice(90, 1090)  # what is kept
QUALITY = {"quality": 88}


def replayed() -> None:
    """A frame of `twin view` with a model that lacks the cables, where they pull most."""
    machine = model = load_model("proton_xy")
    for name, axis in machine.axes.items():
        model = model.with_axis(name, axis.without("cable_slab"))
    shown = replay(model, simulate(machine, "tracking", seed=4, duration=12.0), "tracking.mcap")
    axis = shown.axes["x"]
    frame = int(np.nanargmax(np.abs(axis.modelled - axis.measured)))
    image.imsave(HERE / "view.jpg", next(pictures(shown, shown.gain, [frame])), pil_kwargs=QUALITY)


if __name__ == "__main__":
    model = mujoco.MjModel.from_xml_path(str(HERE.parent / "models" / "proton_xy.xml"))
    data = mujoco.MjData(model)
    data.qpos[:] = AT
    mujoco.mj_forward(model, data)
    with mujoco.Renderer(model, HEIGHT, WIDTH) as renderer:
        renderer.update_scene(data, camera="overview")
        image.imsave(HERE / "stage.jpg", renderer.render()[ROWS, COLUMNS], pil_kwargs=QUALITY)
    replayed()
