"""A machine among its kind: which are off from it, and what a new one is expected to be.

The kind is a distribution of machines, a mean and how far they differ, estimated of those that
there are (empirical Bayes: C. N. Morris, Parametric empirical Bayes inference, J. Am. Stat. Assoc.
78, 1983; spread between machines by R. DerSimonian, N. Laird, Controlled Clinical Trials 7, 1986).
What is known of a new machine is that, drawn to its own logs as these grow.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from identify.fleet.alarms import LAST_NIGHTS
from identify.fleet.nights import FORCE_ERROR, Panel
from identify.results.fleet import Off
from twin.model.machine import AxisModel, MachineModel
from twin.model.parameters import all_parameters, write
from twin.signals import Array

FEWEST = 5  # machines that tell what their kind is
FAR = 5.0  # standard deviations of the kind, by its median, from which a machine is off from it


@dataclass(frozen=True)
class Kind:
    """How a parameter is distributed over machines: mean, and standard deviation between them."""

    mean: float
    spread: float

    def expected(self, value: float, deviation: float) -> tuple[float, float]:
        """A machine that its own logs tell as value +- deviation: what it is, and how sure."""
        if self.spread == 0.0:
            return self.mean, 0.0
        kept = self.spread**2 / (self.spread**2 + deviation**2)
        return self.mean + kept * (value - self.mean), float(np.sqrt(kept) * deviation)


def kind_of(values: Array, deviations: Array) -> Kind:
    """The kind of machines (m,), each told with this standard deviation (m,)."""
    w = 1.0 / np.maximum(deviations, 1e-9 * np.abs(values).max() + 1e-300) ** 2
    mean = float(w @ values / w.sum())
    excess = float(w @ (values - mean) ** 2) - (len(values) - 1)
    between = max(excess / float(w.sum() - (w**2).sum() / w.sum()), 0.0)
    w = 1.0 / (1.0 / w + between)
    return Kind(float(w @ values / w.sum()), float(np.sqrt(between)))


def levels(panel: Panel) -> tuple[Array, Array]:
    """Where each machine stands now (m,), and the standard deviation of that (m,).

    Of its last nights, which scatter as all of its neighbouring nights do.
    """
    last = [row[np.isfinite(row)][-LAST_NIGHTS:] for row in panel.values]
    means = np.array([row.mean() for row in last])
    steps = [np.diff(row[np.isfinite(row)]) for row in panel.values]
    usual = np.median([np.std(s) / np.sqrt(2.0) for s in steps if len(s) > 1] or [0.0])
    within = np.nanmean(panel.deviations) if np.isfinite(panel.deviations).any() else 0.0
    nights = np.array([len(row) for row in last])
    return means, np.maximum(usual, within) / np.sqrt(nights)


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


def expected(
    panels: Iterable[Panel], kind: str, machine: str | None = None
) -> Mapping[tuple[str, str], tuple[float, float]]:
    """By axis and parameter what a machine of a kind is, and its standard deviation.

    machine: one whose own logs take part; None: one that has none yet.
    """
    found = {}
    for panel in panels:
        own = list(panel.machines).index(machine) if machine in panel.machines else None
        if panel.kind != kind or panel.parameter == FORCE_ERROR or len(panel.machines) < FEWEST:
            continue
        values, deviations = levels(panel)
        others = np.arange(len(values)) != own
        known = kind_of(values[others], deviations[others])
        found[panel.axis, panel.parameter] = (
            (known.mean, known.spread)
            if own is None
            else known.expected(float(values[own]), float(deviations[own]))
        )
    return found


def begun(model: MachineModel, told: Mapping[tuple[str, str], tuple[float, float]]) -> MachineModel:
    """A model whose parameters start where its kind is."""
    for name, axis in model.axes.items():
        model = model.with_axis(name, _begun(name, axis, told))
    return model


def _begun(
    name: str, axis: AxisModel, told: Mapping[tuple[str, str], tuple[float, float]]
) -> AxisModel:
    where = [c for c in all_parameters(axis) if (name, c.label) in told]
    return write(axis, where, [told[name, c.label][0] for c in where])
