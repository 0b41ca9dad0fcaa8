"""The thesis's study in small: chapters run, recover what was planted, and are written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_runs import twin
from report_cases import without_drawing

import identify
from twin.errors import InputError

QUICK = ("simulation", "cable", "twin")


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("thesis")
    asked = [part for name in QUICK for part in ("--chapter", name)]
    with without_drawing():  # tests/identify/output/test_laws_thesis_pictures.py draws
        done = twin("reproduce", "-o", "out", "--small", "--json", *asked, folder=folder)
    assert done.returncode == 0, done.stderr
    (folder / "printed.json").write_text(done.stdout)
    return folder


@pytest.fixture(scope="module")
def chapters(written: Path) -> dict:
    return json.loads((written / "printed.json").read_text())["chapters"]


def test_every_mean_of_the_simulation_study_is_within_a_thousandth(chapters) -> None:
    chapter = chapters["simulation"]
    assert chapter["snr_db"] == 80.0
    for name, p in chapter["parameters"].items():
        assert p["mean"] == pytest.approx(p["true"], rel=1e-3), name
        assert p["printed"] == pytest.approx(p["true"], rel=6e-3)
    noisy = chapter["by_snr_db"]["40"]
    assert noisy["sigma2"]["sd"] > 30.0 * chapter["parameters"]["sigma2"]["sd"]


def test_the_cable_and_the_pitch_are_recovered(chapters) -> None:
    cable = chapters["cable"]
    assert cable["rms_error"] < 3e-4
    assert cable["rms_error"] < 0.4 * cable["rms_error_with_spikes"]
    assert cable["pitch"]["mean"] == pytest.approx(cable["pitch"]["true"], abs=1e-4)
    assert len(cable["spikes"]) == 8


@pytest.mark.slow
def test_the_missing_memory_is_named_and_the_error_falls_to_the_noise_floor(
    tmp_path: Path,
) -> None:
    done = twin("reproduce", "--chapter", "residuals", "--small", "--json", folder=tmp_path)
    chapter = json.loads(done.stdout)["chapters"]["residuals"]
    assert chapter["planted"] != chapter["fitted"]
    assert chapter["named"] == [chapter["planted"]]
    assert chapter["test_error_before"] > 5.0 * chapter["noise_floor"]
    assert chapter["test_error_after"] < 1.2 * chapter["noise_floor"]
    assert chapter["white"] == {"before": False, "after": True}
    assert chapter["parameters"]["spread"]["mean"] == pytest.approx(10.0, rel=0.01)


def test_machine_and_twin_agree_and_a_changed_mass_is_named(chapters) -> None:
    chapter = chapters["twin"]
    assert chapter["alike"]["agree"]
    changed = chapter["changed"]["axes"]["x"]
    assert changed["differing"] == ["mass"]
    mass = changed["parameters"]["mass"]
    assert mass["difference"] == pytest.approx(chapter["changed"]["added_mass"], rel=0.02)
    assert "payload_mass" in [c["effect"] for c in changed["causes"]]
    assert chapter["closed_loop_error"]["position"]["found"] < 1e-6


def test_the_report_holds_every_chapter_and_needs_nothing_else(written: Path, chapters) -> None:
    page = (written / "out" / "thesis.html").read_text()
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert all(f'id="{name}"' in page for name in chapters)
    kept = json.loads((written / "out" / "thesis.json").read_text())
    assert kept["chapters"].keys() == chapters.keys()


def test_a_chapter_alone_gives_the_same_numbers(chapters) -> None:
    alone = identify.reproduce(["cable"], small=True)
    assert list(alone.chapters) == ["cable"]
    assert alone.chapters["cable"].rms_error == chapters["cable"]["rms_error"]


def test_an_unknown_chapter_suggests_the_nearest() -> None:
    with pytest.raises(InputError, match="did you mean 'cable'"):
        identify.reproduce(["cables"])


def test_levels_are_recovered_along_the_track_where_the_map_reads_them_too_low() -> None:
    chapter = identify.reproduce(["track"], small=True).chapters["track"]
    for direction in (1.0, -1.0):
        assert chapter.fits[direction]["Fs"].largest_error < 1e-3
        assert chapter.maps[direction]["Fs"].largest_error > 3e-3
        assert chapter.fits[direction]["Fc"].largest_error < 3e-3
    ahead, back = (chapter.fits[way]["Fs"].found for way in (1.0, -1.0))
    assert all(ahead > back)  # as planted: friction is lower backwards
    assert ahead[0] > ahead[1]  # and falls along the track
