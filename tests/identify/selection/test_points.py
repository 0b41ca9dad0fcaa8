"""What was seen on real drives, planted: each wrong answer of a diagnosis as a test."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from constructed import log_of
from machines import CATALOGUE
from numpy.typing import NDArray
from planted_logs import HARDWARE, NOISE, RATE, RUBS, SLIDE, Ride, asked, begun, few, having, logged
from scipy.signal import lfilter

import identify
from identify.dataset.dataset import Role
from identify.estimation.errors import Errors
from identify.estimation.fit import fit_axis
from identify.estimation.found_shape import found_shape
from identify.estimation.free_curves import shapes_of
from identify.output.as_json import json_of
from identify.output.words.findings import finding_in_words
from identify.output.words.next_step import WRITE, next_commands
from identify.output.words.verdict import verdict_in_words
from identify.selection.diagnosis import AxisDiagnosis, Verdict, diagnose_axis
from identify.selection.findings import Confirmation, Finding, FindingKind
from identify.selection.refusal import EndsAtBound
from identify.selection.trying import try_effect
from twin.logs import Log
from twin.model.machine import AxisModel, Fitted, MachineModel

Array = NDArray[np.float64]


# 1. A control that is the candidate itself.


@pytest.mark.parametrize("size", [0.01, 0.3])
def test_an_offset_far_above_the_noise_is_named(size: float) -> None:
    """A constant shifted in time is the constant: as its own control it was never proved."""
    true = having(SLIDE, "constant_force", F0=size)
    found = asked(SLIDE, true, few("constant_force", "asymmetric_friction", "cogging", "spring"))
    assert found.named == ("constant_force",)
    assert found.final.at_floor
    assert found.findings[0].parameters["F0"] == pytest.approx(size, rel=0.05)


# 2. Absolute sizes.

IN_UNITS = {
    "wear": {"rate": 0.2},
    "cogging": {"p": 0.021, "a1": 0.03, "b1": 0.02},
}
RIVALS = few(*IN_UNITS, "load_dependent_friction", "quadratic_drag", "position_dependent_friction")
SLOW = pytest.mark.slow
UNITS = [(0.01, 100.0), pytest.param(100.0, 1.0, marks=SLOW), pytest.param(1.0, 0.01, marks=SLOW)]


@cache
def in_units(name: str, force: float, place: float) -> AxisDiagnosis:
    """The diagnosis of a machine with that effect, in a unit of N / force and of m / place."""
    true = having(SLIDE, name, **IN_UNITS[name])
    hardware = replace(
        HARDWARE, travel=(-0.1 * place, 0.1 * place), encoder_noise=1e-9 * place,
        current_noise=NOISE * force, velocity=0.3 * place, acceleration=2.0 * place,
        jerk=100.0 * place,
    )  # fmt: skip
    rubs = {"Fc": 0.31 * force, "Fs": 0.31 * force, "sigma2": 0.53 * force / place}
    friction = Fitted.at_start(RUBS.effect, rubs)
    base = AxisModel(SLIDE.mass * force / place, hardware, (friction,))

    def told(seed: int) -> Log:
        x = logged(true, Ride(seed)).axes["x"]
        return log_of(RATE, place * x.position, force * x.force)

    one, two, held = map(told, (1, 2, 3))
    return diagnose_axis(*begun(base, {"one": one, "two": two}, {"held": held}), RIVALS)


@pytest.mark.parametrize(("force", "place"), UNITS)
@pytest.mark.parametrize("name", IN_UNITS)
def test_the_answer_is_the_same_in_other_units(name: str, force: float, place: float) -> None:
    own, other = in_units(name, 1.0, 1.0), in_units(name, force, place)
    assert own.named == (name,)
    assert other.answers == own.answers
    assert other.findings[0].score.part == pytest.approx(own.findings[0].score.part, rel=0.02)
    assert other.findings[0].explains == pytest.approx(own.findings[0].explains, rel=0.02)
    assert other.final.ratio == pytest.approx(own.final.ratio, rel=0.02)


# 3. Values at their upper bound.


def lagged(tau: float, seed: int) -> Log:
    """A log of a drive whose force follows its command that late (s)."""
    x = logged(SLIDE, Ride(seed), noise=0.0).axes["x"]
    noise = NOISE * np.random.default_rng(seed).standard_normal(len(x.force))
    return log_of(RATE, x.position, x.force + tau * RATE * np.gradient(x.force) + noise)


@pytest.mark.parametrize(
    ("tau", "told"), [(0.05, None), (0.15, EndsAtBound(("actuator_lag.tau",)))]
)
def test_a_lag_at_its_upper_bound_is_refused(tau: float, told: EndsAtBound | None) -> None:
    known = replace(SLIDE, mass_fixed=True)
    fit, dataset = begun(known, {"one": lagged(tau, 1)}, {"held": lagged(tau, 2)})
    assert try_effect(fit, dataset, CATALOGUE["actuator_lag"]).refused == told


def test_a_bound_that_the_logs_do_not_prefer_is_held_against_no_effect() -> None:
    """Of a mode that the motion does not reach, its mass over its stiffness alone is told."""
    true = having(SLIDE, "flexible_mode", load=0.3, frequency=100.0, damping=0.3)
    found = asked(SLIDE, true, few("flexible_mode", "backlash", "actuator_lag"), ride=Ride(8))
    assert "flexible_mode" in found.answers[0]
    assert found.final.at_floor
    held = found.final.axis["flexible_mode"]
    assert [p for p in held.fixed if held.values[p] < held.effect.parameter(p).upper]


# Of own simulators.


def hum(seed: int) -> Array:
    """Force noise of 50 mN with a memory of 20 ms, N."""
    rng = np.random.default_rng(seed)
    return lfilter([1.0], [1.0, -np.exp(-0.05)], 0.05 * 0.31 * rng.standard_normal(6000))


def with_hum(log: Log, seed: int, times: float = 1.0) -> Log:
    """The same log with that noise in its command."""
    x = log.axes["x"]
    return log_of(RATE, x.position, x.force + times * hum(seed))


def test_a_ripple_of_narrow_peaks_resembles_the_law_that_a_curve_replaces() -> None:
    """What was added is not there any more when a free curve has taken its place."""

    def ripple(x: Array, _: Array) -> Array:
        return 0.3 * np.exp(-(((np.mod(x / 0.012, 1.0) - 0.5) / 0.1) ** 2))

    found = asked(SLIDE, SLIDE, few("cogging", "quadratic_drag"), beside=ripple)
    assert found.named == ("cogging",)
    assert found.findings[0].kind is FindingKind.RESEMBLES
    assert "cogging" not in found.final.axis.names


def test_stops_are_found_where_the_logs_end_whatever_the_travel_of_the_model() -> None:
    true = having(SLIDE, "end_stop", low=-0.054, high=0.054, stiffness=400.0)
    wide = replace(SLIDE, hardware=replace(HARDWARE, travel=(-0.09, 0.108)))
    stops = few("end_stop", "asymmetric_friction", "cogging")
    found = asked(wide, true, stops, ride=Ride(1, seconds=10.0))
    assert found.named == ("end_stop",)
    assert found.final.axis["end_stop"].values["low"] == pytest.approx(-0.054, abs=5e-4)


def test_noise_of_the_drive_with_nothing_missing_is_told_in_all_forms() -> None:
    """That the noise floor rises is no change of the model: each form had unpacked its findings."""
    one, two, held = (with_hum(logged(SLIDE, Ride(seed)), seed) for seed in (1, 2, 3))
    model = MachineModel("m", {"x": SLIDE}, RATE)
    known = few("cogging", "quadratic_drag", "spring")
    found = identify.diagnose(model, {"one": one, "two": two}, {"held": held}, catalogue=known)
    assert found.axes["x"].verdict is Verdict.NOTHING_MISSING
    assert found.axes["x"].dataset.force_noise > 0.02
    assert "its origin is not known" in str(found)
    assert json_of(found)["axes"]["x"]["verdict"] == "nothing_missing"


def test_rounding_is_named_beside_noise_that_no_sensor_makes() -> None:
    def read(log: Log, seed: int) -> Log:
        x = with_hum(log, seed, 1.4).axes["x"]
        return log_of(RATE, np.round(x.position / 4e-6) * 4e-6, x.force)

    one, two, held = (read(logged(SLIDE, Ride(seed)), seed) for seed in (1, 2, 3))
    catalogue = few("encoder_quantization", "cogging", "quadratic_drag", "spring")
    _, dataset = begun(SLIDE, {"one": one, "two": two}, {"held": held})
    dataset = dataset.at_length(0.02)  # s, at which the steps are more than the hum
    found = diagnose_axis(fit_axis(SLIDE, dataset.training), dataset, catalogue)
    assert found.named == ("encoder_quantization",)


@pytest.mark.slow
@pytest.mark.parametrize("size", [-0.4, 0.4])
def test_a_friction_that_would_need_more_asymmetry_than_there_is_is_never_named(
    size: float,
) -> None:
    """It takes nearly all of an offset, whatever the sign of the bound at which it ends."""
    true = having(SLIDE, "constant_force", F0=size)
    found = asked(SLIDE, true, few("asymmetric_friction", "cogging"))
    (first, *_) = found.ranking
    assert first.effect.name == "asymmetric_friction"
    assert first.part > 0.9
    assert isinstance(first.refused, EndsAtBound)
    assert found.named == ()


# 4. A chain that was thrown out for a resonance.


@pytest.mark.slow
@pytest.mark.parametrize(
    "names",
    [
        ("cogging", "base_vibration", "quadratic_drag", "flexible_mode", "periodic_disturbance"),
        pytest.param(tuple(CATALOGUE), marks=pytest.mark.slow),
    ],
    ids=["few", "all"],
)
def test_a_chain_is_kept_although_the_motion_repeats_in_training_and_selection(
    names: tuple[str, ...],
) -> None:
    """Whatever repeats with it, as the answer of a resonance, can imitate the chain there."""
    true = having(having(SLIDE, "cogging", p=0.021, a1=0.03, b1=0.02), "quadratic_drag", c=1.5)
    one, held = (again(true, seed) for seed in (1, 2))
    test = {"test": logged(true, Ride(5))}
    found = diagnose_axis(*begun(SLIDE, {"one": one}, {"held": held}, test), few(*names))
    assert found.named == ("cogging", "quadratic_drag")
    assert found.tested.after < 0.1 * found.tested.before
    assert all(f.tested.after < f.tested.before for f in found.findings)


def again(true: AxisModel, seed: int) -> Log:
    """The same ride as ever, with noise of its own."""
    x, rng = logged(true, Ride(1), noise=0.0).axes["x"], np.random.default_rng(seed)
    noise = rng.standard_normal((2, len(x.force)))
    return log_of(RATE, x.position + 1e-9 * noise[0], x.force + NOISE * noise[1])


# 5. A curve of friction where one direction is hardly seen, or that is no friction.

WAVY = {"c1": 0.3, "c2": -0.2, "c3": 0.3, "c4": 0.1, "c5": -0.3}


@pytest.mark.parametrize(("back", "offered"), [(1.0, True), (24.0, False)])
def test_a_curve_of_friction_is_offered_where_both_directions_are_well_visited(
    back: float, offered: bool
) -> None:
    true = having(SLIDE, "position_dependent_friction", **WAVY)
    ride = Ride(1, reach=0.05, fast=0.02 if back > 1.0 else 0.3, back=back)
    logs = {str(i): logged(true, replace(ride, seed=i)) for i in (1, 2)}
    fit, dataset = begun(SLIDE, logs, {})
    speed = np.concatenate([p.test_function.mean(p.motion.velocity) for p in dataset.training])
    behind = float(np.mean(speed[fit.kept] < 0.0))
    assert behind > 0.4 if offered else behind < 0.07
    shapes = shapes_of(fit, dataset)
    assert [s.effect for s in shapes] == ["coulomb_viscous"] * offered
    for shape in shapes:  # drawn where the logs have been, and nowhere else
        places = np.concatenate([log.motion.position for log in dataset.training])
        drawn = found_shape(shape, fit, dataset)
        assert (drawn.coordinate[0], drawn.coordinate[-1]) == (places.min(), places.max())
        ahead, behind = (curve.found for curve in drawn.curves.values())
        np.testing.assert_allclose(ahead, -behind, rtol=0.1)  # as friction does, it turns


PITCHES = (0.0113, 0.0171, 0.0079, 0.0253, 0.0061)  # m


# 6. Effects that raise the test error.


def test_what_test_logs_contradict_is_told_and_not_in_the_model() -> None:
    true = having(SLIDE, "cogging", p=0.021, a1=0.03, b1=0.02)
    logs = {"one": logged(true, Ride(1))}, {"held": logged(true, Ride(2))}
    rivals = few("cogging", "spring")
    for machine, confirmed in ((SLIDE, False), (true, True)):
        found = diagnose_axis(*begun(SLIDE, *logs, {"test": logged(machine, Ride(3))}), rivals)
        (finding,) = found.findings if confirmed else found.contradicted
        assert finding.effect == "cogging"
        assert (finding.tested.after < finding.tested.before) is confirmed
        assert finding.state is (Confirmation.CONFIRMED if confirmed else Confirmation.CONTRADICTED)
        assert (finding.confidence is not None) is confirmed
        told = (verdict_in_words(found), " ".join(finding_in_words(finding)))
        assert all(("contradict" in text) is not confirmed for text in told)
        assert (WRITE in next_commands(found)) is confirmed
        assert (found.named, found.final.axis.names[-1:]) == (
            (("cogging",), ("cogging",)) if confirmed else ((), found.base.axis.names[-1:])
        )
        assert ("were right" in told[1]) is confirmed


@cache
def confirmed() -> Finding:
    """A cogging that the test log confirms."""
    true = having(SLIDE, "cogging", p=0.021, a1=0.03, b1=0.02)
    one, held, test = ({str(i): logged(true, Ride(i))} for i in (1, 2, 3))
    (finding,) = diagnose_axis(*begun(SLIDE, one, held, test), few("cogging")).findings
    return finding


@pytest.mark.parametrize(
    ("after", "state"),
    [
        (0.5, Confirmation.CONFIRMED),
        (1.001, Confirmation.UNTESTED),
        (1.3, Confirmation.WITHIN_NOISE),
        (1.6, Confirmation.CONTRADICTED),
    ],
)
def test_noise_contradicts_nothing(after: float, state: Confirmation) -> None:
    """A stiff bristle makes noise of the path, of which the model without it has none."""
    named = confirmed()
    assert named.noise == pytest.approx(1.3 * NOISE / 20**0.5, rel=0.3)  # of 20 samples and more
    found = replace(named, tested=Errors(1.0, after, Role.TEST), noise=1.5)
    assert found.state is state
    assert (found.confidence is None) is (state is Confirmation.CONTRADICTED)


# 8. Bumps of another form, and coloured noise.

BUMPS = having(
    SLIDE, "roller_spikes", pitch=0.034, width=0.004, ahead=0.06, behind=0.04, phase=0.006
)
NEAR_BUMPS = ("backlash", "cogging", "flexible_mode", "presliding_hysteresis")


@pytest.mark.slow
@pytest.mark.parametrize("size", [1.0, 5.0])
@pytest.mark.parametrize("names", [NEAR_BUMPS, tuple(CATALOGUE)], ids=["few", "all"])
def test_bumps_of_another_form_alone_are_no_other_effect(
    size: float, names: tuple[str, ...]
) -> None:
    def bumps(x: Array, v: Array) -> Array:
        off = (x - 0.006 + 0.017) % 0.034 - 0.017
        height = size * np.where(v > 0.0, 0.06, -0.04)
        return -height * np.exp(-4.0 * np.log(2.0) * (2.0 * off / 0.006) ** 2)

    found = asked(BUMPS, SLIDE, few(*names), bumps)
    assert found.named == ()
    assert {f.effect for f in found.findings} == {"roller_spikes"}


@pytest.mark.slow
def test_a_lone_bump_is_no_cogging() -> None:
    def bump(x: Array, v: Array) -> Array:
        return 0.06 * np.exp(-4.0 * np.log(2.0) * ((x - 0.011) / 0.004) ** 2)

    found = asked(SLIDE, SLIDE, few(*NEAR_BUMPS), bump)
    assert (found.verdict, found.findings) == (Verdict.UNEXPLAINED, ())
    assert found.base.ratio > 5.0


@pytest.mark.parametrize("pole", [0.98, *(pytest.param(p, marks=SLOW) for p in (0.9, 0.995))])
def test_of_coloured_noise_alone_nothing_is_missing_over_a_floor_of_its_size(pole: float) -> None:
    size, rng = 0.010, np.random.default_rng(1)  # N

    def noise(x: Array, v: Array) -> Array:
        drawn = lfilter([1.0], [1.0, -pole], rng.standard_normal(len(x)))
        return size * drawn / drawn.std()

    found = asked(SLIDE, SLIDE, few("cogging", "quadratic_drag", "backlash", "wear"), noise)
    assert (found.verdict, found.findings) == (Verdict.NOTHING_MISSING, ())
    assert found.final.floor == pytest.approx(size, rel=0.2)


# 10. Several hidden effects, and viscous friction alone.


@pytest.mark.slow
def test_both_of_two_hidden_effects_are_named() -> None:
    """Friction that warms behind a hysteresis takes next to nothing of what both leave."""
    true = having(SLIDE, "presliding_hysteresis", reach=0.004, f0=0.05, f1=0.03, f2=0.02, f3=0.01)
    true = having(true, "thermal_drift", dry=0.4, viscous=0.0, tau=10.0, idle=1e-9)
    rivals = few("presliding_hysteresis", "thermal_drift", "cogging", "asymmetric_friction", "wear")
    found = asked(SLIDE, true, rivals, ride=Ride(1, 8.0))
    assert found.named == ("presliding_hysteresis", "thermal_drift")
    assert found.final.at_floor


@pytest.mark.parametrize(
    "count", [2, pytest.param(len(PITCHES), marks=pytest.mark.slow)], ids=["two", "five"]
)
def test_unrelated_periods_are_several_coggings_of_one_diagnosis(count: int) -> None:
    def coggings(x: Array, v: Array) -> Array:
        return sum(0.03 * np.sin(2.0 * np.pi * x / p + p) for p in PITCHES[:count])

    far = replace(SLIDE, hardware=replace(HARDWARE, travel=None))
    found = asked(far, far, few("cogging"), coggings, Ride(1, 5.0, reach=0.3))
    assert len(found.missing) == count
    assert {f.effect.split("_")[0] for f in found.findings} == {"cogging"}
    assert found.final.at_floor


def test_viscous_friction_alone_is_named_where_there_is_no_friction() -> None:
    free = replace(SLIDE, effects=())
    rivals = few("viscous_friction", "quadratic_drag", "constant_force", "cogging")
    found = asked(free, having(free, "viscous_friction", c=0.8), rivals)
    assert found.named == ("viscous_friction",)
    assert found.findings[0].parameters["c"] == pytest.approx(0.8, rel=0.02)


@pytest.mark.slow  # 6 s
def test_a_payload_that_swings_on_a_rope_is_a_mode_of_the_load() -> None:
    """A mode began at 1 Hz, so that the frame alone was named for a swing of 0.7 Hz, with 99 %."""
    true = having(SLIDE, "flexible_mode", load=0.25, frequency=0.7, damping=0.05)
    known = few("flexible_mode", "base_vibration", "backlash")
    found = asked(SLIDE, true, known, ride=Ride(1, seconds=10.0))
    assert "flexible_mode" in found.answers[0]
    assert found.final.at_floor
