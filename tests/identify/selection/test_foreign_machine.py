"""Logs of other simulators, which share no law with the product: the right name, or none.

The second simulator and its drives are those of benchmarks/, which judge all effects.
"""

from __future__ import annotations

import numpy as np
import pytest

import identify
from benchmarks import silence
from benchmarks.drives import row
from benchmarks.foreign import (
    CATALOGUE,
    DURATION,
    FORMS,
    STAGE,
    diagnosed,
    made,
    model_for,
    planted_row,
)
from benchmarks.judgement import fitted
from benchmarks.second_simulator.drives import Recorder
from benchmarks.second_simulator.effects import INSIDE
from benchmarks.second_simulator.machine import drawn, logs_of
from identify.selection.diagnosis import AxisDiagnosis, Verdict, diagnose_axis
from twin.effects import Catalogue
from twin.logs import AxisLog, Log

RATE = 4e3  # Hz
FEW = Catalogue([CATALOGUE[n] for n in ("asymmetric_friction", "cogging", "quadratic_drag")])


@pytest.mark.slow  # tests/benchmarks/test_judgement.py diagnoses the same machine
def test_an_effect_of_the_catalogue_is_named() -> None:
    planted, rng = INSIDE["cogging"], np.random.default_rng(5)
    machine = planted.make(drawn(np.random.default_rng(5), RATE), 0.01, rng)
    answer = diagnosed(model_for(planted), machine, 5, 6.0, FEW)
    assert answer.best is not None
    assert answer.best.effect.name in planted.right


@pytest.mark.slow
def test_nothing_is_named_where_nothing_is_planted() -> None:
    machine = drawn(np.random.default_rng(1), RATE)
    assert diagnosed(STAGE, machine, 1, 6.0, FEW).verdict is Verdict.NOTHING_MISSING


@pytest.mark.slow
@pytest.mark.parametrize("hidden", ["nothing", pytest.param("ripple", marks=pytest.mark.slow)])
def test_noise_of_the_force_is_no_friction_that_grows_with_it(hidden: str) -> None:
    """A servo of 1 kHz logged at 200 Hz: what thinning folds into its force is half of it."""
    found = row("servo", hidden, Recorder(200, 1000), 1)
    assert not [f for f in found["findings"] if f["mark"] == "wrong"]


@pytest.mark.slow
def test_what_something_foretells_is_no_alias_of_the_command() -> None:
    """A servo of 4 kHz logged at 2 kHz, within 1.2 floors: its spring was told as noise."""
    found = silence.row(silence.cases(91, 9)[8])
    assert found["mark"] in {"right", "equivalent"}


@pytest.mark.slow  # 40 s
def test_sines_that_stand_for_the_shape_of_a_cable_are_not_told() -> None:
    """Of an end stop beside a cable of another form a third cogging was told, with 91 %."""
    found = planted_row("end_stop", 20.0, 58, [*FORMS])
    assert not [f for f in found["findings"] if f["mark"] == "wrong"]
    assert any(f["effect"] == "cable_slab" for f in found["findings"])


def of_which_one_chooses(name: str, seed: int, which: int) -> AxisDiagnosis:
    """A machine whose bumps, cable and friction have other forms, by one of its three logs."""
    one = made(name, 8.0, seed, [*FORMS])
    training, held = logs_of(one.machine, one.code, DURATION)
    logs = training | held
    chosen = [*logs][which]
    rest = {n: log for n, log in logs.items() if n != chosen}
    return diagnose_axis(*fitted(one.model, "x", rest, {chosen: logs[chosen]})[::-1], CATALOGUE)


@pytest.mark.slow  # 80 s
def test_a_cable_of_another_form_is_no_cogging_and_no_end_stop() -> None:
    """Beside a drift and other bumps both were named, of which a curve took twice as much.

    The last of its three logs chooses.
    """
    answer = of_which_one_chooses("thermal_drift", 59, 2)
    assert answer.named == ("thermal_drift",)
    assert {"cable_slab", "roller_spikes"} <= {f.effect for f in answer.findings}


@pytest.mark.slow  # 80 s
def test_stops_in_the_middle_of_the_travel_are_not_told_beside_the_curve_that_they_stood_for() -> (
    None
):
    answer = of_which_one_chooses("actuator_delay", 61, 0)
    assert "end_stop" not in answer.named
    assert answer.final.ratio < 1.3


@pytest.mark.slow  # 2 min
def test_a_sound_log_is_not_odd_where_all_together_are_explained_better() -> None:
    """Two of them came to a cogging, beside which the third had 2.4 times their error."""
    answer = of_which_one_chooses("encoder_ripple", 61, 0)
    assert answer.dataset.odd is None
    assert {"encoder_ripple", "cable_slab"} <= {f.effect for f in answer.findings}
    assert answer.final.ratio < 1.2


# A drive as many are: dry friction that sticks at each turn, and an encoder of a micrometre

SAMPLED, SECONDS, SUB = 1000, 10.0, 10
MASS, COULOMB, VISCOUS = 12.0, 9.0, 25.0  # kg, N, N s/m
PITCH, HEIGHT = 0.020, 2.5  # m, N


def setpoint(rng: np.random.Generator) -> np.ndarray:
    """Moves of minimum jerk from place to place without a rest, m."""
    parts, at, count = [], 0.15, round(SECONDS * SAMPLED)
    while sum(map(len, parts)) < count:
        to, speed, steep = rng.uniform(0.02, 0.48), rng.uniform(0.05, 0.4), rng.uniform(1.0, 4.0)
        way = abs(to - at)
        lasts = max(1.875 * way / speed, np.sqrt(5.77 * way / steep), 0.05)
        s = np.linspace(0.0, 1.0, round(lasts * SAMPLED))[1:]
        parts.append(at + (to - at) * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5))
        at = to
    return np.concatenate(parts)[:count]


def recorded(seed: int, step: float, height: float) -> Log:
    """A PID loop at the log's rate; friction holds the mass until the force exceeds it."""
    rng = np.random.default_rng(seed)
    wanted = setpoint(rng)
    speed = np.gradient(wanted, 1.0 / SAMPLED)
    ahead = MASS * np.gradient(speed, 1.0 / SAMPLED) + COULOMB * np.tanh(speed / 0.01)
    reading, force = np.zeros((2, len(wanted)))
    seen, pushed = (
        0.3e-6 * rng.standard_normal(len(wanted)),
        0.02 * rng.standard_normal(len(wanted)),
    )
    x, v, total, dt = float(wanted[0]), 0.0, 0.0, 1.0 / SAMPLED / SUB
    for k in range(len(wanted)):
        reading[k] = np.round((x + seen[k]) / step) * step
        error = wanted[k] - reading[k]
        rate = speed[k] - (reading[k] - reading[k - 1]) * SAMPLED if k else 0.0
        total += error / SAMPLED
        force[k] = ahead[k] + 6e4 * error + 1200.0 * rate + 4e5 * total
        for _ in range(SUB):
            pull = force[k] + pushed[k] - VISCOUS * v + height * np.sin(2.0 * np.pi * x / PITCH)
            free = v + pull / MASS * dt
            held = COULOMB / MASS * dt
            before, v = v, (free - held if free > held else free + held if free < -held else 0.0)
            x += 0.5 * (before + v) * dt
    return Log(SAMPLED, {"x": AxisLog({"position": reading, "force": force})})


def found(step: float, height: float = 0.0) -> AxisDiagnosis:
    logs = {str(seed): recorded(seed, step, height) for seed in (1, 2, 3)}
    held = {"3": logs.pop("3")}
    return identify.diagnose(identify.first_model(logs), logs, held).axes["x"]


@pytest.mark.slow
@pytest.mark.parametrize("step", [1e-6, pytest.param(1e-8, marks=pytest.mark.slow)])
def test_nothing_is_missing(step: float) -> None:
    """Noise of the readings is as fast as what sticks for some milliseconds and is at rest."""
    answer = found(step)
    assert answer.verdict is Verdict.NOTHING_MISSING
    assert answer.base.ratio < 1.15
    values = answer.base.axis["coulomb_viscous"].values
    assert answer.base.axis.mass == pytest.approx(MASS, rel=2e-3)
    assert values["Fc"] == pytest.approx(COULOMB, rel=5e-3)
    assert values["sigma2"] == pytest.approx(VISCOUS, rel=1e-2)


@pytest.mark.slow
def test_cogging_is_named_and_nothing_beside_it() -> None:
    answer = found(1e-6, HEIGHT)
    assert answer.named == ("cogging",)

    values = answer.final.axis["cogging"].values
    assert values["p"] == pytest.approx(PITCH, rel=1e-3)
    assert answer.final.at_floor
