"""What a video shows beside the machine: a panel of one instant, and strips of the whole time."""

from __future__ import annotations

import numpy as np
import pytest

from identify.view.replay import AxisReplay, Replay, Strip
from identify.view.video import at_time, panel, strips
from twin.model.machine import AxisModel, MachineModel
from twin.model.units import LINEAR, ROTARY

COUNT = 40
MOTION = np.linspace(-0.02, 0.03, COUNT)
FORCES = {
    "cogging": np.linspace(-2.0, 2.0, COUNT),
    "wear": np.full(COUNT, -1.0),
    "gms": np.full(COUNT, 0.5),
}
SPIKE = np.zeros((2, COUNT))
SPIKE[1, 25] = 3e-6
DIP = np.zeros((2, COUNT))
DIP[0, 10] = -0.4
DIP[1, 30] = 0.2


def replay(**forces: np.ndarray) -> Replay:
    axis = AxisReplay(
        LINEAR, MOTION, MOTION + 1e-4, MOTION - 2e-5, forces or FORCES,
        (Strip("model - measured", "m", SPIKE), Strip("force left over", "N", DIP)),
    )  # fmt: skip
    machine = MachineModel("stage", {"x": AxisModel(1.0)}, 1000.0)
    return Replay("run", machine, 20.0, 1.5, {"x": axis})


def bars(image: np.ndarray) -> list[tuple[int, int]]:
    """First and last column of each bar, from above."""
    blue = (image[:, :, 2].astype(int) - image[:, :, 0] > 100).astype(int)
    full = blue * (np.cumsum(blue, axis=1) > 0)
    rows = np.flatnonzero(full.sum(axis=1) > 2)
    starts = rows[np.flatnonzero(np.diff(rows, prepend=-9) > 1)]
    return [(int(c[0]), int(c[-1])) for c in (np.flatnonzero(full[row + 1]) for row in starts)]


def test_bars_go_to_the_side_of_their_force_in_proportion_to_the_largest_of_all_time() -> None:
    cogging, wear, gms = bars(panel(replay(), COUNT - 1, 1.0))
    zero, reach = cogging[0], cogging[1] - cogging[0]
    assert reach > 30
    assert gms == pytest.approx((zero, zero + 0.25 * reach), abs=1)
    assert wear == pytest.approx((zero - 0.5 * reach, zero), abs=1)
    assert bars(panel(replay(), 0, 1.0))[0] == pytest.approx((zero - reach, zero), abs=1)


def test_a_panel_without_any_force_has_no_bar() -> None:
    assert bars(panel(replay(none=np.zeros(COUNT)), 3, 1.0)) == []


def lines_that_differ(one: np.ndarray, other: np.ndarray) -> list[int]:
    rows = np.flatnonzero((one != other).any(axis=(1, 2)))
    return sorted({int(row - 6) // 19 for row in rows})


def test_each_line_of_a_panel_shows_its_own_number() -> None:
    def changed(axis: AxisReplay) -> np.ndarray:
        old = replay()
        return panel(Replay("run", old.machine, old.rate, old.start, {"x": axis}), 5, 1.0)

    own = replay().axes["x"]
    whole = panel(replay(), 5, 1.0)
    moved = {"units": own.units, "strips": own.strips, "forces": own.forces}
    columns = {"measured": own.measured, "setpoint": own.setpoint, "modelled": own.modelled}
    model = changed(AxisReplay(**moved, **{**columns, "modelled": own.modelled + 1e-5}))
    setpoint = changed(AxisReplay(**moved, **{**columns, "setpoint": own.setpoint + 1e-5}))
    assert lines_that_differ(whole, model) == [4]
    assert lines_that_differ(whole, setpoint) == [5]
    assert lines_that_differ(whole, panel(replay(), 5, 20.0)) == [1]
    assert lines_that_differ(panel(replay(), 5, 2.0), panel(replay(), 5, 3.0)) == [1]
    assert lines_that_differ(whole, panel(replay(), 6, 1.0))[:2] == [0, 3]
    turning = changed(AxisReplay(**{**moved, "units": ROTARY}, **columns))
    assert {3, 4, 5} <= set(lines_that_differ(whole, turning))


def drawn_at(image: np.ndarray, first: float, last: float) -> np.ndarray:
    """The columns in which curves reach between two heights, parts of the picture from above."""
    tall = image.shape[0]
    red = image[:, :, 0].astype(int) - image[:, :, 2] > 60
    return np.flatnonzero(red[int(first * tall) : int(last * tall)].any(axis=0))


def test_strips_stand_below_each_other_over_the_whole_time_and_lose_no_spike() -> None:
    wide, tall = 800, 200
    image = strips(replay(), wide, tall)
    assert image.shape == (tall, wide, 3)
    # The first takes the upper half, below its label: its spike is up there, at rest it is low.
    spike = drawn_at(image, 0.15, 0.3)
    assert spike.mean() / wide == pytest.approx(25 / (COUNT - 1), abs=0.01)
    assert np.ptp(spike) < 3 * wide / COUNT
    high, low = drawn_at(image, 0.64, 0.7), drawn_at(image, 0.93, 0.97)
    assert high.mean() / wide == pytest.approx(30 / (COUNT - 1), abs=0.01)
    assert low.mean() / wide == pytest.approx(10 / (COUNT - 1), abs=0.01)


def test_the_time_is_marked_in_every_strip_and_the_picture_stays_as_it_is() -> None:
    image = strips(replay(), 400, 100)
    kept = image.copy()
    marked = at_time(image, 0.25)
    np.testing.assert_array_equal(image, kept)
    assert np.flatnonzero((marked != image).any(axis=(0, 2))).tolist() == [100, 101]
    assert len(np.unique(marked[:, 100:102].reshape(-1, 3), axis=0)) == 1
