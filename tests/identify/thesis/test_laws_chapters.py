"""The chapters "track", "twin", "residuals" and "future" in parts."""

from __future__ import annotations

from dataclasses import astuple, replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import CATALOGUE, axis_of, built_fit, fitted
from constructed import COVERED
from scipy.stats import t as student

from identify.estimation import curve_band
from identify.estimation.intervals import half_widths_of
from identify.estimation.stribeck_curve import StribeckCurve
from identify.estimation.velocity_map import VelocityMap
from identify.thesis import future, residuals, track, twin
from twin.model.file import load_model
from twin.model.parameters import read

TRACK = load_model("thesis_track", CATALOGUE)
CURVE = StribeckCurve(0.285, 0.335, 0.01, 0.018)
SPEEDS = np.array([0.001, 0.003, 0.006, 0.01, 0.015, 0.03, 0.06, 0.1, 0.2])


def silent(*_) -> None:
    """No progress."""


def test_the_band_of_a_curve_follows_from_what_each_parameter_does_to_it(monkeypatch):
    fit = built_fit(0.1)
    count = len(fit.scaling.where)
    slopes = np.random.default_rng(3).standard_normal((count, 4))

    monkeypatch.setattr(
        track, "_curve", lambda axis, place, velocity: read(axis, fit.scaling.where) @ slopes
    )
    monkeypatch.setattr(curve_band, "half_widths", lambda _: np.linspace(0.01, 0.02, count))
    monkeypatch.setattr(curve_band, "half_widths_of", lambda _, found: found)
    _, found = track._of_law(fit, 0.0, np.ones(3))
    np.testing.assert_allclose(found, slopes, rtol=1e-6)


def test_what_two_estimates_have_in_common_is_surer_than_either():
    """Two columns that are nearly one: their sum is known where neither of them is."""
    rng = np.random.default_rng(5)
    one = rng.standard_normal(600)
    columns = np.stack([one, one + 1e-3 * rng.standard_normal(600)], axis=1)
    fit = SimpleNamespace(jacobian=columns, residual=rng.standard_normal(600))
    alone, (both,) = half_widths_of(fit, np.eye(2)), half_widths_of(fit, np.ones((2, 1)))
    assert both < 0.01 * alone.min()
    assert both == pytest.approx(1.7 / np.sqrt(600), rel=0.5)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_curve_through_a_map_has_the_intervals_of_least_squares(way):
    """By the scatter about the curve over its slopes; a plateau weighs by its samples."""
    scatter = 1e-5 * np.random.default_rng(4).standard_normal(len(SPEEDS))
    samples = np.linspace(50.0, 150.0, len(SPEEDS))
    one_way = VelocityMap(way * SPEEDS, CURVE(SPEEDS) + scatter, 0.0 * SPEEDS, samples)
    values, half = track._through(one_way)
    np.testing.assert_allclose(values, astuple(CURVE)[:4], rtol=1e-2)
    found = StribeckCurve(*values)
    columns, weight = found.slopes(SPEEDS), np.diag(samples)
    left = found(SPEEDS) - one_way.friction
    freedom = len(SPEEDS) - 4
    covariance = np.linalg.inv(columns.T @ weight @ columns) * (left @ weight @ left) / freedom
    expected = student.ppf(0.95, freedom) * np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(half, expected, rtol=1e-5)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("place", [-0.1, 0.05])
def test_steady_friction_is_what_the_laws_reach_at_one_place(way, place):
    """Stribeck's curve with the level of the place, more forwards than backwards."""
    axis = TRACK.axes["x"]
    along = np.pi * (place + 0.17) / 0.34
    level = 1.0 + 0.06 * np.cos(along) - 0.015 * np.cos(2 * along) + 0.008 * np.cos(3 * along)
    level *= 1.0 + 0.02 * way
    for v in (0.002, 0.1):
        curve = level * (0.285 + 0.05 * np.exp(-((v / 0.01) ** 2))) + 0.018 * v
        assert track.steady_friction(axis, place, way * v) == pytest.approx(curve, rel=2e-3)
    values = track._curve(axis, place, way * SPEEDS)
    expected = [0.285 * level, 0.335 * level, 0.01, 0.018]
    assert np.all(np.abs(values / expected - 1.0) < [5e-3, 5e-3, 2e-2, 0.05])


def test_brisk_moves_are_repeated_and_too_fast_ones_left_out(monkeypatch):
    monkeypatch.setattr(track, "simulate", lambda model, moves, **more: (moves, more["seed"]))
    size = track.Size(1, (0.001, 0.004, 0.005, 0.07, 0.08), 3)
    logs = track._logs(TRACK, "x", 0.02, size, np.random.default_rng(0))
    assert {label: len(moves.speeds) for label, (moves, _) in logs.items()} == {
        "0.001 m/s": 1, "0.004 m/s": 1, "0.005 m/s": 3, "0.07 m/s": 3,
    }  # fmt: skip
    assert len({seed for _, seed in logs.values()}) == 4
    for label, (moves, _) in logs.items():
        assert {f"{v:g} m/s" for v in moves.speeds} == {label}
        assert (moves.at, moves.span) == ((0.02,), 0.01)


def test_at_one_place_friction_and_its_direction_are_fitted_and_the_rest_is_known(monkeypatch):
    """What varies along the track is a slope there; spikes repeat and are not at the places."""
    monkeypatch.setattr(track, "fit_axis", lambda axis, logs: (axis, logs))
    monkeypatch.setattr(
        track, "datasets", lambda *_: {"x": SimpleNamespace(fit="logs", excitation=COVERED)}
    )
    both = VelocityMap(
        *(
            np.r_[a, b]
            for a, b in (
                (SPEEDS, -SPEEDS),
                (CURVE(SPEEDS), CURVE(SPEEDS)),
                (SPEEDS, SPEEDS),
                (SPEEDS, SPEEDS),
            )
        )
    )
    axis, logs = track._local_fit(TRACK, "x", {}, both)
    assert logs == "logs"
    local = axis["position_dependent_friction"]
    assert set(axis.names) == {"lugre", "cable_slab", local.effect.name, "asymmetric_friction"}
    first, *others = (p.name for p in local.effect.strengths)
    assert first not in local.fixed
    assert local.fixed.issuperset(others)
    assert axis.mass_fixed
    begun = axis["lugre"].values
    assert [begun[n] for n in track.NAMES] == pytest.approx(astuple(CURVE)[:4], rel=1e-4)
    assert begun["sigma0"] != 260.0  # from the start rule
    assert axis["lugre"].fixed == {"n"}
    assert axis["cable_slab"].fixed == set(axis["cable_slab"].values)
    assert axis["cable_slab"].values == TRACK.axes["x"]["cable_slab"].values
    assert not any(axis["asymmetric_friction"].values.values())


def test_each_place_and_direction_has_its_own_map_fit_and_planted_curve(monkeypatch):
    """Numbers that tell the way (map 100, fit 200, planted 300), the direction and the place."""
    seen = []

    def velocity_map(axis, motion):
        seen.append(motion)
        return VelocityMap(*(np.array([1.0, -1.0, 2.0, -2.0]) for _ in range(4)))

    def sign(velocity):
        return 10.0 * float(np.sign(velocity[0]))

    for name, stub in (
        ("_logs", lambda model, name, place, size, rng: {"one": place, "two": place}),
        ("motion_of", lambda log, name, label, ripples: (label, log)),
        ("velocity_map", velocity_map),
        ("_local_fit", lambda model, name, logs, found: logs["one"]),
        ("_through", lambda m: (100.0 + sign(m.velocity) + np.arange(4.0), np.full(4, 0.1))),
        ("_of_law", lambda fit, place, v: (
            200.0 + sign(v) + fit + np.arange(4.0) + len(v), np.full(4, 0.2))),
        ("_curve", lambda axis, place, v: 300.0 + sign(v) + place + np.arange(4.0)),
    ):  # fmt: skip
        monkeypatch.setattr(track, name, stub)
    size = replace(track.SMALL, places=3)
    found = track.run([TRACK], CATALOGUE, size, np.random.default_rng(0), silent)
    places = -0.136 + 3 * 34e-3 * np.arange(3)
    np.testing.assert_allclose(found.places, places)
    assert seen == [(label, p) for p in found.places for label in ("one", "two")]
    for way in (1.0, -1.0):
        for j, name in enumerate(track.NAMES):
            mapped, law = found.maps[way][name], found.fits[way][name]
            np.testing.assert_allclose(mapped.found, 100.0 + 10.0 * way + j)
            np.testing.assert_allclose(law.found, 202.0 + 10.0 * way + j + places)
            for along, half in ((mapped, 0.1), (law, 0.2)):
                np.testing.assert_allclose(along.half, half)
                np.testing.assert_allclose(along.planted, 300.0 + 10.0 * way + j + places)
            assert mapped.unit == {"Fc": "N", "Fs": "N", "v0": "m/s", "sigma2": "N s/m"}[name]


# --- residuals and twin ---------------------------------------------------------------------


def test_free_values_of_the_planted_friction_stand_beside_those_found():
    planted = replace(fitted("lugre", Fc=0.2), fixed=frozenset({"n", "sigma1"}))
    found = axis_of().with_effect(fitted("lugre", Fc=0.3, Fs=0.4))
    told = residuals._values(planted, found)
    assert "n" not in told
    assert "sigma1" not in told
    assert (told["Fc"].true, told["Fc"].mean, told["Fc"].unit) == (0.2, 0.3, "N")
    assert told["Fs"].mean == 0.4
    assert residuals._values(planted, axis_of()) == {}


def test_machine_twin_and_the_heavier_machine_are_each_identified(monkeypatch):
    """Every log is a name and every fit says of which log it is."""
    stage = load_model("proton_xy", CATALOGUE)
    masses, seeds = [], []

    def simulate(machine, kind, *, seed, duration, simulator):
        masses.append(machine.axes["x"].mass)
        seeds.append(seed)
        assert list(machine.axes) == ["x"]
        return f"log {len(masses)}"

    for name, stub in (
        ("simulate", simulate), ("identified", lambda model, log: f"fit of {log}"),
        ("twin_of", lambda fit, log, simulator: f"twin of {fit} on {log}"),
        ("agreement", lambda a, b, catalogue: (a, b)),
        ("closed_loop_errors", lambda machine, follower, axis: (machine, follower, axis)),
    ):  # fmt: skip
        monkeypatch.setattr(twin, name, stub)
    found = twin.run([stage], CATALOGUE, twin.SMALL, np.random.default_rng(0), silent)
    own = stage.axes["x"].mass
    assert masses == pytest.approx([own, 1.01 * own])
    assert found.added == pytest.approx(0.01 * own)
    assert len(set(seeds)) == 2
    follower = "twin of fit of log 1 on log 1"
    assert found.alike == ("fit of log 1", f"fit of {follower}")
    assert found.changed == ("fit of log 1", "fit of log 2")
    assert found.errors == ("log 1", follower, "x")


# --- future ---------------------------------------------------------------------------------


def test_friction_near_zero_speed_is_read_in_both_ways(monkeypatch):
    """Each speed has a log of its own; the map reads it forwards; the law is fitted to all."""
    axis, logs = load_model("thesis_simulation", CATALOGUE), []

    def one_way(motion):
        return SimpleNamespace(friction=np.array([motion, 3.0 * motion]))

    def velocity_map(axis, motion):
        return SimpleNamespace(towards=lambda way: one_way(motion if way > 0 else np.nan))

    def simulate(model, moves, *, seed, simulator):
        assert moves.longest_plateau == 7.0
        logs.append(seed)
        return moves.speeds[0]

    prepared = SimpleNamespace(excitation=SimpleNamespace(force_max=1.0), fit="fit")
    changed = axis.axes["x"].with_effect(replace(
        residuals.friction_of(axis.axes["x"]),
        values={**residuals.friction_of(axis.axes["x"]).values, "Fs": 0.5, "Fc": 0.5},
    ))  # fmt: skip
    for name, stub in (
        ("simulate", simulate), ("velocity_map", velocity_map),
        ("motion_of", lambda log, name, label, ripples: log),
        ("datasets", lambda model, logs, held: {"x": prepared}),
        ("fit_axis", lambda a, logs: SimpleNamespace(axis=changed)),
        ("steady_friction", lambda a, place, v: a["lugre"].values["Fs"] + v),
    ):  # fmt: skip
        monkeypatch.setattr(future, name, stub)
    monkeypatch.setattr(type(CATALOGUE["lugre"]), "starts", lambda self, seen=None: {})
    speeds = (1e-4, 3e-4)
    size = replace(future.SMALL, slow=speeds, plateau=7.0)
    found = future._slow(axis, size, np.random.default_rng(0), silent)
    assert len(set(logs)) == 2
    np.testing.assert_allclose(found.speed, speeds)
    np.testing.assert_allclose(found.mapped, 2.0 * np.array(speeds))
    np.testing.assert_allclose(found.planted, 0.335 + np.array(speeds))
    np.testing.assert_allclose(found.fitted, 0.5 + np.array(speeds))
