"""`twin view`: the replay is what was logged and modelled, and page, video and viewer show it."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arms import ARM, COUPLED, JOINTS, MOTORS, SAMPLE, SUMS, arm_log, coupled_log
from axis_kinds import MACHINES, machine
from browser import Browser, browser
from cli_runs import RATE, in_small, process, refusal, twin

import identify
from identify.view.live import HOME, LEAP, LEFT, RIGHT, SPACE, UP, Player
from identify.view.page import write_page
from identify.view.replay import Replay, replay
from identify.view.stage import Stage
from identify.workflow import side_by_side_of
from twin import load_model, simulate
from twin.logs import AxisLog, Log, write_log
from twin.model.machine import AxisModel, MachineModel

BYTES = 3_000_000  # of a page
MESH = """<mujoco><asset><mesh name="m" vertex="{points}"/></asset><worldbody>
<body><joint name="x" type="slide" axis="1 0 0"/><geom type="mesh" mesh="m" mass="1"/></body>
<geom type="capsule" size="0.1 0.2" pos="0 1 0"/><geom type="ellipsoid" size="0.1 0.2 0.3"/>
</worldbody><actuator><motor name="motor_x" joint="x"/></actuator></mujoco>"""
PIXELS = """
const pixels = () => {
  const p = new Uint8Array(4 * canvas.width * canvas.height);
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, p);
  return p;
};
const apart = (a, b) => a.reduce((n, v, i) => n + (Math.abs(v - b[i]) > 8), 0);
"""


@pytest.fixture(scope="module")
def chrome(tmp_path_factory) -> Iterator[Browser]:
    with browser(tmp_path_factory.mktemp("browser")) as running:
        yield running


def found_in(chrome: Browser, page: Path, script: str) -> dict[str, Any]:
    """What a script puts into ``found`` in a page, which asks for nothing and has no errors."""
    chrome.open(page, 1000, 800)
    found: dict[str, Any] = chrome.run(f"const found = {{}}; {PIXELS} {script} return found;")
    assert not [e for e in chrome.errors if "ReadPixels" not in e]  # that is the script's
    assert [r for r in chrome.requests if r != "data:,"] == [page.resolve().as_uri()]
    return found


@pytest.fixture(scope="module")
def stage() -> MachineModel:
    return replace(load_model("proton_xy"), sample_rate=RATE)


@pytest.fixture(scope="module")
def lighter(stage) -> MachineModel:
    """A model that is wrong: it lacks the cable of x."""
    axis = stage.axes["x"].without("cable_slab")
    return stage.with_axis("x", axis)


@pytest.fixture(scope="module")
def log(stage) -> Log:
    return simulate(stage, "tracking", seed=4, duration=3.0)


@pytest.fixture
def folder(log, tmp_path) -> Path:
    write_log(log, tmp_path / "l.mcap")
    return tmp_path


@pytest.fixture(scope="module")
def shown(lighter, log) -> Replay:
    return replay(lighter, log, "log")


def test_it_shows_the_log_and_the_free_run_of_a_comparison(shown, lighter, log) -> None:
    topics = side_by_side_of(identify.compare(lighter, {"log": log})).topics
    for name, axis in shown.axes.items():
        at = round(shown.start * RATE) + (np.arange(len(shown)) * (RATE / 60.0)).astype(int)
        signals = log.axes[name].columns
        np.testing.assert_allclose(axis.measured, signals["position"][at], atol=1e-8)
        np.testing.assert_allclose(axis.setpoint, signals["setpoint_position"][at], atol=1e-12)
        left, off = (strip.range for strip in axis.strips)
        compared = topics[f"/residual/{name}"]
        assert np.nanmax(off) == pytest.approx(-compared["position"].min())
        assert np.nanmin(off) == pytest.approx(-compared["position"].max())
        assert left.max() == pytest.approx(compared["force"].max(), rel=0.02)
        assert np.nanmax(axis.modelled - axis.measured) <= np.nanmax(off)
        assert set(axis.forces) == set(lighter.axes[name].names)


def test_forces_of_the_effects_are_those_of_their_laws() -> None:
    plain = machine(MACHINES["linear"][0] + "[axes.x.effects.constant_force]\nF0 = 0.5\n")
    run = simulate(plain, "tracking", seed=1, duration=2.0)
    axis = replay(plain, run, "run").axes["x"]
    np.testing.assert_allclose(axis.forces["constant_force"], 0.5)
    velocity = np.gradient(axis.measured) * 60.0
    fast = np.abs(velocity) > 0.05
    friction = -np.sign(velocity) - 2.0 * velocity  # Fc = 1 N, sigma2 = 2 N s/m
    np.testing.assert_allclose(
        axis.forces["coulomb_viscous"][fast][1:-1], friction[fast][1:-1], atol=0.1
    )


def test_no_spike_is_lost_and_an_hour_is_3_mb(tmp_path) -> None:
    t = 0.01 * np.arange(360_000)
    wanted = np.sin(t)
    position = wanted.copy()
    position[77_777] += 0.5
    hour = Log(
        100.0, {a: AxisLog({"position": position, "setpoint_position": wanted}) for a in "xyz"}
    )
    shown = replay(None, hour, "hour")
    assert shown.axes["y"].strips[0].range.max() == pytest.approx(0.5)
    write_page(tmp_path / "hour.html", shown, 1.0, 1.0)
    assert 0.3 * BYTES < (tmp_path / "hour.html").stat().st_size < BYTES


def test_differences_are_drawn_so_large_that_they_are_seen(shown) -> None:
    for gain in (shown.gain, 2.0):
        stage, frame = Stage.of(shown), len(shown) // 2
        stage.pose(shown, frame, gain)
        axis = shown.axes["x"]
        at = stage.model.joint("x").qposadr[0]
        off = stage.ghost.qpos[at] - stage.data.qpos[at]
        assert off == pytest.approx(gain * (axis.modelled - axis.measured)[frame])
    drawn = shown.gain * np.nanmax(np.abs(axis.modelled - axis.measured)) / np.ptp(axis.measured)
    assert 0.02 < drawn < 0.5


def test_the_page_moves_in_a_browser(shown, chrome, tmp_path) -> None:
    write_page(tmp_path / "page.html", shown, shown.gain, 2.0)
    found = found_in(chrome, tmp_path / "page.html", """
    const scrub = (part) => {
      at("scrub").value = part;
      at("scrub").dispatchEvent(new Event("input"));
      return pixels();
    };
    const first = scrub(0.3), other = scrub(0.8);
    found.colours = new Set(new Uint32Array(first.buffer)).size;
    found.moved = apart(first, other);
    at("ghost").click();
    found.ghost = apart(other, pixels());
    found.hidden = state.ghost;
    const size = at("gain"); size.value = "1"; size.dispatchEvent(new Event("change"));
    found.gain = state.gain;
    found.cells = [...document.querySelectorAll("#panel td")].map((c) => c.textContent);
    found.time = state.time;
    found.strips = strips.length;
    const column = Math.round((chart.width * state.time) / duration);
    found.cursor = [...chart.getContext("2d").getImageData(column, 5, 1, 1).data];
    scrub(0);
    at("play").click();
    const end = performance.now() + 1e4;
    while (state.time === 0 && performance.now() < end) await frame();
    found.played = state.time;
    """)  # fmt: skip
    assert found["colours"] > 50
    assert found["moved"] > 500
    assert found["ghost"] > 100
    assert (found["hidden"], found["gain"], found["strips"]) == (False, 1, 4)
    frame = round(found["time"] * shown.rate)
    assert found["cells"][0] == f"{1e3 * shown.axes['x'].measured[frame]:.3f} mm".replace("-", "−")
    assert found["cursor"][3] == 255
    assert 0.0 < found["played"] <= (len(shown) - 1) / shown.rate


def jointed(text: str) -> Replay:
    """An arm's log beside the model of its file."""
    axes = {joint: AxisModel(0.0, rotary=True, joint=joint) for joint in JOINTS}
    model = MachineModel("arm", axes, 1.0 / SAMPLE, text, "arm.xml")
    return replay(model, arm_log(1, duration=2.0), "log")


def test_joints_stand_as_tendons_say() -> None:
    axes = {axis: AxisModel(0.0, rotary=True, joint=joint) for axis, joint in MOTORS.items()}
    log = coupled_log(1).part(0, 500)
    what = replay(MachineModel("arm", axes, 1.0 / SAMPLE, COUPLED, "arm.xml"), log, "log")
    stage, last = Stage.of(what), len(what) - 1
    stage.pose(what, last, 1.0)
    lengths = [what.axes[axis].measured[last] for axis in MOTORS]
    np.testing.assert_allclose(SUMS @ stage.data.qpos, lengths)


def test_an_arm_whose_shapes_are_not_there_is_drawn_as_rods() -> None:
    shapes = ARM.replace("<worldbody>", '<asset><mesh name="m" file="m.stl"/></asset><worldbody>')
    missing = shapes.replace("</body>", '<geom type="mesh" mesh="m"/></body>', 1)
    stages = [Stage.of(jointed(text)) for text in (ARM, missing)]
    for stage in stages:
        assert [int(n) for n in stage.model.body_geomnum[1:]] == [2, 2, 2]
    own = ARM.replace("</body>", '<geom size="0.1"/></body>', 1)
    assert Stage.of(jointed(own)).model.ngeom == 1


def of_kind(kind: str) -> Replay:
    """A short log beside its model: an arm, a machine of axes, or one drawn by a mesh."""
    if kind == "arm":
        return jointed(ARM)
    plain = machine(MACHINES["linear" if kind == "mesh" else kind][0])
    if kind == "mesh":
        points = np.random.default_rng(1).normal(size=(60, 3)).ravel()
        mjcf = MESH.format(points=" ".join(map(str, points)))
        plain = replace(plain, mjcf=mjcf, mjcf_name="mesh.xml")
    return replay(plain, simulate(plain, "tracking", seed=2, duration=1.5), "log")


@pytest.mark.parametrize("kind", ["mesh", "arm", *MACHINES])
def test_each_body_of_the_page_is_where_mujoco_has_it(kind, chrome, tmp_path) -> None:
    what = of_kind(kind)
    write_page(tmp_path / "page.html", what, 1.0, 1.0)
    found = found_in(chrome, tmp_path / "page.html", """
    seek(0.7 * duration);
    found.colours = new Set(new Uint32Array(pixels().buffer)).size;
    found.frame = Math.round(state.time * data.rate);
    found.geoms = data.geoms.map((g) => [...moved(placed(g.link, standing.measured), g.at)]);
    """)  # fmt: skip
    stage = Stage.of(what)
    stage.pose(what, found["frame"], 1.0)
    at = [
        p
        for p, rgba in zip(stage.data.geom_xpos, stage.model.geom_rgba, strict=True)
        if rgba[3] > 0
    ]
    np.testing.assert_allclose(found["geoms"], at, atol=2e-5)
    assert found["colours"] > 5


def test_the_command_writes_a_page_and_says_so(tmp_path) -> None:
    with in_small(duration=2.0):
        twin("simulate", "tracking", "-o", "l.mcap", folder=tmp_path)
        done = twin("view", "l.mcap", "proton_xy", "--html", "p.html", folder=tmp_path)
        alone = twin("view", "l.mcap", "--html", "q.html", "--json", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert re.match(r"p.html: 2 s of l.mcap, differences drawn \d+ times as large\n", done.stdout)
    assert "://" not in (tmp_path / "p.html").read_text(encoding="utf-8")
    found = json.loads(alone.stdout)
    assert (found["html"], found["axes"], found["duration_unit"]) == ("q.html", ["x", "y"], "s")


def test_what_cannot_be_shown_is_one_line(folder, monkeypatch) -> None:
    (folder / "z.toml").write_text(MACHINES["rotary"][0])
    for command, said in (
        ("--html p.html --speed 0", "--speed 0: must be above 0"),
        ("z.toml --html p.html", "has the axes x, y, the model c"),
        ("--html p.txt", ".html file"),
        ("--video l.mcap", "give another name"),
        ("--rerun r.html", "r.html: Rerun opens an .rrd file"),
    ):
        assert said in refusal("view", "l.mcap", *command.split(), folder=folder)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    if sys.platform == "linux":
        assert "no display" in refusal("view", "l.mcap", folder=folder)


def test_a_video_without_what_draws_is_one_line(folder, monkeypatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "pencil")
    done = process("view", "l.mcap", "--video", "v.mp4", folder=folder)
    assert done.returncode == 2
    *_, line = done.stderr.splitlines()  # slow, it says before what it does
    assert re.fullmatch(r"twin: --video (draws with pencil|needs ffmpeg), .*", line)
    assert not (folder / "v.mp4").exists()


def test_a_video_has_pictures_that_differ(folder) -> None:
    command = ("view", "l.mcap", "proton_xy", "--video", "v.mp4", "--speed", 30)
    done = process(*command, folder=folder)
    if done.returncode == 2 and ("needs ffmpeg" in done.stderr or "draws with" in done.stderr):
        pytest.skip(done.stderr)
    assert done.returncode == 0, done.stderr
    assert b"ftyp" in (folder / "v.mp4").read_bytes()[:16]
    encoder = shutil.which("ffmpeg") or pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    raw = subprocess.run(
        [encoder, "-loglevel", "error", "-i", folder / "v.mp4", "-f", "rawvideo", "-pix_fmt",
         "gray", "-"],
        capture_output=True, check=True,
    ).stdout  # fmt: skip
    pictures = np.frombuffer(raw, np.uint8).reshape(-1, 1000, 1280)
    assert len(pictures) == 3
    assert all(picture[:720].std() > 10 for picture in pictures)
    assert np.abs(np.diff(pictures[:, :720].astype(int), axis=0)).max() > 50


def test_a_recording_without_rerun_is_one_line(folder, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    monkeypatch.delitem(sys.modules, "identify.view.rerun", raising=False)
    said = refusal("view", "l.mcap", "--rerun", "r.rrd", folder=folder)
    assert said.startswith("twin: --rerun needs rerun-sdk, which is not here; pip install")


def test_the_setpoint_of_an_axis_that_turns_is_marked_over_its_hand() -> None:
    stage = Stage.of(of_kind("rotary"))
    for body, place in stage.marks.values():
        first = stage.model.body_geomadr[body]
        own = range(first, first + stage.model.body_geomnum[body])
        hand = min(own, key=lambda i: stage.model.geom_aabb[i][3:].prod())
        assert place[:2] @ stage.model.geom_pos[hand][:2] > 0.0


@pytest.mark.parametrize("kind", ["mesh", "arm", "rotary", "log alone"])
def test_a_recording_of_rerun_holds_the_replay(kind, log, tmp_path) -> None:
    pytest.importorskip("rerun", reason="rerun-sdk is not installed (extra rerun)")
    from rerun.chunk import RrdReader

    from identify.view.rerun import write_recording

    what = replay(None, log, "log") if kind == "log alone" else of_kind(kind)
    write_recording(tmp_path / "r.rrd", what, 3.0, 1.0)
    parts = {p.entity_path: p for p in RrdReader(tmp_path / "r.rrd").stream() if not p.is_static}

    def column(path: str, name: str) -> np.ndarray:
        values = parts[path].to_record_batch().column(name)
        return np.array((values.cast("int64") if name == "time" else values).to_pylist())

    stage, frame = Stage.of(what), len(what) // 2
    stage.pose(what, frame, 3.0)
    machines = {"measured": stage.data} | ({"modelled": stage.ghost} if what.horizon else {})
    assert {path.split("/")[2] for path in parts if path.startswith("/machine/")} >= set(machines)
    for name, data in machines.items():
        for body in np.flatnonzero(stage.model.body_weldid):
            path = f"/machine/{name}/" + (stage.model.body(body).name or rf"body\ {body}")
            time, places = column(path, "time"), column(path, "Transform3D:translation")
            turned = column(path, "Transform3D:quaternion")[frame, 0]
            np.testing.assert_allclose(
                1e-9 * time, what.start + np.arange(len(what)) / what.rate, atol=1e-8
            )
            np.testing.assert_allclose(places[frame, 0], data.xpos[body], atol=1e-6)
            np.testing.assert_allclose(np.roll(turned, 1), data.xquat[body], atol=1e-6)
    for axis, own in what.axes.items():
        label = rf"{own.units.words('position')}\ \({own.units.position}\)"
        values = column(f"/signals/{axis}/{label}/measured", "Scalars:scalars")
        np.testing.assert_array_equal(values[:, 0], own.measured)
        effects = [p for p in parts if p.startswith(f"/signals/{axis}/") and r"\ effect\ " in p]
        assert {path.split("/")[-1] for path in effects} == set(own.forces)


def test_keys_move_the_replay() -> None:
    player = Player(duration=3.0, speed=1.0)
    for key, name, wanted in (
        (RIGHT, "time", LEAP), (RIGHT, "time", 2 * LEAP), (LEFT, "time", LEAP),
        (HOME, "time", 0.0), (UP, "speed", 2.0), (ord("G"), "ghost", False),
    ):  # fmt: skip
        player.press(key)
        assert getattr(player, name) == wanted
    player.go(100.0)
    assert player.time == 3.0
    player.press(SPACE)
    assert (player.playing, player.time) == (False, 0.0)
