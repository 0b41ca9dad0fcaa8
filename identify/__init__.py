"""The model against measurements: fit, compare, diagnose, add, plan."""

from identify.workflow import add, compare, diagnose, fit, plan

__all__ = ["add", "compare", "diagnose", "fit", "plan"]
