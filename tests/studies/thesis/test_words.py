"""The chapters in words: each number in its own place, and what stands out by its name."""

from __future__ import annotations

import numpy as np

from studies.thesis import cable, dynamic, models, residuals, simulation


def test_words_tell_the_number_of_their_entry() -> None:
    """Whatever is large in the numbers is said in the sentence of that matter."""
    shown = {"repeats": 7, "rms_error": 1.1e-4, "largest_error": 2.2e-4, "within_band": 0.93,
             "rms_error_with_spikes": 3.3e-3, "spikes": [1, 2, 3, 4],
             "pitch": {"mean": 0.03407, "standard_error": 1.3e-5, "true": 0.034}}  # fmt: skip
    assert cable.words(shown) == [
        "cable force from 7 passes each way: 0.00011 N RMS from the planted one, at most 0.00022 "
        "N; 93 % of it inside its 90 % band",
        "with the spikes left in, as in the thesis: 0.0033 N RMS",
        "4 spikes, pitch 34.0700 +- 0.013 mm (planted 34 mm)",
    ]
    assert "there is no pitch" in cable.words({**shown, "pitch": None})[-1]
    said = residuals.words({
        "fitted": "lugre", "planted": "gms", "named": (), "verdict": "nothing_missing",
        "test_error_before": 0.06, "test_error_after": 0.021, "noise_floor": 0.02,
        "white": {"before": False, "after": True},
    })  # fmt: skip
    assert "0.06 N, 3.0 times the noise floor, and its residual is not white" in said[0]
    assert said[1] == "the diagnosis names nothing (nothing missing)"
    assert "0.021 N, 1.05 times the noise floor, and the residual is white" in said[2]


def test_words_name_the_laws_and_parameters_that_stand_out() -> None:
    laws = ("dahl", "gms", "lugre")
    ratios = ((1.01, 5.3, 1.11), (31.0, 1.03, 2.3), (41.0, 7.1, 1.06))
    by_law = {
        law: {"loop_open_by": gap, "right_starts": right, "fit_time": 0.3, "step_time": 2e-8}
        for law, gap, right in zip(laws, (0.017, 0.0, 0.023), (1.0, 0.5, 0.75), strict=True)
    }
    said = models.words({
        "laws": laws, "by_law": by_law,
        "error_over_noise_floor": {
            machine: {law: {"map": r, "drift": np.nan} for law, r in zip(laws, row, strict=True)}
            for machine, row in zip(laws, ratios, strict=True)
        },
        "traits": {"dahl": {"drift": 9e-5}, "gms": {"drift": -2e-6}, "lugre": {"drift": 8e-5}},
    })  # fmt: skip
    assert "1.1 times the noise floor or better; the nearest other is lugre" in said[0]
    assert "a machine with gms, at 2.3 times; dahl is contained in lugre" in said[0]
    assert said[1].startswith("an inner loop stays open with dahl, lugre, so")
    assert "dahl and lugre drift, by up to 9e-05 m/s; the others by 2e-06 m/s" in said[2]
    assert "75 % end within 1.2 times the noise floor; not all do with gms, lugre" in said[3]
    found = {p: {"true": v, "mean": v, "sd": 0.0, "unit": "1", "error": e, "printed": v}
             for p, v, e in zip(simulation.PRINTED, simulation.PRINTED.values(),
                                (0, 0, -2e-3, 0, 1e-3, 0), strict=True)}  # fmt: skip
    found["sigma2"]["true"] = 0.018
    force = {p: np.array([i + 1.0]) for i, p in enumerate(("Fs", "v0", "Fc", "sigma2"))}
    said = simulation.words({"parameters": found, "trials": 9, "snr_db": 60.0,
                             "sensitivity": {"force_error": force}})  # fmt: skip
    assert "9 trials at 60 dB none is further than 0.2 % from the planted value (v0)" in said[0]
    assert said[1].endswith("sigma2 is furthest: -0.56 %")
    assert said[2].endswith("most to sigma2, least to Fs")
    assert len(said) == 3 + 6


def test_words_tell_the_largest_error_of_the_places() -> None:
    record = {"friction_change": 0.01, "force_noise": 0.05, "relative_half_width_90": {"s": 0.5}}
    errors = {"from_rest": [1e-4, 5e-4], "beginning_estimated": [3e-9, 1e-9]}
    said = dynamic.words({
        "records": {"closed_loop": record, "open_loop": {**record, "friction_change": 0.2}},
        "position_error": {"first_period": errors, "after": {k: v[:1] for k, v in errors.items()}},
        "seconds_at_a_place": {"simplex": 2.0, "fit": 0.5}, "position": [0.1, 0.2],
        "simplex": {"s": {"mean": 9.0}},
        "parameters": {"s": {"true": 2.0, "unit": "N/m", "mean": 2.1, "sd": 0.0, "error": 0.05}},
    })  # fmt: skip
    assert "90 % intervals of s +- 50 %; the open-loop sine changes it by 0.2 N" in said[0]
    assert "planted 2 N/m; simplex search from rest 9, fit of simulated motion 2.1" in said[1]
    assert "is 0.0005 m RMS off, from the estimated beginning 3e-09 m; afterwards" in said[2]
    assert "afterwards 0.0001 m and 3e-09 m (largest of 2 places)" in said[2]
    assert "takes 2 s, the fit of simulated motion with its four starts 0.5 s" in said[3]
