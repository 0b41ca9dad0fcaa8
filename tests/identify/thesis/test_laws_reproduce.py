"""How a chapter is run: in the size asked for, with draws of its own, on logs where it can."""

from __future__ import annotations

import pytest
from built_fits import CATALOGUE

from identify.thesis import chapters
from identify.thesis.chapter import Chapter
from twin.errors import InputError
from twin.model.file import load_model


def silent(*_) -> None:
    """No progress."""


@pytest.fixture
def told(monkeypatch):
    """Two chapters that say with what they were run; the second runs on logs too."""

    def run(models, catalogue, size, rng, progress):
        return [m.name for m in models], size, float(rng.uniform())

    known = {
        "one": Chapter(("thesis_track",), "full", "small", run),
        "two": Chapter(("thesis_aging",), "full", "small", run, lambda model, logs: (model, logs)),
    }
    monkeypatch.setattr(chapters, "CHAPTERS", known)


def test_a_chapter_is_run_in_the_size_asked_for_and_draws_for_itself(told):
    both = chapters.reproduce(CATALOGUE, progress=silent)
    assert list(both.chapters) == ["one", "two"] == list(both.seconds)
    assert [r[:2] for r in both.chapters.values()] == [
        ([load_model(name, CATALOGUE).name], "full") for name in ("thesis_track", "thesis_aging")
    ]
    one, two = (r[2] for r in both.chapters.values())
    assert one != two
    alone = chapters.reproduce(CATALOGUE, ["two"], small=True, progress=silent)
    assert alone.chapters == {"two": (both.chapters["two"][0], "small", two)}
    assert (both.small, alone.small) == (False, True)
    other = chapters.reproduce(CATALOGUE, ["two"], seed=2, progress=silent)
    assert other.chapters["two"][2] != two
    assert repr(both) == "<Reproduction of one, two>"


def test_chapters_on_logs_are_those_that_need_no_twin(told):
    assert chapters.reproduce_on_logs([], "model", "logs").chapters == {"two": ("model", "logs")}
    assert not chapters.reproduce_on_logs(["two"], "model", "logs").small
    with pytest.raises(InputError, match=r"chapter 'one' needs the twin.*there is two"):
        chapters.reproduce_on_logs(["one"], "model", "logs")
    with pytest.raises(InputError, match="unknown chapter 'tow'; did you mean 'two'"):
        chapters.reproduce_on_logs(["tow"], "model", "logs")
    with pytest.raises(InputError, match="unknown chapter '9'; there are one, two"):
        chapters.reproduce(CATALOGUE, ["9"], progress=silent)
