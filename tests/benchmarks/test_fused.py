"""The laws fused by hand, which the benchmarks measure against, are the laws of the product."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import fused
from benchmarks.simulation import FusedSimulator
from benchmarks.workload import Workload
from twin.core.walks import walk_sets
from twin.effects import load_catalogue
from twin.experiments.kinds import Tracking
from twin.model.file import load_model
from twin.model.machine import axis_table
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator, run

MODEL = load_model("proton_xy", load_catalogue())


@pytest.mark.slow
def test_by_hand_the_reduced_model_gives_the_same_log():
    setpoint = Tracking(3.0).setpoint(MODEL, np.random.default_rng(1))
    ours, hand = (
        run(MODEL, setpoint, np.random.default_rng(2), simulator=s)
        for s in (ReducedSimulator, FusedSimulator)
    )
    for name in ("signals", "forces", "states"):
        np.testing.assert_allclose(getattr(hand, name), getattr(ours, name), rtol=1e-9, atol=1e-12)


def test_a_pass_computes_what_a_walk_computes():
    axis = MODEL.axes["x"]
    t = 1e-3 * np.arange(20_000)
    position, velocity = 0.1 * np.sin(t), 0.1 * np.cos(t)
    found = np.empty(len(t))
    fused.along(fused.constants(axis), position, velocity, 1e-3, found)
    table, totals = axis_table({"x": axis}), np.zeros((1, len(t)))
    first, last, *_ = table.axes[0]
    walk_sets(
        table.entries, first, last, table.parameters[None], table.n_states,
        np.stack([position, velocity, velocity]), np.zeros((3, len(t))), 1e-3, 0, totals, 1.0, 0.0,
        table.remembers, velocity,
    )  # fmt: skip
    np.testing.assert_allclose(found, totals[0], rtol=1e-12)


def test_a_pass_goes_over_every_sample_of_the_logs():
    model = MODEL
    logs = {str(i): simulate(model, "tracking", seed=i, duration=2.0) for i in range(2)}
    work = Workload(model, model, logs, logs)
    assert work.samples == 40_000
    columns = sum(len(a.columns) for a in logs["0"].axes.values())
    assert work.measured_bytes == 2 * columns * 20_000 * 8
    assert work.log_bytes > work.measured_bytes
    assert work.in_passes(3.0 * work.one_pass) == 3.0
    assert 1e-9 < work.one_pass / work.samples < 1e-6
