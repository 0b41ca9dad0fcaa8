"""What a log holds beside the motion, a pressure or a temperature, is read by laws."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from planted_logs import RATE, SLIDE, Ride, few, logged

import identify
from identify.dataset.preparation import datasets
from identify.estimation.fit import fit_axis
from identify.selection.diagnosis import diagnose_axis
from twin.effects import load_catalogue
from twin.errors import CannotRun, InputError
from twin.importers import import_log, load_mapping
from twin.logs import Log, read_log, write_log
from twin.model.machine import Fitted, MachineModel
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator

AREA = 5.3e-4  # m^2, of a piston
MODEL = MachineModel("cylinder", {"x": SLIDE}, RATE)
RIVALS = few("pressure_force", "pressure_friction", "temperature_friction", "constant_force")


def recorded(seed: int, force: float = 0.0, growth: float = 0.0, fall: float = 0.0) -> Log:
    """Moves under a pressure of some kPa that wanders, at a temperature that rises.

    force: Pa over N of AREA. growth: 1/Pa, of the dry friction. fall: 1/K, of the viscous one.
    """
    log = logged(SLIDE, Ride(seed))
    x, rng = log.axes["x"], np.random.default_rng([seed, 1])
    times = np.arange(len(x)) / RATE
    steps = rng.uniform(2e3, 9e3, len(times) // 700 + 2)
    pressure = np.interp(times, 0.7 * np.arange(len(steps)), steps)
    temperature = 295.0 + 12.0 * np.sin(0.9 * times + seed)
    # held over a sample, as the motion's middle has it
    middle = np.append(0.5 * (pressure[1:] + pressure[:-1]), pressure[-1])
    speed = np.append(np.diff(x.position), 0.0) * RATE
    rubs = SLIDE.effects[0].values
    more = rubs["Fc"] * growth * middle * np.sign(np.round(speed, 6)) - force * AREA * middle
    more -= rubs["sigma2"] * speed * fall * (temperature - 295.0)
    columns = {
        **x.columns, "force": x.force + more, "pressure": pressure, "temperature": temperature,
    }  # fmt: skip
    return Log(RATE, {"x": replace(x, columns=columns)})


@pytest.mark.parametrize(
    ("what", "planted", "effect", "parameter", "value"),
    [
        ("a piston", {"force": 1.0}, "pressure_force", "area", AREA),
        ("a seal", {"growth": 3e-4}, "pressure_friction", "growth", 3e-4),
        ("a lubricant", {"fall": 0.06}, "temperature_friction", "viscous", 0.06),
    ],
)
def test_what_follows_a_channel_is_named(what, planted, effect, parameter, value):
    logs = [recorded(seed, **planted) for seed in (1, 2, 3)]
    found = datasets(MODEL, {"1": logs[0], "2": logs[1]}, {"3": logs[2]})["x"]
    told = diagnose_axis(fit_axis(SLIDE, found.training), found, RIVALS)
    assert told.named == (effect,), what
    law = told.final.axis[effect]
    # the base takes the law's mean: T0 is that of the logs
    assert law.values[parameter] == pytest.approx(value, rel=0.1)


def test_a_channel_that_is_not_logged_is_told_in_one_line():
    bare = logged(SLIDE, Ride(1))
    law = load_catalogue()["pressure_force"]
    model = MODEL.with_axis("x", SLIDE.with_effect(Fitted.at_start(law, {"area": AREA})))
    with pytest.raises(InputError, match=r"log: has no pressure of axis x, which pressure_force"):
        identify.fit(model, {"log": bare})
    with pytest.raises(InputError, match=r"reads the pressure, which not all logs hold"):
        identify.add("pressure_force", MODEL, {"log": bare})
    with pytest.raises(
        CannotRun, match=r"pressure_force reads the pressure of a log, which no sim"
    ):
        simulate(model, "moves", seed=1, duration=0.2, simulator=ReducedSimulator)
    found = identify.diagnose(MODEL, {"log": bare}, catalogue=RIVALS)
    assert "pressure_force" not in {c.effect.name for c in found.axes["x"].ranking}


def test_a_channel_goes_through_import_and_log(tmp_path: Path):
    rows = np.arange(1200)
    table = np.stack([1e-3 * rows, np.sin(0.01 * rows), 3.0 + 0.0 * rows, 1.5 + 1e-3 * rows,
                      20.0 + 0.01 * rows], 1)  # fmt: skip
    np.savetxt(tmp_path / "run.csv", table, delimiter=",", header="t,x,f,p,temp", comments="")
    (tmp_path / "map.toml").write_text(
        'format = "csv"\ntime = {column = "t", unit = "s"}\n[axes.x]\n'
        'position = {column = "x", unit = "m"}\nforce = {column = "f", unit = "N"}\n'
        'pressure = {column = "p", unit = "bar"}\ntemperature = {column = "temp", unit = "degC"}\n'
    )
    log = import_log(tmp_path / "run.csv", load_mapping(tmp_path / "map.toml"))
    write_log(log, tmp_path / "run.mcap")
    x = read_log(tmp_path / "run.mcap").axes["x"]
    assert x.columns["pressure"][:2] == pytest.approx([1.5e5, 1.501e5])
    assert x.columns["temperature"][:2] == pytest.approx([293.15, 293.16])
    assert (x.units["pressure"], x.units["temperature"]) == ("Pa", "K")
    assert len(x) == 1200


def test_what_is_left_may_depend_on_a_channel():
    logs = {str(seed): recorded(seed, force=1.0) for seed in (4, 5, 6)}
    found = identify.diagnose(MODEL, logs, catalogue=few("constant_force"))
    left = found.axes["x"].unexplained
    assert left is not None
    assert (left.depends_on, left.unit) == ("pressure", "Pa")
