"""The force of the cable from passes, and the spikes that are kept out of it."""

from __future__ import annotations

import numpy as np
import pytest

import identify
from identify.analysis.cable_force import CableForce, Passes, Spike, find_spikes, pitch_of
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.experiments import kinds
from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.model.machine import MachineModel
from twin.simulator import ReducedSimulator

STAGE = load_model("proton_xy", load_catalogue())
ONE = MachineModel("slide", {"x": STAGE.axes["x"]}, STAGE.sample_rate)
PLACE = np.linspace(-0.14, 0.14, 600)
CABLE = -(0.05 + 1.5 * PLACE - 2.0 * PLACE**2)


def made(ahead: float, behind: float, rng: np.random.Generator, pitch: float = 0.03) -> Passes:
    """Five passes each way with friction, a cable and bumps that brake by that much (N)."""
    apart = (PLACE - 0.004 + 0.5 * pitch) % pitch - 0.5 * pitch
    bump = np.maximum(1.0 - (apart / 0.002) ** 2, 0.0) ** 2
    noise = 1e-3 * rng.standard_normal((2, 5, len(PLACE)))
    return Passes(
        PLACE, 0.3 - CABLE + ahead * bump + noise[0], -0.3 - CABLE - behind * bump + noise[1]
    )


@pytest.mark.parametrize(("ahead", "behind"), [(0.06, -0.06), (-0.05, 0.02)])
def test_spikes_are_found_whichever_way_they_push(ahead: float, behind: float) -> None:
    spikes = find_spikes(made(ahead, behind, np.random.default_rng(1)))
    found = pitch_of(spikes)
    assert len(spikes) == 9
    assert found is not None
    assert found.value == pytest.approx(0.03, abs=2e-5)
    assert abs(found.value - 0.03) < 4.0 * found.standard_error
    assert np.mean([s.ahead for s in spikes]) == pytest.approx(ahead, abs=5e-3)


def test_a_track_without_spikes_has_none_and_one_not_found_leaves_the_pitch_as_it_is() -> None:
    assert find_spikes(made(0.0, 0.0, np.random.default_rng(2))) == ()
    assert pitch_of(()) is None
    places = np.array([0.0, 1.0, 2.0, 4.0, 5.0]) * 0.03
    found = pitch_of(tuple(Spike(p, 0.004, 0.05, 0.05) for p in places))
    assert found is not None
    assert found.value == pytest.approx(0.03)


def test_no_force_is_told_beyond_a_spike_at_the_end_and_its_band_holds_the_truth() -> None:
    """Where the grid begins 2.2 mm before a bump of 4 mm, nothing is known before the bump."""
    whole = made(0.05, 0.05, np.random.default_rng(3))
    first = int(np.searchsorted(PLACE, 0.004 - 0.12 - 0.0022))
    begun = whole.part(slice(first, None))
    found = CableForce.of(begun)
    assert found.spikes[0].centre == pytest.approx(0.004 - 0.12, abs=2e-4)
    assert found.position[0] > found.spikes[0].centre + 0.002
    assert found.position[-1] == PLACE[-1]
    assert found.kept[0]
    true = np.interp(found.position, PLACE, CABLE)
    assert found.force == pytest.approx(true, abs=2e-3)
    assert 0.75 < np.mean(np.abs(found.force - true) < found.band) < 0.99


def test_passes_of_a_machine_give_its_cable_and_its_pitch() -> None:
    passes = kinds.Passes("x", span=0.3, speed=0.1, repeats=2)
    log = simulate(STAGE, passes, seed=1, simulator=ReducedSimulator)
    found = identify.cable_force(STAGE, {"passes": log}, axis="x")
    assert found.pitch is not None
    assert found.pitch.value == pytest.approx(0.034, abs=1e-4)
    log = simulate(ONE, "tracking", seed=1, duration=3.0, simulator=ReducedSimulator)
    with pytest.raises(InputError, match="two each way"):
        identify.cable_force(ONE, {"log": log})
    apart = {f"{at}": simulate(ONE, kinds.Staircase("x", speeds=(0.06,) * 2, span=0.01, at=(at,)),
                               simulator=ReducedSimulator) for at in (0.102, -0.102)}  # fmt: skip
    with pytest.raises(InputError, match="no stretch of the track in common"):
        identify.cable_force(ONE, apart)
