"""The diagnosed drive whose report, texts and roles the tests read."""

import pytest
from report_cases import Case, cogging_case


@pytest.fixture(scope="session")
def case() -> Case:
    return cogging_case()
