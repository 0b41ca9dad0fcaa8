"""The dynamic part of a friction from open-loop logs, the rest of the model being known.

Stiffness and damping of the bristles make little force in closed loop; a slow sine of force below
the break-away shows both (L. Jia 2023). The search begins at a fit of the force residual and goes
on with the simulated motion, for which it estimates where each log begins: a simulation from rest
misses the bend that the bristles have there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.analysis.maps import only_axis
from identify.dataset.dataset import datasets
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.presliding import Presliding
from identify.estimation.simulated_motion import MotionFit, fit_simulated_motion
from twin.effect import Kind
from twin.errors import InputError
from twin.logs import GivenLogs, logs_by_name
from twin.model.machine import AxisModel, MachineModel
from twin.model.parameters import free_parameters

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
    return fit_dynamic_part(known, dataset.fit, np.random.default_rng(seed))


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
    stiffness, damping = free_parameters(known)
    static = known[stiffness.effect].values[STATIC]
    return fit_simulated_motion(Presliding(stiffness, damping).fit(known, logs, static, rng), logs)
