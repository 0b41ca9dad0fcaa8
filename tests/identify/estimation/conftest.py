"""What the tests of a search start from."""

from dataclasses import replace

import pytest
from built_fits import PLAIN, axis_of, built_dataset, fitted

from identify.estimation.fit import Outcome, finished


@pytest.fixture(scope="module")
def dataset():
    return built_dataset("one", "two")


@pytest.fixture(scope="module")
def base(dataset):
    """The axis off its best values, with the residual and Jacobian that it has there."""
    off = replace(axis_of(fitted("constant_force", F0=0.2)), mass=5.6)
    return finished(off, PLAIN, dataset.fit, Outcome.CONVERGED)
