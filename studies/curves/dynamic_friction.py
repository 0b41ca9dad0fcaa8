"""The dynamic part of a friction from open-loop logs, the rest of the model being known.

Stiffness and damping of the bristles make little force in closed loop; a slow sine of force below
the break-away shows both (L. Jia 2023). The search begins at a fit of the force residual: the start
rule, stiffness = Fs / largest deflection and a damping drawn below it, is far off where the
reversals are small, so it is tried at several parts of that stiffness. It goes on with the
simulated motion, for which it estimates where each log begins: a simulation from rest misses the
bend that the bristles have there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.least_squares import MOST_EVALUATIONS, minimise
from identify.estimation.simulated_motion import MotionFit, fit_simulated_motion
from studies.curves.velocity_map import only_axis
from twin.effect import Kind
from twin.errors import InputError
from twin.logs import GivenLogs, logs_by_name
from twin.model.machine import AxisModel, MachineModel
from twin.model.parameters import free_parameters, write
from twin.signals import Array

DYNAMIC = ("sigma0", "sigma1")  # N/m, N s/m: stiffness and damping of a friction's bristles
STATIC = "Fs"  # N, the force that they break away at
TEST_FUNCTION = 0.1  # s


def dynamic_friction(
    model: MachineModel,
    logs: GivenLogs,
    *,
    axis: str | None = None,
    test_function: float = TEST_FUNCTION,
    seed: int = 0,
) -> MotionFit:
    """Stiffness and damping of an axis' bristles from open-loop logs; all else is as in the model.

    axis: the only one that moves where None. seed: draws the damping to start from. Raises
    InputError where the friction has no bristles.
    """
    name, dataset = only_axis(datasets(model, logs_by_name(logs), {}, test_function), axis)
    known = dynamic_part_free(model.axes[name])
    return fit_dynamic_part(known, dataset.training, np.random.default_rng(seed))


def dynamic_part_free(axis: AxisModel) -> AxisModel:
    """The axis with all known but stiffness and damping of its friction; raises InputError."""
    effects = []
    for f in axis.effects:
        own = DYNAMIC if f.effect.kind is Kind.FRICTION else ()
        effects.append(replace(f, fixed=frozenset(n for n in f.values if n not in own)))
    known = replace(axis, effects=tuple(effects), mass_fixed=True)
    if tuple(c.parameter.name for c in free_parameters(known)) != DYNAMIC:
        raise InputError(
            f"the axis has {', '.join(axis.names) or 'no effect'}: no friction with a stiffness "
            "and a damping; give it one that has bristles"
        )
    return known


def fit_dynamic_part(
    known: AxisModel, logs: Sequence[PreparedLog], rng: np.random.Generator
) -> MotionFit:
    """The fit of simulated motion, begun at one of the force residual.

    known: of ``dynamic_part_free``. rng draws the damping to start from.
    """
    return fit_simulated_motion(fit_bristles(known, logs, rng), logs)


def fit_bristles(
    known: AxisModel, logs: Sequence[PreparedLog], rng: np.random.Generator
) -> AxisModel:
    """The same axis with stiffness and damping of its friction fitted to the force residual."""
    where = free_parameters(known)
    low, high = np.array([[c.parameter.lower, c.parameter.upper] for c in where]).T

    def left(x: Array, logs: Sequence[PreparedLog]) -> Array:
        return residual(write(known, where, x), logs)

    def search(logs: Sequence[PreparedLog], start: Array, evaluations: int) -> Array:
        tolerance = 1e-6  # relative fall of the squared error, at which the search ends
        return minimise(
            lambda x: left(x, logs), lambda x: jacobian(write(known, where, x), logs, where),
            start, (low, high), tolerance=tolerance, most_evaluations=evaluations,
        ).x  # fmt: skip

    deflection = max(float(np.ptp(log.motion.position)) for log in logs) / 2.0
    first = known[where[0].effect].values[STATIC] / deflection
    parts = (1.0, 0.3, 0.1, 0.03, 0.01)  # of the stiffness of the start rule
    starts = [np.array([p * first, rng.uniform(0.0, p * first)]) for p in parts]
    head = 3.0  # s of each log, on which the start is chosen
    heads = [PreparedLog.of(w.motion.head(head), w.test_function.length) for w in logs]
    first_evaluations = 3  # of the search from each, after which the best goes on with all
    tried = [search(heads, start, first_evaluations) for start in starts]
    best = min(tried, key=lambda x: float(np.sum(left(x, heads) ** 2)))
    return write(known, where, search(logs, best, MOST_EVALUATIONS))
