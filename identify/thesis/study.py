"""All chapters of the study, by name, in the order of the thesis."""

from __future__ import annotations

import difflib
import time
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identify.thesis import cable, residuals, simulation, track, twin
from identify.thesis.chapter import Progress
from twin.effects import Catalogue
from twin.errors import InputError
from twin.model.file import load_model

SIMULATED = "thesis_simulation"  # model files of the package
STAGE = "proton_xy"
TRACK = "thesis_track"
MEMORY = "thesis_memory"

Result = (
    simulation.SimulationStudy
    | cable.CableStudy
    | track.TrackStudy
    | residuals.ResidualStudy
    | twin.TwinStudy
)
Run = Callable[[Catalogue, bool, np.random.Generator, Progress], Result]


def _simulation(
    catalogue: Catalogue, small: bool, rng: np.random.Generator, progress: Progress
) -> Result:
    size = simulation.SMALL if small else simulation.FULL
    return simulation.simulation_study(load_model(SIMULATED, catalogue), size, rng, progress)


def _cable(
    catalogue: Catalogue, small: bool, rng: np.random.Generator, progress: Progress
) -> Result:
    size = cable.SMALL if small else cable.FULL
    return cable.cable_study(load_model(STAGE, catalogue), size, rng, progress)


def _twin(
    catalogue: Catalogue, small: bool, rng: np.random.Generator, progress: Progress
) -> Result:
    size = twin.SMALL if small else twin.FULL
    return twin.twin_study(load_model(STAGE, catalogue), catalogue, size, rng, progress)


def _track(
    catalogue: Catalogue, small: bool, rng: np.random.Generator, progress: Progress
) -> Result:
    size = track.SMALL if small else track.FULL
    return track.track_study(load_model(TRACK, catalogue), size, rng, progress)


def _residuals(
    catalogue: Catalogue, small: bool, rng: np.random.Generator, progress: Progress
) -> Result:
    size = residuals.SMALL if small else residuals.FULL
    machine, stage = (load_model(name, catalogue) for name in (MEMORY, STAGE))
    return residuals.residual_study(machine, stage, catalogue, size, rng, progress)


CHAPTERS: Mapping[str, Run] = {
    "simulation": _simulation,
    "cable": _cable,
    "track": _track,
    "residuals": _residuals,
    "twin": _twin,
}


@dataclass(frozen=True, eq=False)
class Reproduction:
    """Results of the chapters that were run, and the seconds that each took."""

    chapters: Mapping[str, Result]
    seconds: Mapping[str, float]
    small: bool

    def __repr__(self) -> str:
        return f"<Reproduction of {', '.join(self.chapters)}>"


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
    for name in chapters:
        if name not in CHAPTERS:
            near = difflib.get_close_matches(name, CHAPTERS, n=1, cutoff=0.4)
            hint = f"did you mean '{near[0]}'? " if near else ""
            raise InputError(f"unknown chapter '{name}'; {hint}there are {', '.join(CHAPTERS)}")
    results, seconds = {}, {}
    for name, run in CHAPTERS.items():
        if chapters and name not in chapters:
            continue
        start = time.monotonic()
        results[name] = run(
            catalogue, small, np.random.default_rng([seed, zlib.crc32(name.encode())]), progress
        )
        seconds[name] = time.monotonic() - start
    return Reproduction(results, seconds, small)
