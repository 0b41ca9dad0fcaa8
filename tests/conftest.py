"""Fixtures shared by the whole suite; what every test needs is compiled once for all workers."""

import os

# Two workers on two cores: threads of the linear algebra would only wait for each other.
for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

import time  # noqa: E402
from collections.abc import Iterator  # noqa: E402
from contextlib import contextmanager  # noqa: E402
from pathlib import Path  # noqa: E402

import pytest  # noqa: E402

pytest_plugins = ("changed",)

SHARED_DATA = Path(__file__).resolve().parent.parent.parent / "shared" / "data"
LONGEST_WAIT = 300.0  # s for what another worker compiles


# With `--dist loadfile` a file is one worker's: what its tests share is made once. The longest
# begin first, so that the workers end together.
LONGEST = (
    "test_types",
    "test_readme",
    "test_catalogue_laws",
    "test_odd_logs",
    "test_catalogue_recovery",
    "test_import_guess",
    "test_departures",
    "test_tables",
    "test_left_out",
    "test_recording",
    "test_points",
    "test_imitators",
    "test_user_effects",
    "test_emps_product",
)


@pytest.hookimpl(tryfirst=True)  # before pytest asks which are slow
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for cases in _by_function(items).values():
        if (short := cases[0].get_closest_marker("short")) is not None:
            for item in cases[short.args[0] :]:
                item.add_marker(pytest.mark.slow)
    order = {name: i for i, name in enumerate(LONGEST)}
    items.sort(key=lambda item: order.get(item.path.stem, len(order)))


def _by_function(items: list[pytest.Item]) -> dict[str, list[pytest.Item]]:
    """The cases of each test function, in their order."""
    found: dict[str, list[pytest.Item]] = {}
    for item in items:
        found.setdefault(item.nodeid.partition("[")[0], []).append(item)
    return found


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of real measurements beside the repository; skips where it is absent."""
    if not SHARED_DATA.is_dir():
        pytest.skip("the real measurements (../shared/data) are not beside the repository")
    return SHARED_DATA


@pytest.fixture(scope="session", autouse=True)
def compiled_once(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Each worker compiles a part while the others compile another, and finds theirs on disk.

    Left to themselves they would all compile everything, at the same time. Without xdist a test
    compiles what it needs.
    """
    worker = os.environ.get("PYTEST_XDIST_WORKER")
    if worker is None:
        return
    import compiling

    folder = tmp_path_factory.getbasetemp().parent  # of this run, and common to its workers
    first = int(worker.removeprefix("gw")) % len(compiling.PARTS)
    waiting = [*compiling.PARTS[first:], *compiling.PARTS[:first]]
    end = time.monotonic() + LONGEST_WAIT
    while waiting:
        for part in tuple(waiting):
            with alone(folder / f"{part.__name__}.lock") as mine:
                if mine:
                    part()
                    waiting.remove(part)
        if waiting:
            assert time.monotonic() < end, f"{waiting} are still being compiled elsewhere"
            time.sleep(0.05)


@contextmanager
def alone(lock: Path) -> Iterator[bool]:
    """Whether no other process is within; a file marks the one that is."""
    try:
        lock.touch(exist_ok=False)
    except FileExistsError:
        yield False
        return
    try:
        yield True
    finally:
        lock.unlink()
