"""Laws of a force that repeats along the track: its period, its terms, whether logs share it."""

from dataclasses import replace

import numpy as np
import pytest
from constructed import dataset_of, effect, fit_of, ridden, windowed

from identify.dataset.spectrum import Record
from identify.estimation.residual_dependence import Repeat, _strongest, _term, not_general
from identify.output.words.residual import repeat_in_words
from twin.model.machine import AxisModel


def test_a_force_of_position_has_its_period_and_term():
    m = ridden(lambda m: 0.0 * m.time)
    x = m.position
    for pitch in (2.3e-3, 5.7e-3):
        force = 0.4 * np.cos(2.0 * np.pi * x / pitch - 1.1) + 0.7
        found = _strongest([Record(x, force)])
        assert found.period == pytest.approx(pitch, rel=0.1 * pitch / np.ptp(x))
        term = _term(force, x, pitch)
        # force ~ Re(term exp(2 pi i x / period))
        assert abs(term - 0.4 * np.exp(-1.1j)) < 1e-9
    assert _strongest([Record(0.0 * x, force)]) is None
    assert _strongest([Record(x, np.random.default_rng(4).normal(size=len(x)))]) is None


def test_a_repeat_is_general_where_its_terms_are_alike():
    def repeat(phase, height=1.0):
        return Repeat(2.5e-3, {"a": 1.0, "b": height}, {"a": 0.3, "b": 0.3 + phase})

    turned = 2.0 * np.arcsin(0.25)  # of a unit vector, which moves its end by 1/2
    assert repeat(0.99 * turned).general
    assert not repeat(1.01 * turned).general
    assert repeat(0.0, 0.51).general
    assert not repeat(0.0, 0.49).general
    assert repeat(2.0 * np.pi).general
    words = repeat_in_words(repeat(1.0))
    assert "repeats every 2.50 mm of travel (1.00 N in a, 1.00 N in b)" in words
    assert "by 57 degrees" in words


def test_a_force_with_another_phase_in_each_log_is_told():
    def log(phase, name, pitch=2.3e-3, size=0.3):
        m = ridden(lambda m: size * np.sin(2.0 * np.pi * m.position / pitch + phase))
        return windowed(replace(m, name=name))

    coulomb = effect("coulomb_viscous", {"Fc": 0.7, "Fs": 0.7, "sigma2": 0.9})
    cable = effect("cable_slab", {"offset": 0.2, "k1": -3.0, "k3": 40.0})
    fit = fit_of(AxisModel(1.3, effects=(coulomb, cable)), log(0.3, "a"))
    found = not_general(fit, dataset_of(log(0.3, "a"), holdout=(log(1.8, "b"),)))
    assert found.period == pytest.approx(2.3e-3, rel=5e-3)
    assert found.amplitude == pytest.approx({"a": 0.3, "b": 0.3}, rel=0.1)
    turn = found.phase["b"] - found.phase["a"]
    assert np.mod(turn + np.pi, 2.0 * np.pi) - np.pi == pytest.approx(1.5, abs=0.1)
    same = dataset_of(log(0.3, "a"), log(0.3, "b"))
    assert not_general(fit, same) is None
    assert not_general(fit, dataset_of(log(0.3, "a"))) is None
    other = dataset_of(log(0.3, "a"), log(1.8, "b", 2.6e-3))
    assert not_general(fit, other) is None
    none = dataset_of(log(0.3, "a"), log(1.8, "b", size=0.0))
    assert not_general(fit, none) is None
