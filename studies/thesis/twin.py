"""Chapter "twin": the machine is identified; its twin follows the same reference and is, too.

Fits of both must agree within their uncertainties, and the closed loops must move alike. Of a
machine that was changed the comparison must say what changed. The machine is simulated, stepped ten
times finer than its twin; ``studies.thesis.following`` takes the log of a real one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from identify.output.as_json import json_of
from identify.output.words.fit import agreement_in_words, causes_in_words, difference_in_words
from identify.validation.agreement import Agreement, agreement
from studies.drawing import BLUE, GREY
from studies.telling import Line, Panel, picture
from studies.thesis import shared
from studies.thesis.following import closed_loop_errors, identified, twin_of
from studies.thesis.shared import CATALOGUE, Found
from twin.model.machine import Fitted, MachineModel
from twin.simulation.simulators import MujocoSimulator, ReducedSimulator

TITLE = "Twin against machine"
HEAVIER = 0.01  # of the mass, by which the changed machine differs
REACH = 8.0  # joint standard errors that the picture shows
# RMS of simulated less measured over measured, on the first record of the EMPS drive and on the one
# with pulses (A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, 2019).
EMPS = {
    "position": (1.375e-4, 8.0e-5), "velocity": (2.29e-3, 4.79e-3),
    "acceleration": (8.60e-2, 0.198), "force": (5.85e-2, 8.94e-2),
}  # fmt: skip


def run(small: bool, rng: np.random.Generator) -> Found:
    """On the first axis of the stage, whose dry friction is drawn anew."""
    model, name, axis = shared.machine("proton_xy")
    model = MachineModel(model.name, {name: axis}, model.sample_rate)
    machine = drawn(model, name, rng)
    own = machine.axes[name]
    heavier = machine.with_axis(name, replace(own, mass=own.mass * (1.0 + HEAVIER)))
    logs = [shared.recorded(each, "tracking", rng, 6.0 if small else 20.0)
             for each in (machine, heavier)]  # fmt: skip
    fits = [identified(model, log) for log in logs]
    simulator = ReducedSimulator if small else MujocoSimulator
    follower = twin_of(fits[0], logs[0], simulator=simulator)
    alike = agreement(fits[0], identified(model, follower), CATALOGUE)
    changed, errors = (
        agreement(fits[0], fits[1], CATALOGUE),
        closed_loop_errors(logs[0], follower, name),
    )
    added = own.mass * HEAVIER
    numbers = {
        "alike": json_of(alike),
        "changed": {**json_of(changed), "added_mass": added, "unit": "kg"},
        "closed_loop_error": {
            signal: {"found": error, "unit": "1",
                     "published_emps": dict(zip(("run", "pulses"), EMPS[signal], strict=True))}
            for signal, error in errors.items()
        },
    }  # fmt: skip
    said = [f"machine and twin: {agreement_in_words(*one)}" for one in alike.axes.items()]
    said += [
        f"closed-loop errors of the twin on the machine's reference: {_listed(errors)}",
        f"published for the EMPS drive: {_listed({s: run for s, (run, _) in EMPS.items()})}",
    ]
    for label, found in changed.axes.items():
        said += [
            f"the machine with {added:.3g} kg more: {agreement_in_words(label, found)}",
            *(difference_in_words(n, found.parameters[n]) for n in found.differing),
            *causes_in_words(found),
        ]  # fmt: skip
    return Found(numbers, said, [picture(
        "Difference of the parameters of two fits, in joint standard errors. Dashed: what the "
        "uncertainties of all comparisons together allow; a parameter beyond the picture is drawn "
        "at its edge.",
        _differences(alike, "machine and twin"),
        _differences(changed, "machine before and after the change"), across=2, height=4.2,
    )])  # fmt: skip


def drawn(model: MachineModel, name: str, rng: np.random.Generator) -> MachineModel:
    """The machine with its dry friction scaled by one random factor."""
    axis, factor = model.axes[name], rng.uniform(0.8, 1.25)
    friction = shared.friction_of(axis)
    dry = {p.name for p in friction.effect.parameters if p.dry}
    values = {k: v * factor if k in dry else v for k, v in friction.values.items()}
    fitted = Fitted(friction.effect, values, friction.fixed)
    return model.with_axis(name, axis.with_effect(fitted))


def _listed(errors: Mapping[str, float]) -> str:
    return ", ".join(f"{signal} {100.0 * e:.3g} %" for signal, e in errors.items())


def _differences(found: Agreement, title: str) -> Panel:
    shown = [one for axis in found.axes.values() for one in axis.parameters.items()]
    limit, place = max(d.limit for _, d in shown), np.arange(len(shown))[::-1]
    ratios = np.clip([d.in_standard_errors for _, d in shown], -REACH, REACH)
    allowed = [Line([x, x], [place[0], place[-1]], "", GREY, "--") for x in (-limit, limit)]
    return Panel(
        *allowed, Line(ratios, place, "", BLUE, "o"), title=title, yticks=place,
        yticklabels=[label for label, _ in shown], xlim=(-1.1 * REACH, 1.1 * REACH),
        xlabel="Difference (joint standard errors)",
    )  # fmt: skip
