"""Machines of the second simulator: `python -m benchmarks foreign --help`.

Effects that the model lacks, on machines whose bumps, cable and Stribeck curve may have forms that
the catalogue does not know.
"""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from time import process_time

import numpy as np

from benchmarks.figures import Figure, Target, report
from benchmarks.judgement import Expected, Row, fitted, judged, row_of, stated_wrong
from benchmarks.second_simulator.effects import INSIDE, OUTSIDE, Planted
from benchmarks.second_simulator.kernel import AHEAD, BEHIND, FORCE
from benchmarks.second_simulator.machine import (  # fmt: skip
    PITCH,
    PLACE,
    WIDTH,
    Machine,
    drawn,
    gaussian,
    logs_of,
    run,
    train,
)
from identify.selection.diagnosis import AxisDiagnosis, diagnose_axis
from identify.selection.findings import FindingKind
from twin.effects import Catalogue, load_catalogue
from twin.model.file import load_model
from twin.model.machine import MachineModel

TITLE = "Second simulator: effects on machines whose bumps, cable and friction have other forms"
CATALOGUE = load_catalogue()
NOMINAL = load_model("proton_xy", CATALOGUE)
STAGE = MachineModel(NOMINAL.name, {"x": NOMINAL.axes["x"]}, NOMINAL.sample_rate)
NOTHING = {"nothing": Planted(lambda m, size, rng: m, fixed=True)}
EFFECTS = INSIDE | OUTSIDE | NOTHING
GROUPS = {"inside": list(INSIDE), "outside": list(OUTSIDE)}
DURATION = 10.0  # s of each log
NEAR = 0.8  # of the floors wanted, from which an effect has its size
VARIANTS = ("", "Gaussian bumps", "no bumps at rest", "decimated", "half early", "one early")
EARLY = {"half early": 0.5, "one early": 1.0}  # samples
FORMS = {"bumps": "roller_spikes", "cable": "cable_slab", "stribeck": "lugre"}  # what has another
SEED, FLOORS = 53, 8.0  # of `measure`


def model_for(planted: Planted) -> MachineModel:
    """The nominal model, less what is to be found again."""
    axis = STAGE.axes["x"]
    kept = tuple(f for f in axis.effects if f.effect.name not in planted.drop)
    return STAGE.with_axis("x", replace(axis, effects=kept))


def reshaped(machine: Machine, forms: Collection[str], rng: np.random.Generator) -> Machine:
    """The machine with base effects of other forms than the catalogue's.

    Gaussian bumps that let go at rest, a cable that folds over at two places, and a Stribeck curve
    with an exponent about 1.
    """
    if "bumps" in forms:
        rows = machine.tables.copy()
        shape = train(PITCH, 0.006 + rng.uniform(-0.002, 0.002), 1.3 * WIDTH, gaussian)
        rows[AHEAD], rows[BEHIND] = (rows[r].max() * shape for r in (AHEAD, BEHIND))
        machine = replace(machine, tables=rows).having(turn=0.0)
    if "cable" in forms:
        at, wide = rng.uniform(-0.08, 0.08, 2), rng.uniform(0.015, 0.04, 2)
        folds = [np.tanh((PLACE - a) / w) for a, w in zip(at, wide, strict=True)]
        machine = machine.plus(FORCE, 0.03 * folds[0] - 0.02 * folds[1])
    if "stribeck" in forms:
        machine = machine.having(n=rng.uniform(0.7, 1.3))
    return machine


def excess(machine: Machine, model: MachineModel, seed: int) -> float:
    """How far the fitted model's error stands above its floor, in floors."""
    _, fit = fitted(model, "x", {"log 1": run(machine, 1000 * seed + 1, DURATION)})
    return float(np.sqrt(max(fit.ratio**2 - 1.0, 1e-4)))


def sized(
    planted: Planted, base: Machine, model: MachineModel, wanted: float, seed: int
) -> tuple[Machine, float]:
    """The machine with the effect as large as adds that many floors of error to the model's."""
    size, before = 1.0 if planted.fixed else planted.start, excess(base, model, seed)

    def make(size: float) -> Machine:
        return planted.make(base, size, np.random.default_rng(seed))

    def added(size: float) -> float:
        return float(np.sqrt(max(excess(make(size), model, seed) ** 2 - before**2, 1e-4)))

    seen = added(size)
    for _ in range(0 if planted.fixed else 5):
        if NEAR < seen / wanted < 1.0 / NEAR or (size == planted.largest and seen < wanted):
            break
        size = min(size * np.clip(wanted / seen, 0.1, 10.0), planted.largest)
        seen = added(size)
    return make(size), size


def diagnosed(
    model: MachineModel,
    machine: Machine,
    seed: int,
    duration: float = DURATION,
    catalogue: Catalogue = CATALOGUE,
) -> AxisDiagnosis:
    """The diagnosis of the x axis from two logs and one held out."""
    dataset, base = fitted(model, "x", *logs_of(machine, seed, duration))
    return diagnose_axis(base, dataset, catalogue)


def added_on_logs(base: Machine, found: AxisDiagnosis, seed: int) -> float:
    """Floors of error on the logs of a diagnosis beyond those of the machine without the effect.

    In floors of that machine, as an effect may raise the floor that is told. There are none where
    the model's own parameters take the effect up.
    """
    _, fit = fitted(STAGE, "x", *logs_of(base, seed, DURATION))
    return float(np.sqrt(max(found.base.error**2 - fit.error**2, 0.0)) / fit.floor)


@dataclass(frozen=True)
class Made:
    """A machine with an effect of this size, that without, a model, and the seed of its logs."""

    machine: Machine
    base: Machine
    model: MachineModel
    size: float
    code: int


def made(name: str, wanted: float, seed: int, forms: Sequence[str] = ()) -> Made:
    """A machine with an effect that adds so many noise floors of error; forms: of its own."""
    planted = EFFECTS[name]
    code = 1000 * seed + zlib.crc32(name.encode()) % 997
    rng = np.random.default_rng(code)
    base, model = reshaped(drawn(rng), forms, rng), model_for(planted)
    machine, size = sized(planted, base, model, wanted, code)
    return Made(machine, base, model, float(size), code)


def planted_row(name: str, wanted: float, seed: int, forms: Sequence[str] = ()) -> Row:
    """A machine, diagnosed and judged; nothing is planted where the name is that.

    wanted: noise floors of error that the effect adds. Adds to a row: added, floors on the logs of
    the diagnosis; size, of the effect; seed; forms.
    """
    planted, own = EFFECTS[name], made(name, wanted, seed, forms)
    begun = process_time()
    found = diagnosed(own.model, own.machine, own.code)
    seconds = process_time() - begun
    shapes = tuple(FORMS[f] for f in forms)
    expected = Expected(planted.right, planted.near, planted.shapes, known_shapes=shapes)
    return row_of(f"{name} @{wanted:g} {seed}", expected, found, seconds) | {
        "added": added_on_logs(own.base, found, own.code),
        "wanted": wanted if planted.right else 0.0,
        "size": own.size, "seed": seed, "forms": list(forms),
    }  # fmt: skip


def empty_row(seed: int) -> Row:
    """A machine on which nothing is planted, of any rate, control and noise.

    From 1000 on its bumps have another form, from 2000 on they are gone at rest, from 3000 on the
    log keeps every other sample of a faster control, from 4000 on it has the command half a sample
    early (force steered continuously), from 5000 on the reading of one sample later.
    """
    rng = np.random.default_rng(90_000 + seed)
    rate = (10e3, 4e3, 1e3)[seed % 3]
    variant = VARIANTS[seed // 1000]
    log_rate, rate = rate, 2.0 * rate if variant == "decimated" else rate
    noise = {
        "encoder_noise": 10.0 ** rng.uniform(-9.5, -7.5), "resolution": 10.0 ** rng.uniform(-9, -8),
        "current_noise": 10.0 ** rng.uniform(-4.5, -3.0),
    }  # fmt: skip
    bump = {"bump": gaussian} if variant == "Gaussian bumps" else {}
    machine = drawn(rng, rate, log_rate, **noise, **bump)
    if variant == "no bumps at rest":
        machine = machine.having(turn=0.0)
    begun = process_time()
    found = diagnosed(STAGE, replace(machine, early=EARLY.get(variant, 0.0)), 90_000 + seed)
    shapes = ("roller_spikes",) if "bumps" in variant else ()
    # Its encoder has a resolution, which is no part of the floor of a model without one.
    expected = Expected(known=("encoder_quantization",), known_shapes=shapes)
    row = row_of(empty_name(seed), expected, found, process_time() - begun)
    return row | {"added": 0.0, "wanted": 0.0, "size": 0.0, "seed": seed, "forms": []}


def empty_name(seed: int) -> str:
    """What an empty machine is told by."""
    return f"empty {VARIANTS[seed // 1000]} {seed}"


def jobs_of(
    effects: Sequence[str], forms: Sequence[str], floors: Sequence[float], seeds: Sequence[int]
) -> dict[str, Callable[[], Row]]:
    """The machines by name, each to be diagnosed; effects: names, or inside, or outside."""
    names = [n for given in effects for n in GROUPS.get(given, [given])]
    return {
        f"{n} @{level:g} {seed}": partial(planted_row, n, level, seed, forms)
        for seed in seeds
        for n in names
        for level in (floors[:1] if EFFECTS[n].fixed else floors)
    }


def measure() -> list[Figure]:
    """Nothing and every effect of the catalogue, on machines of other forms."""
    return figures(judged(jobs_of(("nothing", "inside"), [*FORMS], (FLOORS,), (SEED,)), None))


def figures(rows: Sequence[Row]) -> list[Figure]:
    """How many effects are named and shapes told, and what is wrong.

    Of effects that add most of the floors asked for: what the model's own parameters take up is not
    in the logs.
    """
    shown = [r for r in rows if r["added"] > NEAR * r["wanted"] > 0.0]
    named = [r for r in shown if r["named"]]
    formed = [r for r in rows if r["forms"]]
    shaped = [r for r in formed if any(map(tells_a_shape, r["findings"]))]
    wrong = [r for r in rows if r["mark"] == "wrong"]
    empty = [r for r in wrong if r["expected"]["right"] == ()]
    stated = stated_wrong(rows)
    return [
        _of("effects that show, named", named, shown, Target(low=0.9)),
        _of("machines of other forms, of which a wrong shape is told", shaped, formed,
            Target(low=0.8)),
        _of("something wrong is told", wrong, rows),
        Figure("the same where nothing is planted", len(empty), "1", Target(high=0.0)),
        Figure("wrong names stated at 90 % or more", len(stated), "1", Target(high=0.0),
               ", ".join(stated)),
    ]  # fmt: skip


def tells_a_shape(finding: Row) -> bool:
    """Whether a finding is that a law has another shape, as it has."""
    return finding["kind"] == FindingKind.WRONG_SHAPE.value and finding["right"]


def _of(
    what: str, some: Sequence[Row], all_: Sequence[Row], target: Target | None = None
) -> Figure:
    rate = len(some) / len(all_) if all_ else None
    return Figure(what, rate, "1", target, f"{len(some)} of {len(all_)}")


def main(arguments: Sequence[str]) -> int:
    """Judge the machines asked for; 0 where every target is met."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks foreign", description=__doc__)
    parser.add_argument("--empty", type=int, nargs=2, metavar=("FIRST", "END"))
    parser.add_argument("--effects", nargs="*", default=[], help="names, or inside, or outside")
    parser.add_argument("--floors", type=float, nargs="*", default=[5.0, 20.0])
    parser.add_argument("--forms", nargs="*", default=[], choices=list(FORMS), help="of their own")
    parser.add_argument("--seeds", type=int, nargs="*", default=[1])
    parser.add_argument("-o", "--out", type=Path, help="file for the rows as JSON, a line each")
    given = parser.parse_args(arguments)
    seeds = range(*given.empty) if given.empty else ()
    jobs: dict[str, Callable[[], Row]] = {empty_name(s): partial(empty_row, s) for s in seeds}
    jobs |= jobs_of(given.effects, given.forms, given.floors, given.seeds)
    return report(figures(judged(jobs, given.out)))
