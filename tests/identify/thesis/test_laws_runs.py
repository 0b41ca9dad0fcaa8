"""How chapters are put together: what is simulated where, and what arrives where in the result."""

from __future__ import annotations

from dataclasses import astuple, replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import CATALOGUE, axis_of

from identify.thesis import dynamic, future, informed, models
from identify.thesis.residuals import friction_of, frictions
from twin.core.control import Controller
from twin.effect import Excitation
from twin.log import AxisLog, Log
from twin.model.file import load_model
from twin.model.parameters import free_parameters, write

TRACK = load_model("thesis_track", CATALOGUE)
STUDY = load_model("thesis_simulation", CATALOGUE)
NAMES = ("Fc", "Fs", "v0", "sigma2")


def silent(*_) -> None:
    """No progress."""


# --- dynamic --------------------------------------------------------------------------------


def test_the_sine_carries_the_cable_at_its_place_without_feedback(monkeypatch):
    seen = {}
    monkeypatch.setattr(dynamic, "follow", lambda model, setpoint, rngs, **more: seen.update(
        setpoint=setpoint, controllers=more["controllers"], rngs=rngs))  # fmt: skip
    dynamic._sine(TRACK, "x", 0.07, dynamic.Size(1, 6.0), np.random.default_rng(0))
    force = seen["setpoint"].force[:, 0]
    t = np.arange(len(force)) / 1e3
    assert len(force) == round((6.0 + 0.75) * 1e3)
    cable = -(0.05 + 1.5 * 0.07 - 2.0 * 0.07**2 + 8.0 * 0.07**3)
    np.testing.assert_allclose(force, -cable + 0.21 * np.sin(2.0 * np.pi * t / 3.0), atol=1e-9)
    np.testing.assert_allclose(seen["setpoint"].position[:, 0], 0.07)
    assert seen["controllers"] == {"x": Controller()}
    assert seen["rngs"][0] is not seen["rngs"][1]


def test_a_record_begins_a_quarter_of_a_period_late_in_all_its_columns():
    n = np.arange(2000.0)
    log = Log(1e3, {"x": AxisLog({"position": n, "force": -n})}, truth={"x": {"lugre": 2.0 * n}})
    late = dynamic._late(log, "x")
    for column, size in ((late.axes["x"].position, 1.0), (late.axes["x"].force, -1.0),
                         (late.truth["x"]["lugre"], 2.0)):  # fmt: skip
        np.testing.assert_array_equal(column, size * n[750:])


def test_motions_of_the_picture_are_measured_plus_error_from_where_the_record_begins():
    measured = 0.01 * np.arange(100.0)
    motion = SimpleNamespace(sample_period=2e-3, position_at_samples=lambda shift: measured + shift)
    rest, own = np.arange(90.0) ** 2, -np.arange(90.0)
    found = dynamic._trace(SimpleNamespace(motion=motion), 10, rest, own)
    shown = slice(None, None, 5)  # every 10 ms
    np.testing.assert_allclose(found.time, 2e-3 * np.arange(10, 100)[shown])
    np.testing.assert_allclose(found.measured, measured[10:][shown])
    np.testing.assert_allclose(found.from_rest, (measured[10:] + rest)[shown])
    np.testing.assert_allclose(found.from_estimate, (measured[10:] + own)[shown])


def test_errors_are_of_the_first_period_and_of_what_follows(monkeypatch):
    known = dynamic._dynamic_part_free(TRACK.axes["x"])
    where = free_parameters(known)
    fit = SimpleNamespace(axis=write(known, where, [123.0, 0.7]),
                          beginnings=[SimpleNamespace(first=4)])  # fmt: skip
    rest, own = (np.r_[np.full(3000, a), np.full(1000, b)] for a, b in ((1.0, -2.0), (-3.0, 4.0)))
    for name, stub in (
        ("_by_simplex", lambda *_: np.array([9.0, 8.0])), ("_fitted", lambda *_: fit),
        ("_errors", lambda axis, log, begun: (rest, own) if begun.first == 4 else None),
        ("_trace", lambda log, first, a, b: (first, a is rest, b is own)),
    ):  # fmt: skip
        monkeypatch.setattr(dynamic, name, stub)
    log = SimpleNamespace(motion=SimpleNamespace(sample_period=1e-3))
    found = dynamic._at_place(known, [log], np.random.default_rng(0))
    np.testing.assert_allclose(found.errors, [[1.0, 3.0], [2.0, 4.0]])
    np.testing.assert_allclose(found.simplex, [9.0, 8.0])
    np.testing.assert_allclose(found.fitted, [123.0, 0.7])
    assert found.trace == (4, True, True)
    assert all(s >= 0.0 for s in found.seconds)


def test_the_dynamic_chapter_puts_each_place_and_record_where_it_belongs(monkeypatch):
    """Sines at three of the nine places without current noise, one with it for its information."""
    sines = []

    def sine(model, name, place, size, rng):
        sines.append((place, model.axes["x"].hardware.current_noise))
        return f"sine {len(sines) - 1}"

    def at_place(known, prepared, rng):
        k = int(prepared[-1])
        return dynamic._Place(
            np.array([10.0 + k, 20.0 + k]), np.array([30.0 + k, 40.0 + k]), (2.0 * k, 3.0 * k),
            np.array([[1.0, 2.0], [3.0, 4.0]]) + 10.0 * k, f"trace {k}",
        )  # fmt: skip

    for name, stub in (
        ("_sine", sine), ("_late", lambda log, name: log), ("_at_place", at_place),
        ("_prepared", lambda model, name, log: log),
        ("_closed", lambda model, name, known, place, rng: ("closed", place)),
        ("informed", lambda known, name, log, prepared: ("opened", log, prepared)),
    ):  # fmt: skip
        monkeypatch.setattr(dynamic, name, stub)
    found = dynamic.run([TRACK], CATALOGUE, dynamic.Size(3, 6.0), np.random.default_rng(0), silent)
    places = [-0.136, -0.136 + 0.102, -0.136 + 0.204]
    np.testing.assert_allclose(found.places, places)
    noise = TRACK.axes["x"].hardware.current_noise
    assert sines == [*((pytest.approx(p), 0.0) for p in places), (pytest.approx(places[0]), noise)]
    assert found.closed == ("closed", pytest.approx(-0.136))
    assert found.opened == ("opened", "sine 3", "sine 3")
    for by, first in ((found.simplex, (10, 20)), (found.fitted, (30, 40))):
        for (name, r), start, true in zip(by.items(), first, (260.0, 0.6), strict=True):
            np.testing.assert_allclose(r.values, start + np.arange(3.0))
            assert (r.true, r.unit) == (true, {"sigma0": "N/m", "sigma1": "N s/m"}[name])
    assert found.seconds == (2.0, 3.0)  # the median over the places
    np.testing.assert_allclose(found.first_period, [[1, 2], [11, 12], [21, 22]])
    np.testing.assert_allclose(found.afterwards, [[3, 4], [13, 14], [23, 24]])
    assert found.trace == "trace 0"


def test_what_a_record_says_is_over_the_planted_values(monkeypatch):
    axis = dynamic._dynamic_part_free(TRACK.axes["x"])
    where = free_parameters(axis)
    half = np.array([26.0, 0.03])
    monkeypatch.setattr(informed, "finished", lambda a, begun, logs, outcome: (a, begun, logs))
    monkeypatch.setattr(informed, "half_widths", lambda fit: half)
    monkeypatch.setattr(
        informed, "fit_axis", lambda a, logs: SimpleNamespace(axis=write(a, where, [286.0, 0.54]))
    )
    log = SimpleNamespace(truth={"x": {"lugre": np.array([1.0, 5.0] * 9)}})
    found = informed.informed(axis, "x", log, ())
    assert found.friction == pytest.approx(2.0)
    assert found.noise == pytest.approx(2e-4 * 53.4)
    assert found.half_widths == pytest.approx({"sigma0": 0.1, "sigma1": 0.05})
    assert found.found == pytest.approx({"sigma0": 1.1, "sigma1": 0.9})


# --- future ---------------------------------------------------------------------------------


def test_one_log_is_held_out_and_one_is_kept_apart(monkeypatch):
    seeds, prepared = [], []

    def datasets(machine, logs, held, length=None):
        prepared.append((sorted(logs), sorted(held), length))
        return {"x": SimpleNamespace(test_function_length=0.037, made=len(prepared))}

    monkeypatch.setattr(future, "simulate", lambda *_, seed, **more: seeds.append(seed))
    monkeypatch.setattr(future, "datasets", datasets)
    dataset, test = future._recorded(
        STUDY, "x", future.SMALL, np.random.default_rng(0), silent
    )  # fmt: skip
    assert len(set(seeds)) == 4
    assert prepared == [(["log 1", "log 2"], ["log 3"], None), (["log 4"], [], 0.037)]
    assert (dataset.made, test.made) == (1, 2)


def test_the_number_of_elements_with_the_largest_evidence_is_chosen(monkeypatch):
    memory = load_model("thesis_memory", CATALOGUE).axes["x"]
    evidence_of, tried = {1: 0.0, 3: 50.0, 4: 80.0, 6: 70.0}, []

    def fit(axis, logs):
        assert logs == "fit logs"
        count = int(friction_of(axis).values["elements"])
        tried.append(count)
        return SimpleNamespace(axis=count, residual=count, floor=2.0)

    def evidence(first, residual, more):
        assert (first, more) == (1, residual - 1)
        return SimpleNamespace(delta_bic=evidence_of[residual])

    monkeypatch.setattr(future, "fit_axis", fit)
    monkeypatch.setattr(future, "evidence", evidence)
    monkeypatch.setattr(future, "error_on", lambda axis, logs: np.full(4, 10.0 * axis))
    excitation = Excitation(-0.1, 0.1, 0.2, 1.0, 5.0, 1e-3)
    dataset = SimpleNamespace(excitation=excitation, fit="fit logs")
    size = replace(future.SMALL, elements=(1, 3, 4, 6))
    fits = future._elements(memory, dataset, size, silent)
    found, best = future._compared(size.elements, fits, SimpleNamespace(fit="test"))
    assert tried == [1, 3, 4, 6]
    assert [astuple(e) for e in found] == [
        (1, 0.0, 5.0), (3, 50.0, 15.0), (4, 80.0, 20.0), (6, 70.0, 30.0)
    ]  # fmt: skip
    assert best.residual == 4


# --- models ---------------------------------------------------------------------------------


def test_an_error_is_over_the_floor_of_its_own_log(monkeypatch):
    monkeypatch.setattr(models, "error_on", lambda axis, logs: np.full(3, logs[0].error))
    monkeypatch.setattr(models, "floor_of", lambda axis, logs: logs[0].floor)
    logs = [SimpleNamespace(motion=SimpleNamespace(name=n), error=e, floor=f)
            for n, e, f in (("b", 6.0, 2.0), ("a", 5.0, 4.0))]  # fmt: skip
    fit = SimpleNamespace(axis=None, logs=logs)
    found = models._by_log(fit, ["a", "b", "still"])
    assert found[:2] == [1.25, 3.0]
    assert np.isnan(found[2])
    assert models.overall(np.array(found)) == pytest.approx(np.sqrt((1.25**2 + 9.0) / 2.0))


def test_random_starts_are_drawn_within_three_times_and_the_bounds(monkeypatch):
    """A start is right where the error over all logs is at most 1.2 times the floor."""
    tried, ends = [], iter([1.19, 1.21, 1.0, 7.0, 1.1] * 8)
    dataset = SimpleNamespace(
        excitation=Excitation(-0.1, 0.1, 0.2, 1.0, 5.0, 1e-3),
        fit=[SimpleNamespace(motion=SimpleNamespace(name="a"))],
    )

    def fit(axis, logs):
        tried.append(axis)
        return axis

    monkeypatch.setattr(models, "fit_axis", fit)
    monkeypatch.setattr(models, "_by_log", lambda fit, names: [next(ends)])
    effect = CATALOGUE["lugre"]
    share = models._share_right(axis_of(), effect, dataset, 40, np.random.default_rng(3))
    assert share == pytest.approx(0.6)
    begun = models._begun(axis_of(), effect, dataset.excitation)
    assert begun.mass_fixed
    start = begun.effects[0].values
    drawn = {k: np.array([friction_of(a).values[k] for a in tried]) for k in start}
    for p in effect.parameters:
        values = drawn[p.name]
        if p.name in begun.effects[0].fixed or p.fixed:
            assert np.all(values == start[p.name])
        else:
            assert np.all((values >= p.lower) & (values <= p.upper))
            assert values.max() <= 3.0 * start[p.name] * (1 + 1e-12) or p.at_least
            assert np.ptp(values) > 0.5 * start[p.name] or start[p.name] == 0.0
            if not p.at_least:  # as often less as more
                assert np.median(values) == pytest.approx(start[p.name], rel=0.5)
    assert np.all(drawn["Fs"] >= drawn["Fc"])


def test_each_law_is_fitted_to_the_logs_of_every_machine(monkeypatch):
    """Ratio (machine, law, behaviour): the numbers of the machine, of the law and of the log."""
    laws = list(frictions(CATALOGUE))[:3]
    number = {name: i + 1 for i, name in enumerate(laws)}

    def planted(model):
        return number[friction_of(model.axes["x"]).effect.name]

    def datasets(model, logs, held, length):
        assert length == models.TEST_FUNCTION
        assert (list(logs), held) == (["map", "loop"], {})
        hardware = model.axes["x"].hardware
        assert hardware.current_noise * hardware.force_constant == models.FORCE_NOISE
        assert (hardware.encoder_noise, model.sample_rate) == (models.READING_NOISE, models.RATE)
        return {"x": SimpleNamespace(machine=planted(model))}

    def timed(machine, effect, dataset):
        return (dataset.machine, number[effect.name]), 1.0 * dataset.machine

    for name, stub in (
        ("behaviours", lambda model, rng: {"map": planted(model), "loop": planted(model)}),
        ("traits", lambda stage, logs, rng: ("traits", planted(stage))),
        ("datasets", datasets), ("_timed", timed),
        ("_by_log", lambda fit, names: [100.0 * fit[0] + 10.0 * fit[1] + i
                                        for i in range(len(names))]),
        ("_share_right", lambda machine, law, dataset, starts, rng:
            0.1 * dataset.machine + number[law.name]),
        ("_cost", lambda machine: 1e-9 * number[friction_of(machine).effect.name]),
        ("_drawn", lambda machine, turns: (number[friction_of(machine).effect.name], len(turns))),
    ):  # fmt: skip
        monkeypatch.setattr(models, name, stub)
    found = models.run([STUDY], CATALOGUE, models.Size(3, 5), np.random.default_rng(0), silent)
    assert found.laws == tuple(laws)
    expected = [[[100 * m + 10 * k + b for b in (0, 1)] for k in (1, 2, 3)] for m in (1, 2, 3)]
    np.testing.assert_allclose(found.ratios, expected)
    np.testing.assert_allclose(found.right, [1.1, 2.2, 3.3])
    np.testing.assert_allclose(found.seconds, 2.0)  # of each law, the mean over the machines
    np.testing.assert_allclose(found.step, [1e-9, 2e-9, 3e-9])
    assert found.traits == [("traits", i) for i in (1, 2, 3)]
    assert (found.starts, found.behaviours) == (5, ("map", "loop"))
    assert found.loops == {name: (i, len(models.LOOP)) for name, i in number.items()}
    assert found.nested == {name: (i, len(models.NESTED)) for name, i in number.items()}
