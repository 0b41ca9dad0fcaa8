"""A drive with an effect that its model lacks, diagnosed, for the tests of the report."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from html.parser import HTMLParser
from pathlib import Path

from identify import adding, workflow
from identify.output.shown.report import write_report
from identify.output.shown.subject import Subject
from identify.results.grown import Addition
from identify.results.results import Comparison, Diagnosis, summary_of, with_all_found
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from twin.effects import Catalogue, load_catalogue
from twin.logs import Log
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator

HARDWARE = Hardware(
    travel=(-0.1, 0.1), encoder_noise=1e-9, current_noise=1e-3, force_constant=10.0, velocity=0.2,
    acceleration=2.0, jerk=100.0,
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A drive with cogging that its model lacks: the model, its logs and what was found."""

    model: MachineModel
    fit: dict[str, Log]
    held: dict[str, Log]
    diagnosis: Diagnosis
    addition: Addition

    @property
    def x(self) -> AxisDiagnosis:
        return self.diagnosis.axes["x"]

    def subject(self, result: Diagnosis | Comparison) -> Subject:
        return Subject("Report", result, self.addition.model.history, [self.addition])

    def concluding(self, x: AxisDiagnosis) -> Diagnosis:
        """The same diagnosis with another conclusion."""
        told = {"x": summary_of(x)}
        fitted, compared = self.diagnosis.fitted, self.diagnosis.comparison
        better = with_all_found(fitted, {"x": x}, told)
        return Diagnosis(fitted, {"x": x}, compared, told, model=better)

    @property
    def quiet(self) -> AxisDiagnosis:
        """The axis, had nothing been found."""
        x = self.x
        return replace(
            x, verdict=Verdict.NOTHING_MISSING, findings=(), steps=(), final=x.base,
        )  # fmt: skip

    def write(self, path: Path, **changes: object) -> str:
        subject = replace(self.subject(self.diagnosis), **changes)  # type: ignore[arg-type]
        write_report(path, subject)
        return path.read_text(encoding="utf-8")


def thinned(log: Log, every: int = 5) -> Log:
    """As a recorder keeps it: position and force of one instant, which the command is not."""
    x = {name: column[::every] for name, column in log.axes["x"].columns.items()}
    return Log(log.sample_rate / every, {"x": replace(log.axes["x"], columns=x)})


@cache
def cogging_case() -> Case:
    """The drive with two short logs, diagnosed among two effects.

    Its channel delay is seen when cogging is beside the model.
    """
    catalogue = load_catalogue()
    effects = [("coulomb_viscous", {"Fc": 0.3, "Fs": 0.3, "sigma2": 0.5}), ("constant_force", {})]
    axis = AxisModel(
        5.0, HARDWARE, tuple(Fitted.at_start(catalogue[n], values) for n, values in effects)
    )
    model = MachineModel("drive", {"x": axis}, 10_000.0)
    hidden = Fitted.at_start(catalogue["cogging"], {"p": 0.025, "a1": 0.1})
    truth = model.with_axis("x", axis.with_effect(hidden))
    first, second = (
        thinned(simulate(truth, "tracking", seed=seed, duration=6.0, simulator=ReducedSimulator))
        for seed in (1, 2)
    )
    fit, held = {"run 1": first}, {"run 2": second}
    few = Catalogue([catalogue["cogging"], catalogue["quadratic_drag"]])
    return Case(
        model, fit, held,
        workflow.diagnose(model, fit, held, catalogue=few),
        adding.add(catalogue["cogging"], model, fit, held),
    )  # fmt: skip


class Outline(HTMLParser):
    """Tags, attributes and visible text of a page; its scripts and styles apart."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.text = ""
        self._apart = False
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs
        self._apart = tag in ("script", "style")

    def handle_endtag(self, tag: str) -> None:
        self._apart = False

    def handle_data(self, data: str) -> None:
        self.text += "" if self._apart else data
