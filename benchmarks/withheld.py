"""Real machines whose model lacks a term: `python -m benchmarks withheld [--data DIR] [-o FILE]`.

What each machine has is known from its publication and from independent least squares; what is
right to say was written down before any diagnosis.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import pi
from pathlib import Path
from time import process_time

from benchmarks import real_machines
from benchmarks.figures import Figure, Target, report
from benchmarks.judgement import (
    EQUIVALENT,
    RIGHT,
    STATED,
    Expected,
    Row,
    fitted,
    judged,
    row_of,
    stated_wrong,
)
from benchmarks.real_machines import EXAMPLES, Given
from identify.estimation.variable_projection import usable
from identify.results.results import Diagnosis
from identify.selection.diagnosis import AxisDiagnosis, diagnose_axis
from identify.selection.findings import Finding
from identify.workflow import diagnose
from twin.effect import Kind
from twin.effects import Catalogue, load_catalogue
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.mujoco.mechanism import joints_of

TITLE = "Real machines with a term withheld from their model"
DATA = Path(__file__).parents[2] / "shared" / "data"
CATALOGUE = load_catalogue()
FRICTIONS = tuple(
    e.name for e in CATALOGUE.values() if e.kind is Kind.FRICTION and not e.is_nonparametric
)
MEMORY = (
    "dahl", "lugre", "leuven", "modified_leuven", "gms", "cable_hysteresis",
    "presliding_hysteresis",
)  # fmt: skip
# How a real drive's friction bends with speed no published model says: known as another shape of
# it, by a free curve or by the name of such a curve.
BENDS = "shear_thinning"


@dataclass(frozen=True)
class Case:
    """A real machine and a model of one axis that lacks a term.

    given: folder of the data -> logs by role. expected: what is right to say of it. bodies: folder
    of the data -> name and text of the MJCF or URDF file whose joints the axes are.
    """

    name: str
    given: Callable[[Path], Given]
    model: MachineModel
    expected: Expected
    bodies: Callable[[Path], tuple[str, str]] | None = None

    @property
    def axis(self) -> str:
        """The axis that lacks something: the last of the model."""
        return list(self.model.axes)[-1]

    def modelled(self, data: Path) -> MachineModel:
        """The model with its bodies."""
        if self.bodies is None:
            return self.model
        name, text = self.bodies(data)
        found = joints_of(text, name, self.model.joints)
        axes = {
            axis: replace(own, mass=found[axis].inertia, mass_fixed=True)
            for axis, own in self.model.axes.items()
        }
        return replace(self.model, axes=axes, mjcf=text, mjcf_name=name)


def law(name: str, *fixed: str, **values: float) -> Fitted:
    """An effect with values to start from, some of them held beside those held by design."""
    fitted = Fitted.at_start(CATALOGUE[name], values)
    return replace(fitted, fixed=fitted.fixed | {*fixed})


def having(name: str, *laws: Fitted) -> MachineModel:
    """The machine of an example's model, with these effects alone."""
    model = load_model(EXAMPLES / f"{name}.toml", CATALOGUE)
    ((axis, given),) = model.axes.items()
    return model.with_axis(axis, replace(given, effects=laws))


def slide(name: str, mass: float, rate: float, *laws: Fitted) -> MachineModel:
    """A machine of one linear axis; mass: kg, 0 where the motion is imposed; rate: Hz."""
    return MachineModel(name, {"x": AxisModel(mass, effects=laws)}, sample_rate=rate)


# EMPS: symmetric friction and an offset leave a friction that differs by direction (1.94 N, with it
# 1.30 N on the other record), for which the offset stands in; a pre-sliding state helps a little.
# A free curve of the friction over speed, with its sign, says the direction as well.
EMPS_FRICTION = law("coulomb_viscous", Fc=15.0, Fs=15.0, sigma2=100.0)
DIRECTION = "asymmetric_friction"
# A constant and a friction of each direction are one force on a drive that moves at many speeds but
# for their viscous parts, of which the first is small here.
EMPS = (
    Case(
        "EMPS: direction",
        real_machines.emps,
        having("emps", EMPS_FRICTION, law("constant_force")),
        Expected((DIRECTION,), known=(BENDS, *MEMORY), known_shapes=("coulomb_viscous",)),
    ),
    Case(
        "EMPS: Coulomb",
        real_machines.emps,
        having("emps", law("viscous_friction", c=200.0), law("constant_force")),
        Expected(FRICTIONS, known=(DIRECTION, BENDS, *MEMORY), known_shapes=("coulomb_viscous",)),
    ),
    Case(
        "EMPS: offset",
        real_machines.emps,
        having("emps", EMPS_FRICTION),
        Expected(
            ("constant_force",),
            (DIRECTION,),
            known=(BENDS, *MEMORY),
            known_shapes=("coulomb_viscous",),
        ),
    ),
)

# LAAS: cogging of 12, 18, 24, ... 72 a turn; about 2 mN m of Coulomb friction. At the one speed of
# the first log any friction is a constant force.
LAAS_FRICTION = law("coulomb_viscous", Fc=0.002, Fs=0.002, sigma2=1e-6)
LAAS_BASE = (LAAS_FRICTION, law("constant_force"))


def cogging(*a_turn: int) -> tuple[Fitted, ...]:
    """Coggings of so many periods a turn."""
    numbered = (f"cogging_{i}" if i > 1 else "cogging" for i in range(1, len(a_turn) + 1))
    return tuple(law(n, p=2.0 * pi / k) for n, k in zip(numbered, a_turn, strict=True))


LAAS = (
    Case(
        "LAAS: all cogging", real_machines.laas_speed, having("laas", *LAAS_BASE),
        Expected(("cogging",), shapes=("cogging",)),
    ),
    Case(
        "LAAS: cogging but 72 a turn", real_machines.laas_speed,
        having("laas", *LAAS_BASE, *cogging(72)), Expected(("cogging",), shapes=("cogging",)),
    ),
    Case(
        "LAAS: cogging but 72 and 12 a turn", real_machines.laas_speed,
        having("laas", *LAAS_BASE, *cogging(72, 12)), Expected(("cogging",), shapes=("cogging",)),
    ),
    Case(
        "LAAS: friction, one speed", real_machines.laas_speed, having("laas", *cogging(72, 12)),
        Expected(
            (*FRICTIONS, "viscous_friction"), ("constant_force",), known=("cogging",),
            known_shapes=("cogging",),
        ),
    ),
    Case(
        "LAAS: friction, reversals", real_machines.laas_accelerations,
        having("laas", law("constant_force")),
        Expected(FRICTIONS, ("viscous_friction",), known=("cogging",)),
    ),
)  # fmt: skip

# ARTS: dry friction with a stiffness before it slides, and play; imposed motion.
ARTS = (
    Case(
        "ARTS: memory", real_machines.arts,
        slide(
            "damper", 0.0, real_machines.ARTS_RATE,
            law("coulomb_viscous", Fc=1e3, Fs=1e3), law("constant_force"),
        ),
        Expected(MEMORY),
    ),
    Case(
        "ARTS: friction", real_machines.arts,
        slide("damper", 0.0, real_machines.ARTS_RATE, law("constant_force")),
        Expected(MEMORY, FRICTIONS),
    ),
)  # fmt: skip

# Silverbox: m x'' + d x' + k1 x + k3 x^3 = u, with volts taken for N and m.
DAMPER = law("viscous_friction", c=2e-4)
SPRING = law("spring", k1=1.0)
LINEAR_SPRING = law("spring", "k2", "k3", k1=1.0)
SILVERBOX = tuple(
    Case(
        f"silverbox: {term}", real_machines.silverbox,
        slide("silverbox", 5e-6, real_machines.SILVERBOX_RATE, *laws), expected,
    )
    for term, laws, expected in (
        ("cubic term", (DAMPER, LINEAR_SPRING), Expected((), ("cable_slab",), ("spring",))),
        ("damping", (SPRING,), Expected(("viscous_friction",), FRICTIONS)),
        ("spring", (DAMPER,), Expected(("spring",), ("cable_slab", "gravity"))),
    )
)  # fmt: skip


def arm(rate: float, joints: Sequence[str], joint: str, *laws: Fitted) -> MachineModel:
    """A mechanism of joints without effects, but for one of them; rate: Hz."""
    plain = {name: AxisModel(1.0, rotary=True, joint=name) for name in joints if name != joint}
    return MachineModel("arm", plain, rate).with_axis(
        joint, AxisModel(1.0, effects=laws, rotary=True, joint=joint)
    )


# TX40: Coulomb and viscous friction and a rotor on each joint; the motor of joint 6 turns with
# joint 5 as well, and its friction acts on both; the friction of joint 3 follows its load.
RUBS, ROTOR = law("coulomb_viscous", Fc=3.0, Fs=3.0, sigma2=1.0), law("rotor_inertia", inertia=0.05)
# The friction of joint 5 repeats every 0.1394 rad: a turn of its motor, behind a gear of 45, is
# 2 pi/45 = 0.1396 rad.
TX40_KNOWN = (
    BENDS, "constant_force", "gravity", "spring", "cogging", "force_constant_ripple",
    "friction_ripple",
)  # fmt: skip
TX40 = tuple(
    Case(
        f"TX40: {term}", real_machines.tx40,
        arm(real_machines.TX40_RATE, real_machines.TX40_JOINTS, joint, *laws),
        Expected((right,), known=(*also, *TX40_KNOWN), known_shapes=("coulomb_viscous",)),
        lambda data: ("tx40.urdf", (data / "tx40" / "tx40.urdf").read_text(encoding="utf-8")),
    )
    for term, joint, laws, right, also in (
        ("armature, joint 1", "joint_1", (RUBS,), "rotor_inertia", ("quadratic_drag",)),
        ("armature, joint 3", "joint_3", (RUBS,), "rotor_inertia", ("joint_load_friction",)),
        ("armature, joint 4", "joint_4", (RUBS,), "rotor_inertia", ()),
        ("wrist, joint 5", "joint_5", (RUBS, ROTOR), "transmission_coupling", ()),
        ("wrist, joint 6", "joint_6", (RUBS, ROTOR), "transmission_coupling", ()),
        ("load, joint 3", "joint_3", (RUBS, ROTOR), "joint_load_friction", ()),
    )
)  # fmt: skip


def pendulum(lever: float) -> tuple[str, str]:
    """The double pendulum as its laboratory identified it; lever: m, of link 2's centre."""
    turning, at = 0.02392, max(lever, 1e-3)  # kg m^2 about joint 2; m
    links = ((0.5594, 0.3, 0.05347 - 0.5594 * 0.3**2), (0.6043, at, turning - 0.6043 * lever**2))
    first, second = (
        f'<joint name="{name}" axis="0 -1 0"/><inertial pos="0 0 {-centre:g}" mass="{mass:g}" '
        f'diaginertia="{own:g} {own:g} {own:g}"/>'
        for name, (mass, centre, own) in zip(real_machines.PENDULUM_JOINTS, links, strict=True)
    )
    return "pendulum.xml", (
        f'<mujoco><worldbody><body name="link1">{first}<body name="link2" pos="0 0 -0.3">{second}'
        "</body></body></worldbody></mujoco>"
    )


# Double pendulum: friction that follows the load; torques or masses are off by some 5 %, so that a
# weight is left on each joint.
PENDULUM_KNOWN = ("joint_load_friction", "gravity", "spring")
PENDULUM_RUBS = law("coulomb_viscous", Fc=0.1, Fs=0.1, sigma2=0.05)
ONE_JOINT = arm(
    real_machines.PENDULUM_RATE, real_machines.PENDULUM_JOINTS, "second",
    law("viscous_friction", c=0.1),
)  # fmt: skip
BOTH_JOINTS = replace(
    ONE_JOINT,
    axes={n: replace(own, effects=(PENDULUM_RUBS,)) for n, own in ONE_JOINT.axes.items()},
)
PENDULUM = (
    Case(
        "double pendulum: Coulomb, joint 2", real_machines.double_pendulum, ONE_JOINT,
        Expected(FRICTIONS, known=PENDULUM_KNOWN, known_shapes=FRICTIONS),
        lambda _: pendulum(0.1838),
    ),
    # Told by both joints together; friction that follows the load is not in the model.
    Case(
        "double pendulum: gravity of link 2", real_machines.double_pendulum, BOTH_JOINTS,
        Expected(("gravity", "link_mass"), known=PENDULUM_KNOWN, known_shapes=FRICTIONS),
        lambda _: pendulum(0.0),
    ),
)  # fmt: skip
CASES = (*EMPS, *LAAS, *ARTS, *SILVERBOX, *TX40, *PENDULUM)


def run(case: Case, data: Path) -> Row:
    """The diagnosis of one machine on one thread, judged."""
    begun = process_time()
    model = case.modelled(data)
    if all(own.joint and own.effects for own in model.axes.values()):
        found = _with_body(diagnose(model, *case.given(data), catalogue=CATALOGUE), case.axis)
        return row_of(case.name, case.expected, found, process_time() - begun)
    dataset, base = fitted(model, case.axis, *case.given(data))
    # One joint alone: its torque constant has its rivals, the bodies, on the others.
    known = usable(CATALOGUE, model)
    offered = Catalogue([e for e in known.values() if e.name != "torque_constant"])
    found = diagnose_axis(base, dataset, offered)
    return row_of(case.name, case.expected, found, process_time() - begun)


def run_named(name: str, data: Path) -> Row:
    """The same by its name, as another process is told of it."""
    (case,) = (c for c in CASES if c.name == name)
    return run(case, data)


def _with_body(result: Diagnosis, axis: str) -> AxisDiagnosis:
    """The diagnosis of an axis, with what was found of the bodies as a finding."""
    found, body = result.axes[axis], result.body
    if body is None:
        return found
    errors, unit = body.errors[axis], found.dataset.units.force
    finding = Finding("link_mass", body.tied, body.score.part, errors, errors, unit, {}, body.score)
    return replace(found, findings=(finding, *found.findings))


def measure() -> list[Figure]:
    """All cases, on the measurements beside the repository."""
    return figures(judge(CASES, DATA))


def figures(rows: Sequence[Row]) -> list[Figure]:
    """How many answers are right, and what is wrongly stated."""
    if not rows:
        return [Figure("withheld terms", None, note="the measurements are not there")]
    right = [r for r in rows if r["mark"] in (RIGHT, EQUIVALENT)]
    wrong = stated_wrong(rows)
    return [
        Figure(
            "right or declared equivalent, and nothing wrong beside", len(right) / len(rows), "1",
            Target(low=0.8), f"{len(right)} of {len(rows)}",
        ),
        Figure(
            f"wrong names stated at {STATED:.0%} or more", len(wrong), "1", Target(high=0.0),
            ", ".join(wrong),
        ),
    ]  # fmt: skip


def judge(cases: Iterable[Case], data: Path, out: Path | None = None) -> list[Row]:
    """The rows of the cases; none where the measurements are absent."""
    if not data.is_dir():
        print(f"skipped: no measurements in {data}; give --data DIR", file=sys.stderr)
        return []
    return judged({c.name: partial(run_named, c.name, data) for c in cases}, out)


def main(arguments: Sequence[str]) -> int:
    """Judge some cases or all; 0 where every target is met."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks withheld", description=__doc__)
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the measurements")
    parser.add_argument("--case", default="", help="only those whose name begins so")
    parser.add_argument("-o", "--out", type=Path, help="file for the rows as JSON, a line each")
    given = parser.parse_args(arguments)
    cases = [c for c in CASES if c.name.startswith(given.case)]
    return report(figures(judge(cases, given.data, given.out)))
