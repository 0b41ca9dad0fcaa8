"""The whole loop on a machine with a hidden effect."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from identify import workflow
from identify.dataset.preparation import datasets
from identify.estimation.fit import fit_axis
from identify.experiment_design.planting import draw_effect, hidden_part, other_machine
from identify.output.numbers import listed, quantity
from identify.output.shown.report import write_report
from identify.output.shown.subject import Subject
from identify.output.words.next_step import Source
from identify.results.results import Diagnosis, Feedforward, OnMachine
from identify.selection.diagnosis import AxisDiagnosis
from twin.effect import Effect, Kind
from twin.effects import Catalogue
from twin.errors import InputError
from twin.files import make_folder
from twin.logs import Log, write_log
from twin.model.file import save_model
from twin.model.machine import Fitted, MachineModel
from twin.numbers import require_seed
from twin.parallel import Progress, silent
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator

DURATION = 12.0  # s of each log
BETTER = "better.toml"  # the model with what was found
TRAINING, SELECTION, TEST = ("tracking", "moves"), "tracking", "moves"  # run for each role
FORCE = 0.05  # N RMS of the hidden effect, about 50 times the noise floor


@dataclass(frozen=True, eq=False)
class Demo:
    """The result of the demonstration."""

    hidden: Fitted
    diagnosis: Diagnosis
    feedforward: Feedforward | None
    report: Path

    @property
    def named(self) -> bool:
        """Whether the diagnosis named the hidden effect."""
        effect = self.diagnosis.effect
        return effect is not None and effect.name == self.hidden.effect.name


def demo(
    model: MachineModel,
    catalogue: Catalogue,
    folder: Path,
    seed: int,
    source: Source,
    say: Callable[[str], None] = print,
    progress: Progress = silent,
) -> Demo:
    """Make a machine with a hidden effect, log it, and diagnose the logs.

    Writes machine_*.mcap, better.toml and report.html into the folder. source: of the report.
    Raises InputError where the folder cannot be made.
    """
    require_seed(seed)
    make_folder(folder)
    rng = np.random.default_rng(seed)
    machine, hidden = hidden_machine(model, catalogue, rng)
    say("1. a machine with an effect that the model lacks runs four experiments, logged as MCAP")
    logs: dict[str, Log] = {}
    for i, experiment in enumerate((*TRAINING, SELECTION, TEST), start=1):
        path = folder / f"machine_{i}.mcap"
        logs[str(path)] = simulate(
            machine, experiment, seed=seed + 1000 * i, duration=DURATION,
            progress=partial(progress, f"simulating {path.name}"),
        )  # fmt: skip
        write_log(logs[str(path)], path)
    test, held = dict([logs.popitem()]), dict([logs.popitem()])
    known = ", ".join(next(iter(model.axes.values())).names)
    say(f"2. the model ({known}) is fitted, and every absent effect tried")
    diagnosis = workflow.diagnose(model, logs, held, test, catalogue=catalogue, progress=progress)
    worth, final, found = None, diagnosis.model, diagnosis.leading
    if found.named:
        axis = found.dataset.axis
        say(f"3. the diagnosis names {listed(found.named)} on {axis}")
        say(_fallen(found, diagnosis.summaries[axis].floor))
        worth = workflow.feedforward(
            final, test, diagnosis.fitted, machine=machine, progress=progress
        )
        say(_followed(worth, axis))
    save_model(final, folder / BETTER)
    report = folder / "report.html"
    subject = Subject(
        f"{model.name}: what the model lacks",
        diagnosis,
        final.history,
        source=source,
        machine=OnMachine(worth=worth),
    )
    write_report(report, subject)
    return Demo(hidden, diagnosis, worth, report)


def _fallen(found: AxisDiagnosis, floor: float) -> str:
    before, after = found.tested.before, found.tested.after
    unit = f"m{found.dataset.units.force}"
    return (
        f"4. added: on the test log, which decided nothing, the force error falls from "
        f"{1e3 * before:.2f} {unit} to {1e3 * after:.2f} {unit}, {before / after:.0f} times; the "
        f"noise floor is {1e3 * floor:.2f} {unit}"
    )


def _followed(worth: Feedforward, axis: str) -> str:
    found, unit = worth.axes[axis], worth.model.axes[axis].units.position
    assert found.before is not None
    return (
        "5. as feedforward, the RMS tracking error of the machine on the motion of the test log "
        f"falls from {quantity(found.before.rms, unit)} with the model before to "
        f"{quantity(found.diagnosed.rms, unit)}; under feedback alone it is "
        f"{quantity(found.without.rms, unit)}"
    )


def hidden_machine(
    model: MachineModel, catalogue: Catalogue, rng: np.random.Generator
) -> tuple[MachineModel, Fitted]:
    """A machine with other values and one more effect on its first axis, large enough to find."""
    machine = model
    for name, axis in model.axes.items():
        machine = machine.with_axis(name, other_machine(axis, rng))
    log = simulate(
        machine, "tracking", seed=int(rng.integers(1 << 30)), duration=DURATION,
        simulator=ReducedSimulator,
    )  # fmt: skip
    name, axis = next(iter(machine.axes.items()))
    dataset = datasets(machine, {"log": log}, {})[name]
    base = fit_axis(axis, dataset.training)
    absent = [
        effect for effect in catalogue.values()
        if effect.name not in axis.names and machine.can_use(effect) and _can_hide(effect)
    ]  # fmt: skip
    for index in rng.permutation(len(absent)):
        hidden = draw_effect(absent[index], axis, dataset.training, dataset.excitation, FORCE, rng)
        visible = 0.5  # least part of the hidden force that a fit without the effect cannot absorb
        if hidden_part(hidden, base, dataset) < 1.0 - visible:
            return machine.with_axis(name, axis.with_effect(hidden)), hidden
    raise InputError(
        "no effect of the catalogue can be seen in the motion of this machine; try another seed"
    )


def _can_hide(effect: Effect) -> bool:
    kinds = (Kind.FORCE, Kind.MODIFIER, Kind.ACTUATION)
    return effect.kind in kinds and not (effect.is_nonparametric or effect.channels)
