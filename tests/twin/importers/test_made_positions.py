"""A position that is a velocity's integral, and a force of which only parts are recorded."""

import tomllib

import numpy as np
import pytest
from import_cases import guess_map, mapping, write_csv

from twin.errors import InputError
from twin.importers import import_log
from twin.importers.mapping import parse_mapping

T = np.arange(4000) / 1000.0
Q = 0.05 * np.sin(5.0 * T) + 0.02 * np.sin(13.0 * T)
V = 0.25 * np.cos(5.0 * T) + 0.26 * np.cos(13.0 * T)
F = 3.0 * np.gradient(V, T) + 2.0 * np.sign(V) + 5.0 * V
NOISE = np.random.default_rng(3).standard_normal(len(T))


@pytest.mark.parametrize(
    ("speed", "size", "kind"),
    [("Speed [mm/s]", 1e3, "linear"), ("n act [rpm]", 30.0 / np.pi, "rotary")],
)
def test_the_position_of_a_velocity_alone_is_its_integral(tmp_path, speed, size, kind):
    force = "Force [N]" if kind == "linear" else "Torque [Nm]"
    asked = {"Speed setpoint": size * (V + 1e-3 * NOISE)} if kind == "rotary" else {}
    path = tmp_path / "a.csv"
    write_csv(path, {"t [s]": T, speed: size * V, **asked, force: F})
    text = guess_map(path).text
    (entry,) = tomllib.loads(text)["axes"].values()
    assert entry["position"]["column"] == entry["velocity"]["column"] == speed
    assert entry["position"]["integrated"]
    assert "of a velocity, as no position is recorded" in text
    (axis,) = import_log(path, mapping(tmp_path, text)).axes.values()
    assert axis.kind.kind == kind
    np.testing.assert_allclose(axis.position, Q - Q[0], atol=1e-6)


@pytest.mark.parametrize(
    ("field", "unit", "message"),
    [
        ("force", "N", "integrated: of a velocity a position is made, no force"),
        ("position", "mm", "unit 'mm' is not known here"),
        ("position", "counts/s", "to be integrated it must be one of a velocity"),
    ],
)
def test_only_a_velocity_is_integrated_to_a_position(tmp_path, field, unit, message):
    entries = {"position": '{column = "q", unit = "m"}', "force": '{column = "f", unit = "N"}'}
    entries[field] = f'{{column = "q", unit = "{unit}", integrated = true}}'
    lines = "\n".join(f"{name} = {entry}" for name, entry in entries.items())
    with pytest.raises(InputError, match=message):
        parse_mapping(f"sample_rate = 1000\n[axes.x]\n{lines}\n")


def test_parts_of_a_command_are_no_force(tmp_path):
    path = tmp_path / "a.csv"
    write_csv(path, {"t": T, "q": Q, "tau_ff": 0.9 * F, "tau_pid": 0.1 * F + 1e-2 * NOISE})
    found = guess_map(path)
    (axis,) = tomllib.loads(found.text)["axes"].items()
    assert (axis[0], [*axis[1]]) == ("x", ["position"])
    assert "not used: tau_ff, tau_pid: a part of the command, by its name" in found.text
    assert any("looks like a force" in lack for lack in found.missing)
    write_csv(path, {"t": T, "q": Q, "PID torque": F})  # which may be all there is
    assert "that it is all of the force ASSUMED" in guess_map(path).text
