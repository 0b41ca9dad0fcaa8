"""What a law is told about the axis: every slot of io holds what twin.effect says it holds."""

from dataclasses import replace

import numpy as np
import pytest
from axis_runs import BOTH, Stepper
from effect_runs import CATALOGUE

from twin.effect import (
    A_OTHER,
    DT,
    FRICTION,
    HOLD,
    INDEX,
    MASS,
    OUT,
    TIME,
    V_OTHER,
    X_OTHER,
    Effect,
    Kind,
    Parameter,
    U,
    V,
    X,
)
from twin.experiments.named import simulate
from twin.logs import Log
from twin.model.file import load_model
from twin.model.machine import Fitted

EACH = pytest.mark.parametrize("stage", BOTH)


def note_time_and_axis(p, s, io):
    s[0], s[1], s[2], s[3] = io[INDEX], io[TIME], io[DT], io[MASS]
    s[4], s[5], s[6], s[7] = io[X], io[V], io[U], io[HOLD]
    io[OUT] = p[0]


def note_other_axis(p, s, io):
    s[0], s[1], s[2], s[3] = io[X_OTHER], io[V_OTHER], io[A_OTHER], io[FRICTION]
    io[OUT] = p[0]


def noted(law, names: tuple[str, ...], stage: Stepper) -> Log:
    """A log of the stage with an effect on x that notes io in its states, and adds 0.5 N."""
    spy = Effect(
        kind=Kind.ACTUATION if "u" in names else Kind.FORCE,
        summary="notes what it is told", equation="F = c", source="none", fingerprint="none",
        excited_by="none", law=law, states=names,
        parameters=(Parameter("c", "N", 0.5, 0.0, 1.0, "force", strength=True),),
    )  # fmt: skip
    model = load_model("proton_xy", CATALOGUE)
    axis = replace(model.axes["x"].with_effect(Fitted.at_start(spy)), mass=17.0)
    return simulate(model.with_axis("x", axis), "moves", seed=6, duration=1.0, simulator=stage)


def column(log: Log, name: str) -> np.ndarray:
    return log.truth["x"][f"test_physics_axis_io_{name}"]


@EACH
def test_a_law_is_told_of_its_axis(stage: Stepper) -> None:
    names = ("index", "time", "dt", "mass", "x", "v", "u", "hold")
    log = noted(note_time_and_axis, names, stage)
    true, n = log.truth["x"], np.arange(len(log))
    np.testing.assert_array_equal(column(log, "index"), n)
    np.testing.assert_allclose(column(log, "time"), n * 1e-4, rtol=1e-10)
    np.testing.assert_array_equal(column(log, "dt"), 1e-4)
    np.testing.assert_array_equal(column(log, "mass"), 17.0)
    np.testing.assert_array_equal(column(log, "v"), true["velocity"])
    ahead = true["position"] + 0.5e-4 * true["velocity"]  # where a step of Euler's has come to
    np.testing.assert_allclose(column(log, "x"), ahead, rtol=0, atol=1e-16)
    command = log.axes["x"].force
    noise = 5.0 * 53.4 * 2e-4  # N, of the current that is logged
    np.testing.assert_allclose(column(log, "u"), command, rtol=0, atol=noise)
    hold = 17.0 * column(log, "v") / 1e-4 + column(log, "u")  # no force is known yet
    np.testing.assert_allclose(column(log, "hold"), hold, rtol=1e-12)


@EACH
def test_a_law_is_told_of_the_other_axis(stage):
    log = noted(note_other_axis, ("x", "v", "a", "friction"), stage)
    other = log.truth["y"]
    ahead = other["position"] + 0.5e-4 * other["velocity"]
    np.testing.assert_allclose(column(log, "x"), ahead, rtol=0, atol=1e-16)
    np.testing.assert_array_equal(column(log, "v"), other["velocity"])
    # The acceleration comes late by a sample or two, and the encoder's noise is in it.
    wanted = np.gradient(other["velocity"], 1e-4)
    found = column(log, "a")
    slope, _ = np.polyfit(wanted, found, 1)
    assert slope == pytest.approx(1.0, abs=0.05)
    friction = -log.truth["x"]["lugre"]  # what is logged is the force on the axis
    np.testing.assert_array_equal(column(log, "friction")[1:], friction[:-1])
