"""Diagnosis of machines of the second simulator: python tests/foreign_diagnoses.py --help."""

from __future__ import annotations

import argparse
import time
import zlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from foreign_effects import INSIDE, OUTSIDE, Planted
from foreign_machine import (
    AHEAD,
    BEHIND,
    FORCE,
    PITCH,
    PLACE,
    WIDTH,
    Machine,
    drawn,
    gaussian,
    logs_of,
    run,
    train,
)  # fmt: skip
from machines import one_axis

from identify import workflow
from identify.selection.diagnosis import diagnose_axis
from identify.selection.findings import FindingKind
from twin.effects import load_catalogue
from twin.model.file import load_model

CATALOGUE = load_catalogue()
STAGE = one_axis(load_model("proton_xy", CATALOGUE))
NOTHING = {"nothing": Planted(lambda m, size, rng: m, fixed=True)}
EFFECTS = INSIDE | OUTSIDE | NOTHING
DURATION = 10.0  # s of each log
NEAR = 0.8  # of the floors wanted, from which an effect has its size
VARIANTS = ("", "Gaussian bumps", "no bumps at rest", "decimated", "half early", "one early")
EARLY = {"half early": 0.5, "one early": 1.0}  # samples
FIELDS = (
    "planted", "seed", "floors", "added", "left", "size", "verdict", "findings", "mark", "top",
    "held", "s",
)  # fmt: skip
FORMS = {"bumps": "roller_spikes", "cable": "cable_slab", "stribeck": "lugre"}  # what has another


def model_for(planted: Planted):
    """The nominal model, less what is to be found again."""
    axis = STAGE.axes["x"]
    kept = tuple(f for f in axis.effects if f.effect.name not in planted.drop)
    return STAGE.with_axis("x", replace(axis, effects=kept))


def reshaped(machine: Machine, forms, rng: np.random.Generator) -> Machine:
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


def excess(machine: Machine, model, seed: int) -> float:
    """How far the fitted model's error stands above its floor, in floors."""
    fit = workflow.fit(model, {"log 1": run(machine, 1000 * seed + 1, DURATION)}).fits["x"]
    return float(np.sqrt(max(fit.ratio**2 - 1.0, 1e-4)))


def sized(planted: Planted, base: Machine, model, wanted: float, seed: int):
    """The machine with the effect as large as adds that many floors of error to the model's."""
    size, before = 1.0 if planted.fixed else planted.start, excess(base, model, seed)

    def make(size):
        return planted.make(base, size, np.random.default_rng(seed))

    def added(size):
        return np.sqrt(max(excess(make(size), model, seed) ** 2 - before**2, 1e-4))

    seen = added(size)
    for _ in range(0 if planted.fixed else 5):
        if NEAR < seen / wanted < 1.0 / NEAR or (size == planted.largest and seen < wanted):
            break
        size = min(size * np.clip(wanted / seen, 0.1, 10.0), planted.largest)
        seen = added(size)
    return make(size), size


def diagnosed(model, machine: Machine, seed: int, duration=DURATION, catalogue=CATALOGUE):
    """The diagnosis of the x axis from two logs and one held out, less the free runs."""
    fitted = workflow.fit(model, *logs_of(machine, seed, duration))
    return diagnose_axis(fitted.fits["x"], fitted.datasets["x"], catalogue)


def added_on_logs(base: Machine, found, seed: int) -> float:
    """Floors of error on the logs of a diagnosis beyond those of the machine without the effect.

    There are none where the model's own parameters take the effect up.
    """
    fit = workflow.fit(STAGE, *logs_of(base, seed, DURATION)).fits["x"]
    return float(np.sqrt(max(found.base.ratio**2 - fit.ratio**2, 0.0)))


def describe(d, planted: Planted, forms=()) -> dict:
    """The answer in a line."""
    d = d
    curves = [f.kind is FindingKind.WRONG_SHAPE for f in d.findings]
    missing = [(f.effect, *f.tied) for f, c in zip(d.findings, curves, strict=True) if not c]
    wrong = [f.effect for f, c in zip(d.findings, curves, strict=True) if c]
    true = [{*planted.right, *planted.near} & {*names} for names in missing]
    shapes = {FORMS[f] for f in forms}
    marks = [
        "quiet" if not d.findings else "",
        "right" if any({*planted.right} & {*names} for names in missing) else "",
        "near" if any(true) else "",
        "shape" if shapes & {*wrong} else "",
        "WRONG" if not all(true) else "",
        "WRONG SHAPE" if not {*wrong} <= shapes else "",
    ]
    told = "; ".join(
        f"{f.kind.value} {'/'.join((f.effect, *f.tied))} {f.explains:.2f} c{f.confidence:.2f}"
        for f in d.findings
    )
    top = ", ".join(
        f"{c.effect.name} {c.delta_bic:.0f}{'' if c.supported else '-'} "
        f"x{c.fit.ratio:.2f}" for c in d.ranking[:3]
    )  # fmt: skip
    gain = d.ranking[0].gain
    floor = d.base.floor
    return {
        "floors": f"{d.base.ratio:.2f}", "left": f"{d.final.ratio:.2f}",
        "verdict": d.verdict.name.lower(), "findings": told or "-",
        "mark": " ".join(m for m in marks if m), "top": top,
        "held": f"{gain.before / floor:.2f}>{gain.after / floor:.2f}",
    }  # fmt: skip


def dataset(name: str, wanted: float, seed: int, forms=()) -> dict:
    """One machine, diagnosed; nothing is planted where the name is that."""
    planted = EFFECTS[name]
    code = 1000 * seed + zlib.crc32(name.encode()) % 997
    rng = np.random.default_rng(code)
    base, model = reshaped(drawn(rng), forms, rng), model_for(planted)
    machine, size = sized(planted, base, model, wanted, code)
    begun = time.perf_counter()
    found = diagnosed(model, machine, code)
    row = {
        "planted": " ".join((f"{name} @{wanted:g}", *forms)),
        "seed": seed,
        "size": f"{size:.3g}",
        "added": f"{added_on_logs(base, found, code):.2f}",
        "wanted": wanted if planted.right else 0.0,
    }
    return row | describe(found, planted, forms) | {"s": f"{time.perf_counter() - begun:.0f}"}


def empty(seed: int) -> dict:
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
    begun = time.perf_counter()
    found = diagnosed(STAGE, replace(machine, early=EARLY.get(variant, 0.0)), 90_000 + seed)
    row = {
        "planted": f"empty {variant} {rate / 1e3:g}/{log_rate / 1e3:g} kHz", "seed": seed,
        "size": f"{noise['encoder_noise']:.1e} m, {noise['current_noise']:.1e} A",
        "added": "0", "wanted": 0.0,
    }  # fmt: skip
    return row | describe(found, Planted(None)) | {"s": f"{time.perf_counter() - begun:.0f}"}


def line(row: dict) -> str:
    return "| " + " | ".join(str(row[f]) for f in FIELDS) + " |\n"


def summary(rows: Sequence[dict], forms: Sequence[str]) -> str:
    """How many effects are named and shapes told, and what is wrong.

    Of effects that add most of the floors asked for: what the model's own parameters take up is not
    in the logs.
    """
    shown = [r for r in rows if float(r["added"]) > NEAR * r["wanted"] > 0.0]
    named = [r for r in shown if {"right", "near"} & {*r["mark"].split()}]
    told = [r for r in rows if "shape" in r["mark"].split()]
    wrong = [r for r in rows if "WRONG" in r["mark"]]
    lines = [
        f"named: {len(named)} of {len(shown)} that show, of {len(rows)} planted",
        f"a wrong shape told: {len(told)} of {len(rows)}" if forms else "",
        f"wrong beside: {len(wrong)} of {len(rows)}",
        *(f"not named: {r['planted']}, {r['added']} floors" for r in shown if r not in named),
        *(f"does not show: {r['planted']}, {r['added']} floors" for r in rows if r not in shown),
    ]
    return "\n".join(filter(None, lines))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--empty", type=int, nargs=2, metavar=("FIRST", "END"))
    parser.add_argument("--effects", nargs="*", default=[], help="names, or inside, or outside")
    parser.add_argument("--floors", type=float, nargs="*", default=[5.0, 20.0])
    parser.add_argument("--forms", nargs="*", default=[], choices=list(FORMS), help="of their own")
    parser.add_argument("--seeds", type=int, nargs="*", default=[1])
    parser.add_argument("-o", "--out", type=Path, default=Path("foreign.md"))
    given = parser.parse_args()
    groups = {"inside": list(INSIDE), "outside": list(OUTSIDE)}
    names = [n for g in given.effects for n in groups.get(g, [g])]
    jobs = [(empty, (s,)) for s in range(*given.empty)] if given.empty else []
    for seed in given.seeds:
        for n in names:
            levels = given.floors[:1] if EFFECTS[n].fixed else given.floors
            jobs += [(dataset, (n, floors, seed, given.forms)) for floors in levels]
    if not given.out.exists():
        given.out.write_text(line({f: f for f in FIELDS}) + "|---" * len(FIELDS) + "|\n")
    rows = []
    for job, args in jobs:
        try:
            rows.append(job(*args))
            text = line(rows[-1])
        except Exception as error:  # one that fails must not end the dataset
            text = f"| {args} FAILED | {type(error).__name__}: {error} |\n"
        with given.out.open("a") as out:
            out.write(text)
    print(summary(rows, given.forms))


if __name__ == "__main__":
    main()
