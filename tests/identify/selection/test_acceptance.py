"""Laws of the acceptance test and of its controls, on residuals of which the answer is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from built_fits import (
    FRICTION,
    PLAIN,
    axis_of,
    built_dataset,
    built_fit,
    built_machine,
    dataset_stub,
    fitted,
)
from constructed import log_of
from linear_cases import cut
from machines import CATALOGUE

from identify.dataset.dataset import Dataset, Role
from identify.dataset.motion import motion_of
from identify.dataset.prepared_log import PreparedLog, split_by_log, sticks
from identify.estimation.errors import Errors
from identify.estimation.evidence import BLOCKS
from identify.estimation.fit import fit_axis
from identify.estimation.force_balance import jacobian
from identify.estimation.least_squares import unabsorbed
from identify.estimation.variable_projection import tried_shapes
from identify.output.words.refusal import refusal_in_words
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
from identify.selection.controls import Columns, ControlTest, change_control, with_unit_penalty
from identify.selection.refusal import ByChance, TakesLittle, Uncertain
from identify.selection.trying import reshape, try_effect
from twin.effect import Effect, Excitation, Kind
from twin.errors import InputError
from twin.model.machine import AxisModel, Fitted
from twin.model.parameters import ParameterReference, free_parameters

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
    assert Score(found, found).refused == Uncertain(found.t, least_t(1))


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
    refused = Score(found, found).refused
    assert refused == TakesLittle(found.part)
    assert refusal_in_words(refused) == "takes 0 % of what is left"


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
    assert Score(sure, sure, control=0.55).refused == ByChance(0.55)


def test_of_many_changes_the_best_must_be_surer() -> None:
    """One in twenty of them would be sure by chance."""
    found = Taken(2.0, 0.5, 0.5)
    assert Score(found, found).accepted
    assert isinstance(Score(found, found, among=30).refused, Uncertain)
    asked = [least_t(among) for among in (1, 3, 10, 30, 100)]
    assert asked == sorted(asked)
    assert 1.5 < asked[0] < asked[-1] < 4.0


MANY = axis_of(*(fitted(n) for n in ("cogging", "roller_spikes", "spring", "quadratic_drag")))


def fitted_to_noise(seed: int) -> Score:
    """The score of as many columns of noise as the added effects have."""
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


# Controls over the whole catalogue: what is planted passes, and its control leaves clearly more.
#
# A control that spans what it controls, as a constant shifted in time does, would refuse the truth;
# one that takes nothing would let anything pass.


RATE = 1000.0  # Hz
CLEARLY = 0.8  # of what a control leaves, at most, that the truth leaves
SIZE = 0.05  # N RMS beside what the base takes, 50 times the noise
SEEN = Excitation(-0.05, 0.05, 0.3, 0.3, 3.0, 1.0 / RATE)
STICKY = Fitted.at_start(CATALOGUE["lugre"])
PHYSICAL = [
    e
    for e in CATALOGUE.values()
    if e.strengths and not (e.is_nonparametric or e.is_noise or e.of_joints or e.channels)
]
FRICTIONS = [e for e in PHYSICAL if e.kind is Kind.FRICTION]
OTHERS = [e for e in PHYSICAL if e.kind is not Kind.FRICTION]
AXES = (
    replace(PLAIN, mass_fixed=True),
    replace(PLAIN, rotary=True),
    replace(PLAIN, effects=()),
    *(PLAIN.with_effect(Fitted.at_start(CATALOGUE[n])) for n in ("cable_slab", "cable_hysteresis")),
)  # each effect can be had on one of them


def prepared(name: str, seed: int) -> PreparedLog:
    """Four seconds of smooth moves that pause, of both axes."""
    rng = np.random.default_rng(seed)
    t = np.arange(4000) / RATE
    pace = np.clip(0.6 + 1.2 * np.sin(2.0 * np.pi * 0.8 * t + rng.uniform(0.0, 6.0)), 0.0, 1.0)
    pace = np.convolve(pace, np.hanning(100) / np.hanning(100).sum(), "same")
    s, phase = np.cumsum(pace) / RATE, rng.uniform(0.0, 6.0, 3)
    x = 0.035 * np.sin(2.0 * np.pi * 0.7 * s + phase[0]) + 0.01 * np.sin(15.0 * s + phase[1])
    a = np.gradient(np.gradient(x)) * RATE**2
    u = 5.3 * a + 0.02 * rng.standard_normal(len(t))
    other = 0.03 * np.sin(2.0 * np.pi * 1.1 * t + phase[2])
    return PreparedLog.of(motion_of(log_of(RATE, x, u, other), "x", name), 0.04)


@cache
def logs() -> Dataset:
    return Dataset("x", (prepared("one", 1),), (prepared("two", 2),), lambda: SEEN)


def axis_for(effect: Effect) -> AxisModel:
    """The first axis that can have it; what friction has at rest needs one that sticks."""
    if effect.name == "dwell_stiction":
        return replace(AXES[0], effects=(STICKY,))
    having = (a for a in AXES if a.can_have(effect) and effect.name not in a.names)
    return next(a for a in having if a.effects or effect.kind is not Kind.MODIFIER)


@dataclass(frozen=True, eq=False)
class Planted:
    """A fit of the base to logs that have an effect's force, and the effect's columns."""

    judged: Judged
    columns: Columns
    sticking: bool

    @property
    def part(self) -> float:
        return ControlTest.beside(self.judged).part(self.columns, sticking=self.sticking)

    @property
    def control(self) -> float:
        return ControlTest.beside(self.judged).control(self.columns, sticking=self.sticking)


def planted(effect: Effect, size: float = SIZE) -> Planted:
    """With the effect's own force at the middle one of its start shapes."""
    base = axis_for(effect)
    honest = built_machine(logs(), base)
    fit = fit_axis(base, honest.training)
    places = np.concatenate([log.motion.position for log in honest.training])
    seen = replace(SEEN, position_low=float(places.min()), position_high=float(places.max()))
    shapes = list(tried_shapes(effect, seen))
    axis = fit.axis.with_effect(Fitted.at_start(effect, shapes[len(shapes) // 2]))
    where = [ParameterReference(effect.name, p) for p in effect.strengths]

    def columns(logs: Sequence[PreparedLog]) -> list[np.ndarray]:
        return split_by_log(jacobian(axis, logs, where), logs)

    own = np.concatenate(columns(honest.training))[fit.kept]
    sizes = np.linalg.norm(own, axis=0)
    assert sizes.any(), "its columns are nothing on these logs"
    strengths = np.random.default_rng(3).uniform(0.5, 1.0, len(where)) / np.maximum(sizes, 1e-12)
    shown = unabsorbed(own @ strengths, fit.basis)
    strengths *= size / np.sqrt(np.mean(shown**2))

    def having(logs: tuple[PreparedLog, ...]) -> tuple[PreparedLog, ...]:
        pairs = zip(logs, columns(logs), strict=True)
        return tuple(replace(log, command=log.command - c @ strengths) for log, c in pairs)

    dataset = replace(honest, training=having(honest.training), selection=having(honest.selection))
    judged = Judged(fit_axis(base, dataset.training), dataset)
    return Planted(judged, with_unit_penalty(columns, judged.fit), sticks(axis))


def beside(control: float) -> float:
    """What is left that is clearly less than what a control leaves."""
    return CLEARLY * (1.0 - control)


@pytest.mark.short(10)
@pytest.mark.parametrize("effect", OTHERS, ids=lambda e: e.name)
def test_what_is_planted_passes_and_its_control_leaves_clearly_more(effect: Effect) -> None:
    found = planted(effect)
    assert found.part > 0.95
    assert 1.0 - found.part < beside(found.control)


@pytest.mark.short(10)
@pytest.mark.parametrize("effect", OTHERS, ids=lambda e: e.name)
def test_of_noise_an_effect_takes_next_to_nothing(effect: Effect) -> None:
    found = planted(effect, 0.0)
    assert abs(found.part) < 0.05


def test_a_selection_log_of_fewer_test_functions_than_blocks_has_controls() -> None:
    found = planted(CATALOGUE["cogging"])
    (log,) = found.judged.dataset.selection
    short = PreparedLog.of(log.motion.head(0.2), 0.04)
    judged = replace(found.judged, dataset=replace(found.judged.dataset, selection=(short,)))
    assert len(short) < 24
    assert np.isfinite(replace(found, judged=judged).control)


@pytest.mark.parametrize("effect", FRICTIONS, ids=lambda e: e.name)
def test_a_planted_friction_passes_beside_another_by_what_it_changes(effect: Effect) -> None:
    """It has no columns of its own."""
    other = STICKY if effect.name == "coulomb_viscous" else FRICTION
    true, base = (replace(AXES[0], effects=(f,)) for f in (Fitted.at_start(effect), other))
    dataset = built_machine(logs(), true)
    before, after = (Judged(fit_axis(axis, dataset.training), dataset) for axis in (base, true))
    found = score(before, after, change_control(before, after))
    assert found.part > 0.95
    assert found.accepted
    assert 1.0 - found.part < beside(found.control)


# A change that somebody asks for is judged as the search judges it, and refused in words


DRAWN = built_dataset("run 1", "run 2", held=("held 1",))


def test_an_effect_that_is_there_is_proved_and_one_that_is_not_is_refused() -> None:
    machine = built_machine(DRAWN, axis_of(fitted("cogging", p=0.02, a1=0.4)))
    base = fit_axis(axis_of(), machine.training)
    there = try_effect(base, machine, CATALOGUE["cogging"])
    assert (there.supported, there.refused) == (True, None)
    assert there.part > 0.9
    assert there.score.control < there.part
    assert there.fit.axis["cogging"].values["p"] == pytest.approx(0.02, rel=0.01)
    absent = try_effect(base, machine, CATALOGUE["quadratic_drag"])
    assert not absent.supported
    assert absent.refused
    assert "quadratic_drag" in absent.fit.axis.names, "it is refitted, as was asked for"


def test_a_law_of_another_shape_is_given_the_one_that_the_logs_show() -> None:
    def bumps(position, direction):
        return 0.3 * np.sign(np.sin(2.0 * np.pi * position / 0.02))

    machine = built_machine(DRAWN, axis_of(), bumps)
    smooth = axis_of(fitted("cogging", p=0.02, a1=0.4))
    fit = fit_axis(smooth, machine.training)
    found, change = reshape(CATALOGUE["cogging"], {"x": fit}, {"x": machine})
    assert change.name == "cogging"
    assert found.fit.error < 0.7 * fit.error
    with pytest.raises(InputError, match="show no other shape of"):
        reshape(CATALOGUE["cogging"], {}, {})


# Shares of what was found


def test_a_share_is_of_the_squared_error_above_the_noise_floor():
    fall = Errors(0.6, 0.4, Role.TRAINING)
    assert fall.share_of(0.7, 0.3) == pytest.approx((0.6**2 - 0.4**2) / (0.7**2 - 0.3**2))
    # Without one of several effects a fit may leave more than the base did.
    more = Errors(0.9, 0.5, Role.TRAINING)
    assert more.share_of(0.7, 0.3) == pytest.approx((0.9**2 - 0.5**2) / (0.9**2 - 0.3**2))
    assert replace(more, after=0.1).share_of(0.7, 0.3) == 1.0
    assert fall.share_of(0.7, 0.8) == 0.0  # at the floor nothing is left to share
