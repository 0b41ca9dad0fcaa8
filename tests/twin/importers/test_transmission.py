"""Signals of coupled motors become those of the joints, and no power is lost on the way."""

import numpy as np
import pytest

from twin.errors import InputError
from twin.importers import import_log, load_mapping

RATIOS = np.array([[45.0, 0.0], [32.0, -32.0]])  # motor turns a joint turn; the wrist is coupled
GEARS = ("{elbow = 45.0}", "{elbow = 32.0, wrist = -32.0}")


def imported(folder, gears=GEARS, wrist_velocity=True):
    """What the importer makes of the motors' columns of two joints; and these, (2, 3, n)."""
    rng = np.random.default_rng(3)
    position, velocity, torque = rng.normal(size=(3, 2, 100))
    motors = np.stack([RATIOS @ position, RATIOS @ velocity, np.linalg.solve(RATIOS.T, torque)])
    names = [f"{signal}{i}" for signal in "pvt" for i in range(2)]
    rows = [",".join(names), *(",".join(map(repr, map(float, r))) for r in motors.reshape(6, -1).T)]
    (folder / "log.csv").write_text("\n".join(rows))
    text = "sample_rate = 1000.0\n"
    for i, (axis, gear) in enumerate(zip(("elbow", "wrist"), gears, strict=True)):
        text += f'[axes.{axis}]\ngear = {gear}\nposition = {{column = "p{i}", unit = "rad"}}\n'
        if wrist_velocity or i == 0:
            text += f'velocity = {{column = "v{i}", unit = "rad/s"}}\n'
        text += f'current = {{column = "t{i}", unit = "A"}}\nforce_constant = 0.5\n'
    (folder / "map.toml").write_text(text)
    log = import_log(folder / "log.csv", load_mapping(folder / "map.toml"))
    return log, np.stack([position, velocity, 0.5 * torque])


def test_joints_have_their_own_motion_and_torque(tmp_path):
    log, wanted = imported(tmp_path)
    for i, axis in enumerate(log.axes.values()):
        found = axis.position, axis.columns["velocity"], axis.force
        np.testing.assert_allclose(found, wanted[:, i], rtol=1e-9, atol=1e-12)
        assert axis.kind.rotary


@pytest.mark.parametrize(
    ("gears", "velocity", "said"),
    [
        (("{elbow = 1.0}", "{elbow = 2.0}"), True, "do not tell all joints"),
        (("{elbow = 1.0}", "{hand = 2.0}"), True, "has no axis 'hand'; it has elbow, wrist"),
        (GEARS, False, "axes.wrist: has no velocity, but is coupled"),
    ],
)
def test_what_cannot_be_brought_to_joints_is_one_line(tmp_path, gears, velocity, said):
    if not velocity:  # the elbow's motor turns with the wrist
        gears = ("{elbow = 45.0, wrist = 1.0}", gears[1])
    with pytest.raises(InputError, match=said):
        imported(tmp_path, gears, wrist_velocity=velocity)
