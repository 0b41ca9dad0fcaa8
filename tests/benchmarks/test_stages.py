"""The stages that the benchmark of a diagnosis times are functions that a diagnosis calls."""

from __future__ import annotations

import pytest

from benchmarks.stages import STAGES


@pytest.mark.parametrize(
    ("module", "function"), [s[1:] for s in STAGES], ids=[s[0] for s in STAGES]
)
def test_exists(module, function):
    assert callable(getattr(module, function))
