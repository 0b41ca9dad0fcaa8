"""Parts of the chapters against closed forms, without a machine."""

from __future__ import annotations

import runpy
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import built_fit
from constructed import log_of

from identify.estimation.intervals import half_widths, half_widths_of
from identify.output.report.thesis import track as page
from identify.thesis import track, twin
from twin import schemas


def test_signals_of_a_log_are_those_of_its_motion():
    rate, turn = 2000.0, 2.0 * np.pi * 2.0
    t = np.arange(6001) / rate
    x = 0.03 * np.sin(turn * t)
    found = twin._signals(log_of(rate, x, np.cos(t)), "x")
    inner = slice(200, -200)
    wanted = {
        "position": x, "velocity": 0.03 * turn * np.cos(turn * t),
        "acceleration": -0.03 * turn**2 * np.sin(turn * t), "force": np.cos(t),
    }  # fmt: skip
    for name, values in wanted.items():
        np.testing.assert_allclose(
            found[name][inner], values[inner], atol=2e-3 * np.abs(values).max()
        )


def test_the_band_of_a_curve_follows_from_what_each_parameter_does_to_it(monkeypatch):
    fit = built_fit(0.1)
    count = len(fit.scaling.where)
    slopes = np.random.default_rng(3).standard_normal((count, 4))

    def curve(axis, place, velocity):
        from twin.model.parameters import read

        return read(axis, fit.scaling.where) @ slopes

    monkeypatch.setattr(track, "_curve", curve)
    monkeypatch.setattr(track, "half_widths", lambda _: np.linspace(0.01, 0.02, count))
    monkeypatch.setattr(track, "half_widths_of", lambda _, found: found)
    _, found = track._of_law(fit, 0.0, np.ones(3))
    np.testing.assert_allclose(found, slopes, rtol=1e-6)


def test_what_two_estimates_have_in_common_is_surer_than_either():
    """Two columns that are nearly one: their sum is known where neither of them is."""
    rng = np.random.default_rng(5)
    one = rng.standard_normal(600)
    columns = np.stack([one, one + 1e-3 * rng.standard_normal(600)], axis=1)
    fit = SimpleNamespace(jacobian=columns, residual=rng.standard_normal(600))
    alone, (both,) = half_widths(fit), half_widths_of(fit, np.ones((2, 1)))
    assert both < 0.01 * alone.min()
    assert both == pytest.approx(1.7 / np.sqrt(600), rel=0.5)


def test_the_largest_error_of_the_track_is_told(monkeypatch):
    def errors(a, b):
        return {1.0: {n: SimpleNamespace(largest_error=a) for n in page.LEVELS},
                -1.0: {n: SimpleNamespace(largest_error=b) for n in page.LEVELS}}  # fmt: skip

    monkeypatch.setattr(page, "track_in_words", lambda result: [])
    told = page._answer(SimpleNamespace(fits=errors(0.001, 0.0023), maps=errors(0.04, 0.03)))
    assert "0.23 %" in told.headline
    assert {t.value for t in told.tiles} == {"4 %", "0.23 %"}


def test_the_command_writes_every_schema(monkeypatch, tmp_path):
    files = {tmp_path / "a.json": "one", tmp_path / "b.json": "two"}
    monkeypatch.setattr(schemas, "written", lambda: files)
    runpy.run_module("twin.schemas", run_name="__main__")
    assert {p: p.read_text() for p in tmp_path.iterdir()} == files


@pytest.mark.parametrize("off", [-0.12, -0.05, 0.04, 0.13])
def test_a_lines_frequency_is_refined_from_either_side(off):
    from identify.dataset.spectral_lines import _refined
    from identify.dataset.spectrum import Record

    t = np.sort(np.random.default_rng(4).uniform(0.0, 10.0, 3000))
    true, step = 7.3, 0.1
    frequency, share = _refined(
        [Record(t, np.sin(2.0 * np.pi * true * t))], true + off * step, step
    )
    assert frequency == pytest.approx(true, abs=0.01 * step)
    assert share == pytest.approx(1.0, abs=0.01)
