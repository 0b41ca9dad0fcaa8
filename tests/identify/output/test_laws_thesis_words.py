"""The reproduced study in words: each number in its own place."""

from __future__ import annotations

from dataclasses import replace

import built_chapters as made
import numpy as np
import pytest

from identify.output.words import reproduction as words
from identify.output.words.thesis_dynamic import dynamic_in_words
from identify.output.words.thesis_future import future_in_words
from identify.output.words.thesis_models import contained, models_in_words
from identify.output.words.thesis_twin import twin_in_words


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
    alike, errors, published, heavier, first, second, force, cause = twin_in_words(made.TWIN)
    assert alike == "machine and twin: axis x: the fits agree in all 3 parameters that can be " \
                    "compared"  # fmt: skip
    assert errors.endswith("position 0.0023 %, velocity 0.41 %, acceleration 11.7 %, force 5.3 %")
    assert published.startswith("published for the EMPS drive: position 0.01")
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
    elements, beside, slow, run = future_in_words(made.FUTURE)
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
