"""The next step of a diagnosis as commands, of the model and the logs that it was made of."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from identify.dataset.dataset import Dataset, Role
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from twin.effects import load_catalogue

OPTIONS = {Role.TRAINING: "", Role.SELECTION: "--holdout ", Role.TEST: "--test "}
Names = Mapping[Role, Sequence[str]]


@dataclass(frozen=True)
class Source:
    """What a result was made of: the command as typed, the model's name in it, the logs' folder.

    options: those of the command that the next one needs as well.
    """

    command: str = ""
    model: str = "MODEL"
    folder: Path = Path()
    options: str = ""

    def filled(self, text: str, names: Names) -> str:
        """A command with this model and these logs in the place of MODEL and LOG...

        A plan reads no test logs. What is written has another name than the model.
        """
        given = [
            f"{OPTIONS[role]}{shlex.quote(name)}"
            for role, logs in names.items()
            for name in logs
            if role is not Role.TEST or not text.startswith("twin plan")
        ]
        every = " ".join([*given, *([self.options] if self.options else [])])
        begun, _, written = text.rpartition("-o ")
        if again := re.fullmatch(rf"{Path(written).stem}(?:_(\d+))?", Path(self.model).stem):
            name = f"{Path(written).stem}_{int(again[1] or 1) + 1}{Path(written).suffix}"
            text = f"{begun}-o {name}"
        return text.replace("LOG...", every).replace("MODEL", shlex.quote(self.model))


UNKNOWN = Source()


def names_of(dataset: Dataset) -> dict[Role, list[str]]:
    """Names of the logs of a dataset by role."""
    return {role: [log.motion.name for log in dataset.having(role)] for role in Role}


def fitted_curves() -> list[str]:
    """Effects that lower an error without explaining it."""
    every = load_catalogue().values()
    return [e.name for e in every if e.is_nonparametric and not e.free_shape]


def next_commands(found: AxisDiagnosis) -> list[str]:
    """What to run next, of MODEL and LOG...: of what is named first, else of what is left."""
    if found.verdict is Verdict.NOTHING_MISSING:
        return []
    for finding in found.missing:
        if finding.tied:
            pair = f"{finding.effect} {finding.tied[0]}"
            return [f"twin plan MODEL LOG... --between {pair} -o next.toml"]
        if finding.together:
            second = f"twin add {finding.together[0]} first.toml LOG... -o both.toml"
            return [f"twin add {finding.effect} MODEL LOG... -o first.toml", second]
    first = next((f for f in found.findings if not f.contradicted), None)
    if first is None:
        added = fitted_curves()[0] if found.unexplained else None
    elif first in found.missing:
        added = first.effect
    else:  # of a free exponent the model file has to be changed
        added = None if first.bend else f"--shape {first.effect}"
    return [f"twin add {added} MODEL LOG... -o better.toml"] if added else []
