"""A replay in MuJoCo's own viewer, on a display."""

from __future__ import annotations

import time
from dataclasses import dataclass

import mujoco
import numpy as np

from identify.view.replay import Replay
from identify.view.stage import Stage
from identify.view.video import at_time, panel, strips
from twin.errors import InputError

SPACE, RIGHT, LEFT, DOWN, UP, HOME = 32, 262, 263, 264, 265, 268  # keys, as the viewer numbers them
LEAP = 0.5  # s, of the arrow keys
KEYS = "space\nleft, right\nup, down\nhome\nG"
DO = "pause\n0.5 s back, on\nspeed {speed:g} x\nbeginning\nmodel"


@dataclass
class Player:
    """Where the replay is, s; keys move it. speed: 1 is real time; ghost: the model is shown."""

    duration: float
    speed: float
    time: float = 0.0
    playing: bool = True
    ghost: bool = True

    def press(self, key: int) -> None:
        """Do what a key asks for."""
        if key == SPACE:
            self.playing = not self.playing
            self.time %= self.duration  # from the end it begins anew
        elif key in (LEFT, RIGHT):
            self.go(LEAP if key == RIGHT else -LEAP)
        elif key in (UP, DOWN):
            self.speed *= 2.0 if key == UP else 0.5
        elif key == HOME:
            self.time = 0.0
        elif key == ord("G"):
            self.ghost = not self.ghost

    def go(self, seconds: float) -> None:
        """Move by some seconds of the log, not beyond its ends."""
        self.time = min(max(self.time + seconds, 0.0), self.duration)


def show(replay: Replay, gain: float, speed: float) -> None:
    """Play until the window is closed. Raises InputError where there is no display."""
    stage, player = Stage.of(replay), Player((len(replay) - 1) / replay.rate, speed)
    _require_display()
    import mujoco.viewer

    window = mujoco.viewer.launch_passive(
        stage.model, stage.data, key_callback=player.press, show_left_ui=False, show_right_ui=False
    )
    with window:
        _look(stage, window.cam)
        below, size, before = strips(replay, 100, 100), (0, 0), time.monotonic()
        while window.is_running():
            now = time.monotonic()
            player.go((now - before) * player.speed * player.playing)
            before, frame = now, round(player.time * replay.rate)
            with window.lock():
                stage.pose(replay, frame, gain)
                window.user_scn.ngeom = 0
                stage.draw_others(replay, frame, window.user_scn, player.ghost)
            wide, tall = window.viewport.width, window.viewport.height
            if (wide, tall) != size:
                size = wide, tall
                # of the window's height
                below = strips(replay, max(wide, 100), max(int(0.3 * tall), 100))
            beside, marked = panel(replay, frame, gain), at_time(below, frame / len(replay))
            window.set_images([
                (mujoco.MjrRect(0, bottom, picture.shape[1], len(picture)), picture)
                for bottom, picture in ((0, marked), (tall - len(beside), beside))
            ])  # fmt: skip
            corner = mujoco.mjtGridPos.mjGRID_TOPRIGHT
            window.set_texts((None, corner, KEYS, DO.format(speed=player.speed)))
            window.sync()
            time.sleep(1.0 / replay.rate)


def _look(stage: Stage, camera: mujoco.MjvCamera) -> None:
    """Look from where the first camera of the model stands, free to go around."""
    mujoco.mjv_defaultFreeCamera(stage.model, camera)
    lower = 0.15  # of the machine
    camera.lookat[2] -= lower * stage.model.stat.extent  # the strips hide what is below
    if stage.model.ncam:
        mujoco.mj_camlight(stage.model, stage.data)
        away = stage.data.cam_xpos[0] - camera.lookat
        camera.distance = np.linalg.norm(away)
        camera.azimuth = np.degrees(np.arctan2(-away[1], -away[0]))
        camera.elevation = -np.degrees(np.arcsin(away[2] / camera.distance))


def _require_display() -> None:
    """Raise InputError where there is none: the viewer would wait for one."""
    import warnings

    import glfw

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it says so in a warning of its own
        if not glfw.init():
            raise InputError(
                "there is no display for MuJoCo's viewer; give --html FILE for a page that any "
                "browser shows, or --video FILE"
            )
