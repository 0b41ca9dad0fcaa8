"""An effect is proved where it gains more than its own columns do shifted in time."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import CATALOGUE, PLAIN, axis_of, built_dataset, fitted
from identify.selection.decoys import DECOYS, Proof, Trial, _left, _Part, _ridge, proof

from identify.estimation.evidence import Gain
from identify.estimation.fit import Outcome, finished
from identify.estimation.force_balance import averaged_force
from identify.selection import decoys
from twin.model.machine import AxisModel

BESIDE_DECOYS = 0.8  # the rule as it was decided
RNG = np.random.default_rng(21)
COGGING = fitted("cogging", p=0.013, a1=0.4, b1=0.2)


@pytest.fixture(scope="module", params=[(), ("held",)], ids=["left out", "held out"])
def dataset(request):
    return built_dataset("one", "two", held=request.param)


def with_force(dataset, added, size: float):
    """The dataset with a force that its model lacks; size: N RMS of a smooth remainder."""

    def moved(log):
        knots = RNG.standard_normal(9)
        smooth = np.interp(np.linspace(0, 8, len(log)), np.arange(9), knots)
        return replace(log, command=log.command - averaged_force(added, [log]) + size * smooth)

    return replace(
        dataset, fit=tuple(map(moved, dataset.fit)), holdout=tuple(map(moved, dataset.holdout))
    )


def base_of(dataset):
    return finished(PLAIN, PLAIN, dataset.fit, Outcome.CONVERGED)


def test_an_effect_that_is_there_is_proved_beside_a_remainder(dataset) -> None:
    there = with_force(dataset, AxisModel(1.0, effects=(COGGING,)), 0.1)
    found = proof(base_of(there), COGGING, there)
    assert found is not None
    assert found.holds
    assert found.gain > 0.6 > found.decoy


def test_an_effect_that_is_not_there_is_not_proved(dataset) -> None:
    nothing = with_force(dataset, AxisModel(1.0), 0.1)
    found = proof(base_of(nothing), COGGING, nothing)
    assert found is not None
    assert not found.holds
    assert found.gain < 0.2


def test_the_same_is_told_every_time(dataset) -> None:
    there = with_force(dataset, AxisModel(1.0, effects=(COGGING,)), 0.1)
    assert proof(base_of(there), COGGING, there) == proof(base_of(there), COGGING, there)
    assert DECOYS >= 20


def test_an_effect_is_set_against_what_one_decoy_in_twenty_exceeds(monkeypatch) -> None:
    """Of forty the third best: a shift that nearly repeats the motion is no decoy."""
    left = iter([[1.0, 1.0], [0.3, 0.2], *([1.0 - k / 100, 1.0 - k / 200] for k in range(40))])
    monkeypatch.setattr(decoys, "_left", lambda *_: np.array(next(left)))
    part = SimpleNamespace(with_columns=lambda *_: SimpleNamespace(columns=("log",)))
    whole, typical = Trial(part, None).proofs(lambda logs: [], sticking=False)
    assert (whole.gain, whole.decoy) == pytest.approx((0.7, 0.37))
    assert (typical.gain, typical.decoy) == pytest.approx((0.8, 0.185))


def test_a_refit_counts_where_it_takes_more_than_a_linear_step(monkeypatch, dataset) -> None:
    """A friction that grows at rest changes what the friction beside it must be."""
    proofs = Proof(0.3, 0.1), Proof(0.2, 0.15, typical=True)
    monkeypatch.setattr(Trial, "proofs", lambda *_, **__: proofs)

    def found(after: float, typical: float) -> Proof:
        base = base_of(dataset)
        told = proof(base, COGGING, dataset, Gain(2.0, after, 4.0, typical))
        assert told is not None
        return told

    assert found(2.5, 1.2) == proof(base_of(dataset), COGGING, dataset) == proofs[0]
    assert found(1.0, 1.2) == Proof(0.75, 0.1)
    assert found(2.5, 0.4) == Proof(0.6, 0.15, typical=True)


@pytest.mark.parametrize(
    ("gain", "decoy", "holds"),
    [(0.21, 0.0, True), (0.19, 0.0, False), (0.61, 0.5, True), (0.59, 0.5, False),
     (0.1, -0.2, True), (-0.1, -0.2, False)],
)  # fmt: skip
def test_it_must_leave_a_fifth_less_than_its_decoy(gain, decoy, holds) -> None:
    assert Proof(gain, decoy).holds is holds
    assert (1.0 - gain < BESIDE_DECOYS * (1.0 - decoy)) is holds


def test_a_shift_in_time_makes_no_decoy_for_a_friction_or_for_what_repeats_in_time(dataset) -> None:
    base = base_of(dataset)
    assert proof(base, fitted("lugre"), dataset) is None
    assert proof(base, fitted("periodic_disturbance", f=3.0, a=0.1), dataset) is None
    held = replace(COGGING, fixed=frozenset(p.name for p in COGGING.effect.strengths))
    assert proof(base, held, dataset) is None
    assert axis_of(COGGING).names
    assert CATALOGUE["cogging"] is COGGING.effect


def parts_of_two(rng: np.random.Generator) -> _Part:
    """Two logs of 60 and 90 test functions, three columns of a base and two that are tried."""
    columns = [rng.standard_normal((n, 2)) for n in (60, 90)]
    return _Part(
        (), rng.standard_normal(150), rng.standard_normal((150, 3)), rng.random(150) < 2.0, columns
    )


def all_columns(part: _Part, shifts) -> np.ndarray:
    moved = [
        np.roll(c, round(s * len(c)), axis=0) for c, s in zip(part.columns, shifts, strict=True)
    ]
    return np.hstack([part.base, np.concatenate(moved)])


def step_of(columns: np.ndarray, force: np.ndarray) -> np.ndarray:
    rows = np.vstack([columns, np.eye(columns.shape[1])])  # a unit penalty
    return np.linalg.lstsq(rows, np.concatenate([force, np.zeros(columns.shape[1])]))[0]


def test_what_is_left_is_that_of_fits_to_the_other_blocks_and_on_other_logs() -> None:
    part, held = (parts_of_two(np.random.default_rng(seed)) for seed in (5, 6))
    there = np.array([0.25, 0.4])
    columns = all_columns(part, there)
    edges = np.linspace(0, 150, 25).astype(int)
    squares = []
    for a, b in pairwise(edges):
        others = np.r_[0:a, b:150]
        step = step_of(columns[others], part.force[others])
        squares.append(np.sum((part.force[a:b] - columns[a:b] @ step) ** 2))
    typical = 24 * np.prod(np.array(squares) ** (1 / 24))
    expected = np.array([sum(squares), typical]) / 150
    assert _left(part, None, there) == pytest.approx(expected, rel=1e-9)

    both = np.array([*there, 0.1, 0.9])
    left = held.force - all_columns(held, both[2:]) @ step_of(columns, part.force)
    assert _left(part, held, both)[0] == pytest.approx(np.mean(left**2), rel=1e-9)


def test_one_part_of_a_log_that_nothing_explains_does_not_decide_alone() -> None:
    """As where a held-out log creeps at a speed that the fit logs do not hold."""
    rng = np.random.default_rng(8)
    shapes = [rng.standard_normal((240, 1)) for _ in range(2)]
    forces = [c[:, 0] + 0.1 * rng.standard_normal(240) for c in shapes]
    forces[1][:30] = -9.0 * shapes[1][:30, 0]  # an eighth of it asks for the contrary
    kept, base = np.ones(240, dtype=bool), rng.standard_normal((240, 1))
    fit, held = (_Part((None,), f, base, kept) for f in forces)
    trial = Trial(replace(fit, logs=("fit",)), replace(held, logs=("held",)))

    def columns(logs):
        return [100.0 * shapes[0 if logs == ("fit",) else 1]]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(decoys, "moving", lambda logs, sticking: kept)
        whole, typical = trial.proofs(columns, sticking=False)
        assert not whole.holds
        assert typical.holds
        assert decoys.clearer((whole, typical)) is typical
        assert (whole.typical, typical.typical) == (False, True)


def test_a_block_that_holds_next_to_nothing_proves_nothing(monkeypatch):
    """Any column moved into it makes there what was not; the noise floor is what counts."""
    kept = np.ones(240, dtype=bool)
    monkeypatch.setattr(decoys, "moving", lambda logs, sticking: kept)

    def is_proved(seed: int, quiet: float) -> bool:
        """Of six random walks for another one, all small in the first sixth of both logs."""
        walks = np.cumsum(np.random.default_rng(seed).standard_normal((2, 240, 7)), axis=1)
        walks[:, :40] *= 0.01
        force = walks[..., 0] / np.sqrt(np.mean(walks[..., 0] ** 2, axis=1))[:, None]
        parts = [_Part((k,), force[k], np.zeros((240, 0)), kept) for k in (0, 1)]
        found = Trial(*parts, quiet).proofs(lambda logs: [walks[logs[0], :, 1:]], sticking=False)
        return decoys.clearer(found).holds

    without, with_floor = (sum(is_proved(k, quiet) for k in range(16)) for quiet in (0.0, 0.04))
    assert with_floor < 0.5 * without


def test_a_strength_that_the_fit_logs_do_not_excite_stays_whatever_it_does_in_others() -> None:
    columns = np.column_stack([np.ones(4), np.zeros(4)])
    np.testing.assert_allclose(_ridge(columns), [2e-4, np.inf])
