"""A replay as a video, drawn without a display: the machine, the forces, and the strips below."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from identify.view.panel import WIDE, Pixels, at_time, panel, strips
from identify.view.replay import Replay
from twin.errors import InputError
from twin.files import write_atomically
from twin.progress import Progress

WIDTH, HEIGHT, BELOW = 1280, 720, 280  # pixels, even: of the machine, of the strips


def write_video(path: Path, replay: Replay, gain: float, speed: float, progress: Progress) -> None:
    """Write the replay as MP4; speed: 1 is real time. Raises InputError."""
    rate = 30.0  # frames a second of the video
    encoder, every = _encoder(), replay.rate * speed / rate
    count = max(int(len(replay) / every), 1)
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "made.mp4"
        with open(Path(folder) / "said", "w+b") as said:
            drawn = pictures(replay, gain, [int(i * every) for i in range(count)])
            tall, wide, _ = next(drawn).shape  # the first is drawn twice
            command: list[str | Path] = [
                encoder, "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s",
                f"{wide}x{tall}", "-r", f"{rate:g}", "-i", "-", "-pix_fmt", "yuv420p", made,
            ]  # fmt: skip
            with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=said) as running:
                assert running.stdin is not None
                with suppress(BrokenPipeError):
                    for i, picture in enumerate(drawn):
                        progress("drawing", i, count)
                        running.stdin.write(picture.tobytes())
                    running.stdin.close()
            said.seek(0)
            if running.returncode:
                reason = said.read().decode(errors="replace")[-200:]
                raise InputError(f"{path}: ffmpeg cannot make it: {reason}")
        write_atomically(path, made.read_bytes())


def pictures(replay: Replay, gain: float, frames: Sequence[int]) -> Iterator[Pixels]:
    """Pictures of some frames, the first of them twice. Raises InputError where nothing draws."""
    if os.environ.get("MUJOCO_GL", "disable") == "disable":  # read once, as MuJoCo is imported
        os.environ["MUJOCO_GL"] = "egl"
    try:
        import mujoco
    except Exception as error:  # each library for drawing has errors of its own
        raise _nothing_draws() from error
    from identify.view.stage import Stage

    stage, below = Stage.of(replay), strips(replay, WIDTH, BELOW)
    try:
        renderer = mujoco.Renderer(stage.model, HEIGHT, WIDTH)
    except Exception as error:
        raise _nothing_draws() from error
    with renderer:
        for frame in [*frames[:1], *frames]:
            stage.pose(replay, frame, gain)
            renderer.update_scene(stage.data, 0 if stage.model.ncam else -1)
            stage.draw_others(replay, frame, renderer.scene)
            picture, beside = renderer.render().copy(), panel(replay, frame, gain)
            picture[: len(beside), :WIDE] = beside[:HEIGHT]
            yield np.concatenate([picture, at_time(below, frame / len(replay))])


def _nothing_draws() -> InputError:
    return InputError(
        f"--video draws with {os.environ['MUJOCO_GL']}, which does not work here; install EGL "
        "(libegl1) or OSMesa (libosmesa6, and set MUJOCO_GL=osmesa), or give --html"
    )


def _encoder() -> str:
    """The program that makes MP4; raises InputError where there is none."""
    if found := shutil.which("ffmpeg"):
        return found
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    except (ImportError, RuntimeError) as error:
        raise InputError(
            "--video needs ffmpeg, which is not here; pip install 'proton-twin[view]', or give "
            "--html"
        ) from error
