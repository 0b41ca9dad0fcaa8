"""Velocity maps of logs: the curve that a map asks for, its intervals, places of the track."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from identify.estimation.map_curve import LINE, NAMES, curve_through, speeds_of
from identify.estimation.stribeck_curve import StribeckCurve
from identify.estimation.velocity_map import VelocityMap
from identify.output.plain import plain
from identify.output.report.thesis import write_reproduction
from identify.output.reproduction import reproduction_json, reproduction_text
from identify.thesis.chapters import reproduce_on_logs
from identify.thesis.maps_of_logs import track_of_logs
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.experiments.kinds import Staircase
from twin.experiments.named import simulate
from twin.log.importers import import_log, load_mapping
from twin.model.file import load_model
from twin.simulator import ReducedSimulator

CURVE = StribeckCurve(0.285, 0.335, 0.01, 0.018)
SPEEDS = np.array([0.001, 0.002, 0.004, 0.007, 0.01, 0.015, 0.03, 0.1, 0.2, 0.3])
EXAMPLES = Path(__file__).parents[3] / "examples"


def one_way(speeds, noise: float, seed: int, repeats: int = 3) -> VelocityMap:
    rng = np.random.default_rng(seed)
    speed = np.repeat(speeds, repeats) * (1.0 + 1e-4 * rng.standard_normal(repeats * len(speeds)))
    friction = CURVE(speed) + noise * rng.standard_normal(len(speed))
    return VelocityMap(speed, friction, np.zeros_like(speed), np.full(len(speed), 100.0))


def test_the_intervals_of_a_curve_hold_the_truth_as_often_as_they_say() -> None:
    """90 % of them; 25 maps leave 79 to 99 % to chance at two standard errors."""
    true = {name: getattr(CURVE, name) for name in NAMES}
    held = []
    for seed in range(25):
        found = curve_through(one_way(SPEEDS, 1e-3, seed))
        held += [abs(found.values[n] - true[n]) <= found.half[n] for n in NAMES]
    assert 0.79 <= np.mean(held) <= 0.99


def test_few_fast_speeds_are_a_line_and_plateaus_at_one_speed_count_once() -> None:
    fast = one_way(np.array([0.1, 0.2, 0.3]), 1e-4, 1)
    assert [len(group) for group in speeds_of(fast)] == [3, 3, 3]
    found = curve_through(fast)
    assert tuple(found.half) == LINE
    assert found.values == pytest.approx({"Fc": 0.285, "sigma2": 0.018}, rel=0.05)
    with pytest.raises(InputError, match="3 plateaus at 1 speed in"):
        curve_through(one_way(np.array([0.1]), 1e-4, 1))


def test_friction_along_the_track_is_read_place_by_place(tmp_path: Path) -> None:
    stage = load_model("thesis_track", load_catalogue())
    speeds = (0.03, 0.06)
    logs = {
        f"{place} {speed}": simulate(
            stage, Staircase("x", speeds=(speed,) * 2, span=0.01, longest_plateau=1e4, at=(place,)),
            seed=1, simulator=ReducedSimulator,
        )
        for place in (-0.1, 0.1) for speed in speeds
    }  # fmt: skip
    done = reproduce_on_logs([], stage, logs)
    chapters = json.loads(json.dumps(plain(reproduction_json(done))))["chapters"]
    assert chapters["track"]["position"] == pytest.approx([-0.1, 0.1], abs=1e-3)
    low, high = (m["parameters"]["forwards"]["Fc"]["found"] for m in chapters["track"]["maps"])
    assert low > 1.05 * high  # as planted: the levels fall along the track
    assert "no stretch of the track in common" in done.left_out["cable"]
    assert "cable: left out" in reproduction_text(done)
    write_reproduction(tmp_path / "page.html", done)
    assert "on logs of a machine" in (tmp_path / "page.html").read_text()
    with pytest.raises(InputError, match="all logs are of one place"):
        track_of_logs(stage, dict(list(logs.items())[:2]))


def test_the_map_of_a_real_drive_shows_its_direction_dependent_viscosity(shared_data) -> None:
    """Published: Fv 166.7 and 240.4 N s/m, Fc 20.1 and 20.6 N (IDIM-LS by direction)."""
    mapping = load_mapping(EXAMPLES / "import_emps.toml")
    log = import_log(shared_data / "emps" / "DATA_EMPS.mat", mapping)
    model = load_model(EXAMPLES / "emps.toml", load_catalogue())
    done = reproduce_on_logs(["simulation"], model, {"run": log})
    curves = done.chapters["simulation"].curves
    assert curves[1.0].values == pytest.approx({"Fc": 20.1, "sigma2": 166.7}, rel=0.06)
    assert curves[-1.0].values == pytest.approx({"Fc": 20.6, "sigma2": 240.4}, rel=0.06)
    assert "sigma2 differs" in reproduction_text(done)
