"""What a residual varies with: the coordinate that accounts for most of it, and what repeats.

What varies may be a value of the model, such as the inertia of a winder or the gain of a motor that
warms: then the residual is the acceleration, or the motor's force, times a curve over a coordinate.

A term of one turn of a screw or a ball is real in each log; where its phase differs between logs no
function of position holds for both, and a model with it would not generalise. That is said.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from identify.dataset.coordinates import OTHER, QUANTITIES, beside, gathered
from identify.dataset.dataset import Dataset
from identify.dataset.motion import Motion
from identify.dataset.prepared_log import PreparedLog, on_blocks, total_force
from identify.dataset.spectrum import ScatteredSignal, SpectralLine, find_lines
from identify.dataset.test_function import OVERLAP
from identify.estimation.evidence import effective_samples
from identify.estimation.fit import Fit
from identify.rules import RULE
from twin.effect import CHANNELS
from twin.logs import LINEAR_UNITS
from twin.model.units import LINEAR
from twin.record import Number, record
from twin.signals import Array

BINS = (24, 96, 384)  # numbers of bins along a coordinate
SAME_PERIOD = 0.02  # relative difference, or of a turn, within which two are one


class Varying(Enum):
    """What of a model varies with a coordinate: then the error is in proportion to its force."""

    INERTIA = "inertia"
    GAIN = "gain"  # of the motor, as its magnets warm or its voltage is at an end


@record
class Dependence:
    """On what coordinate an error depends."""

    share_of_error: Number
    """0..1 of the squared force error above the floor, that it accounts for."""
    depends_on: str
    period: Number | None
    unit: str
    """Of the coordinate."""
    shares: Mapping[str, Number]
    """The same part of every coordinate."""
    varies: Varying | None = None
    """What varies with the coordinate, where the error is more clearly in proportion to that."""


# Of a linear axis; ``unit_of`` gives those of any.
UNITS = {
    "position": "m",
    "velocity": "m/s",
    "direction": "1",
    "acceleration": "m/s^2",
    "time": "s",
    "distance_since_reversal": "m",
    "other_axis_position": "m",
    "other_axis_velocity": "m/s",
    "other_axis_acceleration": "m/s^2",
}
OF_CHANNELS = {field: LINEAR_UNITS[field] for field in CHANNELS.values()}


def unit_of(coordinate: str, motion: Motion, linear: Mapping[str, str] = UNITS) -> str:
    """Unit of a coordinate along a motion; linear: declared units, a length where not among them.

    On a machine with more than two axes the others have names and units of their own.
    """
    for axis, other in motion.beside.items():
        for quantity in QUANTITIES:
            if coordinate == beside(axis, quantity):
                return other.units(UNITS[quantity])
    units = motion.other_units if coordinate.startswith(OTHER) else motion.units
    known = {**OF_CHANNELS, **linear}
    return units(known.get(coordinate, LINEAR.position))


def share(residual: Array, coordinate: Array) -> float:
    """Part of the residual's square that its means over bins of the coordinate explain, 0..1.

    The finest of several widths is taken that the data carry, each adjusted for what as many bins
    explain of noise with the same effective sample size.
    """
    widths = [bins for bins in BINS if bins == BINS[0] or len(residual) > 5 * bins]
    return max(_share(residual, coordinate, np.ones(len(residual)), bins) for bins in widths)


def _foremost(shares: Mapping[str, float]) -> str:
    """The coordinate with the largest share; time only where no other comes near it.

    Within one run of a program of moves, any coordinate is a function of time.
    """
    name = max(shares, key=lambda k: shares[k])
    rest = {k: s for k, s in shares.items() if k != "time"}
    other = max(rest, key=lambda k: rest[k])
    return other if name == "time" and rest[other] > RULE.rather * shares[name] else name


def _share(residual: Array, coordinate: Array, along: Array, bins: int) -> float:
    """The same of so many bins, in each of which it is in proportion to a force along (n,)."""
    levels = np.unique(np.quantile(coordinate, np.linspace(0.0, 1.0, bins + 1)))
    if len(levels) < 2:
        return 0.0
    index = np.clip(np.searchsorted(levels, coordinate, side="right") - 1, 0, len(levels) - 2)
    square = np.bincount(index, along**2, len(levels) - 1)
    slope = np.bincount(index, along * residual, len(levels) - 1) / np.where(square, square, 1.0)
    mean = slope[index] * along
    explained = float(np.sum(mean * residual) / np.sum(residual**2))
    n = effective_samples(residual - mean)
    k = len(square)
    return max(1.0 - (1.0 - explained) * n / max(n - k, 1.0), 0.0) if n > k else 0.0


def find_dependence(base: Fit, dataset: Dataset) -> Dependence:
    """The coordinate on which the residual of a fit depends most, and its period if it has one."""
    where, begins = _where(base, dataset)
    taken, lines = _shares(base.residual, where, begins)
    shares = {name: float(share) for name, share in taken.items()}
    name, motion = _foremost(shares), dataset.training[0].motion
    found = Dependence(shares[name], name, lines.get(name), unit_of(name, motion), shares)
    for what, along in _forces(base, dataset, where).items():
        slowly = BINS[0]  # as a value of a model varies
        by = {
            c: _share(base.residual, where[c], along, slowly) for c in where if _may_vary(what, c)
        }
        name = _foremost(by)
        most = 0.6  # of the error: a half of it some product accounts for in one log
        if by[name] > max(found.share_of_error * _times_more(found), most):
            found = Dependence(by[name], name, None, unit_of(name, motion), shares, what)
    return found


def _times_more(found: Dependence) -> float:
    """How much more of an error a value that varies has to explain than what was found first.

    More than a force by itself does, but of time, of which any force of one run is a function.
    """
    if found.varies:
        return 1.0
    return RULE.rather if found.depends_on == "time" else 1.0 / RULE.rather


def _may_vary(what: Varying, coordinate: str) -> bool:
    """Whether a value may vary with a coordinate: an inertia by what was moved where and when."""
    of_motor = what is Varying.GAIN and coordinate in ("velocity", *OF_CHANNELS)
    return of_motor or coordinate.endswith(("position", "time"))


def _forces(base: Fit, dataset: Dataset, where: Mapping[str, Array]) -> dict[Varying, Array]:
    """To what the error of a value is in proportion, (n,) on the windows of a fit.

    Of the motor's force what the model knows: the noise of its reading is in the residual too.
    """
    command = np.concatenate([log.command for log in dataset.training])[base.kept]
    return {
        Varying.INERTIA: where["acceleration"],
        Varying.GAIN: command - base.residual,
    }


def dependences(force: Array, fit: Fit, dataset: Dataset) -> dict[str, float]:
    """Share of a force's square (n,) N, on the windows of a fit, by each coordinate: 0..1."""
    return _shares(force, *_where(fit, dataset))[0]


def _where(fit: Fit, dataset: Dataset) -> tuple[dict[str, Array], NDArray[np.int64]]:
    """Coordinates of the windows of a fit, and where those of each log but the first begin."""
    ends = np.cumsum([len(log) for log in dataset.training])
    kept = np.concatenate([[0], np.cumsum(fit.kept)])
    begins = np.unique(kept[ends])  # a log at rest throughout has none
    where = {k: v[fit.kept] for k, v in gathered(dataset.training).items()}
    return where, begins[(begins > 0) & (begins < kept[-1])]


def _shares(
    residual: Array, where: Mapping[str, Array], logs: NDArray[np.int64]
) -> tuple[dict[str, float], dict[str, float]]:
    """Share of each coordinate, and the periods of those in which the residual repeats.

    logs: where each but the first begins.
    """
    shares = {name: share(residual, values) for name, values in where.items()}
    for name in where.keys() - {"direction", "velocity"}:
        # Friction has the other sign backwards.
        backwards = share(residual * where["direction"], where[name])
        shares[name] = max(shares[name], backwards)
    periods = {}
    for name, runs in (("position", []), ("time", logs)):
        found = line(residual, where[name], runs)
        if found is not None:
            periods[name], strength = found
            shares[name] = max(shares[name], strength)
    return shares, periods


def line(
    residual: Array, coordinate: Array, runs: Sequence[int] | NDArray[np.int64] = ()
) -> tuple[float, float] | None:
    """Period (unit of the coordinate) and share of the strongest line, if one stands out.

    runs: where further runs begin, between which the line keeps its period but not its phase.
    """
    parts = zip(np.split(coordinate, runs), np.split(residual, runs), strict=True)
    best = _strongest([ScatteredSignal(*part) for part in parts])
    return (best.period, best.share) if best and best.share > RULE.line_share else None


def _strongest(records: Sequence[ScatteredSignal]) -> SpectralLine | None:
    """The strongest line that all the records share and that is no chance, if there is one."""
    span = max(r.span for r in records)
    if span == 0.0:
        return None
    lowest = RULE.fewest_cycles / span
    highest = max(len(r.values) for r in records) / (OVERLAP * span)
    found = find_lines(records, lowest, highest, chance=RULE.line_chance)
    return max(found, key=lambda line: line.share, default=None)


@record
class Repeat:
    """A force that repeats along the track in each log, with another phase in each."""

    period: Number
    amplitude: Mapping[str, Number]
    """By log."""
    phase: Mapping[str, Number]
    """By log, at one place."""
    unit: str = LINEAR.force
    period_unit: str = LINEAR.position
    phase_unit: str = "rad"
    same: ClassVar[float] = 0.5
    """Difference of two terms over the larger, below which they are one."""

    @property
    def general(self) -> bool:
        """Whether one sine of position holds for all logs."""
        terms = [a * np.exp(1j * self.phase[n]) for n, a in self.amplitude.items()]
        size = max(self.amplitude.values())
        return all(abs(t - terms[0]) < self.same * size for t in terms)


def not_general(fit: Fit, dataset: Dataset) -> Repeat | None:
    """The strongest force that repeats in position in every log with another phase, if any."""
    logs = (*dataset.training, *dataset.selection)
    if len(logs) < 2:
        return None
    records = [ScatteredSignal(log.motion.position, _left_on_blocks(fit, log)) for log in logs]
    lines = [_strongest([record]) for record in records]
    periods = [line.period for line in lines if line is not None]
    if len(periods) < len(logs) or np.ptp(periods) > SAME_PERIOD * periods[0]:
        return None
    common = _strongest(records)
    period = float(np.median(periods))
    if common is not None and abs(common.period - period) <= SAME_PERIOD * period:
        period = common.period
    # Far from the data a phase would hold the error of the period, times the periods between.
    middle = float(np.mean(np.concatenate([r.coordinate for r in records])))
    terms = {
        log.motion.name: _term(record.values, record.coordinate - middle, period)
        for record, log in zip(records, logs, strict=True)
    }
    found = Repeat(
        period,
        {n: float(abs(z)) for n, z in terms.items()},
        {n: float(np.angle(z)) for n, z in terms.items()},
        dataset.units.force,
        dataset.units.position,
    )
    return None if found.general else found


def _left_on_blocks(fit: Fit, log: PreparedLog) -> Array:
    """Force (n,) N that the model leaves in each block."""
    m = log.motion
    force = total_force(on_blocks(fit.axis), m)
    return np.asarray(m.net + force - fit.axis.mass * m.acceleration)


def _term(force: Array, position: Array, period: float) -> complex:
    """Complex amplitude (N) of exp(2 pi i x/period) in a force."""
    phase = 2.0 * np.pi * position / period
    columns = np.stack([np.cos(phase), np.sin(phase), np.ones_like(phase)], axis=1)
    a, b, _ = np.linalg.lstsq(columns, force, rcond=None)[0]
    return complex(a, -b)
