"""Laws of a line that logs share: told by its evidence, whatever its size, and synchronised by."""

import numpy as np
import pytest
from constructed import dataset_of, effect, fit_of, moved, windowed

from identify.dataset.spectral_lines import lines_in_time
from identify.estimation.force_balance import residual
from identify.estimation.time_origin import _common_line, synchronised, time_origins
from identify.rules import RULE
from twin.model.machine import AxisModel

LOGS = [windowed(moved(np.random.default_rng(s), 6.0, 1000.0), 0.02) for s in range(4)]
N = len(LOGS[0])
STEP = LOGS[0].test_function.stride * LOGS[0].test_function.period
F = 23.7  # Hz


def left(heights, size=1.0):
    """White residuals of 1 N with a line of those heights (N), each log with its own phase."""
    return [
        size
        * (np.random.default_rng(90 + k).normal(size=N) + a * np.cos(2 * np.pi * F * log.time + k))
        for k, (log, a) in enumerate(zip(LOGS, heights, strict=True))
    ]


@pytest.mark.parametrize("size", [1.0, 1e-6, 1e4])
def test_a_line_that_all_logs_share_has_its_frequency_and_the_phase_of_the_first(size):
    frequency, phase = _common_line(LOGS, left([0.8, 0.5, 0.7, 0.6], size))
    assert frequency == pytest.approx(F, abs=0.02)
    assert phase == pytest.approx(2.0 * np.pi * (F - frequency) * 3.0, abs=0.3)


def test_a_line_of_less_evidence_than_its_phases_cost_is_chance():
    """Samples x gain must exceed two numbers a log: in all logs it does, in one it does not."""
    height = 11.5 / np.sqrt(N)
    alone = left([height, 0.0, 0.0, 0.0])
    assert any(abs(f - F) < 0.1 for f in lines_in_time([(alone[0], STEP)]))
    needed = 2 * 4 * np.log(4 * N) + RULE.least_bic
    assert 0.5 * height**2 * N < needed < 4.0 * 0.5 * height**2 * N
    assert _common_line(LOGS, alone) is None
    assert _common_line(LOGS, left([height] * 4))[0] == pytest.approx(F, abs=0.05)


def test_a_fit_is_synchronised_unless_it_reads_the_clock():
    axis = AxisModel(1.7)
    pushed = [
        w.__class__(
            w.motion, w.test_function, w.fine, w.command - residual(axis, [w]) + r, w.acceleration
        )
        for w, r in zip(LOGS, left([0.8, 0.5, 0.7, 0.6], 0.01), strict=True)
    ]
    dataset = dataset_of(*pushed)
    found, fit = synchronised(fit_of(axis, *pushed), dataset)
    turns = time_origins(found) * F
    np.testing.assert_allclose(turns, np.arange(4) / (2.0 * np.pi), atol=0.05)
    assert fit.logs is found.fit
    pump = AxisModel(1.7, effects=(effect("periodic_disturbance", {"f": F, "a": 0.01}),))
    own = fit_of(pump, *pushed)
    assert synchronised(own, dataset) == (dataset, own)
