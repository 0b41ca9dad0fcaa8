"""The reproduced study as JSON and as text: each number under its own name, in its own place."""

from __future__ import annotations

import json
from dataclasses import replace

import built_chapters as made
import numpy as np
import pytest

from identify.output.plain import plain
from identify.output.reproduction import reproduction_json, reproduction_text
from identify.output.words import reproduction as words
from identify.output.words.thesis_dynamic import dynamic_in_words
from identify.output.words.thesis_future import future_in_words
from identify.output.words.thesis_models import contained, models_in_words
from identify.thesis.chapter import Recovered
from identify.thesis.chapters import Reproduction

SECONDS = {name: 1.5 + i for i, name in enumerate(made.CHAPTERS)}
ALL = Reproduction(made.CHAPTERS, SECONDS, small=True)


@pytest.fixture(scope="module")
def told() -> dict:
    return json.loads(json.dumps(plain(reproduction_json(ALL))))


def of(r: Recovered) -> dict:
    """What JSON says of a parameter, by its definition."""
    off = np.asarray(r.values) / r.true - 1.0
    return {
        "true": r.true, "mean": pytest.approx(np.mean(r.values)), "printed": r.printed,
        "sd": pytest.approx(np.std(r.values, ddof=1) if len(r.values) > 1 else 0.0),
        "unit": r.unit, "error": pytest.approx(np.mean(off)),
        "rms_error": pytest.approx(np.sqrt(np.mean(off**2))),
    }  # fmt: skip


def test_the_study_says_how_long_each_chapter_took(told) -> None:
    assert told["seconds_by_chapter"] == SECONDS
    assert told["seconds"] == pytest.approx(sum(SECONDS.values()))
    assert told["small"] is True
    lines = reproduction_text(ALL).splitlines()
    heads = [line for line in lines if not line.startswith("  ")]
    assert heads == [f"{name} ({seconds:.0f} s)" for name, seconds in SECONDS.items()]


def test_models_in_json(told) -> None:
    found, r = told["chapters"]["models"], made.MODELS
    ratios = found["error_over_noise_floor"]
    for i, machine in enumerate(r.laws):
        for j, law in enumerate(r.laws):
            row = [None if np.isnan(x) else x for x in r.ratios[i, j]]
            assert list(ratios[machine][law].values()) == row
        assert found["by_law"][machine] == {
            "right_starts": r.right[i], "starts": 8, "fit_time": r.seconds[i],
            "step_time": r.step[i], "time_unit": "s", "loop_open_by": r.loops[machine].gap,
            "nested_loops_open_by": r.nested[machine].gap, "unit": "N", "printed": None,
        }  # fmt: skip


def test_the_simulation_study_in_json(told) -> None:
    found, r = told["chapters"]["simulation"], made.SIMULATION
    assert found["by_snr_db"] == {
        f"{snr:g}": {k: of(p) for k, p in by.items()} for snr, by in r.by_snr.items()
    }
    assert found["parameters"] == found["by_snr_db"]["60"]
    assert found["sensitivity"]["force_error"]["v0"] == r.sensitivity.force["v0"].tolist()
    assert found["map"]["velocity"] == r.map.velocity.tolist()
    assert found["map"]["friction"] == r.map.friction.tolist()


@pytest.mark.parametrize("result", [made.CABLE, made.CABLE_OF_LOGS])
def test_the_cable_in_json(result) -> None:
    found = reproduction_json(Reproduction({"cable": result}, {"cable": 1.0}, False))
    told, c = found["chapters"]["cable"], made.CABLE_FOUND
    for key, values in (("position", c.position), ("found", c.force), ("band_90", c.band),
                        ("with_spikes", c.with_all)):  # fmt: skip
        assert told[key] == values.tolist()
    assert told["spikes"][1] == {"centre": -0.0227, "width": 0.0019, "ahead": 0.023,
                                 "behind": -0.013}  # fmt: skip
    assert told["pitch"]["standard_error"] == 1.3e-5
    planted = result is made.CABLE
    assert told["repeats"] == (5 if planted else 3)
    assert told["true"] == (made.CABLE.planted.tolist() if planted else None)
    if planted:
        off = c.force - made.CABLE.planted
        assert told["largest_error"] == pytest.approx(np.abs(off).max())
        assert told["rms_error_with_spikes"] == pytest.approx(
            np.sqrt(np.mean((c.with_all - made.CABLE.planted) ** 2))
        )
        assert told["pitch"]["mean"] == pytest.approx(0.034 * 1.002)
    else:
        assert told["pitch"]["mean"] == 0.03407


def test_the_track_in_json(told) -> None:
    found = told["chapters"]["track"]
    for way, by in (("map", made.TRACK.maps), ("fit", made.TRACK.fits)):
        for side, direction in (("forwards", 1.0), ("backwards", -1.0)):
            for name, a in by[direction].items():
                off = np.abs(a.found - a.planted)
                assert found[way][side][name] == {
                    "true": a.planted.tolist(), "found": a.found.tolist(),
                    "half_width_90": a.half.tolist(), "unit": made.UNITS[name], "printed": None,
                    "within": np.mean(off <= a.half),
                    "largest_error": pytest.approx((off / a.planted).max()),
                }  # fmt: skip
                assert found[way][side][name]["within"] == pytest.approx(0.6)


def test_the_dynamic_part_in_json(told) -> None:
    found, r = told["chapters"]["dynamic"], made.DYNAMIC
    for key, record in (("closed_loop", r.closed), ("open_loop", r.opened)):
        assert found["records"][key] == {
            "friction_change": record.friction, "force_noise": record.noise, "unit": "N",
            "relative_half_width_90": record.half_widths, "found_over_true": record.found,
        }  # fmt: skip
    assert found["simplex"] == {k: of(p) for k, p in r.simplex.items()}
    assert found["parameters"] == {k: of(p) for k, p in r.fitted.items()}
    assert found["seconds_at_a_place"] == {"simplex": 3.7, "fit": 0.19}
    assert found["position_error"] == {
        "first_period": {"from_rest": [5.1e-4, 4.7e-4], "beginning_estimated": [1.3e-8, 1.7e-8]},
        "after": {"from_rest": [3.1e-5, 3.7e-5], "beginning_estimated": [2.3e-9, 1.9e-9]},
    }


def test_residuals_and_future_work_in_json(told) -> None:
    found, r = told["chapters"]["residuals"], made.RESIDUALS
    assert (found["fitted"], found["planted"], found["named"]) == ("lugre", "gms", ["gms"])
    assert (found["test_error_before"], found["test_error_after"]) == (0.0431, 0.00219)
    assert found["noise_floor"] == 0.00207
    assert found["ranking"][2] == {
        "effect": "effect_2", "delta_bic": pytest.approx(100 / 3), "error_over_noise_floor": 3.13
    }  # fmt: skip
    for name, tests in (("before", r.before), ("after", r.after)):
        assert found["outside_90_bounds"][name] == {c.signal: c.outside for c in tests.correlations}
    future, f = told["chapters"]["future"], made.FUTURE
    assert (future["elements"]["planted"], future["elements"]["found"]) == (4, 4)
    assert future["elements"]["tried"][2] == {
        "elements": 6, "delta_bic": 871.0, "error_over_noise_floor": 1.11
    }  # fmt: skip
    assert future["residuals"][1] == {
        "model": "empirical_map", "parameters_added": 31, "holdout_error": 0.0279,
        "test_error": 0.0291,
    }  # fmt: skip
    slow = future["near_zero_speed"]
    assert [slow[k][0] for k in ("velocity", "true", "map", "found")] == [1e-4, 0.41, 0.23, 0.4105]
    for key, drift, seen in (("aging", f.aging.level, True), ("without", f.aging.steady, False)):
        run = future["long_run"][key]
        assert [run[k] for k in ("distance", "true", "found", "half_width_90")] == [
            x.tolist() for x in (drift.distance, drift.truth, drift.found, drift.half)
        ]
        assert (run["slope"], run["slope_standard_error"]) == drift.slope
        assert (run["slope_unit"], run["detected"]) == ("N/m", seen)


def test_the_twin_in_json(told) -> None:
    found = told["chapters"]["twin"]
    assert (found["alike"]["agree"], found["changed"]["agree"]) == (True, False)
    assert found["changed"]["added_mass"] == 0.153
    assert found["changed"]["axes"]["x"]["differing"] == ["p0", "p2"]
    assert found["closed_loop_error"]["velocity"] == {"found": 4.1e-3, "unit": "1"}


# --- text ----------------------------------------------------------------------------------


def test_one_parameter_in_words() -> None:
    r = made.recovered("N", 0.01, 0.03, true=2.0, printed=2.1)
    said = words.recovered_in_words("Fc", r)
    assert said == "Fc: planted 2 N, found 2.04 +- 0.03 (+2.0000 %), thesis 2.1"
    assert "thesis" not in words.recovered_in_words("Fc", replace(r, printed=None))


@pytest.mark.parametrize(("off", "said"), [
    (0.9e-3, "Every mean is within 0.1 %"), (-0.9e-3, "Every mean is within 0.1 %"),
    (1.1e-3, "The mean of Fs is more than 0.1 %"), (-1.1e-3, "The mean of Fs is more than 0.1 %"),
])  # fmt: skip
def test_a_mean_may_be_off_by_a_thousandth(off, said) -> None:
    found = {"Fc": made.recovered("N", 0.5e-3), "Fs": made.recovered("N", off)}
    result = replace(made.SIMULATION, by_snr={80.0: found})
    assert words.simulation_headline(result).startswith(said)
    assert words.worst(result)[0] == "Fs"


def test_the_simulation_study_in_words() -> None:
    of_trials, printed, reacts = words.simulation_in_words(made.SIMULATION)
    assert of_trials.endswith("3 % from the planted value (v0)")
    assert "2 trials at 60 dB" in of_trials
    assert printed.endswith("v0 is furthest: +3.00 %")
    force = {"Fc": 0.3, "Fs": 0.9, "v0": 0.1, "sigma2": 0.5, "sigma0": 9.0, "sigma1": 0.01}
    bent = replace(
        made.SIMULATION.sensitivity, force={k: np.array([0.0, f]) for k, f in force.items()}
    )
    assert words.reactions(replace(made.SIMULATION, sensitivity=bent)) == ("Fs", "v0")
    assert reacts.startswith("of the static parameters")


def test_the_cable_in_words() -> None:
    force, spikes, pitch = words.cable_in_words(made.CABLE)
    assert force.startswith("cable force from 5 passes each way: 0.21 N RMS")
    assert "at most 0.4 N; 56 % of it" in force
    assert spikes.startswith("with the spikes left in")
    assert pitch == "2 spikes, pitch 34.0680 +- 0.013 mm (planted 34 mm)"
    without = replace(made.CABLE, pitch=None)
    assert words.cable_in_words(without)[2].startswith("fewer than three spikes")
    none = replace(made.CABLE_FOUND, pitch=None)
    assert words.cable_in_words(replace(made.CABLE, found=none))[2].startswith("fewer than three")
    assert words.cable_of_logs_in_words(replace(made.CABLE_OF_LOGS, found=none))[1].startswith(
        "fewer than three"
    )
    c = made.CABLE_FOUND
    passes, pitch = words.cable_of_logs_in_words(made.CABLE_OF_LOGS)
    assert f"{c.force.min():.4g} to {c.force.max():.4g} N" in passes
    assert f"+- {np.median(c.band):.2g} N (median)" in passes
    assert pitch == "2 spikes, pitch 34.0700 +- 0.013 mm (the thesis's stage: 34 mm)"


def test_the_track_in_words() -> None:
    said = words.track_in_words(made.TRACK)
    for line, way, name, off in zip(
        said, ("map", "map", "fit", "fit"), ("Fc", "Fs", "Fc", "Fs"), ("5", "6", "0.5", "0.6"),
        strict=False,
    ):  # fmt: skip
        assert way in line
        assert f" {name} is within {off} %" in line
        assert "at 5 places; 60 % of the 90 % intervals" in line


@pytest.mark.parametrize(("slope", "said"), [(2.0, "a trend"), (-2.0, "a trend"), (0.02, "no")])
def test_a_trend_along_the_track_is_three_times_its_scatter(slope, said) -> None:
    scatter = 0.01 * np.array([1.0, -1.0, 0.5, -1.2, 0.9])
    found = 1.0 + slope * made.PLACES + scatter
    line = replace(made.TRACK.fits[1.0]["v0"], found=found)
    (expected, _), spread = np.polyfit(made.PLACES, found, 1, cov=True)
    assert words.trend(made.PLACES, line) == pytest.approx((expected, spread[0, 0] ** 0.5))
    fits = {way: {**by, "v0": line} for way, by in made.TRACK.fits.items()}
    told = words.track_in_words(replace(made.TRACK, fits=fits))
    assert f"along the track v0 shows {said}" in told[4]
    few = replace(line, found=found[:3])
    assert words.trend(made.PLACES[:3], few) == (0.0, 1.0)


def test_what_the_residual_tests_say_in_words() -> None:
    with_first, named, with_it = words.residuals_in_words(made.RESIDUALS)
    assert "with lugre fitted to a machine with gms the test error is 0.0431 N" in with_first
    assert "20.8 times the noise floor" in with_first
    assert named == f"the diagnosis names gms ({made.RESIDUALS.verdict.value})"
    assert "0.00219 N, 1.06 times" in with_it
    assert with_first.endswith("its residual is not white")
    assert with_it.endswith("the residual is white")
    assert "nothing" in words.residuals_in_words(replace(made.RESIDUALS, named=()))[1]


def test_the_twin_in_words() -> None:
    alike, errors, heavier, first, second, force, cause = words.twin_in_words(made.TWIN)
    assert alike == "machine and twin: axis x: the fits agree in all 3 parameters that can be " \
                    "compared"  # fmt: skip
    assert errors.endswith("position 0.0023 %, velocity 0.41 %")
    assert heavier.startswith("the machine with 0.153 kg more: axis x: the fits differ in 2 of 3")
    assert first.startswith("p0 differs by 1.1 kg (2 and 3.1 kg), 11.0 joint standard errors")
    assert second.startswith("p2 differs by -0.564 N s/m")
    assert "0.0139 N RMS" in force
    assert cause.startswith("payload_mass would make 93 %")


def test_the_dynamic_part_in_words() -> None:
    records, stiff, damped, first, time = dynamic_in_words(made.DYNAMIC)
    shut, opened = records.split("; the open-loop")
    assert "change the friction by 0.012 N" in shut
    assert "force is 0.046 N: 90 % intervals of sigma0 +- 310 %, sigma1 +- 770 %" in shut
    assert opened == " sine changes it by 0.21 N: sigma0 +- 1.3 %, sigma1 +- 2.9 %"
    assert stiff == (
        "sigma0: planted 260 N/m; simplex search from rest 265.2, fit of simulated motion 260.13 "
        "+- 0.6 (+0.050 %)"
    )
    assert damped.startswith("sigma1: planted 0.6 N s/m; simplex search from rest 1.02")
    assert "from rest is 0.00051 m RMS off, from the estimated beginning 1.7e-08 m" in first
    assert first.endswith("afterwards 3.7e-05 m and 2.3e-09 m (largest of 2 places)")
    assert "simplex search takes 3.7 s" in time
    assert "four starts 0.19 s" in time


def test_future_work_in_words() -> None:
    elements, beside, slow, run, _ = future_in_words(made.FUTURE)
    assert elements.startswith("the data choose 4 elements, the machine has 4; ")
    assert elements.endswith("1.07 times the noise floor")
    assert beside == (
        "on the test log lugre leaves 0.0437 N, with empirical map 0.0291 N, with learned residual "
        "0.0267 N, gms 0.00227 N (noise floor 0.00211 N)"
    )
    assert "(0.0001 to 0.001 m/s)" in slow
    assert "the map is up to 44 % off" in slow
    assert slow.endswith("the whole law fitted to the same moves 0.28 %")
    assert run.startswith("over 9.3 m the dry friction of the machine that ages drifts in")
    assert "0.0021 +- 0.0002 N/m" in run
    assert "without aging it does not drift in its second half: 0.0003 +- 0.0004" in run


@pytest.mark.parametrize(
    ("slope", "seen"), [(2.9, False), (3.1, True), (-2.9, False), (-3.1, True)]
)
def test_a_drift_is_three_standard_errors(slope, seen) -> None:
    assert replace(made.FUTURE.aging.level, slope=(0.02 * slope, 0.02)).detected is seen


def test_models_in_words() -> None:
    assert contained(made.MODELS) == [("dahl", "lugre")]
    fits, loops, starts, time = models_in_words(made.MODELS)
    assert "own data to 1.1 times" in fits
    assert "the nearest other is lugre for a machine with gms, at 2.7 times" in fits
    assert fits.endswith("dahl is contained in lugre, which fits as well")
    assert "stays open with dahl, lugre, so these forget" in loops
    assert "71 % end within 1.2 times" in starts
    assert starts.endswith("not all do with gms, lugre")
    assert "0.31 to 0.62 s of CPU time, a step of a law 21 to 53 ns" in time
