"""The machine: its effects, its model, its simulation, its experiments and its logs.

Data flow: effects -> model -> core -> mujoco and the reduced simulator -> log. Nothing here imports
``identify``.

    >>> import twin
    >>> log = twin.simulate(twin.load_model("example_machine"), "moves", seed=1, duration=10.0)
    >>> twin.write_log(log, "moves.mcap")
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in identify: `twin --help` loads none of it
if TYPE_CHECKING:
    from typing import Any

    from twin.checks import check_log
    from twin.effect import Effect, Parameter
    from twin.effects import Catalogue, load_catalogue
    from twin.errors import CannotRun, InputError
    from twin.experiments.experiment import Experiment
    from twin.experiments.file import load_experiment, save_experiment
    from twin.importers import import_log, load_mapping
    from twin.laws.verdict import check_effect
    from twin.logs import AxisLog, Log, cut_log, read_log, recover_log, write_log
    from twin.model.file import load_model, save_model
    from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
    from twin.simulation.simulate import simulate

HOMES = {
    "twin.effect": ("Effect", "Parameter"),
    "twin.effects": ("Catalogue", "load_catalogue"),
    "twin.errors": ("CannotRun", "InputError"),
    "twin.experiments.experiment": ("Experiment",),
    "twin.experiments.file": ("load_experiment", "save_experiment"),
    "twin.simulation.simulate": ("simulate",),
    "twin.laws.verdict": ("check_effect",),
    "twin.logs": ("AxisLog", "Log", "cut_log", "read_log", "recover_log", "write_log"),
    "twin.checks": ("check_log",),
    "twin.importers": ("import_log", "load_mapping"),
    "twin.model.file": ("load_model", "save_model"),
    "twin.model.machine": ("AxisModel", "Fitted", "Hardware", "MachineModel"),
}
__all__ = [
    "AxisLog",
    "AxisModel",
    "CannotRun",
    "Catalogue",
    "Effect",
    "Experiment",
    "Fitted",
    "Hardware",
    "InputError",
    "Log",
    "MachineModel",
    "Parameter",
    "check_effect",
    "check_log",
    "cut_log",
    "import_log",
    "load_catalogue",
    "load_experiment",
    "load_mapping",
    "load_model",
    "read_log",
    "recover_log",
    "save_experiment",
    "save_model",
    "simulate",
    "write_log",
]


def __getattr__(name: str) -> Any:
    """What is offered, loaded when it is first asked for."""
    for home, names in HOMES.items():
        if name in names:
            import importlib

            return getattr(importlib.import_module(home), name)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")


def __dir__() -> list[str]:
    """What is offered; the rest of the package may change."""
    return sorted([*__all__, "__all__", "__doc__", "__file__", "__name__", "__path__"])
