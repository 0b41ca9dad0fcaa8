"""Sentences that few results have, of made-up numbers that are all different."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import built_results as made
import numpy as np
import pytest
from built_fits import built_fit, known_floor

from identify.analysis.motor_rotor import RotorBeforeGear
from identify.analysis.recording import Recording
from identify.dataset.odd_log import Disagreement, Otherwise, Recorded
from identify.estimation.found_shape import FoundCurve, FoundShape
from identify.estimation.intervals import Inseparable, OpenSided, Side
from identify.experiment_design.missing_excitation import Gap
from identify.output.words import fit, fleet, next_step
from identify.output.words.findings import role_in_words, shape_in_words
from identify.output.words.first_look import first_look_in_words
from identify.output.words.next_step import UNKNOWN, WRITE, Source
from identify.output.words.odd import odd_in_words, with_odd
from identify.output.words.recording import (
    read_otherwise_in_words,
    recording_in_words,
    rotor_in_words,
)
from identify.output.words.refusal import refusal_in_words
from identify.output.words.verdict import headline_in_words, verdict_in_words
from identify.results.fleet import Ingested, KindParameter
from identify.selection.diagnosis import Verdict
from identify.selection.findings import FindingKind
from identify.selection.first_look import Likely
from identify.selection.refusal import (
    ByChance,
    EndsAtBound,
    Instead,
    OutsideKnee,
    Refusal,
    TakesLittle,
    Uncertain,
)
from identify.selection.roles import RoleDependent
from identify.validation.misfit_maps import Region
from twin.checks import CheckReport, Fault
from twin.curve import Coordinate
from twin.knee import Imitated
from twin.model.units import LINEAR, ROTARY


@pytest.mark.parametrize(
    ("reason", "said"),
    [
        (TakesLittle(0.042), "takes 4 % of what is left"),
        (TakesLittle(-0.2), "takes 0 % of what is left"),
        (Uncertain(1.234, 2.345), "gain uncertain: t = 1.2, where 2.3 is sure"),
        (ByChance(0.31), "shifted in time, where it cannot be real, it takes 31 %"),
        (EndsAtBound(("a",)), "a ends at a bound"),
        (EndsAtBound(("a", "b")), "a and b end at a bound"),
        (
            OutsideKnee("reach", 0.0123, 0.0456, "m", Imitated.SPRING),
            "its reach of 0.0123 m is below 0.0456 m, so that it is a spring here",
        ),
        (
            OutsideKnee("limit", 7.1, 3.2, "1", Imitated.NOTHING),
            "its limit of 7.1 is beyond 3.2, so that it is nothing here",
        ),
        (
            OutsideKnee("play", 1.2341, 1.2342, "m", Imitated.GAIN),
            "its play is below 1.23 m, so that it is a gain of the motor here",
        ),
    ],
)
def test_why_a_change_is_not_proved_is_said_with_its_numbers(reason: Refusal, said: str) -> None:
    assert refusal_in_words(reason) == said


def test_each_reason_that_has_no_number_is_said_in_words_of_its_own() -> None:
    told = {refusal_in_words(reason) for reason in Instead}
    assert len(told) == len(Instead)
    assert all(text[0].islower() and not text.endswith(".") for text in told)


ODD = Disagreement("run 2", error=0.83, others=0.21)


def otherwise(what: str | Recorded, there: float, elsewhere: float = 0.0) -> Disagreement:
    return replace(ODD, otherwise=Otherwise(what, there, elsewhere))


@pytest.mark.parametrize(
    ("odd", "said"),
    [
        (ODD, "4.0 times their error, 0.830 N of 210 mN"),
        (replace(ODD, span=(1.25, 3.5)), "of 210 mN, above all from 1.25 s to 3.50 s"),
        (otherwise(Recorded.GAIN, 1.7), "as if its force were recorded 1.70 times as large"),
        (otherwise(Recorded.CONSTANT, 0.31), "as if a constant 310 mN acted in it alone"),
        (otherwise(Recorded.DELAY, 0.004), "as if its force came 4.00 ms later"),
        (otherwise(Recorded.DELAY, -0.003), "as if its force came 3.00 ms earlier"),
        (otherwise("mass", 6.0, 5.0), "as if mass were 1.20 times as large in it"),
        (otherwise("wear.k", 6.0), "as if wear.k were there in it alone"),
    ],
)
def test_how_a_log_disagrees_is_told_with_its_numbers(odd: Disagreement, said: str) -> None:
    told = odd_in_words(replace(made.DATASET, odd=odd))
    assert told.startswith("run 2 disagrees with the other logs: 4.0 times")
    assert f"{said}; leave it out, or find what was otherwise" in told


def test_what_is_to_do_about_an_odd_log_depends_on_whether_it_is_still_there() -> None:
    near = replace(ODD, log="gone", error=0.1)
    assert odd_in_words(replace(made.DATASET, odd=near)) == (
        "gone disagrees with the other logs; all else is told without it"
    )
    rest = odd_in_words(replace(made.DATASET, odd=replace(ODD, at_rest=True)))
    assert rest.endswith("the axis is at rest there, so that no fit uses it: see what happened")


def test_a_report_on_logs_tells_the_odd_one_beside_its_other_faults() -> None:
    reports = {name: CheckReport(()) for name in ("run 1", "run 2")}
    told = with_odd(reports, {"y": made.DATASET, "x": replace(made.DATASET, odd=ODD)})
    assert told["run 1"].findings == ()
    (finding,) = told["run 2"].findings
    assert (finding.fault, finding.axis) == (Fault.ODD, "x")
    assert finding.what.startswith("it disagrees with the other logs: 4.0 times their error")
    assert reports["run 2"].findings == ()


def test_a_recording_that_is_another_is_told_with_what_is_left_of_it() -> None:
    found = Recording("two joints are exchanged", "elbow", 0.87, 0.043, lambda log: log)
    said = (
        "two joints are exchanged: bodies and friction then leave 4 % of the torque of elbow, in "
        "place of 87 %; correct the import map, or the file"
    )
    assert recording_in_words(found) == said
    first, then = read_otherwise_in_words(found)
    assert said in first
    assert "as they are then" in then
    assert read_otherwise_in_words(None) == []


def test_a_rotor_before_its_gear_is_told_with_the_one_at_the_joint() -> None:
    model = replace(made.MODEL, mjcf_name="arm.xml")
    said = rotor_in_words(RotorBeforeGear("x", stated=2e-3, asked=0.21, gear=10.0), model)
    assert said.startswith("arm.xml: warning: axis x: armature 0.002 kg is that of the rotor alone")
    assert "behind the gear of 10 the joint feels 10^2 times that, 0.2 kg" in said
    assert 'the log asks for 0.21 kg; state armature="0.2" in the file' in said


@pytest.mark.parametrize(
    ("gap", "said"),
    [
        (
            Gap("speed", "m/s", 0.0137, 0.0591, None),
            "the explanations differ most at speed 13.7 to 59.1 mm/s",
        ),
        (
            Gap("speed", "m/s", 0.0137, 0.0591, 0.0117),
            "missing motion: speed 13.7 to 59.1 mm/s; 1.2 % of the data is there",
        ),
        (
            Gap("speed", "m/s", 0.0137, 0.0591, 0.417),
            "no motion is missing, but more of it is needed at speed 13.7 to 59.1 mm/s; 41.7 % of "
            "the data is there",
        ),
    ],
)
def test_which_motion_the_logs_lack_is_said_by_how_much_there_is(gap: Gap, said: str) -> None:
    assert next_step.gap_in_words(gap) == said


NAMES = next_step.names_of(replace(made.DATASET, test=made.DATASET.selection))


def test_a_next_command_has_the_logs_in_their_roles_and_a_new_name_for_its_model() -> None:
    source = Source("", "better.toml", Path(), ("--effects", "my own.py"))
    told = source.filled(WRITE, NAMES)
    assert told == (
        "twin diagnose better.toml 'run 1' 'run 2' --holdout 'held 1' --test 'held 1' --effects "
        "'my own.py' --model better_2.toml"
    )
    again = replace(source, model="better_2.toml", options=())
    assert again.filled(WRITE, NAMES).endswith(" --model better_3.toml")
    other = replace(source, model="stage.toml").filled(WRITE, NAMES)
    assert other.endswith(" --model better.toml")
    plan = again.filled("twin plan MODEL LOG... --axis x --between a b -o next.toml", NAMES)
    assert plan == (
        "twin plan better_2.toml 'run 1' 'run 2' --holdout 'held 1' --axis x --between a b "
        "-o next.toml"
    )


def test_what_is_written_already_is_no_next_command() -> None:
    add = "twin add wear MODEL LOG... -o c.toml"
    source = Source("", "m.toml")
    assert len(source.still_to_do([WRITE, add], NAMES)) == 2
    (left,) = replace(source, written="b.toml").still_to_do([WRITE, add], NAMES)
    assert left.startswith("twin add wear m.toml")


@pytest.mark.parametrize(
    ("command", "call"),
    [
        ("twin add wear MODEL LOG... -o c.toml", "identify.add('wear', model, logs, holdout)"),
        (
            "twin plan MODEL LOG... --axis y --between gms wear -o next.toml",
            "identify.plan(model, logs, holdout, axis='y', between=('gms', 'wear'))",
        ),
        (WRITE, "twin.save_model(found.model, 'better.toml')"),
        ("twin diagnose MODEL LOG... -o d.html", "identify.diagnose(model, logs).report('d.html')"),
    ],
)
def test_a_result_that_knows_no_files_says_the_next_step_as_a_call(command, call) -> None:
    assert UNKNOWN.filled(command, NAMES) == call


def test_of_a_body_what_the_logs_tell_and_do_not_tell_is_said() -> None:
    model, body = replace(made.MODEL, mjcf_name="arm.xml"), made.wrong_body()
    said = next_step.wrong_body_in_words(body, model, ["wear"])
    assert said[0].startswith("The inertia of body fore or upper is not as arm.xml has it")
    assert "it removes 98 % of what all joints leave" in said[0]
    assert said[0].endswith("at most 30 % (19 of 20 times).")
    assert said[-1] == (
        "Error on the selection logs without and with it and wear: x 0.560 -> 0.00220 "
        "N, y 3.16 -> 0.0200 N."
    )
    none = replace(body, band=np.full(10, 9.0), disagreeing=("a", "b"))
    told = next_step.wrong_body_in_words(none, model)
    assert "Of no parameter alone do the joints tell it" in told[1]
    assert told[2].startswith("The logs disagree about it: a and b tell another change")
    (disputed,) = next_step.disputed_in_words({"fore": ("a",)})
    assert disputed.startswith("The logs disagree about body fore: a tells another change")


def test_why_a_parameter_has_no_interval_is_said() -> None:
    said = fit.no_interval_in_words(Inseparable("wear.k"))
    assert said == "no interval: these data cannot separate it from wear.k"
    assert "a larger value fits as well" in fit.no_interval_in_words(OpenSided(Side.LARGER))
    assert "a smaller value fits as well" in fit.no_interval_in_words(OpenSided(Side.SMALLER))


def test_what_makes_most_of_a_noise_floor_is_told_where_logging_mends_it() -> None:
    parts = {"aliasing": 0.21, "path": 0.07, "sensors": 0.13}
    floor = replace(known_floor(0.26), parts=parts)
    said = fit.noise_in_words(floor, LINEAR)
    assert said is not None
    assert said.startswith("210 mN of the noise floor of 260 mN is the command's fast part")
    path = fit.noise_in_words(replace(floor, parts={"aliasing": 0.07, "path": 0.21}), ROTARY)
    assert path is not None
    assert path.startswith("210 mN·m of the noise floor of 260 mN·m is what its friction makes")
    assert fit.noise_in_words(replace(floor, parts={**parts, "aliasing": 0.18}), LINEAR) is None
    assert fit.noise_in_words(known_floor(0.0), LINEAR) is None


def test_a_channel_delay_of_half_a_sample_has_a_reason_and_another_has_none() -> None:
    half = fit.channel_delay_in_words(replace(made.DATASET, channel_delay=0.52e-3))
    assert half == (
        "the force acts 0.520 ms (0.52 samples) before its time stamp, and was moved by as much: "
        "force and position seem to be read at the same instant"
    )
    whole = fit.channel_delay_in_words(replace(made.DATASET, channel_delay=1.0e-3))
    assert whole is not None
    assert "1.00 ms (1.00 samples)" in whole
    assert "no drive can do that" in whole
    assert fit.channel_delay_in_words(replace(made.DATASET, channel_delay=0.0)) is None


def test_what_was_left_out_of_logs_is_told_with_its_length() -> None:
    dataset = replace(made.DATASET, begun={"run 2": 0.37}, looks=2, asked=0.16, channel_delay=0.0)
    looked, begun = fit.prepared_in_words(dataset)
    assert "averaged over 40.0 ms: a length asked besides" in looked
    assert looked.endswith("--test-function 0.16")
    assert begun.startswith("run 2: the first 370 ms are left out, as their force fits nothing")


@pytest.mark.parametrize(
    ("coordinate", "low", "said"),
    [
        ("standstill", 0.5, "at standstill"),
        ("standstill", -0.5, "in motion"),
        ("direction", 0.5, "moving forwards"),
        ("direction", -1.5, "moving backwards"),
    ],
)
def test_a_region_is_called_by_what_the_axis_does(coordinate: str, low: float, said: str) -> None:
    region = Region(coordinate, "1", low, low + 1.0, 0.087, 7.7, 0.53, "N", 0.31)
    assert fit.place_in_words(region) == said
    assert fit.worst_in_words(region) == (
        f"It is largest {said}: 87.0 mN RMS, 7.70 times the noise floor, 53 % of the squared error "
        "in 31 % of the time."
    )


def test_an_error_that_depends_on_nothing_is_said_to() -> None:
    nothing = fit.dependence_in_words(replace(made.STRUCTURE, share_of_error=0.004))
    assert nothing == "The error depends on nothing that was measured."
    known = fit.dependence_in_words(replace(made.STRUCTURE, share_of_error=0.006, period=None))
    assert "accounts for 1 % of the squared error." in known


def test_a_law_that_is_as_its_curve_is_said_to_be_so_where_its_band_holds_it() -> None:
    curve = FoundCurve(np.array([1.0, 1.5]), np.array([1.2, 2.9]), np.array([0.31, 0.43]))
    other = FoundCurve(np.array([1.0, 1.5]), np.array([1.1, 1.4]), np.array([0.32, 0.41]))
    both = FoundShape(
        Coordinate.POSITION, np.array([0.013, 0.027]), "m", 0.034, False, "N",
        {"backwards": other, "forwards": curve},
    )  # fmt: skip
    off = shape_in_words("cogging", both)
    assert off == (
        "The law of cogging is off most at position 27.0 mm of its period, forwards: it assumes "
        f"{curve.assumed[1]:.2f}, the logs show {curve.found[1]:.2f} ± 0.430 N."
    )
    alike = replace(both, curves={"backwards": other})
    assert shape_in_words("cogging", alike).startswith("At no single position does the curve")


def test_a_law_that_depends_on_the_roles_of_the_logs_is_said_to() -> None:
    named = role_in_words(RoleDependent("wear", True, 0.031, 1.23))
    assert named.endswith("not surely proved: it takes 3 % of what is left, t = 1.2")
    chance = role_in_words(RoleDependent("wear", False, 0.11, 4.56, 0.17))
    assert chance.startswith("whether wear is proved depends on which log chooses: as they are not")
    assert "(it takes 11 % of what is left (17 % by chance), t = 4.6)" in chance


def test_a_first_look_says_what_is_likely_or_how_far_it_is_from_noise() -> None:
    found = (
        Likely("x", ("cogging", "wear"), 0.83, 4.1), Likely("y", (), 0.0, 1.3),
        Likely("z", (), 0.0, 3.7),
    )  # fmt: skip
    assert first_look_in_words("run", found) == (
        "the first 8 s of run: axis x most likely lacks cogging or wear, 83 % of what is left in "
        "one linear step; axis y is at 1.3 times its noise floor; axis z is at 3.7 times its noise "
        "floor, which no effect alone explains"
    )


def test_a_verdict_tells_noise_that_is_above_the_known_floor() -> None:
    above = built_fit(3.0, 1.2)
    found = made.diagnosis_of(Verdict.NOTHING_MISSING, base=above, final=above)
    assert "That of the training logs is 2.5 times theirs" in verdict_in_words(found)


def test_a_shape_beside_what_is_missing_and_several_wrong_values_are_told() -> None:
    cogging, lugre = made.FOUND
    shape = replace(lugre, kind=FindingKind.WRONG_SHAPE)
    beside = made.diagnosis_of(findings=(cogging, shape))
    assert "The law of lugre has another shape too." in verdict_in_words(beside)
    assert headline_in_words(beside).endswith("and lugre has another shape")
    values = [replace(f, kind=FindingKind.WRONG_VALUE, tied=()) for f in (cogging, lugre)]
    wrong = made.diagnosis_of(findings=tuple(values))
    assert verdict_in_words(wrong).startswith("Values of the machine's file are not the machine's")
    assert headline_in_words(wrong) == "cogging and lugre are not as the file says"


def test_what_a_fleet_says_of_no_logs_and_of_a_new_machine() -> None:
    done = Ingested(Path("logs"), Path("store"), 0, 0, 0, 0, 0)
    assert fleet.ingested_in_words(done) == "store: 0 logs, nothing to do"
    one = KindParameter("x", "lugre.Fc", "N", 1.37, 0.12, 9, 1.41, 0.05)
    told = fleet.kind_in_words("stage", [one, replace(one, machines=7)], None)
    assert told.splitlines()[0] == "kind stage, by 9 machines"
    assert "1.37 N, 120 mN between machines; of a new machine 1.410 ± 0.082 N is expected" in told
    unlike = fleet.unlike_in_words("x", 7.31, 1.02)
    assert "is 7.31 times its noise floor from the beginning, 1.02 times in the fit" in unlike
