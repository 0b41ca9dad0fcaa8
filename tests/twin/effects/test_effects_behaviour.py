"""What each effect does, in number, against closed forms worked out here."""

from collections.abc import Callable

import numpy as np
import pytest
from effect_runs import CATALOGUE

from twin.effect import DRY, FRICTION, IO_SIZE, OUT, READING, STATIC, VISCOUS, U, V
from twin.effect import DT as STEP
from twin.laws.motion import Array, Motion
from twin.laws.stepping import trace

DT = 1e-4  # s


def motion(x: Array, u: Array | float = 0.0) -> Motion:
    """A motion by the positions in the middle of its samples."""
    return Motion(DT, x, np.gradient(x, DT), np.broadcast_to(np.asarray(u, float), x.shape).copy())


def after(name: str, slot: int, moves: Motion, **values: float) -> Array:
    effect = CATALOGUE[name]
    return trace(effect, {**effect.starts(), **values}, moves).after[:, slot]


STILL = np.zeros(5000)
SWEEP = np.linspace(-0.1, 0.1, 20_001)


def test_a_step_through_the_lag_is_an_exponential() -> None:
    tau, n = 3e-3, 400
    u = np.where(np.arange(n) < 10, 0.0, 2.0)
    force = after("actuator_lag", U, motion(np.zeros(n), u), tau=tau)
    t = (np.arange(n - 10) + 0.5) * DT
    np.testing.assert_allclose(
        force[10:], 2.0 * (1.0 - np.exp(-t / tau)), atol=2.0 * (DT / tau) ** 2
    )
    mean = np.exp(-t / tau) * np.sinh(0.5 * DT / tau) / (0.5 * DT / tau)  # over each sample
    np.testing.assert_allclose(force[10:], 2.0 * (1.0 - mean), rtol=0, atol=1e-12)


@pytest.mark.parametrize(("u", "wanted"), [(0.4, 0.0), (-0.4, 0.0), (1.5, 1.0), (-1.5, -1.0)])
def test_a_dead_zone_takes_its_width(u: float, wanted: float) -> None:
    assert after("actuator_deadband", U, motion(STILL[:2], u), width=0.5)[1] == wanted


@pytest.mark.parametrize(("u", "wanted"), [(1.9, 1.9), (5.0, 2.75), (-5.0, -2.75)])
def test_saturation_loses_its_part_above_the_limit(u: float, wanted: float) -> None:
    found = after("actuator_saturation", U, motion(STILL[:2], u), limit=2.0, loss=0.75)
    assert found[1] == pytest.approx(wanted)


def test_force_constant_ripple_is_in_proportion_to_the_command() -> None:
    p, a, b = 0.024, 0.03, -0.02
    ratio = after("force_constant_ripple", U, motion(SWEEP, 7.0), p=p, a1=a, b2=b) / 7.0 - 1.0
    angle = 2.0 * np.pi * SWEEP / p
    np.testing.assert_allclose(ratio, a * np.sin(angle) + b * np.cos(2.0 * angle), atol=1e-13)


@pytest.mark.parametrize("samples", [0.25, 3.5, 20.0])
def test_a_delayed_reading_of_a_ramp_is_late_by_the_distance(samples: float) -> None:
    x = 0.2 * DT * np.arange(200)
    found = after("encoder_delay", READING, motion(x), tau=samples * DT)
    np.testing.assert_allclose((x - found)[50:], 0.2 * DT * samples, rtol=1e-9)


def test_readings_are_the_nearest_whole_steps() -> None:
    found = after("encoder_quantization", READING, motion(SWEEP), step=3e-4)
    assert np.abs(found - SWEEP).max() <= 1.5e-4 + 1e-15
    np.testing.assert_allclose(np.diff(np.unique(found)), 3e-4, rtol=1e-9)


def test_encoder_ripple_has_its_amplitude_and_period() -> None:
    period, x = 1e-3, 1e-3 * np.arange(4000) / 400
    error = (
        after("encoder_ripple", READING, motion(x), period=period, a1=3e-6, b1=4e-6, b2=1e-6) - x
    )
    lines = np.fft.rfft(error) / len(x) * 2.0  # ten periods
    assert np.abs(lines[10]) == pytest.approx(5e-6, rel=1e-9)
    assert np.abs(lines[20]) == pytest.approx(1e-6, rel=1e-9)
    assert np.abs(np.delete(lines, [10, 20])).max() < 1e-12


def test_a_disturbance_has_its_frequency_and_mean_over_a_sample() -> None:
    f, a, b = 50.0, 0.6, -0.8
    force = after("periodic_disturbance", OUT, motion(STILL), f=f, a=a, b=b)
    edges = 2.0 * np.pi * f * DT * np.arange(len(STILL) + 1)
    integral = (-a * np.cos(edges) + b * np.sin(edges)) / (2.0 * np.pi * f)
    np.testing.assert_allclose(force, np.diff(integral) / DT, atol=1e-10)


def test_an_end_stop_pushes_with_its_stiffness_beyond_the_travel_alone() -> None:
    slow = motion(SWEEP)
    slow.v[:] = 0.0
    values = {"low": -0.08, "high": 0.09, "stiffness": 20.0, "relaxation": 0.0}
    force = after("end_stop", OUT, slow, **values)
    depth = np.minimum(SWEEP + 0.08, 0.0) + np.maximum(SWEEP - 0.09, 0.0)
    np.testing.assert_allclose(force, -20.0 * depth / (1.0 + 20.0 * DT**2), atol=1e-12)
    assert np.abs(force).max() == pytest.approx(0.4, rel=1e-3)


def test_the_loop_of_the_cable_has_the_area_of_its_slipping_layers() -> None:
    """A layer that slips at f after a deflection d loses 4 f (A - d) in a cycle of amplitude A."""
    n, size, reach = 4000, 0.01, 0.004
    edges = size * np.sin(2.0 * np.pi * np.arange(3 * n + 1) / n)
    moves = Motion(DT, 0.5 * (edges[1:] + edges[:-1]), np.diff(edges) / DT, np.zeros(3 * n))
    forces = {"f0": 0.4, "f1": 0.3, "f2": 0.2, "f3": 0.1}
    found = CATALOGUE["cable_hysteresis"]
    names = [p.name for p in found.parameters if p.name != "reach"]
    values = dict(zip(names, forces.values(), strict=True))
    force = after(found.name, OUT, moves, reach=reach, **values)
    lost = -np.sum(force[-n:] * moves.v[-n:]) * DT
    slips = reach * 0.5 ** np.arange(4)
    wanted = sum(4.0 * f * (size - d) for f, d in zip(forces.values(), slips, strict=True))
    assert lost == pytest.approx(wanted, rel=1e-3)


@pytest.mark.parametrize("rest", [0.05, 0.2, 0.4])
def test_breakaway_grows_with_the_time_at_rest(rest: float) -> None:
    values = {"growth": 0.8, "time": 0.2, "slip": 1e-3}
    factor = after("dwell_stiction", STATIC, motion(STILL), **values)
    assert factor[round(rest / DT)] == pytest.approx(1.0 + 0.8 * rest / (rest + 0.2), rel=1e-9)


def test_friction_recovers_with_the_cooling_time() -> None:
    """With no more friction work the heat, and the logarithm of the loss, decay exponentially."""
    effect, tau = CATALOGUE["thermal_drift"], 0.3
    values = {"dry": 2.0, "viscous": 1.0, "tau": tau}

    io, s, p = np.zeros(IO_SIZE), np.zeros(1), np.array(list(values.values()))
    loss = []
    for k in range(8000):
        io[:] = 0.0
        io[STEP], io[DRY], io[VISCOUS] = DT, 1.0, 1.0
        io[FRICTION], io[V] = (2.0, 0.5) if k < 3000 else (0.0, 0.0)
        effect.law(p, s, io)
        loss.append((-np.log(io[DRY]) / 2.0, -np.log(io[VISCOUS])))
    dry, viscous = np.array(loss).T
    t = np.arange(8000) * DT
    heat = tau * (1.0 - np.exp(-np.minimum(t, 0.3) / tau)) * np.exp(-np.maximum(t - 0.3, 0.0) / tau)
    np.testing.assert_allclose(dry, heat, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(viscous, heat, rtol=1e-9, atol=1e-12)


def test_wear_grows_with_the_distance_travelled() -> None:
    moves = motion(np.concatenate([SWEEP, SWEEP[::-1]]))
    factor = after("wear", DRY, moves, rate=0.5)
    assert factor[len(SWEEP) - 1] == pytest.approx(1.0 + 0.5 * 0.2, rel=1e-3)
    assert factor[-1] == pytest.approx(1.0 + 0.5 * 0.4, rel=1e-3)


@pytest.mark.parametrize(
    "check",
    [
        test_a_step_through_the_lag_is_an_exponential,
        lambda: test_a_dead_zone_takes_its_width(1.5, 1.0),
        lambda: test_saturation_loses_its_part_above_the_limit(5.0, 2.75),
        test_force_constant_ripple_is_in_proportion_to_the_command,
        lambda: test_a_delayed_reading_of_a_ramp_is_late_by_the_distance(3.5),
        test_readings_are_the_nearest_whole_steps,
        test_encoder_ripple_has_its_amplitude_and_period,
        test_a_disturbance_has_its_frequency_and_mean_over_a_sample,
        test_an_end_stop_pushes_with_its_stiffness_beyond_the_travel_alone,
        test_the_loop_of_the_cable_has_the_area_of_its_slipping_layers,
        lambda: test_breakaway_grows_with_the_time_at_rest(0.2),
        test_wear_grows_with_the_distance_travelled,
    ],
)
def test_a_planted_fault_is_seen(
    check: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each of these fails where the laws use values a twentieth too large."""
    right = after

    def wrong(name: str, slot: int, moves: Motion, **values: float) -> Array:
        return right(name, slot, moves, **{k: 1.05 * v for k, v in values.items()})

    monkeypatch.setitem(globals(), "after", wrong)
    with pytest.raises(AssertionError):
        check()
