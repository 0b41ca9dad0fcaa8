"""Chapter "track": friction at nine places between the rollers, each direction apart.

Moves of 10 mm at the thesis's speeds, recorded at 1 kHz, are read in two ways. The thesis's: a map
of the last half of each move, and a curve through it. Ours: the whole law fitted to the logs of the
place, so that bristles which have not settled after 5 mm cost nothing. The cable's force is taken
off with the model, which knows it from passes (chapter "cable"). What is planted at a place is the
friction that the machine's laws reach when they go on at that place. The machine is stepped ten
times finer than the logs' samples of 1 ms: stepped as coarsely as those, its friction follows the
speed late, and the ramps of short moves make that 1e-4 N of Coulomb friction.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, replace
from functools import partial

import numpy as np

from identify.dataset.motion import motion_of
from identify.dataset.preparation import datasets
from identify.estimation.fit import Fit, fit_axis
from identify.estimation.force_along import steady_friction
from identify.estimation.intervals import with_band
from studies.curves.friction_curve import NAMES, fit_stribeck, stribeck_through
from studies.curves.velocity_map import VelocityMap
from studies.drawing import BLUE, GREY, ORANGE, Picture
from studies.telling import Line, Panel, picture
from studies.thesis import shared
from studies.thesis.shared import SIDES, Array, Found, Numbers
from twin.effect import Kind
from twin.experiments.kinds import Staircase
from twin.logs import Log
from twin.model.machine import AxisModel, Fitted, MachineModel

TITLE = "Velocity maps along the track"
SPAN = 0.01  # m
SPEEDS = (
    *(k / 1e4 for k in range(1, 10)), *(k / 1e3 for k in range(1, 15)),
    *(k / 1e3 for k in range(15, 250, 10)),
)  # m/s; those that a move does not hold are left out  # fmt: skip
FEW = (0.002, 0.004, 0.006, 0.01, 0.02, 0.06)
BRISK, REPEATS = 0.004, 6  # m/s, above which moves are so short that they are repeated
FASTEST = 0.3  # of the velocity limit, which a move of 10 mm reaches and holds
TREND = 3.0  # standard errors of a slope, from which there is a trend
SIDEWAYS = 1.5  # mm, between the marks of the two ways, which would hide each other


def run(small: bool, rng: np.random.Generator) -> Found:
    """Measure the friction of a machine at each place, in both ways."""
    model, name, axis = shared.machine("track")
    where = shared.places(2 if small else shared.PLACES)
    # way -> direction -> at each place: values (4,), half widths (4,), planted (4,)
    rows: dict[str, dict[str, list[Array]]] = {
        way: {side: [] for side in SIDES.values()} for way in ("map", "fit")
    }
    for place in map(float, where):
        logs = moves(model, name, place, small, rng)
        # Simulated readings have no ripple that would have to be sought.
        motions = [motion_of(log, name, label, ripples=()) for label, log in logs.items()]
        found = VelocityMap.joined([VelocityMap.of(axis, motion) for motion in motions])
        speeds = np.array(sorted({round(float(abs(v)), 6) for v in found.velocity}))
        fit = local_fit(model, name, logs, found)
        for way, side in SIDES.items():
            true = curve_at(axis, place, way * speeds)
            rows["map"][side].append(np.array([*through(found.towards(way)), true]))
            law = partial(curve_at, place=place, velocity=way * speeds)
            rows["fit"][side].append(np.array([*with_band(fit, law, fit.scaling.where), true]))
    units = {p.name: p.unit for f in axis.effects for p in f.effect.parameters}
    numbers = {"position": where, "position_unit": "m"} | {
        way: {side: _along(np.array(found), units) for side, found in by_side.items()}
        for way, by_side in rows.items()
    }
    return Found(numbers, words(numbers), pictures(numbers))


def _along(found: Array, units: Mapping[str, str]) -> dict[str, Numbers]:
    """Each parameter in one direction, of (places, 3, parameters): found, half width, planted."""
    numbers = {}
    for name, (values, half, true) in zip(NAMES, found.transpose(2, 1, 0), strict=True):
        numbers[name] = {
            "true": true, "found": values, "half_width_90": half, "unit": units[name],
            "within": np.mean(np.abs(values - true) <= half), "printed": None,
            "largest_error": np.abs(values / true - 1.0).max(),
        }  # fmt: skip
    return numbers


def moves(
    model: MachineModel, name: str, place: float, small: bool, rng: np.random.Generator
) -> dict[str, Log]:
    """A log of moves at each speed, to and fro."""
    fastest, repeats = FASTEST * model.axes[name].hardware.velocity, 2 if small else REPEATS
    logs = {}
    for speed in (s for s in (FEW if small else SPEEDS) if s <= fastest):
        speeds = (speed,) * (repeats if speed > BRISK else 1)
        stairs = Staircase(name, speeds=speeds, span=SPAN, longest_plateau=1e4, at=(place,))
        logs[f"{speed:g} m/s"] = shared.recorded(model, stairs, rng)
    return logs


def through(one_way: VelocityMap) -> tuple[list[float], list[float]]:
    """The curve through a map: parameters (4,), half widths (4,) of their 90 % intervals."""
    found = stribeck_through(np.abs(one_way.velocity), one_way.friction, one_way.samples)
    return [found.values[n] for n in NAMES], [found.half[n] for n in NAMES]


def curve_at(axis: AxisModel, place: float, velocity: Array) -> Array:
    """Parameters (4,) of the curve through the friction that an axis reaches at one place."""
    friction = np.array([steady_friction(axis, place, float(v)) for v in velocity])
    return np.array(astuple(fit_stribeck(np.abs(velocity), friction))[: len(NAMES)])


def local_fit(model: MachineModel, name: str, logs: Mapping[str, Log], found: VelocityMap) -> Fit:
    """Friction and its modifiers fitted to the logs of one place, from the curve through its map.

    Of what varies along the track the first term alone is free: over one place it is a slope.
    """
    axis, dataset = model.axes[name], datasets(model, logs, {})[name]
    start = stribeck_through(np.abs(found.velocity), found.friction, found.samples).values
    effects = []
    for f in axis.effects:
        if f.effect.kind is Kind.FRICTION:
            known = {p.name: start[p.name] for p in f.effect.parameters if p.name in start}
            first = Fitted.at_start(f.effect, {**f.effect.starts(), **known})
            effects.append(replace(first, fixed=f.fixed))
        elif f.effect.kind is Kind.MODIFIER:
            first = Fitted.at_start(f.effect, f.effect.starts(dataset.excitation))
            rest = {p.name for p in f.effect.strengths[1:]} if f.effect.reads("X") else set()
            effects.append(replace(first, fixed=first.fixed | rest))
        elif not any(p.period for p in f.effect.parameters):
            effects.append(replace(f, fixed=frozenset(f.values)))
    return fit_axis(replace(axis, effects=tuple(effects), mass_fixed=True), dataset.training)


def words(n: Numbers) -> list[str]:
    """How far the levels found are from those planted, by the thesis's way and by ours."""
    said = []
    for way, which in (("map", "the curve through the map"), ("fit", "the fit")):
        for name in ("Fc", "Fs"):
            off = max(found[name]["largest_error"] for found in n[way].values())
            held = np.mean([found[name]["within"] for found in n[way].values()])
            said.append(
                f"by {which} {name} is within {100.0 * off:.2g} % of the planted level at "
                f"{len(n['position'])} places; {100.0 * held:.0f} % of the 90 % intervals hold it"
            )
    for name in ("v0", "sigma2"):
        seen = any(has_trend(n["position"], found[name]["found"]) for found in n["fit"].values())
        said.append(f"along the track {name} shows {'a' if seen else 'no'} trend")
    # After 5 mm the bristles have not settled, so the map reads friction too low.
    return [*said, "the map's own intervals hold its scatter, not that bristles which have not "
            "settled brake less"]  # fmt: skip


def has_trend(where: Array, found: Sequence[float]) -> bool:
    """Whether a parameter changes along the track by more than its scatter."""
    if len(where) < 4:
        return False
    (slope, _), spread = np.polyfit(where, found, 1, cov=True)
    return bool(abs(slope) > TREND * np.sqrt(spread[0, 0]))


def pictures(n: Numbers) -> list[Picture]:
    """The parameters along the track, one picture a direction."""
    place, shown = 1e3 * n["position"], []
    for side in SIDES.values():
        panels = []
        for name in NAMES:
            a, b = n["map"][side][name], n["fit"][side][name]
            panels.append(Panel(
                Line(place, a["true"], "planted", GREY, width=3.0),
                Line(place - SIDEWAYS / 2.0, a["found"], "map", ORANGE, "x", a["half_width_90"]),
                Line(place + SIDEWAYS / 2.0, b["found"], "fit", BLUE, "o", b["half_width_90"]),
                xlabel="Position (mm)", ylabel=f"{name} ({a['unit']})",
            ))  # fmt: skip
        shown.append(picture(
            f"Moving {side}. Crosses: the curve through the map of the last half of each move, as "
            "in the thesis; dots: the whole law fitted to the same logs. Bars: 90 % intervals.",
            *panels, across=2,
        ))  # fmt: skip
    return shown
