"""For the regression tests of others: do a twin and its machine still agree?

from identify.testing import assert_agree, assert_exported

def test_the_twin_is_the_machine():
    assert_agree("machine.toml", "twin.toml")

def test_the_controller_has_the_model_of_today():
    assert_exported("machine.toml", "controller/")
"""

from __future__ import annotations

from pathlib import Path

from identify.output.machine import export_agreement_text
from identify.results.results import FitResult
from identify.workflow import agree
from twin.effects import Catalogue, load_catalogue
from twin.export import compare_export
from twin.logs import GivenLogs, logs_by_name
from twin.model.file import as_model, load_model
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
    if not found.agree:
        raise AssertionError(str(found))


def assert_exported(
    model: MachineModel | str | Path,
    path: str | Path,
    logs: GivenLogs | None = None,
    *,
    catalogue: Catalogue | None = None,
) -> None:
    """Raise AssertionError with the first line that differs, where an export is not of the model.

    path: what `twin export` wrote; logs: those that it was given. Raises InputError where there is
    no export of such a model.
    """
    __tracebackhide__ = True
    known = load_catalogue() if catalogue is None else catalogue
    found = compare_export(as_model(model, known), Path(path), logs_by_name(logs))
    if not found.agrees:
        raise AssertionError(export_agreement_text(found, str(model), str(path)))
