"""A replay as one HTML file that needs nothing else: shapes and signals inside, drawn by WebGL."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from numpy.typing import ArrayLike

from identify.output.numbers import packed
from identify.view.replay import AxisReplay, Replay
from identify.view.stage import Stage, camera, shapes
from twin.files import write_atomically
from twin.signals import Array

STEPS = 32_767  # of a signal on either side of its middle; -32768 stands for none


def write_page(path: Path, replay: Replay, gain: float, speed: float) -> None:
    """Write the page; gain: by how much differences are drawn larger; speed: 1 is real time."""
    environment = Environment(
        loader=PackageLoader("identify.view", "."), autoescape=True, undefined=StrictUndefined
    )
    text = environment.get_template("page.html.j2").render(
        title=replay.title,
        notes=replay.notes,
        data={
            "gain": gain, "speed": speed, "horizon": replay.horizon, "start": replay.start,
            "log": replay.log, "rate": replay.rate, "frames": len(replay),
            "axes": [_axis(name, axis) for name, axis in replay.axes.items()],
            **_scene(Stage.of(replay), replay),
        },
        version=importlib.metadata.version("proton-twin"),
    )  # fmt: skip
    write_atomically(path, text.encode("utf-8"))


def _axis(name: str, axis: AxisReplay) -> dict[str, Any]:
    return {
        "name": name,
        "unit": axis.units.position,
        "force": axis.units.force,
        "bars": axis.units.words("Force of each effect"),
        "measured": packed(axis.measured, "<f4"),
        "setpoint": _packed(axis.setpoint - axis.measured),
        "modelled": _packed(axis.modelled - axis.measured),
        "forces": [{"name": n, "values": _packed(f)} for n, f in axis.forces.items()],
        "strips": [
            {"label": s.label, "unit": s.unit, "low": _packed(s.range[0]),
             "high": _packed(s.range[1])}
            for s in axis.strips
        ],
    }  # fmt: skip


def _packed(signal: Array) -> dict[str, Any]:
    """A signal in 16 bits a value."""
    known = signal[np.isfinite(signal)]
    low, high = (known.min(), known.max()) if len(known) else (0.0, 0.0)
    middle, size = 0.5 * (low + high), max((high - low) / (2 * STEPS), 1e-300)
    steps = np.full(len(signal), -STEPS - 1)
    steps[np.isfinite(signal)] = np.rint((known - middle) / size)
    return {"middle": float(middle), "size": float(size), "steps": packed(steps)}


def _scene(stage: Stage, replay: Replay) -> dict[str, Any]:
    """Shapes where they stand at rest, the joints that move them, camera and marks."""
    model, data = stage.model, mujoco.MjData(stage.model)
    mujoco.mj_forward(model, data)
    numbers = {axis: i for i, axis in enumerate(replay.axes)}
    moves = {
        joint: ([[numbers[axis], ratio] for axis, ratio in ratios.items()], begin)
        for joint, (ratios, begin) in stage.moves.items()
    }
    chains = [_chain(model, data, body, moves) for body in range(model.nbody)]
    links = [chain for i, chain in enumerate(chains) if chain not in chains[:i]]
    link_of = [links.index(chain) for chain in chains]
    meshes: dict[int, int] = {}
    geoms = []
    for i, shape, rgba in shapes(model):
        geom = {
            "shape": shape, "size": _short(model.geom_size[i]), "at": _short(data.geom_xpos[i]),
            "turned": _short(data.geom_xmat[i]), "rgb": _short(rgba[:3]),
            "link": link_of[model.geom_bodyid[i]],
        }  # fmt: skip
        if shape == "mesh":
            geom["mesh"] = meshes.setdefault(int(model.geom_dataid[i]), len(meshes))
        geoms.append(geom)
    marks = [
        {"axis": i, "link": link_of[body],
         "at": _short(data.xpos[body] + data.xmat[body].reshape(3, 3) @ place)}
        for i, (axis, (body, place)) in enumerate(stage.marks.items())
        if np.isfinite(replay.axes[axis].setpoint).any()
    ]  # fmt: skip
    eye, fovy = camera(model, data)
    of_meshes = 900_000  # bytes, so that the page has 3 MB at most: see identify.view.replay
    share = of_meshes // max(len(meshes), 1)
    return {
        "links": links, "geoms": geoms, "marks": marks,
        "meshes": [_mesh(model, m, share) for m in meshes],
        "extent": float(model.stat.extent), "centre": _short(model.stat.center),
        "eye": _short(eye), "fovy": fovy,
    }  # fmt: skip


def _chain(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    body: int,
    moves: Mapping[int, tuple[list[list[float]], float]],
) -> list[dict[str, Any]]:
    """The axes that move a body, from the world on."""
    chain = [] if body == 0 else _chain(model, data, int(model.body_parentid[body]), moves)
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    return chain + [
        {
            "axes": moves[j][0],
            "hinge": bool(model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE),
            "along": _short(data.xaxis[j]),
            "through": _short(data.xanchor[j]),
            "zero": float(model.qpos0[model.jnt_qposadr[j]]) - moves[j][1],
        }
        for j in range(first, first + count)
        if j in moves
    ]


def _mesh(model: mujoco.MjModel, mesh: int, most: int) -> dict[str, Any]:
    """A mesh with its vertices on a grid, as fine as its share of bytes allows."""
    places = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
    corners = model.mesh_face[model.mesh_faceadr[mesh] :][: model.mesh_facenum[mesh]]
    low = places.min(axis=0)
    for cells, grid, faces in _coarser(places - low, corners):
        size = float(np.ptp(places, axis=0).max()) / cells
        if (len(grid) * 6 + len(faces) * 12) * 4 / 3 <= most:
            break
    return {
        "low": _short(low), "size": size, "grid": packed(grid, "<u2"),
        "faces": packed(faces, "<u4"),
    }  # fmt: skip


def _coarser(places: Array, corners: Any) -> Iterator[tuple[int, Any, Any]]:
    """Cells, vertices as cells of a grid and faces, ever fewer, none without an area."""
    longest = float(np.ptp(places, axis=0).max()) or 1.0
    # of a mesh along its longest side, until it fits
    for cells in (65_535, 512, 256, 128, 64, 32, 16, 8):
        near = np.rint(places * (cells / longest)).astype(np.int64)
        grid, index = np.unique(near, axis=0, return_inverse=True)
        faces = index.reshape(-1)[corners]
        flat = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
        yield cells, grid, faces[~flat]


def _short(values: ArrayLike) -> list[float]:
    return [float(f"{v:.6g}") for v in np.ravel(np.asarray(values, dtype=float))]
