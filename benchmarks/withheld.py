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
from benchmarks.figures import Figure, Target, told
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
from identify.selection.diagnosis import diagnose_axis
from twin.effect import Kind
from twin.effects import load_catalogue
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted, MachineModel

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


@dataclass(frozen=True)
class Case:
    """A real machine and a model of one axis that lacks a term.

    given: folder of the data -> logs by role. expected: what is right to say of it.
    """

    name: str
    given: Callable[[Path], Given]
    model: MachineModel
    expected: Expected


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
        "EMPS: direction", real_machines.emps,
        having("emps", EMPS_FRICTION, law("constant_force")),
        Expected((DIRECTION,), known=MEMORY, known_shapes=("coulomb_viscous",)),
    ),
    Case(
        "EMPS: Coulomb", real_machines.emps,
        having("emps", law("viscous_friction", c=200.0), law("constant_force")),
        Expected(FRICTIONS, known=(DIRECTION, *MEMORY), known_shapes=("coulomb_viscous",)),
    ),
    Case(
        "EMPS: offset", real_machines.emps, having("emps", EMPS_FRICTION),
        Expected(
            ("constant_force",), (DIRECTION,), known=MEMORY, known_shapes=("coulomb_viscous",)
        ),
    ),
)  # fmt: skip

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
CASES = (*EMPS, *LAAS, *ARTS, *SILVERBOX)


def run(case: Case, data: Path) -> Row:
    """The diagnosis of one machine on one thread, judged."""
    begun = process_time()
    ((axis, _),) = case.model.axes.items()
    dataset, base = fitted(case.model, axis, *case.given(data))
    found = diagnose_axis(base, dataset, usable(CATALOGUE, case.model))
    return row_of(case.name, case.expected, found, process_time() - begun)


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
    return judged({c.name: partial(run, c, data) for c in cases}, out)


def main(arguments: Sequence[str]) -> int:
    """Judge some cases or all; 0 where every target is met."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks withheld", description=__doc__)
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the measurements")
    parser.add_argument("--case", default="", help="only those whose name begins so")
    parser.add_argument("-o", "--out", type=Path, help="file for the rows as JSON, a line each")
    given = parser.parse_args(arguments)
    cases = [c for c in CASES if c.name.startswith(given.case)]
    return told(figures(judge(cases, given.data, given.out)))
