"""The model against measurements: fit, compare, diagnose, add, plan, agree.

Logs are given as a Log, the path of one, a list of them or a dict by name; a model as a
MachineModel, the path of its file or a name of the package.

    >>> import identify
    >>> print(identify.fit("proton_xy", "run.mcap"))
"""

# ruff: noqa: F403, F405
from __future__ import annotations

TYPE_CHECKING = False  # without the 10 ms of typing, in which `twin` does not heed Ctrl-C yet
if TYPE_CHECKING:
    from typing import Any

    from identify.adding import *
    from identify.output.as_json import load
    from identify.workflow import *

__all__ = [
    "Addition", "Agreement", "AllAdded", "Comparison", "CorrectedBody", "Diagnosis", "Feedforward",
    "FitResult", "FrequencyResponse", "Removal", "SimulationFit", "add", "add_found", "add_shape",
    "agree", "compare", "correct_body", "diagnose", "feedforward", "first_model", "fit",
    "fit_simulation", "frequency_response", "load", "plan", "remove",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """The calls, loaded with the first of them: `twin --help` needs none."""
    if name not in __all__:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    if name == "load":
        from identify.output import as_json

        return as_json.load
    from identify import adding, workflow

    return getattr(adding if hasattr(adding, name) else workflow, name)


def __dir__() -> list[str]:
    """What is offered; the rest of the package may change."""
    return sorted([*__all__, "__all__", "__doc__", "__file__", "__name__", "__path__"])
