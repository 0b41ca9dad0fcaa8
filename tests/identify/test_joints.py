"""The effects of joints are found beside the bodies of the user's own MuJoCo file."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace

import arms
import mujoco
import numpy as np
import pytest
from arms import (
    ARM,
    COULOMB,
    COUPLED,
    JOINTS,
    MOTORS,
    SAMPLE,
    STEEP,
    VISCOUS,
    arm_log,
    arm_of,
    coupled_log,
    friction,
)
from cli_runs import refusal, twin
from strict_json import valid

from identify.adding import correct_body
from identify.analysis.first_model import first_model
from identify.analysis.recording import misassigned
from identify.dataset.preparation import datasets
from identify.estimation.open_loop import open_loop
from identify.mechanism.departures import departures_of
from identify.output.as_json import answer_of
from identify.project.folder import Folder
from identify.project.keeping import keep
from identify.selection.diagnosis import diagnose_axis
from identify.selection.refusal import Instead
from identify.selection.trying import try_effect
from identify.selection.what import What
from identify.validation.free_run import errors_of_both
from identify.workflow import compare, diagnose, fit, plan
from twin.effects import Catalogue, load_catalogue
from twin.experiments.file import setpoint_of
from twin.experiments.kinds import Passes, Tracking, kind_of
from twin.logs import Log, read_log, write_log
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.mujoco.mechanism import joints_of
from twin.simulation.simulate import simulate
from twin.simulation.simulators import MujocoSimulator

RIVALS = ("gravity", "spring")
LOCAL = "position_dependent_friction"
FEW_NAMES = ("coulomb_viscous", "constant_force", "rotor_inertia", "gravity")
FEW = Catalogue([load_catalogue()[n] for n in FEW_NAMES])
NEW = ("new", "1.mcap", "--mjcf", "arm.xml", "-o", "arm.toml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("arm")
    (folder / "arm.xml").write_text(ARM)
    for seed in (1, 2):
        write_log(arm_log(seed), folder / f"{seed}.mcap")
    done = twin(*NEW, folder=folder)
    assert done.returncode == 0, done.stderr
    return folder


def test_planted_friction_is_found(folder):
    model = load_model(folder / "arm.toml")
    assert model.joints == {name: name for name in JOINTS}
    found = fit(model, folder / "1.mcap", folder / "2.mcap")
    for joint, coulomb, viscous in zip(JOINTS, COULOMB, VISCOUS, strict=True):
        values = found.fits[joint].axis["coulomb_viscous"].values
        assert values["Fc"] == pytest.approx(coulomb, rel=0.02)
        assert values["sigma2"] == pytest.approx(viscous, rel=0.02)
        # the offset of each joint, of which this arm has none
        assert abs(found.fits[joint].axis["constant_force"].values["F0"]) < 0.02 * coulomb
        assert found.fits[joint].ratio < 1.5
        assert found.datasets[joint].channel_delay == 0.0


def test_of_joints_without_effects_nothing_is_free_and_what_is_left_is_told(folder):
    model = load_model(folder / "arm.toml")
    for joint in JOINTS:
        model = model.with_axis(joint, replace(model.axes[joint], effects=()))
    found = fit(model, folder / "1.mcap")
    assert all(one.ratio > 10.0 for one in found.fits.values())


@pytest.mark.slow
def test_friction_of_a_tendon_is_found_on_its_axis_and_nowhere_else():
    """Of a file that is proposed by the motors' names, whose own friction is but a beginning."""
    logs = {str(seed): coupled_log(seed) for seed in (1, 2)}
    text = COUPLED.replace(' stiffness="7" armature="2"', "")
    model = first_model(logs, "arm", load_catalogue(), ("arm.xml", text))
    assert model.joints == MOTORS
    found = fit(model, {"1": logs["1"]}, {"2": logs["2"]})
    for axis, coulomb, viscous in zip(MOTORS, COULOMB, VISCOUS, strict=True):
        values = found.fits[axis].axis["coulomb_viscous"].values
        assert values["Fc"] == pytest.approx(coulomb, rel=0.02)
        assert values["sigma2"] == pytest.approx(viscous, rel=0.02)
        (error,) = compare(found.model, {"2": logs["2"]}).axes[axis].position_error.values()
        assert error < 2e-3
    drag = Fitted.at_start(load_catalogue()["viscous_friction"])
    less = model.with_axis("roll", replace(model.axes["roll"], effects=(drag,)))
    lacking = fit(less, {"1": logs["1"]}, {"2": logs["2"]})
    named = {a: diagnose_axis(lacking.fits[a], lacking.datasets[a], FEW).named for a in MOTORS}
    assert named == {"base": (), "lift": (), "roll": ("coulomb_viscous",)}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda p, f: (p, f), None),
        (
            lambda p, f: (p * [1, 1, -1], f * [1, 1, -1]),
            "axis elbow: with the other sign of its position and torque",
        ),
        (lambda p, f: (p[:, [0, 2, 1]], f[:, [0, 2, 1]]), "axes shoulder and elbow: exchanged"),
        (lambda p, f: (p * [1, np.degrees(1), 1], f), "axis shoulder: with positions in deg"),
        (lambda p, f: (np.radians(p), f), "axes base, shoulder, elbow: with positions in rad"),
        (
            lambda p, f: (
                p[:, [1, 0, 2]],
                f[:, [1, 0, 2]] + [0, 0, 8] * np.sin(30.0 * p[:, :1]),
            ),
            "axes base and shoulder: exchanged",  # whatever else moves the elbow
        ),
    ],
)
def test_a_joint_of_another_sign_or_place_is_told(folder, change, said):
    log = read_log(folder / "1.mcap")
    signals = ([log.axes[j].columns[n] for j in JOINTS] for n in ("position", "force"))
    changed = arm_of(*change(*(np.transpose(columns) for columns in signals)))
    told = misassigned(load_model(folder / "arm.toml"), changed)
    assert told is None if said is None else told is not None and said in told.said


@pytest.mark.slow
def test_the_free_run_goes_as_the_arm_did_and_without_its_friction_astray(folder):
    model = load_model(folder / "arm.toml")
    less = model.with_axis("shoulder", model.axes["shoulder"].without("coulomb_viscous"))
    whole, lacking = (compare(m, folder / "2.mcap").axes for m in (model, less))
    for joint in JOINTS:
        (error,), (noise,) = (
            whole[joint].position_error.values(),
            whole[joint].position_drift_of_noise.values(),
        )
        assert error < 3.0 * noise < 2e-3
    assert max(lacking["shoulder"].position_error.values()) > 0.02


def test_a_model_that_runs_away_is_compared_by_its_torques_alone(folder, caplog):
    """The fingers of some files weigh next to nothing, less than their friction's step."""
    model = load_model(folder / "arm.toml")
    drag = Fitted.at_start(load_catalogue()["viscous_friction"], {"c": 1e5})
    stiff = model.axes["elbow"].with_effect(drag)
    wild = model.with_axis("elbow", stiff)
    found = compare(wild, folder / "2.mcap").axes["elbow"]
    assert not found.position_error
    assert found.force_error
    assert "2.mcap: the simulation became unstable" in caplog.text
    assert caplog.text.rstrip().endswith("lacks the inertia of its motor (armature)")
    prepared = datasets(model, {"2.mcap": read_log(folder / "2.mcap")}, {})
    assert errors_of_both(model, wild, "elbow", prepared) == (None, None)  # of an effect added


def test_friction_holds_an_arm_against_its_weight():
    held = {"Fc": 30.0, "Fs": 40.0, "sigma2": 0.1}  # N m; its weight takes 16 N m at the shoulder
    friction = Fitted.at_start(load_catalogue()["coulomb_viscous"], held)
    bodies = joints_of(ARM, "arm.xml", {joint: joint for joint in JOINTS})
    axes = {
        joint: AxisModel(b.inertia, effects=(friction,), mass_fixed=True, rotary=True, joint=joint)
        for joint, b in bodies.items()
    }
    model = MachineModel("arm", axes, 1000.0, ARM, "arm.xml")
    table = model.table()
    simulator = MujocoSimulator(model, table)
    simulator.place(np.zeros(3), np.zeros(3), np.zeros(table.n_states), 0)
    position = open_loop(model, table, simulator, 0, np.zeros((2000, 3)))
    assert np.abs(position).max() < 1e-3


def rotor(model):
    model.dof_armature[2] = 0.05  # of the elbow


HIDDEN = {
    "rotor_inertia": ("elbow", {"change": rotor}),
    "cogging": ("shoulder", lambda q, v: [0.0, 0.25 * np.sin(2.0 * np.pi * q[1] / 0.2), 0.0]),
    "gravity": ("elbow", lambda q, v: [0.0, 0.0, -0.3 * np.sin(q[2] + 0.3)]),  # a counterbalance
    # The elbow's motor turns with the shoulder as well.
    "transmission_coupling": (
        "elbow", lambda q, v: [0.0, 0.0, -0.15 * np.tanh((v[1] + v[2]) / STEEP)],
    ),
    "spring": ("base", lambda q, v: [-1.5 * q[0], 0.0, 0.0]),
    "quadratic_drag": ("base", lambda q, v: [-0.3 * v[0] * abs(v[0]), 0.0, 0.0]),
    "asymmetric_friction": ("elbow", lambda q, v: [0.0, 0.0, -0.03 * abs(v[2])]),
    LOCAL: ("base", lambda q, v: [-0.3 * np.sin(2.0 * q[0]) * np.tanh(v[0] / STEEP), 0.0, 0.0]),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("effect", HIDDEN)
def test_a_hidden_effect_is_named_on_its_joint_and_nowhere_else(folder, effect):
    joint, planted = HIDDEN[effect]
    if callable(planted):
        planted = {"forces": lambda q, v: friction(q, v) + HIDDEN[effect][1](q, v)}
    logs = {str(k): arm_log(k, **planted) for k in (1, 2, 3)}
    parts = ({n: logs[n]} for n in "123")
    found = diagnose(load_model(folder / "arm.toml"), *parts)
    assert [found.axes[j].named[:1] for j in JOINTS] == [
        (effect,) if j == joint else () for j in JOINTS
    ]
    assert found.axes[joint].tested.after < 0.1 * found.axes[joint].tested.before


def heavier(model):
    """Than its file by a twentieth: no effect, but a file that is not exact."""
    model.body_mass[:] *= 1.05


@pytest.mark.short(1)
@pytest.mark.parametrize(
    ("planted", "refused"),
    [
        ({"change": heavier}, Instead.WEIGHT_OF_BODIES),
        ({"forces": lambda q, v: friction(q, v) - [0.0, 3.0 * np.sin(q[1]), 0.0]}, None),
    ],
)
def test_what_masses_that_are_off_could_make_is_no_effect_of_a_joint(folder, planted, refused):
    made = fit(load_model(folder / "arm.toml"), {"1": arm_log(1, **planted)})
    spring = load_catalogue()["spring"]
    found = try_effect(made.fits["shoulder"], made.datasets["shoulder"], spring)
    assert found.doubt is refused


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('joint = "elbow"', 'joint = "elbo"', "joint = 'elbo' is not in arm.xml"),
        ('joint = "elbow"', "inertia = 1.0", "axes.elbow: has no joint, but base, shoulder has"),
        ('joint = "elbow"', 'joint = "elbow"\ninertia = 1.0', "inertia and joint are both given"),
        ('mujoco = "arm.xml"', "", 'give mujoco = "robot.xml" as well'),
    ],
)
def test_a_model_file_that_is_wrong_is_one_line(folder, old, new, said):
    text = (folder / "arm.toml").read_text()
    assert old in text
    (folder / "wrong.toml").write_text(text.replace(old, new))
    assert said in refusal("fit", "wrong.toml", "1.mcap", "-o", "fitted.toml", folder=folder)


def test_a_log_that_lacks_a_joint_and_a_joint_without_travel_are_one_line(folder):
    log = arm_log(1)
    del log.axes["elbow"]
    write_log(log, folder / "less.mcap")
    said = refusal("fit", "arm.toml", "less.mcap", "-o", "fitted.toml", folder=folder)
    assert "has no axis 'elbow', which is a joint of arm.xml" in said
    said = refusal("new", "less.mcap", "--mjcf", "arm.xml", "-o", "other.toml", folder=folder)
    assert "the joints elbow are no axes" in said
    endless = re.sub("travel = .*", "", (folder / "arm.toml").read_text(), count=1)
    (folder / "endless.toml").write_text(endless)
    said = refusal("plan", "endless.toml", "--axis", "elbow", "-o", "next.toml", folder=folder)
    assert "axis base has no travel; give travel = [low, high] in rad" in said


def balanced(q, v):
    """Friction, and a counterbalance of the fore arm."""
    return friction(q, v) - [0.0, 0.0, 0.6 * np.sin(q[2] + 0.3)]


def ran(model, experiment, seed):
    """The log of the arm with a counterbalance, on a planned motion."""
    setpoint = setpoint_of(experiment, model, 0)
    return arm_log(seed, balanced, planned=setpoint.part(0, len(setpoint)))


@pytest.fixture(scope="module")
def planned(folder):
    model, rivals = load_model(folder / "arm.toml"), [load_catalogue()[n] for n in RIVALS]
    short = Passes("elbow", span=0.5, speed=0.3, repeats=2)
    poor, held = ({name: ran(model, short, seed)} for seed, name in enumerate("ab"))
    found = plan(model, poor, held, between=rivals, axis="elbow", duration=8.0)
    return model, Catalogue(rivals), poor, held, found


@pytest.mark.slow
def test_an_experiment_is_planned_that_decides_between_laws_of_a_joint(planned):
    *_, found = planned
    assert found.decides
    assert kind_of(found.chosen.experiment) == "passes"


@pytest.mark.slow
def test_the_planned_experiment_tells_apart_what_others_of_a_joint_do_not(planned):
    model, rivals, poor, held, found = planned
    told = {}
    for experiment in (Tracking(8.0), found.chosen.experiment):
        made = fit(model, {**poor, "c": ran(model, experiment, 2)}, held)
        elbow = made.fits["elbow"], made.datasets["elbow"]
        one = diagnose_axis(*elbow, rivals)
        told[kind_of(experiment)] = one.named, one.ambiguous_with
    assert told == {"tracking": (("gravity",), ("spring",)), "passes": (("gravity",), ())}


@pytest.mark.parametrize("kind", ["moves", "tracking"])
def test_a_simulated_arm_holds_its_weight_from_the_first_sample(folder, kind):
    model, recorded = load_model(folder / "arm.toml"), read_log(folder / "1.mcap")
    log = simulate(model, kind, duration=2.0)
    for joint in JOINTS:
        off = log.truth[joint]["position"] - log.axes[joint].columns["setpoint_position"]
        assert np.abs(off).max() < 5e-4  # rad; under feedback alone it falls by 2 to 4 mrad
        most = np.abs(recorded.axes[joint].force).max()  # weight included
        assert model.axes[joint].hardware.force_limit == pytest.approx(2.0 * most, rel=0.01)


def loaded_slowly(seed: int) -> Log:
    """Of inverse dynamics along slow sines; the shoulder's friction follows its load."""
    model, rng = mujoco.MjModel.from_xml_string(ARM), np.random.default_rng(seed)
    data = mujoco.MjData(model)
    rate, size = 0.1 * np.pi * rng.uniform(0.1, 0.7, (3, 3)), rng.uniform(0.2, 0.5, (3, 3))
    size[:, 2] *= 0.01  # the elbow hardly moves, so that the load is a function of the place
    at = rate * (0.5 * SAMPLE * np.arange(24_000))[:, None, None] + rng.uniform(0.0, 6.0, (3, 3))
    turned = (np.sin(at), rate * np.cos(at), -(rate**2) * np.sin(at))
    position, *moved = ((size * part).sum(axis=1) for part in turned)
    torque = np.empty((len(position) // 2, 3))
    for k, own in enumerate(zip(position[1::2], *(m[1::2] for m in moved), strict=True)):
        data.qpos[:], data.qvel[:], data.qacc[:] = own
        mujoco.mj_inverse(model, data)
        torque[k] = data.qfrc_inverse
    velocity = moved[0][1::2]
    growth = 1.0 + 0.1 * np.abs(torque) * [0.0, 1.0, 0.0]
    force = torque + growth * COULOMB * np.sign(velocity) + VISCOUS * velocity
    return arm_of(position[::2] + 1e-6 * rng.standard_normal(torque.shape), force)


@pytest.mark.slow
def test_friction_that_follows_the_load_is_fitted_where_the_load_hardly_changes(folder):
    """Its prior had held it at 27 times the noise floor, where a profile along the travel won."""
    logs = {str(seed): loaded_slowly(seed) for seed in (1, 2)}
    few = Catalogue([load_catalogue()[n] for n in ("joint_load_friction", LOCAL)])
    found = fit(folder / "arm.toml", {"1": logs["1"]}, {"2": logs["2"]})
    shoulder = diagnose_axis(found.fits["shoulder"], found.datasets["shoulder"], few)
    assert shoulder.named == ("joint_load_friction",)
    axis = shoulder.final.axis
    assert axis["joint_load_friction"].values["growth"] == pytest.approx(0.1, rel=0.01)
    assert axis["coulomb_viscous"].values["Fc"] == pytest.approx(COULOMB[1], rel=0.01)


@pytest.mark.slow
def test_a_constant_force_is_no_torque_constant(folder):
    """Of 4 % of the weight, which masses could be: the motor had been named with 98 %."""
    logs = [arm_log(s, lambda q, v: np.add(friction(q, v), [0.0, 0.0, 0.1])) for s in (101, 102)]
    found = fit(folder / "arm.toml", {"a": logs[0]}, {"b": logs[1]})
    told = departures_of(found.model, found.fits, found.datasets, FEW)
    assert not told.moved


def loaded(model: mujoco.MjModel) -> None:
    """A payload of 0.5 kg at 0.3 m on the fore arm."""
    fore = model.body("fore").id
    mass, centre, place = model.body_mass[fore], model.body_ipos[fore].copy(), np.array([0.3, 0, 0])
    apart = place - centre
    inertia = np.diag(model.body_inertia[fore]) + mass * 0.5 / (mass + 0.5) * (
        apart @ apart * np.eye(3) - np.outer(apart, apart)
    )
    moments, turned = np.linalg.eigh(inertia)
    turned[:, 0] *= np.sign(np.linalg.det(turned))
    mujoco.mju_mat2Quat(model.body_iquat[fore], turned.ravel())
    model.body_ipos[fore] = (mass * centre + 0.5 * place) / (mass + 0.5)
    model.body_mass[fore], model.body_inertia[fore] = mass + 0.5, moments
    model.body_sameframe[fore] = 0


def heavier_upper_arm(model: mujoco.MjModel) -> None:
    """By 15 % of its mass."""
    model.body_mass[model.body("upper").id] *= 1.15


def test_a_body_is_corrected_beside_the_effects_that_are_given(folder):
    logs = [arm_log(seed, change=loaded) for seed in (11, 12)]
    given = load_model(folder / "arm.toml")
    made = correct_body(given, {"a": logs[0]}, {"b": logs[1]}, file="heavier.xml", catalogue=FEW)
    assert (made.body.body, made.model.mjcf_name) == ("fore", "heavier.xml")
    assert made.given.mjcf_name == "arm.xml"
    heavy = mujoco.MjModel.from_xml_string(made.model.mjcf)
    light = mujoco.MjModel.from_xml_string(ARM)
    added = heavy.body("fore").mass - light.body("fore").mass
    assert added == pytest.approx(0.5, rel=0.02)
    assert heavy.body("upper").mass == light.body("upper").mass


@pytest.mark.slow
def test_a_payload_is_told_with_its_body_and_what_to_write(folder, tmp_path):
    logs = [arm_log(seed, change=loaded) for seed in (11, 12)]
    found = diagnose(folder / "arm.toml", {"a": logs[0]}, {"b": logs[1]}, catalogue=FEW)
    body = found.body
    assert body is not None
    assert (body.body, body.tied, body.axes) == ("fore", (), JOINTS)
    assert body.differing["mass"][0] == pytest.approx(0.5, rel=0.01)
    assert body.differing["first moment x"][0] == pytest.approx(0.15, rel=0.01)
    assert body.differing["inertia yy"][0] == pytest.approx(0.045, rel=0.02)
    assert not any(d.findings for d in found.axes.values())
    assert all(e.after < 0.05 * e.before for e in body.errors.values())
    told = str(found)
    assert told.startswith("The inertia of body fore is not as arm.xml has it (confidence 99 %)")
    assert answer_of(found).entries()["body"]["parameters"]["mass"]["unit"] == "kg"
    # The next command writes what is said into a copy of the file; then nothing is to be said.
    (element,) = re.findall("<inertial .*?/>", told)
    assert (
        "Next: identify.correct_body(model, logs, holdout, file='corrected.xml') writes <inertial"
        in told
    )
    for name in ("arm.toml", "arm.xml"):
        shutil.copy(folder / name, tmp_path)
    for name, log in zip("ab", logs, strict=True):
        write_log(log, tmp_path / f"{name}.mcap")
    add = ("add", "link_mass", "arm.toml", "a.mcap", "--holdout", "b.mcap", "-o")
    assert "--axis: link_mass is of all axes" in refusal(
        *add, "corrected.toml", "--axis", "fore", folder=tmp_path
    )
    (tmp_path / "sub").mkdir()
    done = twin(*add, "sub/arm.toml", "--json", folder=tmp_path)  # as the user's own is called
    assert json.loads(done.stdout)["mujoco"] == "arm_corrected.xml"
    assert load_model(tmp_path / "sub" / "arm.toml").mjcf_name == "arm_corrected.xml"
    done = twin(*add, "corrected.toml", "--json", folder=tmp_path)
    answer = valid(json.loads(done.stdout))
    assert (answer["body"], answer["mujoco"], answer["element"]) == (
        "fore", "corrected.xml", element,
    )  # fmt: skip
    given = {"model": "arm.toml", "out": "corrected.toml"}
    project = Folder(tmp_path)
    project.begin()
    keep(project, "add", given, answer, "twin add link_mass")
    ledger = project.read().models[-1]
    assert ledger.change == ["body fore"]
    assert {e.axis: e.after for e in ledger.errors} == {
        axis: own["after"] for axis, own in answer["errors"].items()
    }
    old = '<inertial pos="0.15 0.02 0" mass="2" diaginertia="0.004 0.02 0.02"/>'
    assert (tmp_path / "corrected.xml").read_text() == ARM.replace(old, element)
    assert (tmp_path / "arm.xml").read_text() == ARM
    again = diagnose(tmp_path / "corrected.toml", {"a": logs[0]}, {"b": logs[1]}, catalogue=FEW)
    assert again.body is None
    assert not any(d.findings for d in again.axes.values())
    said = refusal("add", "link_mass", "corrected.toml", *add[3:], "next.toml", folder=tmp_path)
    assert "the logs prove no body to correct it" in said


@pytest.mark.slow
def test_the_bands_of_a_body_hold_the_truth(folder, monkeypatch):
    """Of a simulation whose steps err by less than the encoders: with four a sample they do not."""
    monkeypatch.setattr(arms, "STEPS", 16)
    truth = np.array([0.5, 0.15, 0.0, 0.0, 0.0, 0.045, 0.045, 0.0, 0.0, 0.0])
    off = []
    for seed in range(1000, 1012, 2):
        a, b = (arm_log(k, change=loaded) for k in (seed, seed + 1))
        found = fit(folder / "arm.toml", {"a": a}, {"b": b})
        (body,) = departures_of(found.model, found.fits, found.datasets, FEW).bodies
        off.append(np.abs(body.change - truth) / body.band)
    assert 0.85 <= np.mean(np.array(off) < 1.0) < 1.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "gain", "body", "motor"),
    [
        pytest.param(heavier_upper_arm, 1.0, "upper", None, marks=pytest.mark.slow),
        (lambda _: None, 1.2, None, "shoulder"),
        pytest.param(lambda _: None, 1.0, None, None, marks=pytest.mark.slow),
    ],
)
def test_a_heavier_link_another_torque_constant_and_nothing_are_told_apart(
    folder, change, gain, body, motor
):
    logs = [arm_log(seed, change=change) for seed in (13, 14)]
    for log in logs:
        log.axes["shoulder"].columns["force"] *= gain
    found = fit(folder / "arm.toml", {"a": logs[0]}, {"b": logs[1]})
    told = departures_of(found.model, found.fits, found.datasets, FEW)
    assert [m.group.axis for m in told.moved if m.group.what is What.GAIN] == [motor] * bool(motor)
    assert [b.body for b in told.bodies] == [body] * bool(body)
    for own in told.bodies:  # a column along its own joint and what turns with it
        assert {"mass", "first moment y"} <= {*own.undetermined}
        assert own.differing["first moment x"][0] == pytest.approx(0.12, rel=0.01)
    if motor:
        known = Catalogue([*FEW.values(), load_catalogue()["torque_constant"]])
        offered = told.offered(known, motor)
        one = diagnose_axis(found.fits[motor], found.datasets[motor], offered)
        assert one.named == ("torque_constant",)
        assert one.findings[0].parameters["error"] == pytest.approx(1.0 / gain - 1.0, abs=0.01)
