"""Sentences about the chapter "twin" of the reproduced study."""

from __future__ import annotations

from collections.abc import Mapping

from identify.output.words.agreement import (
    agreement_in_words,
    causes_in_words,
    difference_in_words,
    wrong_models_in_words,
)
from identify.thesis.printed import EMPS_CLOSED_LOOP
from identify.thesis.twin import TwinOfLogs, TwinResult
from identify.validation.agreement import Agreement


def twin_in_words(result: TwinResult) -> list[str]:
    """Whether machine and twin agree, and what is said of a machine that was changed."""
    said = [f"machine and twin: {agreement_in_words(*item)}" for item in result.alike.axes.items()]
    own = _listed(result.errors)
    said.append(f"closed-loop errors of the twin on the machine's reference: {own}")
    published = {signal: run for signal, (run, _) in EMPS_CLOSED_LOOP.items()}
    said.append(f"published for the EMPS drive: {_listed(published)}")
    for axis, found in result.changed.axes.items():
        said.append(
            f"the machine with {result.added:.3g} kg more: {agreement_in_words(axis, found)}"
        )
        said += [difference_in_words(d) for d in found.differing]
        said += causes_in_words(found)
    return said


def twin_of_logs_in_words(result: TwinOfLogs) -> list[str]:
    """The same of logs of a machine."""
    said = []
    for log, alike in result.alike.items():
        said += _agreement(log, alike)
        said.append(f"closed-loop errors of the twin on {log}: {_listed(result.errors[log])}")
    return [
        *said,
        "the twin has the controller of the model; where the machine has another, the loops move "
        "less alike, while the parameters can still be compared",
    ]


def _agreement(log: str, alike: Agreement) -> list[str]:
    said = []
    for axis, found in alike.axes.items():
        said.append(f"machine and twin on {log}: {agreement_in_words(axis, found)}")
        said += [difference_in_words(d) for d in found.differing]
        said += causes_in_words(found)
        if doubt := wrong_models_in_words(found):
            said.append(doubt)
    return said


def _listed(errors: Mapping[str, float]) -> str:
    return ", ".join(f"{signal} {100.0 * e:.3g} %" for signal, e in errors.items())
