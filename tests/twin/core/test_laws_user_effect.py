"""How a user's law is tried: with samples as a simulation gives them, and guarded arrays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from twin.core import user_effect
from twin.core.user_effect import MOTIONS, PERIOD, SPEEDS, Guarded, Outside, require_sound
from twin.effect import (
    ACC,
    DRY,
    DT,
    HOLD,
    INDEX,
    IO_SIZE,
    MASS,
    MOVED,
    NET,
    OUT,
    READING,
    STATIC,
    TIME,
    VISCOUS,
    WHEN,
    Effect,
    Kind,
    Parameter,
    U,
    V,
    X,
)
from twin.errors import InputError

FILE = Path("mine.py")


@pytest.fixture(autouse=True)
def not_compiled(monkeypatch):
    """What is tried here is tried in plain Python, before anything is compiled."""
    monkeypatch.setattr(user_effect, "law_address", lambda effect: 0)


def effect_of(law, *states: str, start: float = 0.0, upper: float = 1e3) -> Effect:
    return Effect(
        kind=Kind.FORCE, summary="s", equation="F = c", source="none", law=law, fingerprint="none",
        excited_by="none", states=states,
        parameters=(Parameter("c", "N", start, 0.0, upper, "force", strength=True),),
    )  # fmt: skip


def samples(states: int = 0) -> list[dict[int, float]]:
    """All that a law is tried with."""
    seen: list[dict[int, float]] = []

    def law(p, s, io):
        seen.append(dict(enumerate(io)))
        assert p[0] == 0.1  # a strength that is absent at the start is made present
        io[OUT] = p[0]

    require_sound(effect_of(law), FILE)
    return seen


def test_a_law_is_tried_at_speeds_with_every_slot_as_in_a_simulation():
    first = samples()[: len(SPEEDS)]
    assert tuple(io[V] for io in first) == SPEEDS
    assert 0.0 in SPEEDS
    for io in first:
        assert io[DT] == PERIOD
        ones = (MASS, MOVED, WHEN, U, DRY, STATIC, VISCOUS, NET, ACC)
        assert {io[i] for i in ones} == {1.0}
        assert io[READING] == io[X] != 0.0
        # what would stop the axis within this sample, beside its command
        assert io[HOLD] == pytest.approx(io[V] / PERIOD + io[U])


def test_and_along_motions_of_all_sizes_both_ways():
    later = samples()[len(SPEEDS) :]
    assert len(later) == MOTIONS
    for k, io in enumerate(later):
        assert io[INDEX] == k
        assert io[TIME] == pytest.approx(k * PERIOD)
        assert (io[DT], io[MASS], io[MOVED], io[WHEN]) == (PERIOD, 1.0, 1.0, 1.0)
    for slot in (X, V, U):
        values = np.array([io[slot] for io in later])
        assert (values > 0.0).any()
        assert (values < 0.0).any()
        assert 1.0 < np.abs(values).max() <= 10.0
        assert np.abs(values).min() < 1e-4


@pytest.mark.parametrize(("start", "upper", "tried"), [(0.0, 1e3, 0.1), (0.0, 0.03, 0.03),
                                                       (0.7, 1e3, 0.7)])  # fmt: skip
def test_a_strength_is_tried_where_it_acts(start, upper, tried):
    seen = []

    def law(p, s, io):
        seen.append(p[0])
        io[OUT] = p[0]

    require_sound(effect_of(law, start=start, upper=upper), FILE)
    assert set(seen) == {tried}


def test_states_go_on_from_sample_to_sample_and_begin_anew_behind_an_overflow():
    seen = []

    def law(p, s, io):
        seen.append(s[0])
        s[0] += 1.0
        if s[0] == 50.0:
            raise OverflowError("beyond any machine")
        io[OUT] = p[0]

    require_sound(effect_of(law, "own"), FILE)
    assert seen[: len(SPEEDS) + 1] == [*range(len(SPEEDS)), 0]
    assert seen[len(SPEEDS) :][:52] == [*range(50), 0, 1]


@pytest.mark.parametrize("index", [-1, 3, 10**9])
def test_an_index_beyond_an_array_is_told_reading_or_writing(index):
    guarded = Guarded("p", [1.0, 2.0, 3.0])
    assert guarded[2] == 3.0
    guarded[0] = 7
    assert guarded[0] == 7.0
    for touch in (lambda: guarded[index], lambda: guarded.__setitem__(index, 1.0)):
        with pytest.raises(Outside, match=rf"^p\[{index}\]$"):
            touch()


def test_what_a_law_may_not_do_is_one_line_with_the_file():
    def far(p, s, io):
        io[OUT] = p[0] + (s[0] if abs(io[X]) > 5.0 else 0.0)

    def divided(p, s, io):
        io[OUT] = p[0] / io[V]

    def endless(p, s, io):
        io[OUT] = p[0] * 1e308 * 1e308

    def silent(p, s, io):
        p[0]

    def unknown(p, s, io):
        io[OUT] = missing  # noqa: F821

    for law, said in (
        (far, r"at x = -?[5-9]\S* m its law uses s\[0\], but 0 states"),
        (divided, "no finite number at v = 0 m/s .float division by zero"),
        (endless, r"no finite number at v = \S+ m/s .the result is not a finite number"),
        (silent, "writes no result; a force effect writes"),
        (unknown, "fails at v = .* m/s: NameError"),
    ):
        with pytest.raises(InputError, match=rf"^mine.py: .*{said}") as told:
            require_sound(effect_of(law), FILE)
        assert "\n" not in str(told.value)
    assert f"it has {IO_SIZE} slots" in user_effect.outside_words(effect_of(far), "io[99]")
    assert "1 parameters are declared" in user_effect.outside_words(effect_of(far), "p[7]")
