"""Of a machine of many joints little is held beside its log, and what is let go of comes back."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from arms import ARM, arm_log

from identify.analysis.first_model import first_model
from identify.dataset.bodies import PIECE, bodies_along
from identify.dataset.motion import Columns
from identify.workflow import fit
from twin.effects import load_catalogue
from twin.mujoco.mechanism import mechanism_of
from twin.signals import local_parabola

LOG = arm_log(1)
MODEL = first_model({"1": LOG}, "arm", load_catalogue(), ("arm.xml", ARM))
SIGNALS = ("signals", "raw", "force", "net", "joint_signals", "smoothed_position")


@pytest.mark.parametrize("samples", [1, 3])
@pytest.mark.parametrize("blocks", [slice(None), slice(7), slice(5, None), slice(9, 9)])
def test_signals_made_of_columns_are_those_that_are_kept(samples, blocks):
    rng = np.random.default_rng(3)
    columns = Columns(*(rng.normal(size=n) for n in (20 * samples + 1, 20 * samples)), samples, 0.1)
    made, kept = columns.during(blocks), columns.kept.during(blocks)
    for name in ("signals", "raw"):
        np.testing.assert_array_equal(getattr(made, name), getattr(kept, name))
    before = made.signals
    made.forget()
    assert made.signals is not before
    np.testing.assert_array_equal(made.signals, before)


def test_bodies_are_the_same_in_pieces_of_time_as_at_once():
    log = arm_log(2, duration=20.0)
    assert len(log) > 2 * PIECE
    found = bodies_along(MODEL, log, "log")
    mechanism = mechanism_of(ARM, "arm.xml", MODEL.joints)
    x = np.stack([log.axes[axis].position for axis in mechanism.axes])
    smooth = local_parabola(x, 9, derivative=1, period=log.period)  # over less than 20 ms
    place, speed = (0.5 * (s[:, 1:] + s[:, :-1]) for s in (x, smooth))
    between = np.diff(x) / log.period
    momentum, force = mechanism.along(place, between, speed)
    load = force + local_parabola(momentum, 9, derivative=1, period=log.period)
    for i, axis in enumerate(mechanism.axes):
        own = found[axis]
        np.testing.assert_allclose(own.force, force[i], rtol=1e-9)
        np.testing.assert_allclose(own.momentum + own.mass * between[i], momentum[i], rtol=1e-9)
        np.testing.assert_allclose(own.load, load[i], rtol=1e-6, atol=1e-9)
        np.testing.assert_array_equal(own.during(slice(70, 5000)).speeds, speed[:, 70:5000])


def test_a_fit_of_joints_holds_little_beside_their_log_and_its_signals_come_back():
    size = sum(axis.columns[n].nbytes for axis in LOG.axes.values() for n in ("position", "force"))
    fit(MODEL, {"1": LOG})  # loads what is compiled
    tracemalloc.start()
    found = fit(MODEL, {"1": LOG})
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert held < 2.0 * size  # momentum and bias force are one, signals would be one and a half
    for dataset in found.datasets.values():
        motion = dataset.fit[0].motion
        before = {name: getattr(motion, name) for name in SIGNALS}
        motion.forget()
        for name, values in before.items():
            np.testing.assert_array_equal(getattr(motion, name), values)
