"""Maps of logs: each direction's curve, places of the track, the axis that is meant."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import identify
from identify.analysis.friction_curve import StribeckCurve
from identify.analysis.velocity_map import VelocityMap
from identify.dataset.motion import motion_of
from identify.dataset.preparation import datasets
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.experiments.kinds import Reversals, Staircase
from twin.experiments.named import simulate
from twin.importers import import_log, load_mapping
from twin.logs import Log
from twin.model.file import load_model
from twin.model.machine import Fitted, MachineModel
from twin.simulator import ReducedSimulator

EXAMPLES = Path(__file__).parents[3] / "examples"
CATALOGUE = load_catalogue()
LOCAL = Fitted.at_start(CATALOGUE["position_dependent_friction"], {"c1": 0.06})
STAGE = load_model("proton_xy", CATALOGUE)
ONE = MachineModel("slide", {"x": STAGE.axes["x"].with_effect(LOCAL)}, 1000.0)
SLIDE = MachineModel("slide", {"x": STAGE.axes["x"]}, 2000.0)
CURVE = StribeckCurve(0.285, 0.335, 0.01, 0.018)


def moves(place: float) -> dict[str, Log]:
    """A log of moves to and fro at each of two speeds."""
    return {
        f"{place} {speed}": simulate(
            ONE, Staircase("x", speeds=(speed,) * 2, span=0.01, longest_plateau=1e4, at=(place,)),
            seed=1, simulator=ReducedSimulator,
        )
        for speed in (0.03, 0.06)
    }  # fmt: skip


@pytest.fixture(scope="module")
def logs() -> dict[str, Log]:
    return {**moves(0.102), **moves(-0.102)}


def test_friction_along_the_track_is_read_place_by_place(logs) -> None:
    found = identify.along_track(ONE, logs)
    assert [m.position for m in found] == pytest.approx([-0.102, 0.102], abs=1e-3)
    low, high = (m.curves[1.0].values["Fc"] for m in found)
    assert low > 1.05 * high  # as planted: the level falls along the track
    assert [len(m.map) for m in found] == [8, 8]
    with pytest.raises(InputError, match=r"all logs are of one place.*friction_map"):
        identify.along_track(ONE, dict(list(logs.items())[:2]))


def test_a_map_has_a_curve_each_way_and_the_mean_of_both(logs) -> None:
    found = identify.friction_map(ONE, dict(list(logs.items())[:2]), axis="x")
    ahead, back = (found.curves[way].values for way in (1.0, -1.0))
    assert found.both["Fc"] == pytest.approx(0.5 * (ahead["Fc"] + back["Fc"]))
    assert found.differing == []  # the machine's friction does not know the direction
    assert "8 plateaus" in repr(found)
    assert found.units.velocity == "m/s"


def test_the_axis_must_be_one_that_moves(logs) -> None:
    with pytest.raises(InputError, match="axis z does not move in the logs; there moves x"):
        identify.friction_map(ONE, logs, axis="z")
    both = simulate(STAGE, "tracking", seed=1, duration=2.0, simulator=ReducedSimulator)
    assert len(datasets(STAGE, {"run": both}, {})) == 2
    with pytest.raises(InputError, match="x, y move in the logs; give the axis"):
        identify.velocity_map(STAGE, {"run": both})


def test_the_map_of_a_real_drive_shows_its_direction_dependent_viscosity(shared_data) -> None:
    """Published: Fv 166.7 and 240.4 N s/m, Fc 20.1 and 20.6 N (IDIM-LS by direction)."""
    mapping = load_mapping(EXAMPLES / "import_emps.toml")
    log = import_log(shared_data / "emps" / "DATA_EMPS.mat", mapping)
    model = load_model(EXAMPLES / "emps.toml", CATALOGUE)
    found = identify.friction_map(model, {"run": log})
    assert found.curves[1.0].values == pytest.approx({"Fc": 20.1, "sigma2": 166.7}, rel=0.06)
    assert found.curves[-1.0].values == pytest.approx({"Fc": 20.6, "sigma2": 240.4}, rel=0.06)
    assert "sigma2" in found.differing


def test_friction_of_a_machine_with_a_cable_lies_on_its_curve() -> None:
    """Between two rollers; the cable's force is taken off, so both directions are alike."""
    speeds = (0.004, 0.02)
    log = simulate(
        SLIDE, Staircase("x", speeds=speeds, span=0.024, at=(0.023,)), simulator=ReducedSimulator
    )
    found = VelocityMap.of(SLIDE.axes["x"], motion_of(log, "x", "log"))
    assert np.sign(found.velocity).tolist() == [1.0, -1.0, 1.0, -1.0]
    assert np.abs(found.velocity) == pytest.approx(np.repeat(speeds, 2), rel=1e-3)
    assert found.friction == pytest.approx(CURVE(np.abs(found.velocity)), abs=1.5e-3)
    whole = identify.velocity_map(SLIDE, {"log": log})
    assert whole.friction.tolist() == found.friction.tolist()
    assert np.all(np.diff(np.abs(found.towards(-1.0).velocity)) > 0.0)


def test_a_log_without_constant_speed_is_refused() -> None:
    log = simulate(SLIDE, Reversals("x", repeats=8), simulator=ReducedSimulator)
    with pytest.raises(InputError, match="no constant speed"):
        VelocityMap.of(SLIDE.axes["x"], motion_of(log, "x", "log"))
