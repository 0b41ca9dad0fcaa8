"""Fixtures shared by the whole suite."""

from pathlib import Path

import pytest

pytest_plugins = ("changed",)

SHARED_DATA = Path(__file__).resolve().parent.parent.parent / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of real measurements beside the repository; skips where it is absent."""
    if not SHARED_DATA.is_dir():
        pytest.skip("the real measurements (../shared/data) are not beside the repository")
    return SHARED_DATA
