"""Laws of the acceptance test, on plain residuals of which the answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import axis_of, built_fit, dataset_stub, fitted
from linear_cases import cut

from identify.estimation.evidence import BLOCKS
from identify.selection.acceptance import (
    Judged,
    Score,
    Taken,
    least_t,
    most_evidence,
    parts,
    score,
    taken,
)
from twin.model.parameters import free_parameters

SAMPLES = 1200
FLOOR = 0.3  # N
SURE = least_t(1)
GOOD = Taken(9.0, 0.9, 0.9)


def noise(size: float, seed: int = 1, count: int = SAMPLES) -> np.ndarray:
    """White residuals, N, of that RMS."""
    drawn = np.random.default_rng(seed).standard_normal(count)
    return size * drawn / np.sqrt(np.mean(drawn**2))


def test_a_gain_in_every_block_is_sure() -> None:
    before = noise(3.0)
    found = taken(before, 0.5 * before, FLOOR)
    assert found.t > 20.0
    above = 3.0**2 - FLOOR**2
    assert found.whole == pytest.approx(0.75 * 3.0**2 / above, rel=1e-6)
    assert found.typical == pytest.approx(found.whole, rel=0.05)
    assert Score(found, found).accepted


def test_a_gain_in_one_block_alone_is_not_sure() -> None:
    """However much of the squared error it takes."""
    before, after = noise(1.0), noise(1.0)
    before[cut(SAMPLES, BLOCKS)[7]] *= 30.0
    found = taken(before, after, FLOOR)
    assert found.whole > 0.9
    assert found.t < 1.5
    assert "uncertain" in str(Score(found, found).refused)


def test_a_few_large_blocks_do_not_hide_what_all_others_show() -> None:
    before, after = noise(1.0), noise(FLOOR, 2)
    for wide in cut(SAMPLES, BLOCKS)[:3]:
        before[wide] *= 100.0
        after[wide] = before[wide]
    found = taken(before, after, FLOOR)
    assert found.whole < 0.01
    assert found.part == found.typical > 0.8
    assert found.t > SURE


def test_a_loss_is_no_gain() -> None:
    found = taken(noise(1.0), noise(1.5), FLOOR)
    assert found.t < -SURE
    assert found.part < 0.0
    assert str(Score(found, found).refused).startswith("takes 0 %")


def test_residuals_that_tell_nothing_of_each_other_are_left_out() -> None:
    before = noise(3.0)
    after = 0.5 * before
    known = taken(before[:800], after[:800], FLOOR)
    before[1000:], after[800:1000] = np.nan, np.nan
    assert replace(taken(before, after, FLOOR), apart=known.apart) == known
    assert taken(before, np.full(SAMPLES, np.nan), FLOOR) == Taken(0.0, 0.0, 0.0, 0.0)


def test_a_difference_below_what_noise_lets_tell_is_none_however_sure_its_sign() -> None:
    """A fit ends a thousandth of a noise short of another, alike in every block."""
    noise = np.random.default_rng(6).normal(0.0, FLOOR, SAMPLES)
    assert taken(1.001 * noise, noise, FLOOR).t > 10.0
    assert most_evidence(1.001 * noise, noise, FLOOR) < 0.1
    assert most_evidence(1.5 * noise, noise, FLOOR) > 100.0


@pytest.mark.parametrize("factor", [0.01, 100.0])
def test_the_unit_of_force_changes_nothing(factor: float) -> None:
    before, after = noise(2.0), noise(1.2, 2)
    one = taken(before, after, FLOOR, 0.02)
    other = taken(factor * before, factor * after, factor * FLOOR, 0.02)
    np.testing.assert_allclose(
        (other.t, other.whole, other.typical), (one.t, one.whole, one.typical), rtol=1e-9
    )


@pytest.mark.parametrize("left", [0.8, 0.9, 1.0, 1.05])
def test_at_the_floor_nothing_is_left_to_take(left: float) -> None:
    """A tenth of an error that noise makes is no effect, however sure the fall is."""
    before = noise(left * FLOOR)
    found = taken(before, 0.95 * before, FLOOR)
    assert found.t > 20.0
    assert Score(found, found).refused


def test_parts_are_of_what_is_left_above_the_floor() -> None:
    count = np.array([100, 300])
    before, after = np.array([4.0, 8.0]), np.array([2.0, 3.0])
    whole, typical = parts(before, after, count, 1.0)
    assert whole == pytest.approx((7.0 - 2.75) / (7.0 - 1.0))
    typical_before, typical_after = np.sqrt(5.0 * 9.0), np.sqrt(3.0 * 4.0)
    assert typical == pytest.approx((typical_before - typical_after) / (typical_before - 2.0))
    assert parts(before, np.zeros(2), count, 1.0) == (1.0, 1.0)  # more than is left is all of it


@pytest.mark.parametrize(
    "bad", [Taken(9.0, 0.1, 0.15), Taken(1.0, 0.9, 0.9)], ids=["small", "unsure"]
)
def test_the_worse_of_the_two_groups_of_logs_decides(bad: Taken) -> None:
    """Either alone can be imitated: one is fitted, in the other an error may stand by chance."""
    assert Score(GOOD, GOOD).accepted
    for pair in ((GOOD, bad), (bad, GOOD)):
        found = Score(*pair)
        assert not found.accepted
        assert (found.part, found.t) == (min(0.9, bad.part), min(9.0, bad.t))


def test_what_its_controls_take_too_is_no_effect() -> None:
    sure = Taken(9.0, 0.5, 0.5)
    assert Score(sure, sure, control=0.49).accepted
    assert "shifted in time, where it cannot be real, it takes 55 %" in str(
        Score(sure, sure, control=0.55).refused
    )


def test_of_many_changes_the_best_must_be_surer() -> None:
    """One in twenty of them would be sure by chance."""
    found = Taken(2.0, 0.5, 0.5)
    assert Score(found, found).accepted
    assert "uncertain" in str(Score(found, found, among=30).refused)
    asked = [least_t(among) for among in (1, 3, 10, 30, 100)]
    assert asked == sorted(asked)
    assert 1.5 < asked[0] < asked[-1] < 4.0


MANY = axis_of(*(fitted(n) for n in ("cogging", "roller_spikes", "spring", "quadratic_drag")))


def fitted_to_noise(seed: int) -> Score:
    """The score of as many columns as the added effects have, all true to nothing."""
    rng = np.random.default_rng(seed)
    few = len(free_parameters(axis_of()))
    columns = rng.standard_normal((200, len(free_parameters(MANY))))
    data = rng.standard_normal(200)

    def judged(axis, own) -> Judged:
        left = data - own @ np.linalg.lstsq(own, data, rcond=None)[0]
        fit = built_fit(0.0, 0.5, axis, residual=left, jacobian=own)
        return Judged(fit, dataset_stub())  # type: ignore[arg-type]

    return score(judged(axis_of(), columns[:, :few]), judged(MANY, columns))


def test_more_parameters_on_pure_noise_are_not_accepted() -> None:
    found = [fitted_to_noise(seed) for seed in range(30)]
    assert not any(s.accepted for s in found)
    # In blocks that are left out they only add error.
    assert np.mean([s.other.part for s in found]) < -0.05


def test_the_gain_that_parameters_make_of_noise_is_charged_to_them() -> None:
    """On the training logs, where any column takes something of any error."""
    found = [fitted_to_noise(seed) for seed in range(30)]
    assert max(s.training.t for s in found) < SURE
    assert np.mean([s.training.part for s in found]) > 0.05
    before = noise(1.0)
    free, charged = (taken(before, 0.96 * before, 0.5, charge).t for charge in (0.0, 0.1))
    assert free > SURE > 0.0 > charged
