"""A replay as a video, drawn without a display: the machine, the forces, and the strips below.

The viewer shows the same numbers, forces and strips beside the machine.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont
from PIL import Image, ImageDraw, ImageFont

from identify.output.numbers import DisplayUnit, quantity
from identify.view.replay import Replay
from twin.errors import InputError
from twin.files import write_atomically
from twin.installed import pip_install
from twin.parallel import Progress

Pixels = np.ndarray[Any, np.dtype[np.uint8]]

INK, SOFT, BAR, PAPER = (27, 42, 56), (91, 104, 117), (47, 109, 179), (255, 255, 255)
WIDE, LINE = 330, 19  # pixels: of the panel, of a line in it


def panel(replay: Replay, frame: int, gain: float) -> Pixels:
    """Time, and of each axis the differences to what was measured and the force of each effect."""
    zero, reach = 195, 45  # pixels: where the bars begin, and how far they go
    font = ImageFont.truetype(findfont("DejaVu Sans"), 13)  # it has µ and comes with matplotlib
    lines = sum(4 + len(axis.forces) for axis in replay.axes.values())
    image = Image.new("RGB", (WIDE, LINE * (lines + 2) + 12), PAPER)
    draw = ImageDraw.Draw(image)
    at = iter(range(6, image.height, LINE))

    def line(name: str, value: str) -> int:
        top = next(at)
        draw.text((10, top), name, SOFT, font)
        draw.text((WIDE - 10, top), value, INK, font, anchor="ra")
        return top

    line("time", f"{replay.start + frame / replay.rate:.2f} s")
    line("differences drawn", "true size" if gain == 1.0 else f"{gain:,.0f} times as large")
    for name, axis in replay.axes.items():
        line("", "")
        here = axis.measured[frame]
        line(f"{name} measured", f"{1e3 * here:.3f} m{axis.units.position}")
        for word, other in (("model", axis.modelled[frame]), ("setpoint", axis.setpoint[frame])):
            off = quantity(other - here, axis.units.position)
            line(f"{word} - measured", off)
        largest = max((np.abs(f).max() for f in axis.forces.values()), default=0.0) or 1.0
        for effect, force in axis.forces.items():
            top = line(effect, quantity(force[frame], axis.units.force))
            end = zero + reach * force[frame] / largest
            draw.rectangle((min(zero, end), top + 3, max(zero, end), top + 13), BAR)
    return np.asarray(image)


def strips(replay: Replay, wide: int, tall: int) -> Pixels:
    """The strips of all axes over the whole time, as so many pixels."""
    named = [(name, strip) for name, axis in replay.axes.items() for strip in axis.strips]
    figure = Figure(figsize=(wide / 100, tall / 100), dpi=100)
    for i, (name, strip) in enumerate(named):
        axes = figure.add_axes((0.0, 1.0 - (i + 1) / len(named), 1.0, 0.72 / len(named)))
        scale = DisplayUnit.of(strip.unit, strip.range)
        low, high = scale(strip.range)
        axes.fill_between(np.arange(len(low)), low, high, color="#b4541a", lw=0.8)
        axes.set_xlim(0, len(low) - 1)
        axes.axis("off")
        most = np.nanmax(np.abs([low, high]), initial=0.0)
        label = f"{name}: {strip.label}, up to {most:.3g} {scale.unit}"
        size = min(9, 20 * tall / 100 / len(named))
        axes.text(0.005, 1.02, label, transform=axes.transAxes, fontsize=size)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def at_time(drawn: Pixels, part: float) -> Pixels:
    """Strips with a line at a part of the time."""
    marked, column = drawn.copy(), int(part * drawn.shape[1])
    marked[:, column : column + 2] = INK
    return marked


# --- the video ------------------------------------------------------------------------------------

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
            f"--video needs ffmpeg, which is not here; {pip_install('view')}, or give --html"
        ) from error
