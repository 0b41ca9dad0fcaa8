"""A real arm as its user has it: two CSV files of its motors, a map, and its URDF.

Staubli TX40, public repository thanhndv212/figaroh-examples; thirteen parts, of which nine train,
two choose and two report. The errors beside are those of weak-form fits of 0.1 s by columns that
were chosen by hand, with armature, the coupled wrist, friction with load on joint 3 and drag on
joints 1 and 2; the laboratory's Coulomb friction is of a model whose viscous friction is linear.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.figures import Figure, Target
from benchmarks.real_machines import TX40_JOINTS as JOINTS
from benchmarks.withheld import DATA
from identify.analysis.first_model import first_model
from identify.dataset.dataset import Role
from identify.dataset.preparation import datasets
from identify.estimation.errors import error_in
from identify.estimation.fit import fit_axis
from identify.results.results import Diagnosis
from identify.workflow import diagnose
from twin.effects import load_catalogue
from twin.importers import import_log, load_mapping
from twin.logs import Log
from twin.model.machine import Fitted

TITLE = "A real arm from its CSV files, a map and its URDF"
FOLDER = DATA / "tx40"
LENGTH = 0.1  # s, of the test functions by which errors are compared
PART, PARTS = 3000, 13  # rows of a part, and how many
SELECTION, TEST = (2, 8), (5, 11)
BY_HAND = (1.36, 1.04, 1.03, 0.615, 0.774, 0.495)  # N m, test errors
COULOMB = (7.14, 8.26, 6.34, 2.48, 3.03, 0.28)  # N m, the laboratory's
WRIST = 1.95  # N m, the laboratory's Coulomb friction of the coupled wrist
GEARS = (32.0, 32.0, 45.0, -48.0, 45.0, 32.0)
BEGIN = {"joint_2": -50.26548245743669, "joint_3": 70.68583470577035}  # rad, of the motors
MAP = "[[files]]\nsample_rate = 5000.0\n[[files]]\nsample_rate = 5000.0\n" + "".join(
    f"""
[axes.{joint}]
position = {{column = "{joint.capitalize()}", unit = "rad", offset = {BEGIN.get(joint, 0.0)}}}
force = {{column = "{joint.capitalize()}", unit = "N m", file = 2}}
gear = {{{"joint_5 = 32.0, " if joint == "joint_6" else ""}{joint} = {ratio}}}
"""
    for joint, ratio in zip(JOINTS, GEARS, strict=True)
)


def measure() -> list[Figure]:
    """What is named, the test errors over the ones by hand, Coulomb friction."""
    if not FOLDER.is_dir():
        return [Figure("TX40", None, note=f"the measurements are not in {FOLDER.name}")]
    with TemporaryDirectory() as folder:
        logs = dict(enumerate(_parts(Path(folder))))
    chosen = {f"part {k}": logs.pop(k) for k in SELECTION}
    tested = {f"part {k}": logs.pop(k) for k in TEST}
    training = {f"part {k}": log for k, log in logs.items()}
    bodies = ("tx40.urdf", (FOLDER / "tx40.urdf").read_text(encoding="utf-8"))
    model = first_model(training, "tx40", load_catalogue(), bodies)
    found = diagnose(model, training, chosen, tested)
    by_length = datasets(model, training, chosen, LENGTH, test=tested)
    errors = [
        error_in(Role.TEST, fit_axis(one.final.axis, by_length[joint].training), by_length[joint])
        for joint, one in found.axes.items()
    ]
    far = [f"{e:.3g} ({p:.3g})" for e, p in zip(errors, BY_HAND, strict=True) if e > 1.1 * p]
    return [
        _named(found, "rotor_inertia", JOINTS),
        _named(found, "transmission_coupling", ("joint_5", "joint_6")),
        _named(found, "joint_load_friction", ("joint_3",)),
        Figure(
            "joints with a test error up to 1.1 times the one by hand", 6.0 - len(far), "1",
            Target(low=6.0), f"{', '.join(f'{e:.3g}' for e in errors)} N m",
        ),
        _coulomb(found),
    ]  # fmt: skip


def _parts(folder: Path) -> Iterable[Log]:
    """The log of each part, as `twin import` makes it."""
    (folder / "map.toml").write_text(MAP, encoding="utf-8")
    mapping = load_mapping(folder / "map.toml")
    tables = {
        folder / f"{name}.csv": (FOLDER / f"{name}_data.csv").read_text(encoding="utf-8")
        for name in ("pos_read", "curr")
    }
    for first, stop in pairwise(range(0, (PARTS + 1) * PART, PART)):
        for path, text in tables.items():
            head, *rows = text.splitlines()
            path.write_text("\n".join([head, *rows[first:stop]]) + "\n", encoding="utf-8")
        yield import_log([*tables], mapping)


def _named(found: Diagnosis, effect: str, joints: tuple[str, ...]) -> Figure:
    named = [j for j in joints if any(effect in a for a in found.axes[j].answers)]
    what = f"joints on which {effect} is named"
    return Figure(what, float(len(named)), "1", Target(low=float(len(joints))), ", ".join(named))


def _coulomb(found: Diagnosis) -> Figure:
    """Of the sixth joint that of both its frictions, whose speeds are of one sign nearly always."""
    given, laboratory = [], [*COULOMB[:-1], COULOMB[-1] + WRIST]
    for joint in JOINTS:
        laws: list[Fitted] = [*found.axes[joint].final.axis.effects]
        both = {"coulomb_viscous", *(["transmission_coupling"] if joint == JOINTS[-1] else [])}
        given.append(sum(f.values["Fc"] for f in laws if f.effect.name in both))
    near = sum(abs(g / w - 1.0) < 0.25 for g, w in zip(given, laboratory, strict=True))
    note = ", ".join(f"{g:.3g} ({w:.3g})" for g, w in zip(given, laboratory, strict=True))
    what = "joints with Coulomb friction within 25 % of the laboratory's"
    return Figure(what, float(near), "1", Target(low=6.0), f"{note} N m")
