"""Draw the stage for README and site: python docs/pictures.py (needs EGL or OSMesa)."""

from __future__ import annotations

import os
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
from matplotlib import image

HERE = Path(__file__).parent
AT = (0.06, -0.05)  # m, where the axes stand
WIDTH, HEIGHT = 1200, 800  # pixels, the largest that the model allows
ROWS, COLUMNS = slice(130, 730), slice(90, 1090)  # what is kept

if __name__ == "__main__":
    model = mujoco.MjModel.from_xml_path(str(HERE.parent / "models" / "proton_xy.xml"))
    data = mujoco.MjData(model)
    data.qpos[:] = AT
    mujoco.mj_forward(model, data)
    with mujoco.Renderer(model, HEIGHT, WIDTH) as renderer:
        renderer.update_scene(data, camera="overview")
        image.imsave(
            HERE / "stage.jpg", renderer.render()[ROWS, COLUMNS], pil_kwargs={"quality": 88}
        )
