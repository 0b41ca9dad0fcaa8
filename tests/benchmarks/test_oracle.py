"""The oracle of the second simulator: what least squares that know the true laws can prove."""

from __future__ import annotations

from functools import cache

import pytest

from benchmarks.second_simulator.drives import DRIVES, Recorder
from benchmarks.second_simulator.oracle import is_otherwise, is_provable
from benchmarks.second_simulator.recordings import recordings
from twin.logs import Log

NAME, SEED = "actuator", 5
PLAIN = DRIVES[NAME].plant
PLANT = PLAIN._replace(cogging=0.3 * PLAIN.friction)


@cache
def logs_of(spoiled: str | None = None) -> dict[str, Log]:
    return recordings(DRIVES[NAME], PLANT, Recorder(2000, 2000), SEED, spoiled, "moves")


@pytest.mark.parametrize(
    "spoiled", ["payload", "tilted", "other gain", "glitch", "slipped", "warm"]
)
def test_a_log_shows_what_spoils_it(spoiled: str) -> None:
    sound, own = logs_of(), logs_of(spoiled)["moves"]
    others = [log for name, log in sound.items() if name != "moves"]
    assert is_otherwise(PLANT, PLAIN, others, own, sound["moves"])
    assert not is_otherwise(PLANT, PLAIN, others, sound["moves"], sound["moves"])


def test_what_is_hidden_is_provable_and_what_is_not_there_is_not() -> None:
    logs = [*logs_of().values()]
    assert is_provable(PLANT, PLAIN, logs[:2], logs[2:])
    assert not is_provable(PLAIN._replace(spring=1e-6), PLAIN, logs[:2], logs[2:])
