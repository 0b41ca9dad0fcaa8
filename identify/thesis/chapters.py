"""All chapters of the study, by name, in the order of the thesis."""

from __future__ import annotations

import difflib
import time
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from identify.thesis import cable, dynamic, future, models, residuals, simulation, track, twin
from identify.thesis.chapter import Chapter
from twin.effects import Catalogue
from twin.errors import InputError
from twin.log import Log
from twin.model.file import load_model
from twin.model.machine import MachineModel
from twin.progress import Progress

CHAPTERS: Mapping[str, Chapter[Any, Any]] = {
    "models": models.CHAPTER,
    "simulation": simulation.CHAPTER,
    "cable": cable.CHAPTER,
    "track": track.CHAPTER,
    "dynamic": dynamic.CHAPTER,
    "residuals": residuals.CHAPTER,
    "future": future.CHAPTER,
    "twin": twin.CHAPTER,
}


@dataclass(frozen=True, eq=False)
class Reproduction:
    """Results of the chapters that were run, and the seconds that each took.

    logs: names of those of a real machine; none where the twin was used. left_out: why a chapter
    could not be run on them, where none was asked for by name.
    """

    chapters: Mapping[str, Any]
    seconds: Mapping[str, float]
    small: bool
    logs: tuple[str, ...] = ()
    left_out: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"<Reproduction of {', '.join(self.chapters)}>"


def reproduce_on_logs(
    chapters: Sequence[str],
    model: MachineModel,
    logs: Mapping[str, Log],
    *,
    axis: str | None = None,
) -> Reproduction:
    """Chapters on logs of a real machine; where none is named, those that the logs allow.

    axis: the only one that moves where None. Raises InputError for a named chapter that needs the
    twin or other logs, and where none is possible.
    """
    _require_known(chapters)
    possible = {n: c.on_logs for n, c in CHAPTERS.items() if c.on_logs is not None}
    for name in chapters:
        if name not in possible:
            raise InputError(
                f"chapter '{name}' needs the twin, which knows what is planted; on logs there is "
                f"{', '.join(possible)}"
            )
    model = model if axis is None else _alone(model, axis)
    results, seconds, left_out = {}, {}, {}
    for name in chapters or possible:
        start = time.monotonic()
        try:
            results[name] = possible[name](model, logs)
        except InputError as error:
            if chapters:
                raise
            left_out[name] = str(error)
            continue
        seconds[name] = time.monotonic() - start
    if not results:
        raise InputError("; ".join(f"chapter '{n}': {reason}" for n, reason in left_out.items()))
    return Reproduction(results, seconds, small=False, logs=tuple(logs), left_out=left_out)


def _alone(model: MachineModel, axis: str) -> MachineModel:
    if axis not in model.axes:
        raise InputError(f"no axis '{axis}' in {model.name}; there is {', '.join(model.axes)}")
    return MachineModel(model.name, {axis: model.axes[axis]}, model.sample_rate)


def _require_known(chapters: Sequence[str]) -> None:
    for name in chapters:
        if name not in CHAPTERS:
            near = difflib.get_close_matches(name, CHAPTERS, n=1, cutoff=0.4)
            hint = f"did you mean '{near[0]}'? " if near else ""
            raise InputError(f"unknown chapter '{name}'; {hint}there are {', '.join(CHAPTERS)}")


def reproduce(
    catalogue: Catalogue,
    chapters: Sequence[str] = (),
    *,
    small: bool = False,
    seed: int = 1,
    progress: Progress,
) -> Reproduction:
    """Run chapters of the study on the twin, all where none is named.

    small: a quick version, of fewer speeds and trials. The same seed gives the same numbers, and
    each chapter the same whether it runs alone or not. Raises InputError for an unknown chapter.
    """
    _require_known(chapters)
    results, seconds = {}, {}
    for name, chapter in CHAPTERS.items():
        if chapters and name not in chapters:
            continue
        start = time.monotonic()
        models = [load_model(model, catalogue) for model in chapter.models]
        size = chapter.small if small else chapter.full
        rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
        results[name] = chapter.run(models, catalogue, size, rng, progress)
        seconds[name] = time.monotonic() - start
    return Reproduction(results, seconds, small)
