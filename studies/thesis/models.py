"""Chapter "models": every friction of the catalogue fitted to the data of every other.

The thesis compares its frictions by plus and minus (Table 2.1); here each behaviour is measured. A
machine with each friction runs a velocity map, pre-sliding loops with inner loops, forces that rise
and fall at several rates through the break-away, a speed that swings without a reversal (frictional
lag), and a small oscillating force beside a steady one (drift). Every friction is fitted to those
logs together. The loops of its figures 2.6 and 2.7 are drawn from the laws.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from time import process_time
from typing import NamedTuple

import numpy as np

from identify.dataset.dataset import Dataset
from identify.dataset.noise_floor import floor_of
from identify.dataset.preparation import datasets
from identify.estimation.errors import error_on
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit, fit_axis
from identify.estimation.force_along import force_along
from identify.output.blocks import Block
from identify.output.numbers import spaced
from studies.drawing import BLUE
from studies.telling import Line, Panel, picture, table
from studies.thesis import shared
from studies.thesis.behaviours import LEG, LOOP, RATE, behaviours, characteristics, turning
from studies.thesis.shared import Array, Found, Numbers, friction_of
from twin.effect import Effect, Kind
from twin.model.machine import AxisModel, Fitted, MachineModel

TITLE = "The friction models compared"
STARTS = 8  # random ones of each law
FORCE_NOISE, READING_NOISE = 1e-3, 1e-9  # N, m
TEST_FUNCTION = 0.02  # s: pre-sliding is fast
NESTED = 1e-3 * np.array([0.0, 1.0, -1.0, 0.6, -0.4, 0.2, 0.0, 0.2, 0.6, 1.0])  # m, two inside
RANDOM = 3.0  # factor to either side of a start value, between which random starts are drawn
RIGHT = 1.2  # of the noise floor, up to which a fit ended right
STEPS = 100_000  # of a law, over which its cost is measured
CREEPS = 1e-5  # m/s, from which an axis is said to drift
OPEN = 1e-3  # N, from which a loop is said to stay open
ACROSS = 4  # pictures side by side


def run(small: bool, rng: np.random.Generator) -> Found:
    """Plant each friction in a machine, and fit every other to its logs."""
    model, name, axis = shared.machine("simulation")
    effects, starts = (shared.frictions()[:2], 1) if small else (shared.frictions(), STARTS)
    known = friction_of(axis).values
    machines = {e.name: replace(axis, effects=(like(e, known),)) for e in effects}
    numbers: Numbers = {"laws": list(machines), "error_over_noise_floor": {}, "by_law": {}}
    numbers["traits"], spent = {}, []
    loops: dict[str, tuple[Loop, Loop]] = {}
    for effect, (law, machine) in zip(effects, machines.items(), strict=True):
        stage = noisy(model, name, machine)
        logs = behaviours(stage, rng)
        numbers["traits"][law] = characteristics(stage, logs, rng)
        dataset = datasets(stage, logs, {}, TEST_FUNCTION)[name]
        fits = {e.name: timed(shared.begun(machine, dataset, e), dataset) for e in effects}
        spent.append([took for _, took in fits.values()])
        numbers["error_over_noise_floor"][law] = {
            fitted: by_log(fit, tuple(logs)) for fitted, (fit, _) in fits.items()
        }
        loops[law] = loop(machine, LOOP), loop(machine, NESTED)
        right = share_right(shared.begun(machine, dataset, effect), dataset, starts, rng)
        numbers["by_law"][law] = {
            "right_starts": right, "starts": starts, "step_time": cost(machine), "time_unit": "s",
            "loop_open_by": loops[law][0].gap, "nested_loops_open_by": loops[law][1].gap,
            "unit": "N", "printed": None,
        }  # fmt: skip
    for own, took in zip(numbers["by_law"].values(), np.mean(spent, axis=0), strict=True):
        own["fit_time"] = took
    numbers["behaviours"] = list(logs)
    return Found(numbers, words(numbers), pictures(numbers, loops))


def like(effect: Effect, known: Mapping[str, float]) -> Fitted:
    """The effect with the values that are known of another friction, by the parameters' names.

    What is fixed is a shape of the law, whose name may mean another thing there.
    """
    free = [p.name for p in effect.parameters if not p.fixed]
    return Fitted.at_start(effect, {name: known[name] for name in free if name in known})


def noisy(model: MachineModel, name: str, axis: AxisModel) -> MachineModel:
    """A machine of that axis alone, with the chapter's noise."""
    axis = shared.with_hardware(
        axis, encoder_noise=READING_NOISE, force_constant=1.0, current_noise=FORCE_NOISE
    )
    return MachineModel(model.name, {name: axis}, RATE)


def timed(axis: AxisModel, dataset: Dataset) -> tuple[Fit, float]:
    """A fit, and its CPU time, s."""
    start = process_time()
    fit = fit_axis(axis, dataset.training)
    return fit, process_time() - start


def by_log(fit: Fit, names: Sequence[str]) -> dict[str, float]:
    """Error over noise floor on each log; not a number for one in which the axis stands still."""
    found = {
        log.motion.name: rms(error_on(fit.axis, [log])) / floor_of(fit.axis, [log])
        for log in fit.logs
    }
    return {name: found.get(name, float("nan")) for name in names}


def overall(by_log: Mapping[str, float]) -> float:
    """RMS of the ratios over the behaviours in which the machine moves."""
    return float(np.sqrt(np.nanmean(np.square(list(by_log.values())))))


def share_right(begun: AxisModel, dataset: Dataset, starts: int, rng: np.random.Generator) -> float:
    """Share of random starts from which the law's own data are fitted to the noise floor."""
    ended, names = [], [log.motion.name for log in dataset.training]
    for _ in range(starts):
        start = replace(begun, effects=(drawn(begun.effects[0], rng),))
        ended.append(overall(by_log(fit_axis(start, dataset.training), names)) <= RIGHT)
    return float(np.mean(ended))


def drawn(fitted: Fitted, rng: np.random.Generator) -> Fitted:
    """An effect with each free value up to three times too small or too large."""
    values = dict(fitted.values)
    for p in fitted.effect.parameters:
        if p.name not in fitted.fixed and p.lower < p.upper:
            value = values[p.name] * RANDOM ** rng.uniform(-1.0, 1.0)
            least = values[p.at_least] if p.at_least else p.lower
            values[p.name] = float(np.clip(value, least, p.upper))
    return replace(fitted, values=values)


def cost(axis: AxisModel) -> float:
    """CPU time of a step of the axis' friction, s."""
    velocity = 0.01 * np.sin(2.0 * np.pi * np.arange(STEPS) / RATE)
    position = np.cumsum(velocity) / RATE
    start = process_time()
    force_along(axis, position, velocity, 1.0 / RATE, Kind.FRICTION)
    return (process_time() - start) / STEPS


class Loop(NamedTuple):
    """Friction (n,) N along positions (n,) m, and by how much a loop inside stays open, N."""

    position: Array
    friction: Array
    gap: float


def loop(axis: AxisModel, turns: Array) -> Loop:
    """Friction along positions from turn to turn.

    The gap is that between the two passes of the last turn that is visited again.
    """
    position = turning(turns)
    velocity = np.diff(position, append=position[-1]) * RATE
    friction = -force_along(axis, position, velocity, 1.0 / RATE, Kind.FRICTION)
    at = {k: k * round(LEG * RATE) - 1 for k in range(1, len(turns))}
    last = {float(turns[k]): end for k, end in at.items()}
    passes = [
        (at[k], last[float(turn)])
        for k, turn in enumerate(turns[:-1])
        if k and abs(turn) < np.max(turns)
    ]
    return Loop(position, friction, max(abs(float(friction[a] - friction[b])) for a, b in passes))


def words(n: Numbers) -> list[str]:
    """What fits what, which loops stay open, how sure and how dear each fit is."""
    ratios = _overall(n)
    laws, own = [spaced(law) for law in n["laws"]], np.diag(ratios)
    within = [
        f"{laws[i]} is contained in {laws[j]}"
        for i, j in np.argwhere((ratios <= RIGHT) & ~np.eye(len(laws), dtype=bool))
    ]
    others = np.where(ratios <= RIGHT, np.inf, ratios)
    i, j = np.unravel_index(int(np.argmin(others)), others.shape)
    gaps, right, took, step = (
        np.array([own[key] for own in n["by_law"].values()])
        for key in ("loop_open_by", "right_starts", "fit_time", "step_time")
    )
    creep = np.abs([traits["drift"] for traits in n["traits"].values()])
    forget, fails, moving = (
        [law for law, chosen in zip(laws, which, strict=True) if chosen]
        for which in (gaps > OPEN, right < 1.0, creep > CREEPS)
    )
    return [
        f"each friction fits its own data to {own.max():.2g} times the noise floor or better; the "
        f"nearest other is {laws[j]} for a machine with {laws[i]}, at {others[i, j]:.2g} times"
        + (f"; {' and '.join(within)}, which fits as well" if within else ""),
        f"an inner loop stays open with {', '.join(forget) or 'none'}, so these forget; it closes "
        "with the others",
        f"under a small oscillation below the break-away {' and '.join(moving) or 'none'} "
        f"drift{'s' if len(moving) < 2 else ''}, by up to {creep.max():.2g} m/s; the others by "
        f"{creep[creep <= CREEPS].max(initial=0.0):.2g} m/s at most",
        f"of random starts up to three times off {100.0 * right.mean():.0f} % end within "
        f"{RIGHT:g} times the noise floor"
        + (f"; not all do with {', '.join(fails)}" if fails else ""),
        f"a fit takes {took.min():.2g} to {took.max():.2g} s of CPU time, a step of a law "
        f"{1e9 * step.min():.0f} to {1e9 * step.max():.0f} ns",
    ]


def _overall(n: Numbers) -> Array:
    """Ratios (laws, laws) over all behaviours, by machine and fitted law."""
    rows = n["error_over_noise_floor"].values()
    return np.array([[overall(ratios) for ratios in row.values()] for row in rows])


def pictures(n: Numbers, loops: Mapping[str, tuple[Loop, Loop]]) -> list[Block]:
    """Every law on every machine, and the loops of each."""
    rows = {
        f"machine with {machine}": dict(zip(n["laws"], row, strict=True))
        for machine, row in zip(n["laws"], _overall(n), strict=True)
    }
    grids = [
        [
            Panel(Line(1e3 * one.position, 1e3 * one.friction, color=BLUE), title=spaced(law),
                  xlabel="Position (mm)", ylabel="Friction (mN)")
            for law, one in zip(loops, ones, strict=True)
        ]
        for ones in zip(*loops.values(), strict=True)
    ]  # fmt: skip
    return [
        table(rows, "Error over noise floor of each friction (across) fitted to the logs of each "
              "machine, RMS over the behaviours."),
        picture("Friction along a pre-sliding loop with one loop inside it, from the laws (the "
                "thesis's Figure 2.6). A loop that stays open is memory lost at the reversal.",
                *grids[0], across=ACROSS),
        picture("Two loops inside each other (its Figure 2.7): a law with nonlocal memory comes "
                "back to each branch that it left.", *grids[1], across=ACROSS),
    ]  # fmt: skip
