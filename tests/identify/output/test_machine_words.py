"""What is said of an import map, a project, an export, a log and a machine that runs."""

from __future__ import annotations

from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from identify.analysis.first_values import FirstValues
from identify.analysis.map_proof import MapProof
from identify.output import machine as words
from identify.output.live import table_of
from identify.output.project import error_in_words, model_made, project_text
from identify.output.proposal import plot, proof_text
from identify.project.entries import (
    ErrorsEntry,
    ExperimentEntry,
    ExportEntry,
    ModelEntry,
    Project,
    RecordingEntry,
)
from identify.results.fleet import LiveAxis, LiveParameter
from twin.checks import CheckReport, Fault, LogFinding, Severity
from twin.checks.long import AxisInfo, Channel, LogInfo
from twin.checks.report import WHOLE
from twin.export import ExportAgreement, Exported, Outdated
from twin.export.tables import Held, Remark
from twin.importers.proposal.motion import Explained
from twin.model.units import LINEAR, ROTARY

# --- an import map -----------------------------------------------------------------------------

MOTION = Explained(0.934, 0.217, 0.94, 0.5, 0.4, 20.0, 0.0, True)
VALUES = FirstValues(2.13, 0.73, 4.7, 0.0, None)
PROOF = MapProof(MOTION, VALUES, LINEAR, True)
WHOLE_PROOF = (
    "axis x, with this map: moved mass 2.13 kg, friction 0.730 N, force explained to 93 %; with "
    "the sign reversed it would be 22 %"
)


@pytest.mark.parametrize(
    ("proof", "said"),
    [
        (PROOF, WHOLE_PROOF),
        (
            replace(PROOF, values=replace(VALUES, coulomb=0.0)),
            WHOLE_PROOF.replace("0.730 N", "4.70 N·s/m"),
        ),
        (
            replace(PROOF, values=FirstValues(None, 0.0, 0.0, 0.0, None)),
            WHOLE_PROOF.replace("2.13 kg, friction 0.730 N", "not told, no friction told"),
        ),
        (
            replace(PROOF, values=None),
            WHOLE_PROOF.replace(
                "moved mass 2.13 kg, friction 0.730 N",
                "hardly moves, so that neither mass nor friction is told",
            ),
        ),
        (
            replace(PROOF, values=None, has_force=False),
            WHOLE_PROOF.replace(
                "moved mass 2.13 kg, friction 0.730 N",
                "no force yet: give force_constant in the map",
            ),
        ),
        (
            replace(PROOF, units=ROTARY),
            WHOLE_PROOF.replace("mass 2.13 kg", "inertia 2.13 kg·m²").replace("N,", "N·m,"),
        ),
        (
            replace(PROOF, motion=replace(MOTION, both_ways=False)),
            WHOLE_PROOF.replace(
                "with the sign reversed it would be 22 %",
                "it moves one way only, which tells no sign",
            ),
        ),
        (replace(PROOF, motion=replace(MOTION, forward=-0.3)), WHOLE_PROOF.replace("93 %", "0 %")),
    ],
)
def test_what_a_map_makes_of_an_axis_is_one_sentence(proof: MapProof, said: str) -> None:
    assert proof_text("x", proof) == said


def test_a_small_plot_goes_from_the_least_to_the_largest_mean() -> None:
    assert plot(np.arange(8.0)) == "▁▂▃▄▅▆▇█"
    assert plot(np.repeat([3.0, -1.0], 500)) == "█" * 10 + "▁" * 10
    assert plot(np.full(1000, 7.0)) == "▁" * 20
    assert len(plot(np.sin(np.arange(977.0)))) == 20


# --- a project -----------------------------------------------------------------------------------

ERRORS = [
    ErrorsEntry(axis="x", role="test", after=0.31, unit="N"),
    ErrorsEntry(axis="x", role="training", after=0.127, before=0.913, unit="N"),
    ErrorsEntry(axis="y", role="training", after=0.21, unit="N"),
]
FIRST = ModelEntry(file="m.toml")
FITTED = ModelEntry(file="n.toml", base="m.toml", change=["fit"], errors=ERRORS)


def test_a_project_tells_its_recordings_models_and_what_was_made_of_them() -> None:
    project = Project(
        recordings=[
            RecordingEntry(file="a.mcap", role="training", sources=["a.csv", "b.csv"]),
            RecordingEntry(file="held.mcap", role="test"),
        ],
        models=[FIRST, FITTED],
        experiments=[ExperimentEntry(file="next.toml")],
        exports=[ExportEntry(format="c", files=["x.c", "x.h"])],
    )
    assert project_text("servo", project).splitlines() == [
        "project servo",
        "  a.mcap     training, from a.csv",
        "  held.mcap  test",
        "  m.toml = first model",
        "  n.toml = m.toml refitted",
        "    axis x: training 0.913 -> 0.127 N, test 310 mN",
        "    axis y: training 210 mN",
        "  next.toml: an experiment",
        "  x.c, x.h: exported to c",
    ]
    untested = project.model_copy(
        update={"models": [FITTED.model_copy(update={"errors": ERRORS[1:]})]}
    )
    assert "    not tested: it has no error on the test logs" in project_text("s", untested)
    without = untested.model_copy(update={"recordings": project.recordings[:1]})
    assert "not tested" not in project_text("s", without)
    assert project_text("new", Project()).splitlines()[1:] == [
        "  empty; `twin import FILE` takes a recording in"
    ]


def test_a_model_is_told_by_what_was_changed() -> None:
    added = ModelEntry(file="o.toml", base="m.toml", change=["wear", "gms"])
    assert model_made(added) == "m.toml + wear + gms"
    unproved = added.model_copy(update={"proved": False})
    assert model_made(unproved) == "m.toml + wear + gms, which the logs do not prove"
    removed = ModelEntry(file="p.toml", base="o.toml", removed="wear")
    assert model_made(removed) == "o.toml without wear"
    assert error_in_words(ERRORS[0]) == "test 310 mN"


# --- exports -------------------------------------------------------------------------------------


def test_an_export_tells_of_each_axis_what_it_keeps_holds_nearly_and_loses() -> None:
    x = Held(("mass", "cogging"), (Remark("x", "lugre", "as steps"),), (Remark("x", "wear", "no"),))
    written = (Remark("y", "damping", "is 3 now"),)
    told = words.export_text(Exported({}, {"x": x, "y": Held((), (), ())}, written))
    assert told.splitlines() == [
        "axis x: keeps mass, cogging",
        "  nearly: lugre, as steps",
        "  lost: wear, no",
        "axis y: keeps nothing",
        "  in the file: damping, is 3 now",
    ]


def test_exported_files_are_told_to_be_of_the_model_or_where_they_are_not() -> None:
    same = words.export_agreement_text(ExportAgreement(("c", "csv"), ()), "m.toml", "out")
    assert same == "out: c, csv of m.toml, as the model gives it"
    other = ExportAgreement(
        ("fmu",), (Outdated("a.fmu", None, "", ""), Outdated("a.c", 12, "k = 1", "k = 2"))
    )
    assert words.export_agreement_text(other, "m.toml", "out").splitlines() == [
        "out: fmu of m.toml, not as the model gives it now",
        "  a.fmu: is another file",
        "  a.c, line 12: has 'k = 1', the model 'k = 2'",
    ]


# --- logs ----------------------------------------------------------------------------------------


def test_what_is_not_determined_is_told_once_of_all_axes() -> None:
    one, both = words.not_determined_in_words({"x": ["lugre.Fs", "mass"], "y": ["mass"]})
    assert one.startswith("axis x: lugre.Fs is not determined")
    assert both.startswith("axes x, y: mass is not determined")


def test_warnings_of_a_log_are_folded_into_one_line_and_errors_stay() -> None:
    assumes = "a.mcap: warning: the import map assumes mm"
    findings = [
        "a.mcap: error: no force", "my log.mcap: warning: late", "my log.mcap: warning: noisy",
        assumes, "b.mcap: warning: the import map assumes A", "b.mcap: warning: short",
    ]  # fmt: skip
    assert words.minor(findings) == [findings[1], findings[2], findings[5]]
    assert words.briefly(findings) == [
        "a.mcap: error: no force",
        assumes,
        "my log.mcap: 2 warnings; `twin check 'my log.mcap'` tells what to do",
        "b.mcap: 1 warning; `twin check b.mcap` tells what to do",
    ]


FORCE = Channel("force", "N", np.array([-1.5, 2.25, -3.0, 0.5]))
PLACE = Channel("position", "m", np.array([0.01, 0.123456789]))
LATE = LogFinding(Severity.WARNING, Fault.LAG, "x", "it is late", WHOLE, "mend it")


def info(**changes: object) -> LogInfo:
    axes = {
        "x": AxisInfo("linear", (PLACE, FORCE), (7.5, "N/A")),
        "a": AxisInfo("rotary", (PLACE,), None),
    }
    given = {
        "samples": 12345, "sample_rate": 1000.0, "axes": axes,
        "metadata": {"source": "a drive", "map": "one\ntwo\nthree"}, "check": CheckReport(()),
    }  # fmt: skip
    return LogInfo(**{**given, **changes})


def test_a_log_is_told_with_its_axes_and_the_ranges_of_its_signals() -> None:
    assert words.info_text({"run.mcap": info()}).splitlines() == [
        "run.mcap: 12.35 s, 12345 samples at 1000 Hz, axes x, a",
        "  written by: source a drive, map (3 lines)",
        "  axis x (linear, force constant 7.5 N/A)",
        "    position  0.01 to 0.123457 m",
        "    force     -3 to 2.25 N",
        "  axis a (rotary)",
        "    position  0.01 to 0.123457 m",
        "  check: suitable for identification",
    ]


@pytest.mark.parametrize(
    ("severity", "how"),
    [(Severity.WARNING, "warnings alone"), (Severity.ERROR, "not suitable for identification")],
)
def test_what_a_check_found_of_it_is_told_by_kind(severity: Severity, how: str) -> None:
    found = replace(LATE, severity=severity)
    check = CheckReport((found, found, replace(found, axis="a")))
    *_, last = words.info_text({"my run": info(check=check)}).splitlines()
    kind = Fault.LAG.value
    assert last == (
        f"  check: {how}: {kind} (axis x), {kind} (axis a); `twin check 'my run'` tells where, and "
        "what to do"
    )


# --- a machine that runs -------------------------------------------------------------------------


def test_a_machine_that_runs_is_a_table_with_a_row_a_parameter() -> None:
    none = np.zeros(0)
    slow = LiveParameter("lugre.Fc", 1.5, 0.02, 1.31, "N"), LiveParameter("mass", 3, 0.1, 2.9, "kg")
    axes = (
        LiveAxis("x", "N", none, none, 0.0231, 0.0121, slow),
        LiveAxis("y", "N", none, none, 0.017, None, ()),
    )
    console = Console(width=120, record=True, file=StringIO())
    console.print(table_of("run.mcap", 17.4, axes))
    title, *lines = console.export_text().splitlines()
    assert title.strip() == "run.mcap, 17 s"
    cells = [[c.strip() for c in line.strip("│┃").split("│")] for line in lines if "│" in line]
    assert cells == [
        ["x", "23.1 mN", "12.1 mN", "lugre.Fc", "1.500 ± 0.020 N (fitted 1.31 N)"],
        ["", "", "", "mass", "3.00 ± 0.10 kg (fitted 2.90 kg)"],
        ["y", "17.0 mN", "–", "–", "–"],
    ]
