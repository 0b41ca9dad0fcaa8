"""What a page draws of an axis: forces that add up, and means over bins."""

import numpy as np
import pytest
from axis_runs import effect

from identify.dataset.dataset import Role
from identify.dataset.preparation import datasets
from identify.results.signals import means, signals_of
from twin.errors import InputError
from twin.model.machine import AxisModel, Hardware, MachineModel
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator

BARE = AxisModel(
    2.0,
    Hardware(travel=(-0.1, 0.1), velocity=0.2, jerk=100.0),
    (effect("coulomb_viscous", Fc=0.4, Fs=0.4, sigma2=3.0),),
)
WHOLE = BARE.with_effect(effect("cogging", p=0.03, a1=0.5, b1=0.2))


@pytest.fixture(scope="module")
def shown():
    machine = MachineModel("drive", {"x": WHOLE}, 2000.0)
    log = simulate(machine, "tracking", seed=1, duration=3.0, simulator=ReducedSimulator)
    (prepared,) = datasets(machine, {"run": log}, {})["x"].training
    return signals_of({prepared: Role.TRAINING}, BARE, WHOLE)


def test_what_is_to_explain_is_what_the_effects_make_and_what_is_left(shown) -> None:
    left = shown.to_explain - sum(shown.effects.values())
    known = np.isfinite(shown.after)
    assert known.mean() > 0.8
    np.testing.assert_allclose(left[known], shown.after[known], atol=1e-3 * shown.size)


def test_the_model_before_lacks_just_the_force_of_what_was_found(shown) -> None:
    known = np.isfinite(shown.after)
    more = (shown.before - shown.after)[known]
    np.testing.assert_allclose(more, shown.effects["cogging"][known], atol=1e-9)
    assert shown.size == pytest.approx(np.sqrt(np.mean(shown.before[known] ** 2)))
    assert np.sqrt(np.nanmean(shown.after**2)) < 0.05 * shown.size


def test_signals_go_over_time_and_every_coordinate_and_no_other(shown) -> None:
    assert shown.over("time") is shown.time
    assert set(shown.units) == set(shown.coordinates)
    assert "standstill" not in shown.coordinates
    np.testing.assert_array_equal(shown.over("position"), shown.coordinates["position"])
    with pytest.raises(InputError, match="unknown coordinate 'place'; known are time, "):
        shown.over("place")


def test_a_mean_is_drawn_where_a_bin_has_a_few_values() -> None:
    x = np.concatenate([np.repeat([0.0, 40.0], 4), [80.0] * 3, [20.0, np.nan]])
    y = np.concatenate([[1.0, 2.0, 3.0, 6.0], np.full(4, -5.0), [7.0] * 3, [np.nan, 9.0]])
    middles, mean = means(x, y)
    assert len(middles) == len(mean) == 80
    np.testing.assert_allclose(np.diff(middles), 1.0)
    assert middles[0] == pytest.approx(0.5)
    assert (mean[0], mean[40]) == (3.0, -5.0)
    assert np.isnan(np.delete(mean, [0, 40])).all()
