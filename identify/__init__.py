"""The model against measurements: fit, compare, diagnose, add, plan, agree.

And what logs show by themselves: friction by speed and place, its dynamic part, the cable's force.
"""

from __future__ import annotations

TYPE_CHECKING = False  # without the 10 ms of typing, in which `twin` does not heed Ctrl-C yet
if TYPE_CHECKING:
    from typing import Any

    from identify.workflow import (
        add,
        add_shape,
        agree,
        along_track,
        cable_force,
        compare,
        diagnose,
        dynamic_friction,
        fit,
        fit_simulation,
        friction_map,
        plan,
        velocity_map,
    )

__all__ = [
    "add",
    "add_shape",
    "agree",
    "along_track",
    "cable_force",
    "compare",
    "diagnose",
    "dynamic_friction",
    "fit",
    "fit_simulation",
    "friction_map",
    "plan",
    "velocity_map",
]


def __getattr__(name: str) -> Any:
    """The calls, loaded with the first of them: `twin --help` needs none.

    Each with one BLAS thread, as NumPy has been loaded already by the script that calls it.
    """
    if name not in __all__:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    from identify import workflow
    from twin.threads import one_for_matrices

    return one_for_matrices(getattr(workflow, name))
