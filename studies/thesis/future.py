"""Chapter "future": what the thesis leaves to future work, as far as the twin can tell.

The number of elements of a friction with memory is chosen by the data. Nonparametric forces beside
LuGre are judged against physics on a log on which nothing was decided. Friction near zero speed is
read from moves that end before the bristles settle, and from the whole law. A long run warms and
wears a machine; it is cut into logs, on each of which the friction alone is fitted, as on a machine
that is checked from time to time, and is fitted as one log with what made the drift. Mixtures
(studies.thesis.mixed_friction) are fitted to the machine with elements, and to one that is a
mixture.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identify.dataset.dataset import Dataset
from identify.dataset.motion import motion_of
from identify.dataset.preparation import datasets
from identify.estimation.errors import error_on
from identify.estimation.evidence import evidence, rms
from identify.estimation.fit import Fit, fit_axis
from identify.estimation.force_along import steady_friction
from identify.estimation.intervals import half_widths
from identify.output.numbers import spaced
from identify.selection.nonparametric import fit_nonparametric
from studies.curves.velocity_map import VelocityMap
from studies.drawing import BLUE, GREY, ORANGE, Picture
from studies.telling import Line, Panel, picture
from studies.thesis import shared
from studies.thesis.mixed_friction import EQUAL, mixed, mixture, mixture_in_words
from studies.thesis.shared import CATALOGUE, Array, Found, Numbers, friction_of
from twin.effect import DRY, DT, ELEMENTS, IO_SIZE, Kind
from twin.experiments.kinds import Staircase
from twin.logs import AxisLog, Log
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.model.parameters import free_parameters

TITLE = "Future work"
RATE = 1000.0  # Hz
ELEMENT_COST = 1  # parameters that an element counts as
SLOW_SPAN = 0.01  # m, of the moves near zero speed
SURE = 3.0  # standard errors of a slope, from which there is a drift
PART = 10.0  # s, of each log of a long run
THINNED = 100  # samples, over which a state hardly changes
AT_ONCE = 1e-12  # s, of a step in which no state moves


def run(small: bool, rng: np.random.Generator) -> Found:
    """On the machine with elements; the first friction is that of the stage."""
    duration, counts = (6.0, (1, 4)) if small else (20.0, tuple(range(1, 9)))
    memory, name, axis = shared.machine("memory")
    memory = replace(memory, sample_rate=RATE)
    _, _, stage = shared.machine("proton_xy")
    first, own = friction_of(stage), friction_of(axis)
    dataset, test = shared.four_logs(memory, duration, rng, memory)
    fits = with_elements(axis, dataset, counts)
    tried = compared(fits, test)
    chosen = max(tried, key=lambda e: e["delta_bic"])["elements"]
    physics, base = fits[chosen], fit_axis(axis.with_effect(first), dataset.training)
    beside = {first.effect.name: base}
    for effect in (e for e in CATALOGUE.values() if e.is_nonparametric):
        beside[effect.name] = fit_nonparametric(base, dataset, effect).fit
    more = {name: len(fit.scaling.where) - len(base.scaling.where) for name, fit in beside.items()}
    slow, aged = near_zero(small, rng), aging(60.0 if small else 600.0, rng)
    made = axis.with_effect(mixed(own.values, first.values, EQUAL))
    logs = shared.four_logs(memory.with_axis(name, made), duration, rng, memory)
    numbers = {
        "elements": {"planted": int(own.values[ELEMENTS]), "found": chosen, "tried": tried},
        "residuals": [
            {"model": name, "parameters_added": more.get(name, 0),
             "holdout_error": rms(error_on(fit.axis, dataset.selection)),
             "test_error": rms(error_on(fit.axis, test.training))}
            for name, fit in {**beside, own.effect.name: physics}.items()
        ],
        "noise_floor": physics.floor, "unit": "N", "near_zero_speed": slow, "long_run": aged,
        "mixtures": [
            mixture(axis, dataset, test, fits),
            mixture(made, *logs, with_elements(axis, logs[0], counts)),
        ],
    }  # fmt: skip
    return Found(numbers, words(numbers), pictures(aged))


def with_elements(axis: AxisModel, dataset: Dataset, counts: Sequence[int]) -> dict[int, Fit]:
    """A fit with each number of elements."""
    effect, fits = friction_of(axis).effect, {}
    for count in counts:
        start = {**effect.starts(dataset.excitation), ELEMENTS: float(count)}
        known = {p.name for p in effect.of_size(count).parameters} if effect.of_size else set()
        own = {k: v for k, v in start.items() if k in known}
        fits[count] = fit_axis(axis.with_effect(Fitted.at_start(effect, own)), dataset.training)
    return fits


def compared(fits: Mapping[int, Fit], test: Dataset) -> list[Numbers]:
    """Each number of elements: evidence over the first that was tried, test error."""
    least, first = next(iter(fits.items()))
    return [
        {
            "elements": count,
            "delta_bic": evidence(
                first.residual, fit.residual, ELEMENT_COST * (count - least)
            ).delta_bic,
            "error_over_noise_floor": shared.over_floor(fit, test),
        }
        for count, fit in fits.items()
    ]


def near_zero(small: bool, rng: np.random.Generator) -> Numbers:
    """Friction at speeds near zero: planted, by the map, and by the whole law fitted."""
    model, name, axis = shared.machine("simulation")
    model = replace(model, sample_rate=RATE)
    speeds, longest = ((3e-4, 1e-3), 5.0) if small else ((1e-5, 3e-5, 1e-4, 3e-4, 1e-3), 60.0)
    mapped, logs = [], {}
    for speed in speeds:
        moves = Staircase(name, speeds=(speed,), span=SLOW_SPAN, longest_plateau=longest)
        label = f"{speed:g} m/s"
        logs[label] = shared.recorded(model, moves, rng)
        motion = motion_of(logs[label], name, label, ripples=())  # a simulated reading has none
        mapped.append(float(VelocityMap.of(axis, motion).towards(1.0).friction.mean()))
    dataset = datasets(model, logs, {})[name]
    fit = fit_axis(shared.begun(axis, dataset, friction_of(axis).effect), dataset.training)
    planted, fitted = (
        np.array([steady_friction(a, 0.0, v) for v in speeds]) for a in (axis, fit.axis)
    )
    return {"velocity": speeds, "velocity_unit": "m/s", "true": planted, "map": mapped,
            "found": fitted, "printed": None}  # fmt: skip


def aging(duration: float, rng: np.random.Generator) -> Numbers:
    """Run a machine for ``duration`` s, also without what ages; identify it again and again.

    On the whole run its effects are fitted, those that age from their start values.
    """
    model, name, axis = shared.machine("aging")
    young = replace(axis, effects=tuple(f for f in axis.effects if not ages(f)))
    machines = [MachineModel(model.name, {name: one}, model.sample_rate) for one in (axis, young)]
    logs = [shared.recorded(machine, "tracking", rng, duration) for machine in machines]
    level, steady = (drift(m, young, log) for m, log in zip(machines, logs, strict=True))
    whole_run, aged = datasets(machines[0], {"run": logs[0]}, {})[name], axis
    for f in filter(ages, axis.effects):
        aged = shared.begun(aged, whole_run, f.effect)
    whole = fit_axis(aged, whole_run.training)
    where = (f"{c.effect}.{c.parameter.name}" for c in whole.scaling.where)
    half = dict(zip(where, half_widths(whole).tolist(), strict=True))
    parameters = {}
    for f in filter(ages, axis.effects):
        for p, true in f.values.items():
            label, found = f"{f.effect.name}.{p}", whole.axis[f.effect.name].values[p]
            parameters[label] = shared.recovered(true, [found], f.effect.parameter(p).unit)
            parameters[label]["half_width_90"] = half.get(label)
    return {"aging": level, "without": steady, "parameters": parameters}


def ages(fitted: Fitted) -> bool:
    """Whether it changes the friction by what happened before."""
    return fitted.effect.kind is Kind.MODIFIER and bool(fitted.effect.states)


def drift(machine: MachineModel, young: AxisModel, log: Log) -> Numbers:
    """The first dry level of the friction in each part of the run, by the distance travelled.

    true: the mean of the machine's own value over each part. slope: with its standard error, over
    the second half of the run, where the machine is warm; detected: whether it is more than its
    scatter explains.
    """
    ((name, axis),) = machine.axes.items()
    level = next(p for p in friction_of(young).effect.parameters if p.dry)
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(log.truth[name]["position"])))])
    size, rows = round(PART * log.sample_rate), []
    for at in range(0, len(log) - size + 1, size):
        part = slice(at, at + size)
        columns = {k: log.axes[name].columns[k][part] for k in ("position", "force")}
        cut = Log(log.sample_rate, {name: AxisLog(columns)})
        fit = fit_axis(young, datasets(machine, {"part": cut}, {})[name].training)
        index = [c.parameter.name for c in free_parameters(fit.axis)].index(level.name)
        truth = {k: v[part] for k, v in log.truth[name].items()}
        rows.append((
            travelled[part].mean(), friction_of(fit.axis).values[level.name],
            half_widths(fit)[index], true_level(axis, truth, level.name),
        ))  # fmt: skip
    distance, found, half, true = np.array(rows).T
    late = slice(len(distance) // 2, None)
    (slope, _), spread = np.polyfit(distance[late], found[late], 1, w=1.0 / half[late], cov=True)
    error = float(np.sqrt(spread[0, 0]))
    return {
        "distance": distance, "distance_unit": "m", "true": true, "found": found,
        "half_width_90": half, "unit": level.unit, "slope": float(slope),
        "slope_standard_error": error, "slope_unit": f"{level.unit}/m",
        "detected": abs(slope) > SURE * error, "printed": None,
    }  # fmt: skip


def true_level(axis: AxisModel, truth: Mapping[str, Array], level: str) -> float:
    """Mean of the level that the machine's friction had at the states that were logged."""
    factor = np.ones(len(truth["position"]))
    for f in filter(ages, axis.effects):
        states = np.stack([truth[f"{f.effect.name}_{state}"] for state in f.effect.states], axis=1)
        values = np.array(f.vector())
        for k in range(0, len(states), THINNED):
            io = np.zeros(IO_SIZE)
            io[DRY], io[DT] = 1.0, AT_ONCE
            f.effect.law(values, states[k].copy(), io)
            factor[k : k + THINNED] *= io[DRY]
    return float(np.mean(friction_of(axis).values[level] * factor))


def words(n: Numbers) -> list[str]:
    """The number of elements, data-driven residuals against physics, slow moves, the long run."""
    elements, slow, run = n["elements"], n["near_zero_speed"], n["long_run"]
    best = next(e for e in elements["tried"] if e["elements"] == elements["found"])
    first, *added, physics = n["residuals"]
    beside = ", ".join(f"with {spaced(b['model'])} {b['test_error']:.3g} N" for b in added)
    off = [100.0 * np.abs(slow[way] / slow["true"] - 1.0).max() for way in ("map", "found")]
    return [
        f"the data choose {best['elements']} elements, the machine has {elements['planted']}; the "
        f"test error is {best['error_over_noise_floor']:.2f} times the noise floor",
        f"on the test log {first['model']} leaves {first['test_error']:.3g} N, {beside}, "
        f"{spaced(physics['model'])} {physics['test_error']:.3g} N (noise floor "
        f"{n['noise_floor']:.3g} N)",
        f"near zero speed ({min(slow['velocity']):g} to {max(slow['velocity']):g} m/s) the map is "
        f"up to {off[0]:.2g} % off the steady friction, the whole law fitted to the same moves "
        f"{off[1]:.2g} %",
        f"over {run['aging']['distance'].max():.3g} m the dry friction of the machine that ages "
        f"{drift_in_words(run['aging'])}; without aging it {drift_in_words(run['without'])}",
        *map(mixture_in_words, n["mixtures"]),
    ]


def drift_in_words(found: Numbers) -> str:
    """Whether there is one, and its slope."""
    verb = "drifts" if found["detected"] else "does not drift"
    slope, error = found["slope"], found["slope_standard_error"]
    return f"{verb} in its second half: {slope:.2g} +- {error:.1g} N/m (standard error)"


def pictures(aged: Numbers) -> list[Picture]:
    """The level of the friction over a long run."""
    lines = []
    for key, label, color in (("aging", "warms and wears", BLUE), ("without", "does not", ORANGE)):
        run = aged[key]
        lines += [
            Line(run["distance"], 1e3 * run["true"], "", GREY, width=3.0),
            Line(
                run["distance"], 1e3 * run["found"], label, color, "o", 1e3 * run["half_width_90"]
            ),
        ]
    shown = np.concatenate([line.y for line in lines])
    margin = 0.1 * np.ptp(shown)
    return [
        picture("Dry friction found in each part of a long run, with its 90 % interval, against "
                "the distance travelled; some are longer than the picture. Line: the mean of the "
                "machine's own value over that part. First it warms, then it wears; orange: the "
                "same machine without both.",
                Panel(*lines, ylim=(shown.min() - margin, shown.max() + margin),
                      xlabel="Distance travelled (m)", ylabel="Dry friction (mN)"), height=3.6)
    ]  # fmt: skip
