"""Simulated arms that are not as their files say: `python -m benchmarks arms --seed S`.

As a user goes: `twin new --mjcf` of one log and the file, then the diagnosis with logs of two other
runs. Every file states the rotors, the damping and the dry friction of its joints. Of each machine
one to three things are changed, or nothing; what is right to say follows from these and was written
down before any diagnosis. Friction with presliding is right to name beside anything.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np

from benchmarks.drives import RUBS
from benchmarks.figures import Figure, Target, report
from benchmarks.judgement import STATED
from benchmarks.second_simulator.arms import Arm, Changed, drawn, inertia, log_of
from identify.analysis.first_model import first_model
from identify.results.results import Diagnosis
from identify.workflow import diagnose
from twin.effects import load_catalogue

TITLE = "Simulated arms that are not as their files say"
SEED, MACHINES = 70, 12
CATALOGUE = load_catalogue()
BODY, ROTOR, GAIN, LOADED = "link_mass", "rotor_inertia", "torque_constant", "joint_load_friction"
SPRINGS, FRICTION = ("spring", "gravity"), "coulomb_viscous"
RECORDED = "recording"
UPRIGHT = "0 0 1"  # an axis about which no weight turns
KNOWN = (*RUBS, "encoder_quantization", "coulomb_viscous")
CHANGES = (
    ("payload",), (), ("rotor",), ("gain",), ("mass", "spring"), ("load",), ("weightless",), (),
    ("payload", "rotor"), ("spring",), ("mass", "coulomb"), ("payload", "gain", "load"),
)  # fmt: skip
RATES = (250, 100, 500, 250, 100, 1000)  # Hz, in turn
Told = tuple[str, str]  # what is told, and of which body or joint


@dataclass(frozen=True)
class Machine:
    """An arm with what is changed of it, and what is right to say: each by one of some answers."""

    number: int
    arm: Arm
    changed: Changed
    right: tuple[tuple[Told, ...], ...]

    @property
    def case(self) -> str:
        """Its name in a table."""
        told = ", ".join(f"{what} of {place}" for (what, place), *_ in self.right) or "nothing"
        return f"{self.number}: {len(self.arm.mass)} joints at {self.arm.rate} Hz, {told}"


def machine(seed: int, number: int) -> Machine:
    """A machine of a seed."""
    rng = np.random.default_rng([seed, number])
    joints = 2 + (number + number // len(CHANGES)) % 6  # 2 to 7, each beside each change in time
    arm = drawn(rng, joints, RATES[number % len(RATES)])
    changed, right = Changed(), list[tuple[Told, ...]]()
    for what in CHANGES[number % len(CHANGES)]:
        changed, told = _change(what, arm, changed, rng)
        right += [told] if told else []
    return Machine(number, arm, changed, tuple(right))


def _change(
    what: str, arm: Arm, changed: Changed, rng: np.random.Generator
) -> tuple[Changed, tuple[Told, ...]]:
    """One thing more that is changed of an arm, and what is right of it; nothing if unfelt."""
    i = int(rng.integers(len(arm.mass)))
    joint, link = arm.joints[i], arm.links[i]
    if what == "payload":
        more = float(arm.mass[-1] * rng.uniform(0.2, 0.6))
        return replace(changed, payload=more), ((BODY, arm.links[-1]),)
    if what == "weightless":
        turns = zip(arm.slides, arm.axes, strict=True)
        felt = any(not slide and axis != UPRIGHT for slide, axis in turns)  # else it is an offset
        return replace(changed, weightless=True), ((RECORDED, "weight"),) if felt else ()
    level = float(arm.coulomb[i])
    size, told = {
        "mass": (float(arm.mass[i] * rng.uniform(0.2, 0.4)), ((BODY, link),)),
        "rotor": (float(inertia(arm)[i] * rng.uniform(0.2, 0.5)), ((ROTOR, joint),)),
        "coulomb": (level * float(rng.uniform(0.4, 1.0)), ((FRICTION, joint),)),
        "load": (float(rng.uniform(0.5, 1.0)) / _carried(arm, i), ((LOADED, joint),)),
        "gain": (float(rng.choice([-1, 1]) * rng.uniform(0.08, 0.2)), ((GAIN, joint),)),
        "spring": (level * float(rng.uniform(1.0, 2.0)) / float(arm.reach[i]),
                   tuple((name, joint) for name in SPRINGS)),
    }[what]  # fmt: skip
    if what in ("mass", "rotor") and i == 0:  # about one axis they are one
        told = ((BODY, link), (ROTOR, joint))
    by_joint: dict[str, Any] = {what: {i: size}}
    return replace(changed, **by_joint), told


def _carried(arm: Arm, joint: int) -> float:
    """About the largest load of a joint, N m or N."""
    reach = 1.0 if arm.slides[joint] else 0.6 * float(arm.size[joint])
    return 9.81 * float(arm.mass[joint:].sum()) * reach


def answers_of(found: Diagnosis) -> list[tuple[tuple[Told, ...], float, str]]:
    """Each answer with those tied with it, how sure it is stated, and its values in words.

    Of several that are tied with it together, each counts.
    """
    out = list[tuple[tuple[Told, ...], float, str]]()
    if found.recording is not None:
        what = "weight" if "weight" in found.recording.said else found.recording.axis
        out.append((((RECORDED, what),), 1.0, found.recording.said))
    for body in found.bodies:
        each = (name.split(" with ") for name in (body.body, *body.tied))
        names = tuple(_placed(name, BODY) for together in each for name in together)
        mass, band = body.change[0], body.band[0]
        out.append((names, body.confidence, f"{mass:.3f} ± {band:.3f} kg"))
    for axis, own in found.axes.items():
        for f in own.findings:
            values = ", ".join(f"{k} {v:.3g}" for k, v in f.parameters.items())
            each = (name.split(" with ") for name in (f.effect, *f.tied))
            names = tuple(_placed(name, "", axis) for together in each for name in together)
            out.append((names, f.confidence or 0.0, values))
    return out


def _placed(name: str, what: str, axis: str = "") -> Told:
    """An answer of words: "rotor_inertia of joint1", a body, or an effect of an axis."""
    effect, of, place = name.partition(" of ")
    return (effect, place) if of else (what, name) if what else (name, axis)


def judged(own: Machine) -> dict[str, Any]:
    """One machine diagnosed: what is named of what is changed, and what is wrong."""
    logs = [{f"{i}": log_of(own.arm, own.changed, 1000 * own.number + i)} for i in range(3)]
    begun = process_time()
    model = first_model(logs[0], "arm", CATALOGUE, ("arm.xml", own.arm.text))
    found = diagnose(model, *logs, catalogue=CATALOGUE)
    seconds = process_time() - begun
    answers = answers_of(found)
    named = [any({*right} & {*told} for told, _, _ in answers) for right in own.right]
    for k, right in enumerate(own.right):
        if right[0][0] == FRICTION:  # of every joint it is fitted: its value says it
            named[k] = _friction_found(own, found, right[0][1])
    allowed = {one for right in own.right for one in right}
    wrong = [a for a in answers if not ({*a[0]} & allowed or {n for n, _ in a[0]} & {*KNOWN})]
    return {
        "case": own.case,
        "changed": {k: v for k, v in own.changed.__dict__.items() if v},
        "named": named,
        "wrong": [(_words(a), a[1]) for a in wrong],
        "told": [f"{_words(a)} ({a[1]:.0%}; {a[2]})" for a in answers],
        "payload": _payload(own, found),
        "left": {a: d.final.ratio for a, d in found.axes.items()},
        "seconds": seconds,
    }


def _friction_found(own: Machine, found: Diagnosis, joint: str) -> bool:
    i = own.arm.joints.index(joint)
    law = found.axes[joint].final.axis.friction
    true = own.arm.coulomb[i] + own.changed.coulomb[i]
    return law is not None and abs(law.values.get("Fc", 0.0) / true - 1.0) < 0.1


def _payload(own: Machine, found: Diagnosis) -> tuple[float, float] | None:
    """Error of a payload's mass that was found, over its mass and over its band."""
    last = [body for body in found.bodies if body.body == own.arm.links[-1]]
    if not own.changed.payload or not last or not np.isfinite(last[0].band[0]):
        return None
    off = abs(float(last[0].change[0]) - own.changed.payload)
    return off / own.changed.payload, off / float(last[0].band[0])


def _words(answer: tuple[tuple[Told, ...], float, str]) -> str:
    return " or ".join(f"{what} of {place}" for what, place in answer[0])


def rows(seed: int, numbers: Sequence[int]) -> Iterator[dict[str, Any]]:
    """The machines of a seed, each told as it is done."""
    for number in numbers:
        own = machine(seed, number)
        try:
            row: dict[str, Any] = judged(own)
        except Exception as error:  # the other machines are to be judged all the same
            print(f"{own.case}: FAILED: {type(error).__name__}: {error}", flush=True)
            row = {"case": own.case, "named": [False] * len(own.right), "wrong": [], "told": [],
                   "payload": None, "seconds": 0.0}  # fmt: skip
        print(f"{row['case']}: {row['named']} wrong {row['wrong']} {row['seconds']:.0f} s")
        for line in row["told"]:
            print(f"    {line}", flush=True)
        yield row


def figures(found: Sequence[dict[str, Any]]) -> list[Figure]:
    """How often what is changed is named on the right body or joint, and what is named wrongly."""
    named = [n for r in found for n in r["named"]]
    plain = [r for r in found if not r["named"]]
    wrong = [f"{r['case']}: {w}" for r in found for w, sure in r["wrong"] if sure >= STATED]
    noise = [r["case"] for r in plain if r["wrong"]]
    off = [r["payload"] for r in found if r["payload"]]
    return [
        Figure(
            "what is changed, named on its body or joint", sum(named) / max(len(named), 1), "1",
            Target(low=0.9), f"{sum(named)} of {len(named)}",
        ),
        Figure(
            "wrong names stated at 90 % or more", float(len(wrong)), "1",
            Target(high=len(found) / 40.0), "; ".join(wrong) or "none",
        ),
        Figure(
            "machines that lack nothing, of which something is said", float(len(noise)), "1",
            Target(high=0.0), f"of {len(plain)}",
        ),
        Figure(
            "payloads within 5 %, of those found", float(sum(o[0] < 0.05 for o in off)), "1",
            note=f"of {len(off)}; {sum(o[1] < 1.0 for o in off)} within their 90 % bands",
        ),
        Figure("CPU time a machine", float(np.mean([r["seconds"] for r in found])), "s"),
    ]  # fmt: skip


def timed() -> list[Figure]:
    """How long seven joints take that carry what the file does not know, by logs of 60 s."""
    found = []
    for rate, most in ((100, 20.0), (1000, 60.0)):  # Hz, s
        arm = drawn(np.random.default_rng([SEED, rate]), 7, rate)
        carries = Changed(payload=0.4 * float(arm.mass[-1]))
        logs = [{f"{i}": log_of(arm, carries, i, 60.0)} for i in range(3)]
        model = first_model(logs[0], "arm", CATALOGUE, ("arm.xml", arm.text))
        begun, spent = perf_counter(), process_time()
        diagnose(model, *logs, catalogue=CATALOGUE)
        wall, cpu = perf_counter() - begun, process_time() - spent
        what = f"seven joints, three logs of 60 s at {rate} Hz"
        found.append(Figure(what, wall, "s", Target(high=most), f"wall time; {cpu:.0f} s of CPU"))
    return found


def measure() -> list[Figure]:
    """Rates on a seed that decided nothing, and how long it takes."""
    return [*figures([*rows(SEED, range(MACHINES))]), *timed()]


def main(arguments: Sequence[str]) -> int:
    """Judge some machines of a seed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks arms", description=__doc__)
    parser.add_argument("--machines", type=int, default=6)
    parser.add_argument("--first", type=int, default=0, help="number of the first machine")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--timed", action="store_true", help="seven joints by the clock alone")
    parser.add_argument("-o", "--out", type=Path, help="file for the rows as JSON, a line each")
    given = parser.parse_args(arguments)
    if given.timed:
        return report(timed())
    found = [*rows(given.seed, range(given.first, given.first + given.machines))]
    if given.out:
        given.out.write_text("".join(json.dumps(r, default=str) + "\n" for r in found))
    return report(figures(found))
