"""For the regression tests of others: do a twin and its machine still agree?

from identify.testing import assert_agree

def test_the_twin_is_the_machine():
    assert_agree("machine.toml", "twin.toml")
"""

from __future__ import annotations

from pathlib import Path

from identify.output.text import agree_text
from identify.results.results import FitResult
from identify.workflow import agree
from twin.effects import Catalogue, load_catalogue
from twin.model.file import load_model
from twin.model.machine import MachineModel

Fitted = FitResult | MachineModel | str | Path


def assert_agree(fit_a: Fitted, fit_b: Fitted, *, catalogue: Catalogue | None = None) -> None:
    """Raise AssertionError with what differs, where two fits disagree beyond their uncertainties.

    fit_a, fit_b: results of `fit`, models, or paths of files that `twin fit` wrote. catalogue: with
    which files are read; the package's own where None. Raises InputError where nothing can be
    compared.
    """
    __tracebackhide__ = True  # pytest then points at the test
    known = load_catalogue() if catalogue is None else catalogue
    a, b = (load_model(f, known) if isinstance(f, str | Path) else f for f in (fit_a, fit_b))
    found = agree(a, b, catalogue=known)
    if not found.agrees:
        raise AssertionError(agree_text(found))
