"""A machine among its kind: which are off from it, and what a new one is expected to be.

The kind is a distribution of machines, a mean and how far they differ, estimated of those that
there are (empirical Bayes: C. N. Morris, Parametric empirical Bayes inference, J. Am. Stat. Assoc.
78, 1983; spread between machines by R. DerSimonian, N. Laird, Controlled Clinical Trials 7, 1986).
What is known of a new machine is that, drawn to its own logs as these grow.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from identify.fleet.alarms import LAST_NIGHTS
from identify.fleet.nights import FORCE_ERROR, Panel
from identify.results.fleet import KindParameter, Off
from twin.model.machine import MachineModel
from twin.model.parameters import all_parameters, write
from twin.signals import Array

FEWEST = 5  # machines that tell what their kind is
FAR = 5.0  # standard deviations of the kind, by its median, from which a machine is off from it


@dataclass(frozen=True)
class Distribution:
    """How a parameter is distributed over machines: mean, and standard deviation between them."""

    mean: float
    spread: float

    def expected(self, value: float, deviation: float) -> tuple[float, float]:
        """A machine that its own logs tell as value +- deviation: what it is, and how sure."""
        if self.spread == 0.0:
            return self.mean, 0.0
        kept = self.spread**2 / (self.spread**2 + deviation**2)
        return self.mean + kept * (value - self.mean), float(np.sqrt(kept) * deviation)


def kind_of(values: Array, deviations: Array) -> Distribution:
    """The kind of machines (m,), each told with this standard deviation (m,)."""
    w = 1.0 / np.maximum(deviations, 1e-9 * np.abs(values).max() + 1e-300) ** 2
    mean = float(w @ values / w.sum())
    excess = float(w @ (values - mean) ** 2) - (len(values) - 1)
    between = max(excess / float(w.sum() - (w**2).sum() / w.sum()), 0.0)
    w = 1.0 / (1.0 / w + between)
    return Distribution(float(w @ values / w.sum()), float(np.sqrt(between)))


def levels(panel: Panel) -> tuple[Array, Array]:
    """Where each machine stands now (m,), and the standard deviation of that (m,).

    Of its last nights, each of which weighs by its own interval and by what nights scatter.
    """
    known = [np.flatnonzero(np.isfinite(row)) for row in panel.values]
    steps = [np.diff(row[at]) for row, at in zip(panel.values, known, strict=True) if len(at) > 2]
    scatter = np.median([1.4826 * np.median(np.abs(s)) / np.sqrt(2.0) for s in steps] or [0.0])
    within = np.nan_to_num(panel.deviations)
    floor = max(scatter**2, 1e-18 * np.nanmax(np.abs(panel.values)) ** 2)
    out = np.empty((2, len(known)))
    for i, at in enumerate(known):
        last = at[-LAST_NIGHTS:]
        weights = 1.0 / (within[i, last] ** 2 + floor)
        out[:, i] = weights @ panel.values[i, last] / weights.sum(), weights.sum() ** -0.5
    return out[0], out[1]


def off(panels: Iterable[Panel]) -> Iterator[Off]:
    """The machines whose parameter is far from that of their kind."""
    for panel in panels:
        if len(panel.machines) < FEWEST:
            continue
        values, deviations = levels(panel)
        if panel.parameter == FORCE_ERROR:
            values, deviations = np.log(values), deviations / values
        median = np.median(values)
        mad = 1.4826 * np.median(np.abs(values - median))
        scale = np.sqrt(mad**2 + deviations**2)
        far = np.abs(values - median) / np.where(scale > 0.0, scale, np.inf)
        for i in np.flatnonzero(far > FAR):
            usual, own = float(median), float(values[i])
            if panel.parameter == FORCE_ERROR:
                usual, own = float(np.exp(usual)), float(np.exp(own))
            yield Off(panel.machines[i], panel.axis, panel.parameter, panel.unit, own, usual,
                      float(far[i]))  # fmt: skip


def kinds(
    panels: Iterable[Panel], kind: str, machine: str | None = None
) -> Iterator[KindParameter]:
    """What a kind is, parameter by parameter, and what is expected of a machine of it.

    machine: whose own logs take part; None: one that has none yet. A parameter of fewer than
    ``FEWEST`` other machines is left out.
    """
    for panel in panels:
        if panel.kind != kind or panel.parameter == FORCE_ERROR:
            continue
        values, deviations = levels(panel)
        own = np.array([name == machine for name in panel.machines])
        if np.count_nonzero(~own) < FEWEST:
            continue
        known = kind_of(values[~own], deviations[~own])
        told = known.mean, known.spread
        if own.any():
            told = known.expected(float(values[own][0]), float(deviations[own][0]))
        yield KindParameter(
            panel.axis, panel.parameter, panel.unit, known.mean, known.spread,
            int(np.count_nonzero(~own)), *told,
        )  # fmt: skip


def begun(model: MachineModel, told: Iterable[KindParameter]) -> MachineModel:
    """A model whose parameters start where they are expected."""
    values = {(one.axis, one.parameter): one.expected for one in told}
    for name, axis in model.axes.items():
        where = [c for c in all_parameters(axis) if (name, c.label) in values]
        model = model.with_axis(name, write(axis, where, [values[name, c.label] for c in where]))
    return model
