"""Drives that have nothing of the stage, from their logs alone (benchmarks/drives.py)."""

from __future__ import annotations

import pytest

from benchmarks.drives import row
from benchmarks.second_simulator.drives import Recorder


@pytest.mark.parametrize("hidden", ["nothing", pytest.param("ripple", marks=pytest.mark.slow)])
def test_noise_of_the_force_is_no_friction_that_grows_with_it(hidden: str) -> None:
    """A servo of 1 kHz logged at 200 Hz: what thinning folds into its force is half of it."""
    found = row("servo", hidden, Recorder(200, 1000), 1)
    assert not [f for f in found["findings"] if f["mark"] == "wrong"]


@pytest.mark.slow
def test_friction_that_lags_is_no_channel_delay() -> None:
    """Presliding shifts the force at each reversal; it is named, though a delay explains much."""
    found = row("actuator", "nothing", Recorder(1000, 1000), 2)
    named = {name for f in found["findings"] for name in (f["effect"], *f["tied"])}
    assert named & {"presliding_hysteresis", "lugre", "leuven", "modified_leuven", "dahl", "gms"}
    assert found["mark"] != "wrong"
