"""Any machine: one axis or three, linear or rotary, goes round the whole loop in its own units."""

import html
import json
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from axis_kinds import (
    LINEAR_AXIS,
    MACHINES,
    OF_A_HINGE,
    OF_A_SLIDE,
    ROTARY_AXIS,
    ROUNDING,
    SLIDE,
    THREE,
    machine,
    stated_units,
)
from machines import CATALOGUE

from identify import adding, workflow
from identify.dataset.coordinates import coordinates_of
from identify.dataset.preparation import datasets
from identify.estimation.residual_dependence import unit_of
from identify.output import as_json
from identify.output.answers import plain
from identify.output.shown.report import write_report
from identify.output.shown.subject import Subject
from identify.results.grown import Addition
from identify.results.results import Diagnosis, FitResult
from twin.checks import check_log
from twin.effects import Catalogue
from twin.errors import InputError
from twin.experiments.file import format_experiment
from twin.experiments.kinds import Passes
from twin.logs import Log, read_log, write_log
from twin.model.file import format_model, parse_model
from twin.model.machine import MachineModel
from twin.model.units import LINEAR, ROTARY, AxisUnits, units_of
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator
from twin.simulation.spec import machine_spec

TRIED = ("cogging", "constant_force", "quadratic_drag", "axis_coupling")
DURATION = 4.0  # s of each log


@dataclass(frozen=True, eq=False)
class Round:
    """What the loop made of a machine with one effect that its model lacks."""

    kind: str
    axis: str
    model: MachineModel
    truth: MachineModel
    logs: dict[str, Log]
    fitted: FitResult
    found: Diagnosis
    added: Addition

    @property
    def units(self) -> AxisUnits:
        return self.model.axes[self.axis].units


@pytest.fixture(scope="module", params=["rotary", "three"])
def gone_round(request, tmp_path_factory) -> Round:
    toml, axis, hidden = MACHINES[request.param]
    path = tmp_path_factory.mktemp(request.param) / "log.mcap"
    model, truth = machine(toml), machine(toml + hidden)
    logs = {}
    for seed in (1, 2):
        write_log(simulate(truth, "tracking", seed=seed, duration=DURATION), path)
        logs[f"log {seed}"] = read_log(path)
    held = {"log 2": logs.pop("log 2")}
    tried = Catalogue([CATALOGUE[n] for n in TRIED])
    found = workflow.diagnose(model, logs, held, catalogue=tried)
    assert found.effect is not None
    added = adding.add(found.effect, model, logs, held)
    return Round(request.param, axis, model, truth, logs, workflow.fit(truth, logs), found, added)


def page(r: Round, path: Path) -> str:
    """All that a reader of the report sees, in its plots too."""
    history = r.added.model.history
    write_report(path, Subject("machine", r.found, history, [r.added]))
    written = path.read_text()
    drawn = [json.loads(html.unescape(d)) for d in re.findall(r'data-chart="([^"]+)"', written)]
    signals = re.search(r'id="signals">(.*?)</script>', written, re.DOTALL)
    assert signals
    drawn += json.loads(signals[1])
    plain = re.sub(r"<(style|script).*?</\1>", "", written, flags=re.DOTALL)
    return "\n".join([re.sub(r"<[^>]+>", " ", plain), *said(drawn)])


def said(value: object) -> Iterator[str]:
    """The labels and units in what is drawn; what is apart are numbers, and names in the script."""
    if isinstance(value, list):
        for one in value:
            yield from said(one)
    elif isinstance(value, dict):
        for key, one in value.items():
            if isinstance(one, str):
                yield from [one] if key in ("label", "unit") else []
            else:
                yield from one.values() if key == "texts" else said(one)


def texts(r: Round) -> str:
    shown = (
        str(r.fitted), str(r.found.comparison),
        str(r.found), str(r.added), format_model(r.added.model),
    )  # fmt: skip
    return "\n".join(shown)


@pytest.mark.slow
def test_the_log_states_its_units_and_is_fit(gone_round: Round) -> None:
    log = gone_round.logs["log 1"]
    assert check_log(log).ok
    assert set(log.axes) == set(gone_round.model.axes)
    for name, axis in gone_round.model.axes.items():
        units = log.axes[name].units
        assert log.axes[name].kind == axis.units
        assert (units["position"], units["force"]) == (axis.units.position, axis.units.force)


@pytest.mark.short(1)
def test_the_hidden_effect_is_named_and_added(gone_round: Round) -> None:
    hidden = gone_round.truth.axes[gone_round.axis].names[-1]
    assert gone_round.found.effect is not None
    assert gone_round.found.effect.name == hidden
    assert gone_round.found.leading.dataset.axis == gone_round.axis
    assert gone_round.added.kept
    assert gone_round.added.step.unit == gone_round.units.force
    before, after = gone_round.added.position_error
    assert after < 0.5 * before
    assert gone_round.added.position_error_in_mujoco == pytest.approx(after, rel=1e-6)
    again = parse_model(
        tomllib.loads(format_model(gone_round.added.model)), CATALOGUE, None, "again.toml"
    )
    assert again.axes[gone_round.axis] == gone_round.added.model.axes[gone_round.axis]
    assert again.history == gone_round.added.model.history


# What the same quantities are called on the other kind of axis, names of effects apart.
WORDS_OF_A_SLIDE = re.compile(
    r"\bforce (error|residual)|\bForce\b(?! constant)|\b[Pp]osition\b(?! loop)"
)
WORDS_OF_A_HINGE = re.compile(r"\b[Tt]orque\b|\bAngle\b|\bangle (error|between)")


def test_texts_model_file_and_report_are_in_units_and_words_of_the_axis(gone_round, tmp_path):
    printed = (texts(gone_round), page(gone_round, tmp_path / "report.html"))
    assert gone_round.units.mass_name in printed[1]
    for shown in printed:
        for slide, hinge in ((OF_A_SLIDE, OF_A_HINGE), (WORDS_OF_A_SLIDE, WORDS_OF_A_HINGE)):
            wrong, right = (slide, hinge) if gone_round.units.rotary else (hinge, slide)
            shown = shown if slide is OF_A_SLIDE else without_declarations(shown)
            assert not (found := wrong.search(shown)), shown[found.start() - 80 : found.end() + 20]
            assert right.search(shown)


def without_declarations(text: str) -> str:
    """The text less what effects declare, which is for a linear axis."""
    for effect in CATALOGUE.values():
        told = [p.meaning for p in effect.parameters]
        for own in (effect.summary, effect.equation, effect.fingerprint, effect.excited_by, *told):
            text = text.replace(own, "")
    return text


def test_json_is_in_units_of_the_axis(gone_round: Round) -> None:
    objects = [
        as_json.json_of(gone_round.fitted), as_json.json_of(gone_round.found.comparison),
        as_json.json_of(gone_round.found), as_json.json_of(gone_round.added),
    ]  # fmt: skip
    units = set().union(*(stated_units(json.loads(json.dumps(plain(o)))) for o in objects))
    kind = gone_round.units
    other = LINEAR if kind.rotary else ROTARY
    known = ("m", "m/s", "m/s^2", "N", "kg", "N s/m", "1/N")
    assert {kind(u) for u in known} <= units
    assert not {other(u) for u in known} & units


def test_an_effect_of_the_other_axis_is_no_candidate_where_there_are_several(gone_round):
    left_out = ("axis_coupling",) if gone_round.kind == "three" else ()
    assert tuple(gone_round.found.not_tried[gone_round.axis]) == left_out
    told = as_json.json_of(gone_round.found)
    assert told["not_tried"] == list(left_out)
    notes = [n for n in told["notes"] if "not tried" in n]
    assert bool(notes) == bool(left_out)
    assert ("not tried: axis_coupling" in str(gone_round.found)) == bool(left_out)
    tried = {c.effect.name for c in gone_round.found.leading.ranking}
    assert ("axis_coupling" in tried) == (len(gone_round.found.model.axes) == 2)


def test_a_machine_with_several_other_axes_refuses_an_effect_of_the_other_one() -> None:
    toml, axis, _ = MACHINES["three"]
    for effect in ("axis_coupling", "load_dependent_friction"):
        with pytest.raises(InputError, match=f"axis y: {effect} depends on the other axis") as told:
            machine(f"{toml}[axes.{axis}.effects.{effect}]\n")
        assert "remove it" in str(told.value)
        assert "\n" not in str(told.value)
    with pytest.raises(InputError, match="axis y: axis_coupling depends on the other axis"):
        adding.add(CATALOGUE["axis_coupling"], machine(toml), {}, axis="y")
    with pytest.raises(InputError, match="axis z: axis_coupling depends on the other axis"):
        workflow.plan(
            machine(toml), catalogue=CATALOGUE, axis="z",
            between=(CATALOGUE["axis_coupling"], CATALOGUE["cogging"]),
        )  # fmt: skip
    pair = "".join(LINEAR_AXIS.format(name=n, mass=m, dry=f) for n, m, f in THREE[:2])
    assert machine(f"{pair}[axes.y.effects.axis_coupling]\n").axes["y"].names[-1] == "axis_coupling"


def test_each_other_axis_has_its_own_name_in_the_residual(gone_round: Round) -> None:
    log = datasets(gone_round.model, gone_round.logs, {})[gone_round.axis].training[0]
    where = coordinates_of(log)
    assert not [name for name in where if name.startswith("other_axis")]
    named = {name for name in where if name.startswith("axis_")}
    if gone_round.kind != "three":
        assert not named
        return
    assert named == {
        f"axis_{a}_{q}" for a in "xz" for q in ("position", "velocity", "acceleration")
    }
    truth = gone_round.logs["log 1"].truth["z"]["velocity"]
    assert np.std(where["axis_z_velocity"]) == pytest.approx(np.std(truth), rel=0.1)
    assert unit_of("axis_z_velocity", log.motion) == "m/s"
    assert not log.motion.others.any()


def test_one_axis_moves_while_two_rest() -> None:
    model = machine(MACHINES["three"][0])
    log = simulate(model, Passes("z", span=0.3, speed=0.2, repeats=1))
    assert {a for a in log.axes if np.ptp(log.axes[a].position) > 0.1} == {"z"}
    found = workflow.fit(model, {"passes": log})
    assert set(found.fits) == {"z"}
    assert found.fits["z"].ratio < 1.5
    compared = workflow.compare(model, {"passes": log}).axes["z"]
    assert compared.position_error["passes"] < 1e-3
    with pytest.raises(InputError, match="has 3 axes, not two"):
        simulate(model, Passes("z", span=0.3, speed=0.2, repeats=1, other=0.1))


# A rotary axis: its entries, its inertia and its hinge, and the counterparts of linear units


def test_a_plan_is_in_units_of_the_axis() -> None:
    model = machine(ROTARY_AXIS)
    chosen = workflow.plan(
        model, catalogue=CATALOGUE, duration=2.0, axis="c",
        between=(CATALOGUE["cogging"], CATALOGUE["quadratic_drag"]),
    )  # fmt: skip
    shown = str(chosen)
    assert not (wrong := OF_A_SLIDE.search(shown)), wrong
    assert "N·m RMS unexplained" in shown
    assert stated_units(as_json.json_of(chosen)) == {"N m", "s"}
    planned = Passes("c", span=0.3, speed=0.2, repeats=1)
    file = format_experiment(planned, units=model.axis("c").units)
    assert "# rad, length of a pass" in file
    assert "# rad/s, held" in file


@pytest.mark.parametrize(
    ("log_of", "model_of", "message"),
    [
        ("rotary", SLIDE.replace("axes.x", "axes.c"), r"is rotary \(position in rad\), .* in m\)"),
        ("linear", ROTARY_AXIS.replace("axes.c", "axes.x"), r"is linear \(position in m\), .* rad"),
    ],
)  # fmt: skip
def test_a_log_of_the_other_kind_is_refused(log_of: str, model_of: str, message: str) -> None:
    log = simulate(machine(MACHINES[log_of][0]), "tracking", duration=1.0)
    for act in (workflow.fit, workflow.compare):
        with pytest.raises(InputError, match=message) as told:
            act(machine(model_of), {"run": log})
        assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("toml", "message"),
    [
        (ROTARY_AXIS.replace("inertia", "mass = 1.0\ninertia"), "both mass and inertia"),
        (ROTARY_AXIS.replace("inertia = 0.02", ""), "no mass; .* kg m.2 for a rotary axis"),
        (ROTARY_AXIS.replace("0.02", "'big'"), "inertia = 'big': give a number .* kg m.2"),
        (ROTARY_AXIS.replace("= 0.01\n", "= -1.0\n"), r"sigma2 = -1 N m s/rad: outside"),
        (ROTARY_AXIS.replace("inertia", "inertja"), "did you mean 'inertia'"),
    ],
)
def test_a_wrong_rotary_axis_is_refused_in_its_units(toml: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as told:
        machine(toml)
    assert "\n" not in str(told.value)


def test_a_held_inertia_is_said_and_kept() -> None:
    model = machine(ROTARY_AXIS.replace("0.02", "0.02\nfixed = ['inertia']"))
    assert model.axes["c"].mass_fixed
    assert "inertia = 0.02 # kg m^2" in format_model(model)
    assert machine(format_model(model).partition("Hz\n")[2]).axes == model.axes


def test_a_stage_mounts_on_slides_and_hinges_of_its_own() -> None:
    mixed = machine(SLIDE + ROTARY_AXIS)
    spec = machine_spec(mixed)
    assert spec.joint("x").type == mujoco.mjtJoint.mjJNT_SLIDE
    assert spec.joint("c").type == mujoco.mjtJoint.mjJNT_HINGE
    log = simulate(mixed, "tracking", duration=1.0)
    assert (log.axes["x"].kind, log.axes["c"].kind) == (LINEAR, ROTARY)
    reduced = simulate(mixed, "tracking", duration=1.0, simulator=ReducedSimulator)
    for axis in "xc":
        gone = log.truth[axis]["position"] - reduced.truth[axis]["position"]
        assert np.abs(gone).max() < ROUNDING
    motion = datasets(mixed, {"run": log}, {})["x"].training[0].motion
    assert unit_of("other_axis_velocity", motion) == "rad/s"
    assert unit_of("velocity", motion) == "m/s"


@pytest.mark.parametrize("effect", ["flexible_mode", "base_vibration", "backlash", "payload_mass"])
def test_attached_inertias_agree_on_a_hinge(effect: str) -> None:
    values = {"flexible_mode": "load = 0.3", "base_vibration": "recoil = 0.2",
              "backlash": "load = 0.3\nplay = 1e-3", "payload_mass": "ratio = 0.3"}  # fmt: skip
    model = machine(f"{ROTARY_AXIS}[axes.c.effects.{effect}]\n{values[effect]}\n")
    runs = [
        simulate(model, "tracking", duration=1.0, **more).truth["c"]["position"]
        for more in ({}, {"simulator": ReducedSimulator})
    ]
    assert np.abs(runs[0] - runs[1]).max() < 1e-12


def test_a_joint_of_the_other_kind_is_refused() -> None:
    spec = machine_spec(machine(ROTARY_AXIS))
    spec.compile()
    slide = replace(
        machine(SLIDE.replace("axes.x", "axes.c")), mjcf=spec.to_xml(), mjcf_name="c.xml"
    )
    with pytest.raises(InputError, match=r"joint 'c' is not a slide, but the axis is linear"):
        machine_spec(slide)


def test_what_repeats_may_repeat_once_a_turn() -> None:
    for effect in CATALOGUE.values():
        for p in effect.parameters:
            assert not p.period or p.upper > 2.0 * np.pi, f"{effect.name}.{p.name}"


UNITS = {
    "m": "rad", "m/s": "rad/s", "m/s^2": "rad/s^2", "m/s^3": "rad/s^3", "m rms": "rad rms",
    "N": "N m", "N^2": "(N m)^2", "kg": "kg m^2", "N s/m": "N m s/rad", "N/m": "N m/rad",
    "N/m^2": "N m/rad^2", "N/m^3": "N m/rad^3", "N s^2/m^2": "N m s^2/rad^2", "N/A": "N m/A",
    "N/s": "N m/s", "N/(m s)": "N m/(rad s)", "1/m": "1/rad", "1/N": "1/(N m)",
    "s^2/m": "s^2/rad", "A rms": "A rms", "1": "1", "s": "s", "Hz": "Hz", "1/J": "1/J", "": "",
}  # fmt: skip


@pytest.mark.parametrize("linear", UNITS)
def test_a_linear_unit_has_a_rotary_counterpart(linear: str) -> None:
    assert (LINEAR(linear), ROTARY(linear)) == (linear, UNITS[linear])


def test_no_unit_of_the_catalogue_keeps_a_length_a_force_or_a_mass() -> None:
    for effect in CATALOGUE.values():
        for p in effect.parameters:
            told = ROTARY(p.unit)
            rest = told.replace("N m", "").replace("kg m^2", "")
            assert not set(re.findall(r"[A-Za-z]+", rest)) & {"m", "N", "kg"}, (effect.name, told)


def test_words_have_a_rotary_counterpart_and_names_have_none() -> None:
    said = "Force error, free-running position error; forces at two Positions of constant_force"
    turned = "Torque error, free-running angle error; torques at two Angles of constant_force"
    assert (LINEAR.words(said), ROTARY.words(said)) == (said, turned)
    assert [units_of(u).kind for u in ("rad", "rad/s", "N m", "m", "s", None)] == (
        ["rotary"] * 3 + ["linear"] * 3
    )
