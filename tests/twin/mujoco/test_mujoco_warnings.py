"""A simulation that breaks down ends, and says when, on which axis and by which effect."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import chdir
from math import nan, sqrt
from pathlib import Path
from threading import Barrier

import mujoco
import numpy as np
import pytest
from axis_runs import BOTH, effect

from twin.effect import OUT, Effect, Kind, Parameter, X
from twin.errors import CannotRun
from twin.experiments.trajectory import Setpoint
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.mujoco.callback import collected_warnings
from twin.simulation.simulators import run

EACH = pytest.mark.parametrize("simulator", BOTH)


def _law(p, s, io):  # type: ignore[no-untyped-def]
    io[OUT] = p[0] * sqrt(p[1] - io[X])


BREAKS = Effect(
    kind=Kind.FORCE,
    summary="no number beyond a place",
    equation="F = a sqrt(b - x)",
    source="this test",
    parameters=(
        Parameter("a", "N", 1.0, -10.0, 10.0, "size", strength=True),
        Parameter("b", "m", 0.05, -10.0, 10.0, "place"),
    ),
    law=_law,
    fingerprint="",
    excited_by="",
)


def machine(values: dict[str, float]) -> MachineModel:
    """Axis y holds the effect."""
    hardware = Hardware(bandwidth=20.0)
    effect = Fitted(BREAKS, {"a": 1.0, "b": 0.05, **values}, frozenset())
    axes = {"x": AxisModel(2.0, hardware), "y": AxisModel(2.0, hardware, (effect,))}
    return MachineModel("two", axes, 1000.0)


def ramp() -> Setpoint:
    """Both axes from 0 to 0.1 m in 1 s."""
    position = np.repeat(np.linspace(0.0, 0.1, 1001)[:, None], 2, axis=1)
    still = np.zeros_like(position)
    return Setpoint(position, np.full_like(position, 0.1), still, still, 1000.0)


@EACH
def test_a_law_that_breaks_in_the_travel_ends_the_run(simulator: type, tmp_path: Path) -> None:
    with chdir(tmp_path), pytest.raises(CannotRun) as refused:
        run(machine({}), ramp(), np.random.default_rng(0), simulator=simulator)
    text = str(refused.value)
    assert "on axis y: effect test_mujoco_warnings gives nan N" in text
    seconds = float(text.split("t = ")[1].split(" s")[0])
    assert seconds == pytest.approx(0.5, abs=0.05)
    assert list(tmp_path.iterdir()) == []  # no MUJOCO_LOG.TXT


@EACH
def test_a_force_that_is_no_number_from_the_start(simulator: type) -> None:
    with pytest.raises(
        CannotRun, match=r"t = 0\.0000 s on axis y: effect test_mujoco_warnings gives nan N"
    ):
        run(machine({"a": nan}), ramp(), np.random.default_rng(0), simulator=simulator)


@EACH
@pytest.mark.parametrize(("axis", "largest"), [("x", "viscous_friction"), ("y", "spring")])
def test_a_loop_that_swings_up_is_told_with_its_axis_and_the_largest_force_there(
    simulator, axis, largest
):
    """No force is beyond measure by itself: the loop is too fast for its rate."""
    small = {"viscous_friction": {"c": 1e-3}, "spring": {"k1": 1e-3}}
    parts = tuple(
        effect(name, **{p: 1e5 * v if name == largest else v for p, v in values.items()})
        for name, values in small.items()
    )
    fast = {n: 900.0 if n == axis else 20.0 for n in "xy"}
    axes = {n: AxisModel(2.0, Hardware(bandwidth=fast[n]), parts) for n in "xy"}
    model = MachineModel("two", axes, 1000.0)
    said = rf"unstable at t = 0\.01\d+ s on axis {axis} \(its largest force is that of {largest}\)"
    with pytest.raises(CannotRun, match=f"{said}; lower the bandwidth"):
        run(model, ramp(), np.random.default_rng(0), simulator=simulator)


def test_each_thread_has_the_warnings_of_its_own_simulation() -> None:
    before, together = mujoco.get_mju_user_warning(), Barrier(2)

    def warned(text: str) -> list[str]:
        with collected_warnings(mujoco.MjData(mujoco.MjSpec().compile())) as found:
            together.wait(timeout=10.0)  # both are within
            mujoco.get_mju_user_warning()(text)
            together.wait(timeout=10.0)
        return [w.text for w in found]

    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(warned, ("one", "other"))) == [["one"], ["other"]]
    assert mujoco.get_mju_user_warning() is before


def test_a_warning_of_another_simulation_goes_to_the_handler_that_was_there() -> None:
    told: list[str] = []
    mujoco.set_mju_user_warning(told.append)
    try:
        with (
            collected_warnings(mujoco.MjData(mujoco.MjSpec().compile())) as found,
            ThreadPoolExecutor(1) as elsewhere,
        ):
            elsewhere.submit(lambda: mujoco.get_mju_user_warning()("foreign")).result()
    finally:
        mujoco.set_mju_user_warning(None)
    assert (told, found) == (["foreign"], [])
