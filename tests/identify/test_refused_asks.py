"""What is asked of a model that has not, or has already, what it takes is refused in one line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import date

import numpy as np
import pytest
from machines import CATALOGUE

import identify
from identify.dataset.motion import shortest_log
from identify.experiment_design.discrimination import require_within_limits
from identify.fleet.cause import cause_of
from identify.fleet.floor import STAGE as STAGE_FILE
from identify.fleet.found_logs import origin_of
from identify.fleet.models import Models
from identify.results.fleet import Alarm, Scope
from identify.validation.agreement import agreement
from identify.validation.tracking import unmoved
from identify.view.replay import replay
from twin.effects import Catalogue, load_catalogue
from twin.errors import InputError
from twin.logs import AxisLog, Log
from twin.model.machine import AxisIntervals, AxisModel, Fitted, Hardware, MachineModel

RATE = 1000.0
TIME = np.arange(3000) / RATE
HARDWARE = Hardware(travel=(-0.1, 0.1), force_limit=30.0, velocity=0.3, acceleration=4.0, jerk=300)


def having(name: str, **values: float) -> Fitted:
    return Fitted.at_start(CATALOGUE[name], values)


RUBBING = having("coulomb_viscous", Fc=1.0, Fs=1.0, sigma2=2.0)
WORN, COGGED = having("wear", rate=0.1), having("cogging", p=0.03, a1=0.2, b1=0.1)
SLIDE = AxisModel(3.0, HARDWARE, (RUBBING,))
ONE = MachineModel("slide", {"x": SLIDE}, RATE)
TWO = MachineModel(
    "stage",
    {"x": replace(SLIDE, effects=(RUBBING, COGGED)), "y": replace(SLIDE, effects=(COGGED, WORN))},
    RATE,
)


def moving(axis: str = "x", seconds: float = 3.0) -> Log:
    t = TIME[seconds > TIME]
    x = 0.03 * np.sin(5.0 * t) + 0.01 * np.sin(13.0 * t)
    v, a = np.gradient(x, t), np.gradient(np.gradient(x, t), t)
    force = 3.0 * a + np.sign(v) + 2.0 * v
    log = AxisLog({"position": x, "force": force})
    return Log(RATE, {axis: log}, truth={axis: {"position": x}})


LOG = moving()
STILL = Log(RATE, {"x": AxisLog({"position": 0.0 * TIME, "force": 0.0 * TIME})})
CHANGED = date(2026, 3, 2)
ALARM = Alarm(
    "m1", "x", "stage", "lugre.Fc", "N", CHANGED, CHANGED, CHANGED, CHANGED, 0.3, 0.4, 0.1, 0.01,
    7.0, Scope.MACHINE,
)  # fmt: skip


def with_intervals(above: float) -> MachineModel:
    return ONE.with_intervals("x", AxisIntervals({}, above))


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (
            lambda: identify.add("coulomb_viscous", ONE, LOG),
            "axis x has the effect 'coulomb_viscous' already; `twin fit` refits it",
        ),
        (
            lambda: identify.remove("cogging", TWO, LOG),
            "cogging: cannot be taken out; several axes have it: give one of x, y",
        ),
        (
            lambda: identify.remove("gms", TWO, LOG),
            "gms: cannot be taken out; axis x has coulomb_viscous, cogging; axis y has cogging, "
            "wear",
        ),
        (
            lambda: identify.remove("wear", TWO, LOG, axis="x"),
            "wear: cannot be taken out; axis x has coulomb_viscous, cogging",
        ),
        (
            lambda: identify.add_found(TWO, ONE, LOG),
            "the answer is about a machine with axes x, y, the model has x; give the model that "
            "was diagnosed",
        ),
        (
            lambda: identify.add_found(ONE, ONE, LOG),
            "slide: the answer found nothing that this model lacks; diagnose it again",
        ),
        (
            lambda: identify.correct_body(ONE, LOG, file="c.xml"),
            "slide: link_mass corrects a body of a MuJoCo file, and its axes are no joints of one",
        ),
        (
            lambda: agreement(ONE, replace(TWO, axes={"y": SLIDE}), Catalogue([])),
            "the models have no axis in common: one has x, the other y",
        ),
        (
            lambda: agreement(with_intervals(1.2), with_intervals(7.31), Catalogue([])),
            "no parameter has an interval in both models, so nothing can be compared; a fit that "
            "leaves 7.31 times its noise floor has none",
        ),
        (
            lambda: agreement(ONE, ONE, Catalogue([])),
            "no parameter has an interval in both models, so nothing can be compared; fit each",
        ),
        (
            lambda: replay(TWO, moving("z"), "run"),
            "run: has the axes z, the model x, y; give the model of this machine, or none",
        ),
        (
            lambda: identify.fit(ONE, moving(seconds=0.02)),
            "no training log says anything of axis x; training 1: it lasts 0.02 s, and "
            f"identification needs {shortest_log(1e-3):.3g} s at 1000 Hz; give a longer one",
        ),
        (
            lambda: identify.fit(ONE, STILL),
            "no training log says anything of axis x; training 1: axis x stands still in it; give",
        ),
        (
            lambda: require_within_limits(
                ONE.with_axis("x", replace(SLIDE, hardware=replace(HARDWARE, force_limit=1.5))), LOG
            ),
            "axis x reaches its force_limit of 1.5 N; move more gently, or check the limit",
        ),
        (
            lambda: cause_of(ALARM, [], Models.at(STAGE_FILE)),
            "has 0 logs since 2026-03-02; ",
        ),
        (lambda: origin_of({}, {}), "does not tell its machine and started; write them into"),
        (
            lambda: origin_of({"machine": "m"}, {"axis": "x"}),
            "does not tell its started; write them into the metadata of the log",
        ),
    ],
)
def test_it_is_refused_with_what_there_is(ask: Callable[[], object], said: str) -> None:
    with pytest.raises(InputError) as refused:
        ask()
    assert str(refused.value).startswith(said)
    assert "\n" not in str(refused.value)


def test_a_log_in_which_no_axis_of_the_model_moves_says_which_there_are() -> None:
    assert unmoved(ONE, LOG) is None
    assert unmoved(TWO, STILL) == (
        "no axis of the model (x, y) moves in it; give one in which one does"
    )
    asked = replace(STILL.axes["x"], columns={**STILL.axes["x"].columns, "setpoint_position": TIME})
    assert unmoved(ONE, replace(STILL, axes={"x": asked})) is None


def test_within_its_limits_nothing_is_said() -> None:
    require_within_limits(ONE, LOG)


def test_an_effect_whose_force_is_no_number_somewhere_is_refused_as_it_is_added(tmp_path) -> None:
    """The root of a negative number beyond 25 mm, in which no trial as it is loaded comes."""
    (tmp_path / "rooted.py").write_text(
        "from math import sqrt\n"
        "from twin.effect import OUT, Effect, Kind, Parameter, X\n"
        "def law(p, s, io):\n"
        "    io[OUT] = -p[0] * sqrt(0.025 * 0.025 - io[X] * io[X])\n"
        'K = Parameter("k", "N/m", 0.0, 0.0, 1e6, "stiffness", strength=True)\n'
        'EFFECT = Effect(kind=Kind.FORCE, summary="a", equation="b", source="c", parameters=(K,),\n'
        '                law=law, fingerprint="d", excited_by="e")\n'
    )
    known = load_catalogue(tmp_path / "rooted.py")
    with pytest.raises(InputError, match=r"with rooted: .* is not a finite number in"):
        identify.add("rooted", ONE, LOG, catalogue=known)
