"""The thesis's study in small: chapters run, recover what was planted, and are written."""

from __future__ import annotations

import json
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from studies.thesis import future, track
from studies.thesis.__main__ import main
from studies.thesis.mixed_friction import EQUAL, mixed, mixture
from studies.thesis.reproduction import CHAPTERS, reproduce
from studies.thesis.shared import Found, four_logs, friction_of, machine
from twin.errors import InputError
from twin.model.machine import MachineModel

BLANK = "data:image/svg+xml;base64,PHN2Zy8+"


def without_drawing() -> AbstractContextManager[object]:
    """Inside, pictures are blank: drawing them takes most of a page's time."""
    return patch("studies.drawing.data_uri", lambda figure: BLANK)


QUICK = ("simulation", "cable", "track", "dynamic", "twin")


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The quick chapters, as they are written."""
    folder = tmp_path_factory.mktemp("thesis")
    asked = [part for name in QUICK for part in ("--chapter", name)]
    with without_drawing():
        assert main(["-o", str(folder), "--small", *asked]) == 0
    return folder


@pytest.fixture(scope="module")
def chapters(written: Path) -> dict[str, Any]:
    return json.loads((written / "thesis.json").read_text())["chapters"]


@pytest.mark.slow
def test_every_mean_of_the_simulation_study_is_within_a_thousandth(chapters) -> None:
    chapter = chapters["simulation"]
    assert chapter["snr_db"] == 80.0
    for name, p in chapter["parameters"].items():
        assert p["mean"] == pytest.approx(p["true"], rel=1e-3), name
        assert p["printed"] == pytest.approx(p["true"], rel=6e-3)
    noisy = chapter["by_snr_db"]["40"]
    assert noisy["sigma2"]["sd"] > 30.0 * chapter["parameters"]["sigma2"]["sd"]


@pytest.mark.slow
def test_the_force_reacts_to_a_parameter_by_what_it_is_off(chapters) -> None:
    """Nothing at the planted value; with the viscous coefficient in proportion to the speeds."""
    found = chapters["simulation"]["sensitivity"]
    factors = np.array(found["factors"])
    np.testing.assert_allclose(factors[[0, 20, -1]], [0.5, 1.0, 1.5])
    speeds = np.abs(chapters["simulation"]["map"]["velocity"])
    expected = np.abs(factors - 1.0) * 0.018 * np.sqrt(np.mean(speeds**2))
    np.testing.assert_allclose(found["force_error"]["sigma2"], expected, atol=1e-12)
    for name in ("sigma0", "sigma1"):
        force = np.array(found["force_error"][name])
        assert np.argmin(force) == 20
        assert force[20] < 0.1 * min(force[0], force[-1])


@pytest.mark.slow
def test_the_cable_and_the_pitch_are_recovered(chapters) -> None:
    cable = chapters["cable"]
    assert cable["rms_error"] < 3e-4
    assert cable["rms_error"] < 0.4 * cable["rms_error_with_spikes"]
    assert cable["pitch"]["mean"] == pytest.approx(cable["pitch"]["true"], abs=1e-4)
    assert len(cable["spikes"]) == 8


@pytest.mark.slow
def test_levels_are_recovered_along_the_track_where_the_map_reads_them_too_low(chapters) -> None:
    chapter = chapters["track"]
    for side in ("forwards", "backwards"):
        assert chapter["fit"][side]["Fs"]["largest_error"] < 1e-3
        assert chapter["map"][side]["Fs"]["largest_error"] > 3e-3
        assert chapter["fit"][side]["Fc"]["largest_error"] < 3e-3
    ahead, back = (np.array(chapter["fit"][s]["Fs"]["found"]) for s in ("forwards", "backwards"))
    assert all(ahead > back)  # as planted: friction is lower backwards
    assert ahead[0] > ahead[1]  # and falls along the track


@pytest.mark.slow
def test_dynamic_parameters_are_found_where_the_simplex_search_from_rest_is_misled(
    chapters,
) -> None:
    chapter = chapters["dynamic"]
    for name, p in chapter["parameters"].items():
        assert p["mean"] == pytest.approx(p["true"], rel=2e-3), name
    assert abs(chapter["simplex"]["sigma0"]["error"]) > 0.01
    records = chapter["records"]
    for name in chapter["parameters"]:
        shut, opened = (records[r]["relative_half_width_90"][name] for r in records)
        assert shut > 50.0 * opened
    assert records["closed_loop"]["friction_change"] < 0.2 * records["closed_loop"]["force_noise"]
    first = chapter["position_error"]["first_period"]
    assert first["beginning_estimated"][0] < 1e-3 * first["from_rest"][0]


@pytest.mark.slow
def test_machine_and_twin_agree_and_a_changed_mass_is_named(chapters) -> None:
    chapter = chapters["twin"]
    assert chapter["alike"]["agree"]
    changed = chapter["changed"]["axes"]["x"]
    assert changed["differing"] == ["mass"]
    mass = changed["parameters"]["mass"]
    assert mass["difference"] == pytest.approx(chapter["changed"]["added_mass"], rel=0.02)
    assert "payload_mass" in [c["effect"] for c in changed["causes"]]
    loop = chapter["closed_loop_error"]["position"]
    assert loop["found"] < 1e-6
    assert loop["published_emps"] == {"run": 1.375e-4, "pulses": 8.0e-5}


@pytest.mark.slow
def test_the_report_holds_every_chapter_and_needs_nothing_else(written: Path, chapters) -> None:
    page = (written / "thesis.html").read_text()
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert all(f'id="{name}"' in page for name in QUICK)
    assert all(CHAPTERS[name].TITLE in page for name in chapters)
    assert page.count(BLANK) == 3 + 2 + 2 + 1 + 1
    assert "Simulation, parameters" in page  # a table of what was found


@pytest.mark.slow
def test_a_chapter_alone_gives_the_same_numbers_and_says_them(
    chapters, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with without_drawing():
        assert main(["--chapter", "cable", "--small", "--json", "-o", str(tmp_path)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["chapters"] == {"cable": chapters["cable"]}
    assert told["small"]
    assert told["report"] == str(tmp_path / "thesis.html")
    done = reproduce(["cable"], small=True, seed=2)
    assert done.chapters["cable"].numbers["rms_error"] != chapters["cable"]["rms_error"]
    assert str(done).startswith("cable (")
    assert "8 spikes, pitch" in str(done)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--chapter", "cables"), "unknown chapter 'cables'; did you mean 'cable'? there are mod"),
        (("--chapter", "9"), "unknown chapter '9'; there are models, simulation, cable"),
        (("--seed", "-1"), "seed -1: is not allowed"),
    ],
)
def test_bad_input_is_one_line(options, said: str, tmp_path: Path, capsys) -> None:
    assert main([*options, "-o", str(tmp_path)]) == 2
    out, err = capsys.readouterr()
    assert (out, len(err.splitlines())) == ("", 1)
    assert err.startswith(f"thesis: {said}")
    assert list(tmp_path.iterdir()) == []


# --- the longer chapters ----------------------------------------------------------------------


def small(name: str) -> Found:
    return reproduce([name], small=True).chapters[name]


@pytest.mark.slow
def test_each_law_fits_its_own_data_and_not_the_other_ones() -> None:
    found = small("models")
    ratios = found.numbers["error_over_noise_floor"]
    dry, bristles = ratios
    assert len(found.numbers["laws"]) == 2
    assert all(ratio < 1.3 for law in ratios for ratio in ratios[law][law].values() if ratio > 0)
    assert ratios[dry][bristles]["pre-sliding loops"] > 2.0  # at rest, a dry law may hold any force
    assert ratios[bristles][dry]["velocity map"] > 2.0
    assert found.numbers["by_law"][bristles]["loop_open_by"] > 1e-3
    assert found.words[0].startswith("each friction fits its own data to 0.9")


@pytest.mark.slow
def test_the_missing_memory_is_named_and_the_error_falls_to_the_noise_floor() -> None:
    chapter = small("residuals").numbers
    assert chapter["planted"] != chapter["fitted"]
    assert list(chapter["named"]) == [chapter["planted"]]
    assert chapter["test_error_before"] > 5.0 * chapter["noise_floor"]
    assert chapter["test_error_after"] < 1.2 * chapter["noise_floor"]
    assert chapter["white"] == {"before": False, "after": True}
    assert chapter["parameters"]["spread"]["mean"] == pytest.approx(10.0, rel=0.01)


@pytest.mark.slow
def test_elements_are_chosen_and_physics_beats_the_data_driven_residual() -> None:
    found = small("future")
    elements, slow = found.numbers["elements"], found.numbers["near_zero_speed"]
    assert elements["found"] == elements["planted"] == 4
    *others, physics = found.numbers["residuals"]
    assert physics["test_error"] < 1.2 * found.numbers["noise_floor"]
    assert all(b["test_error"] > 3.0 * physics["test_error"] for b in others)
    assert np.abs(slow["found"] / slow["true"] - 1.0).max() < 0.01
    assert slow["map"][0] < 0.8 * slow["true"][0]
    assert "the data choose 4 elements, the machine has 4" in found.words[0]


@pytest.mark.slow
def test_a_drift_is_detected_where_one_was_planted_and_not_otherwise() -> None:
    found = future.aging(400.0, np.random.default_rng(3))
    level = found["aging"]
    assert level["detected"]
    assert not found["without"]["detected"]
    assert np.mean(np.abs(level["found"] - level["true"]) <= level["half_width_90"]) > 0.7
    assert found["parameters"]["wear.rate"]["mean"] == pytest.approx(0.002, rel=0.1)


@pytest.mark.slow
def test_a_mixture_is_found_where_there_is_one_and_elements_do_not_stand_in() -> None:
    model, name, axis = machine("memory")
    _, _, stage = machine("proton_xy")
    made = axis.with_effect(mixed(friction_of(axis).values, friction_of(stage).values, EQUAL))
    planted = MachineModel(model.name, {name: made}, 1000.0)
    data = four_logs(planted, 20.0, np.random.default_rng(11), planted)
    found = mixture(made, *data, future.with_elements(axis, data[0], (1, 4)))
    weight, left = found["weight"], found["error_over_noise_floor"]
    assert abs(weight["found"] - weight["true"]) < 2.0 * weight["half_width_90"]
    assert left["mixed_friction"] < 1.2
    assert min(left["lugre"], left["modified_leuven"], *left["elements"].values()) > 1.8


def test_the_whole_study_is_that_of_the_thesis() -> None:
    """100 trials at 80 dB, 50 speeds, 20 reversals; 10 passes; nine places; 0.1 to 245 mm/s."""
    from studies.thesis import cable, dynamic, shared, simulation

    speeds, span, repeats, trials, ratios = simulation.WHOLE
    assert (trials, ratios[0], len(set(speeds)), repeats, span) == (100, 80.0, 50, 20, 0.2)
    assert (min(speeds), max(speeds)) == (0.001, 0.41)
    assert (cable.REPEATS, cable.SPEED, cable.SPAN) == (10, 0.1, 0.3)
    assert (dynamic.AMPLITUDE, dynamic.PERIOD) == (0.21, 3.0)
    np.testing.assert_allclose(shared.places(9), -0.136 + 0.034 * np.arange(9))
    np.testing.assert_allclose(shared.places(2), [-0.136, 0.0])
    assert (track.SPAN, min(track.SPEEDS), max(track.SPEEDS)) == (0.01, 1e-4, 0.245)
    with pytest.raises(InputError, match="unknown chapter"):
        reproduce(["all"])
