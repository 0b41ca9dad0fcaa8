"""The model against measurements: fit, compare, diagnose, add."""

from identify.workflow import add, compare, diagnose, fit

__all__ = ["add", "compare", "diagnose", "fit"]
