"""The chapters in words: each number in its own place, and what stands out by its name."""

from __future__ import annotations

from studies.thesis import cable, dynamic, residuals


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
