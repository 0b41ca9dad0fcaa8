"""The frequency response of machines whose own is known exactly; nothing of it is of the twin."""

from __future__ import annotations

import json
import os
import pickle
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from scipy.linalg import expm
from scipy.signal import butter, lfilter

import identify
from benchmarks.second_simulator.two_masses import CELLS, TwoMasses, multisine, wandering
from identify.frequency.plant import Banded, loop_of, plant_of
from identify.frequency.response import LoopSignals, Response, response
from identify.output.as_json import answer_of
from tests.cli_runs import refusal, twin
from twin.effects import Catalogue, load_catalogue
from twin.errors import InputError
from twin.logs import AxisLog, Log, write_log
from twin.model.file import load_model, save_model
from twin.model.machine import Fitted, MachineModel
from twin.signals import Array
from twin.simulation.simulate import simulate

SAMPLES = 16_000
MACHINE = TwoMasses()
Setpoint = Callable[[int, np.random.Generator], Array]


def recorded(setpoint: Setpoint, machine: TwoMasses = MACHINE, seed: int = 1) -> LoopSignals:
    rng = np.random.default_rng(seed)
    return machine.run(setpoint(SAMPLES, rng), rng)


def read_off_log() -> Log:
    """A log of the machine, all of whose plant can be read off."""
    record = recorded(wandering)
    return Log(1.0 / record.period, {"x": AxisLog({
        "setpoint_position": record.setpoint, "force": record.force, "position": record.position,
    })})  # fmt: skip


@pytest.mark.parametrize("setpoint", [multisine, wandering])
def test_the_response_is_that_of_the_machine_and_its_band_holds_it(setpoint: Setpoint) -> None:
    found = response([recorded(setpoint, seed=s) for s in range(3)])
    told, true = found.tells, MACHINE.response(found.frequency)
    assert np.count_nonzero(told) > 0.8 * len(told)
    held = np.abs(found.plant - true)[told] < found.band[told]
    assert 0.8 < held.mean() < 0.97
    assert np.median(np.abs(found.plant / true - 1.0)[told]) < 0.02


def of_lines(lines: Array) -> Setpoint:
    """A periodic setpoint (n,) m that has only some lines."""

    def setpoint(samples: int, rng: np.random.Generator) -> Array:
        spectrum = np.fft.rfft(multisine(CELLS, rng))
        kept = np.zeros(len(spectrum))
        kept[lines] = 1.0
        return np.tile(np.fft.irfft(kept * spectrum, CELLS), -(-samples // CELLS))[:samples]

    return setpoint


@pytest.mark.parametrize(
    "lines",
    [
        np.arange(1, 900, 2),
        np.append(1, np.arange(4, 900, 4)),
        np.unique(np.rint(np.geomspace(4.0, 800.0, 90)).astype(int)),
    ],
    ids=["odd", "every fourth and a slow one", "even on a logarithmic axis"],
)
def test_a_response_is_told_at_the_lines_that_a_setpoint_has(lines: Array) -> None:
    """Between them is only noise, which is no response."""
    found = response([recorded(of_lines(lines), seed=s) for s in range(3)])
    told, true = found.tells, MACHINE.response(found.frequency)
    where = found.frequency * CELLS * found.period
    assert np.isin(np.rint(where), lines).all()
    assert np.count_nonzero(told) > 0.7 * len(told) > 20
    held = np.abs(found.plant - true)[told] < found.band[told]
    assert held.mean() > 0.8
    assert np.median(np.abs(found.plant / true - 1.0)[told]) < 0.02


@pytest.mark.short(2)
@pytest.mark.parametrize("setpoint", [multisine, wandering])
@pytest.mark.parametrize("delay", [0.0, pytest.param(0.4e-3, marks=pytest.mark.slow), 1.3e-3])
def test_mass_resonance_and_delay_are_read_off(setpoint: Setpoint, delay: float) -> None:
    machine = replace(MACHINE, delay=delay)
    plant = plant_of(response([recorded(setpoint, machine)]))
    frequency, ratio = machine.resonance
    (mode,) = plant.modes
    assert plant.mass.value == pytest.approx(machine.mass, rel=0.01)
    assert mode.frequency.value == pytest.approx(frequency, rel=0.01)
    assert mode.damping.value == pytest.approx(ratio, rel=0.1)
    assert plant.delay.value == pytest.approx(delay, abs=0.02 * machine.period)
    assert mode.gain.value == pytest.approx(machine.load / machine.motor, rel=0.05)


def test_the_ratio_of_spectra_is_biased_under_feedback_where_the_instrument_is_not() -> None:
    noisy = replace(MACHINE, noise=5e-5, load=1e-3)
    records = [recorded(wandering, noisy, seed) for seed in range(3)]
    with_it = response(records)
    without = response([replace(record, setpoint=None) for record in records])
    near = (with_it.frequency > 5.0) & (with_it.frequency < 30.0)
    true = noisy.response(with_it.frequency)[near]
    error = [abs(np.mean(r.plant[near] / true - 1.0)) for r in (with_it, without)]
    assert 4.0 * error[0] < error[1]


def test_noise_and_what_is_not_linear_are_told_apart() -> None:
    quiet, noisy = recorded(multisine), recorded(multisine, replace(MACHINE, noise=1e-6))
    bent = replace(quiet, position=quiet.position + 2e3 * quiet.position**2)
    shares = []
    for record in (noisy, bent):
        found = response([record])
        shares.append(np.median((found.distortion / found.spread)[found.tells] ** 2))
    assert shares[0] < 0.3 < 0.9 < shares[1]


def test_the_margins_are_those_of_the_loop() -> None:
    stiff = replace(MACHINE, load=1e-3)
    found = response([recorded(wandering, stiff)])
    own = stiff.controller(found.frequency)
    exact = own * stiff.response(found.frequency)
    told = loop_of(found, None)
    known = loop_of(found, own)
    assert told is not None
    assert known is not None
    peak = np.abs(1.0 / (1.0 + exact))[found.tells].max()
    assert told.peak == pytest.approx(peak, rel=0.05)
    assert known.peak == pytest.approx(peak, rel=0.05)
    falls = np.flatnonzero((np.abs(exact[:-1]) > 1.0) & (np.abs(exact[1:]) <= 1.0))[-1]
    low, high = found.frequency[falls : falls + 2]
    assert 0.98 * low < told.crossover < 1.02 * high
    assert told.phase_margin == pytest.approx(np.angle(-exact[falls]), abs=0.1)


@pytest.mark.parametrize("by_controller", [True, False])
def test_the_margins_of_a_loop_of_three_poles_are_those_of_its_formula(by_controller: bool) -> None:
    """L = K/(s (s/a + 1)^2) is 1 at a/2 for K = 0.625 a, and real at a, where it is -K/(2 a)."""
    corner = 2.0 * np.pi * 20.0
    s = 2j * np.pi * np.geomspace(1.0, 60.0, 400)
    loop = 0.625 * corner / (s * (s / corner + 1.0) ** 2)
    plant, ones = 1.0 / (3.0 * s**2), np.ones(len(s))
    found = Response(
        frequency=s.imag / (2.0 * np.pi), plant=plant, spread=1e-9 * ones, noise=0.0 * ones,
        closed=loop / (1.0 + loop), coherence=ones, band=1e-9 * ones, strength=1e3 * ones,
        period=1e-3,
    )  # fmt: skip
    told = loop_of(found, loop / plant if by_controller else None)
    assert told is not None
    assert told.by_controller is by_controller
    assert told.crossover == pytest.approx(10.0, rel=1e-4)
    assert np.degrees(told.phase_margin) == pytest.approx(36.87, abs=0.01)
    assert told.gain_margin == pytest.approx(3.2, rel=0.04)
    np.testing.assert_allclose(told.sensitivity, 1.0 / (1.0 + loop), rtol=1e-9)
    assert told.peak == pytest.approx(np.abs(1.0 / (1.0 + loop)).max())
    low = found.at(found.frequency < 8.0)
    assert np.isnan(loop_of(low, loop[: len(low.frequency)] / low.plant).crossover)


def test_a_mass_on_a_spring_and_damper_is_read_off() -> None:
    """P(s) = 1/(m s^2 + d s + k), whose samples of a held command are those of its two poles."""
    mass, damping, stiffness, period = 3.0, 40.0, 2.0e4, 1e-3
    rates = np.array([[0.0, 1.0, 0.0], [-stiffness / mass, -damping / mass, 1.0 / mass], [0.0] * 3])
    step = expm(rates * period)
    frequency = np.geomspace(2.0, 200.0, 60)
    turns = np.exp(2j * np.pi * frequency * period)
    drive = step[:2, 2]
    plant = np.array([np.linalg.solve(z * np.eye(2) - step[:2, :2], drive)[0] for z in turns])
    ones = np.ones(len(plant))
    told = plant_of(
        Response(
            frequency=frequency, plant=plant, spread=1e-3 * np.abs(plant), noise=0.0 * ones,
            closed=np.nan * plant, coherence=ones, band=1e-3 * np.abs(plant), strength=1e3 * ones,
            period=period,
        )
    )  # fmt: skip
    assert told.modes == ()
    assert told.mass.value == pytest.approx(mass, rel=1e-3)
    assert told.damping.value == pytest.approx(damping, rel=1e-2)
    assert told.stiffness.value == pytest.approx(stiffness, rel=1e-3)
    assert told.delay.value == pytest.approx(0.0, abs=0.01 * period)
    np.testing.assert_allclose(told.fitted, plant, rtol=1e-3)
    assert told.misfit < 0.1


def test_where_the_setpoint_makes_none_of_the_force_nothing_is_told() -> None:
    """There the ratio is that of noise, which feedback makes: as sure as it is wrong."""
    noisy = replace(MACHINE, noise=5e-5, load=1e-3)
    found = response([recorded(wandering, noisy, seed) for seed in range(3)])
    wrong = np.abs(found.plant / noisy.response(found.frequency) - 1.0)
    assert wrong[2.0 * found.band < np.abs(found.plant)].max() > 10.0
    assert wrong[found.tells].max() < 5.0


RUBBING = """
sample_rate = 2000.0
[axes.x]
mass = 3.0
travel = [0.0, 0.3]
velocity = 0.34
acceleration = 2.4
jerk = 120.0
bandwidth = 30.0
[axes.x.effects.coulomb_viscous]
Fc = 2.0
Fs = 2.0
sigma2 = 8.0
"""


def test_no_mass_is_read_off_where_not_even_that_of_the_model_comes_back(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(RUBBING)
    model = load_model(tmp_path / "m.toml")
    log = simulate(model, "tracking", seed=1, duration=6.0)
    found = identify.frequency_response(log, model)
    axis = found.axes["x"]
    assert axis.bias is not None
    assert axis.bias.own == 3.0
    assert axis.bias.back.value - axis.bias.back.band > 3.0
    assert axis.measured.plant is axis.modelled.plant is axis.measured.loop is None
    assert "mass, delay and loop are not read off: of the model's own 3.00 kg" in str(found)
    without = str(identify.frequency_response(log))
    assert re.search(
        r"of the 3.0\d kg that least squares with friction find .* shows 3.[4-9]", without
    )


def test_what_cannot_be_told_is_refused_in_one_line() -> None:
    record = recorded(wandering)
    with pytest.raises(InputError, match="give logs of one rate"):
        response([record, replace(record, period=2e-3)])
    still = replace(record, position=1e-7 * np.random.default_rng(0).standard_normal(SAMPLES))
    with pytest.raises(InputError, match="too few for a mass"):
        plant_of(response([still]))
    assert loop_of(response([replace(record, setpoint=None)]), None) is None


# A joint behind an elastic gear: a rigid fit makes a mass or a delay of it


# what would be seen as well in a position that lags behind the force
LAGGING = Catalogue(
    [load_catalogue()[name] for name in ("flexible_mode", "backlash", "actuator_lag", "spring",
     "encoder_delay", "base_vibration", "coulomb_viscous", "quadratic_drag")]
)  # fmt: skip


@pytest.fixture(scope="module", params=[pytest.param(8.0, marks=pytest.mark.slow), 12.0])
def geared(request: pytest.FixtureRequest) -> tuple[TwoMasses, list[Log]]:
    machine = TwoMasses(
        motor=1.0, load=2.0, frequency=request.param, ratio=0.05, delay=0.0, bandwidth=4.0
    )
    logs = []
    for seed in range(2):
        rng = np.random.default_rng(seed)
        wanted = 1e-2 * lfilter(*butter(2, 0.016), rng.standard_normal(SAMPLES))
        done = machine.run(wanted, rng)
        columns = {"setpoint_position": wanted, "position": done.position, "force": done.force}
        logs.append(Log(1.0 / machine.period, {"q": AxisLog(columns)}))
    return machine, logs


def test_an_elastic_gear_is_seen_through_and_named(geared: tuple[TwoMasses, list[Log]]) -> None:
    machine, logs = geared
    plant = identify.frequency_response(logs).axes["q"].measured.plant
    assert plant is not None
    (mode,) = plant.modes
    assert mode.frequency.value == pytest.approx(machine.resonance[0], rel=0.01)
    assert plant.mass.value == pytest.approx(machine.mass, rel=0.02)
    model = identify.first_model(logs[0])
    found = identify.diagnose(model, *logs, catalogue=LAGGING).axes["q"]
    ((name, *tied),) = found.answers
    assert "flexible_mode" in (name, *tied)
    assert found.missing[0].parameters["frequency"] == pytest.approx(machine.frequency, rel=0.01)


# The command


@pytest.fixture(scope="module")
def elastic() -> MachineModel:
    """A stage whose mass hangs in part on a spring, and whose command acts late."""
    catalogue = load_catalogue()
    model = load_model("proton_xy", catalogue)
    model = replace(model, axes={"x": model.axes["x"]}, mjcf=None, mjcf_name=None)
    axis = model.axes["x"]
    for name, values in (
        ("flexible_mode", {"load": 0.4, "frequency": 60.0, "damping": 0.03}),
        ("actuator_delay", {"tau": 1.3e-3}),
    ):
        axis = axis.with_effect(Fitted.at_start(catalogue[name], values))
    return model.with_axis("x", axis)


@pytest.fixture(scope="module")
def log(elastic: MachineModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("frf") / "multisine.mcap"
    write_log(simulate(elastic, "multisine", duration=8.0, seed=3), path)
    return path


def test_twin_and_model_show_what_was_planted_in_spite_of_friction(
    elastic: MachineModel, log: Path
) -> None:
    found = identify.frequency_response(log, elastic).axes["x"]
    for shown in (found.measured, found.modelled):
        assert shown is not None
        assert shown.plant is not None
        (mode,) = shown.plant.modes
        assert shown.plant.mass.value == pytest.approx(elastic.axes["x"].mass, rel=0.02)
        assert mode.frequency.value == pytest.approx(60.0 / np.sqrt(0.6), rel=0.01)
        assert mode.damping.value == pytest.approx(0.03 / np.sqrt(0.6), rel=0.1)
        assert shown.plant.delay.value == pytest.approx(1.3e-3, abs=2e-5)


def test_the_command_prints_and_writes(log: Path, tmp_path: Path) -> None:
    table, picture = tmp_path / "r.csv", tmp_path / "bode.png"
    done = twin("frf", log, "-o", table, "--plot", picture, folder=tmp_path)
    assert "resonance: 77" in done.stdout
    assert re.search(r"delay: 1\.(29|30)", done.stdout)
    head, *lines = table.read_text().splitlines()
    assert head.startswith("axis,source,frequency (Hz),real (m/N)")
    assert len(lines) > 50
    assert picture.read_bytes()[:4] == b"\x89PNG"
    answer = twin("frf", log, "-o", "r.mcap", "--json", folder=tmp_path)
    with (tmp_path / "r.mcap").open("rb") as stream:
        ((schema, channel, message),) = make_reader(stream).iter_messages()
    assert channel.topic == "/x/frequency_response/measured"
    assert json.loads(schema.data)["properties"]["real"]["unit"] == "m/N"
    real = [float(line.split(",")[3]) for line in lines]
    np.testing.assert_allclose(json.loads(message.data)["real"], real, rtol=1e-8)
    assert "end the name in .csv or .mcap" in refusal("frf", log, "-o", "r.txt", folder=tmp_path)
    assert "end the name in .png" in refusal("frf", log, "--plot", "b.xyz", folder=tmp_path)
    measured = json.loads(answer.stdout)["axes"]["x"]["measured"]
    assert ("gain margin" in done.stdout) == (measured["loop"]["gain_margin"] is not None)
    plant = measured["plant"]
    assert plant["delay"]["value"] == pytest.approx(1.3e-3, abs=2e-5)


def test_a_page_shows_it_beside_the_model(log: Path, elastic: MachineModel, tmp_path: Path) -> None:
    save_model(elastic, tmp_path / "m.toml")
    done = twin("compare", "m.toml", log, "-o", "page.html", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "page.html").read_text()
    shown = page[page.index('<section id="frequency"') :].partition("</section>")[0]
    assert "Magnitude (dB of m/N)" in shown
    row = re.search(r"<td>resonance</td>(.*?)</tr>", shown, re.DOTALL)
    assert row is not None
    assert len(re.findall(r"77\.\d+ ± ", row[1])) == 2  # measured and model


def test_a_response_is_drawn_by_a_process_that_has_printed_nothing(tmp_path: Path) -> None:
    """`twin frf --plot` drew before it printed: "a FrequencyResponse has no residual"."""
    found = identify.frequency_response(read_off_log())
    (tmp_path / "found").write_bytes(pickle.dumps(found))
    code = "import pickle, sys; pickle.load(open(sys.argv[1], 'rb')).plot().savefig(sys.argv[2])"
    run = [sys.executable, "-c", code, str(tmp_path / "found"), str(tmp_path / "bode.png")]
    there = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(run, capture_output=True, text=True, env=there, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "bode.png").exists()


def test_a_log_in_which_nothing_moves_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "rest.mcap"
    still = {n: np.zeros(4000) for n in ("position", "setpoint_position", "force")}
    write_log(Log(1000.0, {"x": AxisLog(still)}), path)
    with pytest.raises(InputError, match="no axis has in all of the logs a force that changes"):
        identify.frequency_response(path)


def test_a_response_is_python_controls_frd() -> None:
    control = pytest.importorskip("control")
    found = identify.frequency_response(read_off_log())
    frd = found.to_frd("x")
    assert isinstance(frd, control.FRD)
    assert answer_of(found)
    assert isinstance(found.axes["x"].measured.plant.mass, Banded)
