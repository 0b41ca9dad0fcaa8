"""A rotor that a MuJoCo file states as at the motor, by what a log asks for at the joint."""

import numpy as np
from cli_runs import twin
from import_cases import write_csv


def test_a_rotor_that_a_file_states_before_its_gear_is_told(tmp_path):
    """Of a data sheet; MuJoCo needs what the joint feels of it: the square of the gear as much."""
    t = 0.002 * np.arange(3000)
    place = 0.5 * np.sin(3.0 * t) + 0.1 * np.sin(13.0 * t)
    speed, rate = np.gradient(place, 0.002), np.gradient(np.gradient(place, 0.002), 0.002)
    bodies = 0.35 * rate + 1.5 * 9.81 * 0.3 * np.sin(place)  # about its axis
    torque = bodies + 0.03 * rate + 2.0 * np.tanh(speed / 0.01) + 0.6 * speed
    turns = {"q [rad]": 50.0 * place, "M [Nm]": torque / 50.0}
    write_csv(tmp_path / "a.csv", {"t": t, **turns})
    (tmp_path / "map.toml").write_text(
        "sample_rate = 500.0\n[axes.elbow]\ngear = 50.0\n"
        'position = {column = "q [rad]", unit = "rad"}\nforce = {column = "M [Nm]", unit = "N m"}\n'
    )
    arm = (
        '<mujoco model="arm"><compiler angle="radian"/><worldbody><body name="arm">'
        '<joint name="elbow" axis="0 1 0" armature="0.000012" damping="0.6"/>'
        '<inertial pos="0 0 -0.3" mass="1.5" diaginertia="0.215 0.215 0.005"/>'
        "</body></worldbody></mujoco>"
    )
    said = {}
    assert twin("import", "a.csv", "--map", "map.toml", "-o", "a.mcap", folder=tmp_path).stdout
    for armature in ("0.000012", "0.03"):
        (tmp_path / "arm.xml").write_text(arm.replace("0.000012", armature))
        done = twin("new", "a.mcap", "--mjcf", "arm.xml", "-o", "m.toml", folder=tmp_path)
        assert done.returncode == 0, done.stderr
        said[armature] = done.stderr
    assert "feels 50^2 times that, 0.03 kg m^2" in said["0.000012"]
    assert 'state armature="0.03" in the file' in said["0.000012"]
    assert "armature" not in said["0.03"]
