"""A log that disagrees with the others is told and left out; a sound one never is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import built_dataset
from planted_logs import RATE, SLIDE, Array, Ride, few, having, logged, with_force

import identify
from benchmarks.second_simulator.drives import DRIVES
from benchmarks.second_simulator.recordings import AXIS, recordings
from benchmarks.silence import Case, cases
from identify.analysis.first_model import first_model
from identify.dataset.dataset import Dataset
from identify.dataset.odd_log import Disagreement, Otherwise, Recorded
from identify.estimation.disagreement import odd_in
from identify.estimation.fit import Fit, fit_axis
from identify.output.words.odd import odd_in_words, with_odd
from identify.output.words.verdict import verdict_in_words
from identify.selection.acceptance import Judged
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.doubts import Conclusion
from identify.selection.odd_logs import without_odd_log
from identify.selection.search import Found
from twin.checks.report import CheckReport, Fault
from twin.effects import Catalogue
from twin.logs import Log
from twin.model.machine import AxisModel, MachineModel

RIDES = {f"run{i}": Ride(20 + i) for i in range(4)}
MODEL = MachineModel("m", {"x": SLIDE}, RATE)
FEW = few("coulomb_viscous", "constant_force", "spring", "cogging", "asymmetric_friction", "lugre")


def runs(machine: AxisModel = SLIDE, **others: AxisModel) -> dict[str, Log]:
    """A log of each ride; others: what another machine it was in some of them."""
    return {name: logged(others.get(name, machine), ride) for name, ride in RIDES.items()}


def fitted(logs: dict[str, Log]) -> Dataset:
    return identify.fit(MODEL, logs).datasets["x"]


def test_logs_of_one_machine_agree() -> None:
    assert fitted(runs()).odd is None


def test_what_a_model_lacks_in_all_logs_makes_none_of_them_odd() -> None:
    assert fitted(runs(having(SLIDE, "cogging", p=0.02, a1=0.8))).odd is None


def test_another_payload_is_told_with_its_mass() -> None:
    odd = fitted(runs(run2=replace(SLIDE, mass=1.5 * SLIDE.mass))).odd
    assert odd is not None
    assert odd.log == "run2"
    own = odd.otherwise
    assert own is not None
    assert own.what == "mass"
    assert own.there / own.elsewhere == pytest.approx(1.5, rel=0.05)


@pytest.mark.parametrize(
    ("change", "what", "size"),
    [
        (lambda force: 0.75 * force, Recorded.GAIN, 0.75),
        (lambda force: force + 2.0, Recorded.CONSTANT, 2.0),
        (lambda force: np.roll(force, 20), Recorded.DELAY, 20 / RATE),
    ],
)
def test_what_is_otherwise_in_a_recording_is_told(change, what, size) -> None:
    """Its gain, a constant in it alone (a tilt), a delay of its force."""
    logs = runs()
    odd = fitted({**logs, "run1": with_force(logs["run1"], change)}).odd
    assert odd is not None
    assert odd.log == "run1"
    assert odd.otherwise is not None
    assert odd.otherwise.what == what
    assert odd.otherwise.there == pytest.approx(size, rel=0.05)


@pytest.mark.parametrize("late", [0, 3, 6])
def test_a_delay_of_some_samples_is_told_beside_what_the_others_prove(late: int) -> None:
    logs = runs()
    spoiled = {**logs, "run1": with_force(logs["run1"], lambda force: np.roll(force, late))}
    found = identify.fit(MODEL, spoiled)
    odd = odd_in(found.fits["x"].axis, found.datasets["x"])
    assert (odd is not None) == bool(late)
    if odd is not None:
        assert odd.log == "run1"
        assert odd.otherwise is not None
        assert odd.otherwise.what == Recorded.DELAY
        assert odd.otherwise.there == pytest.approx(late / RATE, rel=0.2)


@pytest.mark.parametrize(("constant", "odd"), [(4.0, "run1"), (0.0, "run2")])
def test_a_log_that_is_surely_otherwise_is_not_excused_by_one_that_may_be(constant, odd) -> None:
    """A tilt of many times the others' error, beside a force that is late in another log."""
    logs = {name: logged(SLIDE, ride, noise=0.5) for name, ride in RIDES.items()}
    other = {
        "run1": with_force(logs["run1"], lambda force: force + constant),
        "run2": with_force(logs["run2"], lambda force: np.roll(force, 4)),
    }
    found = identify.fit(MODEL, {**logs, **other})
    told = odd_in(found.fits["x"].axis, found.datasets["x"])
    assert told is not None
    assert told.log == odd


@pytest.mark.parametrize(("size", "told"), [(0.3, False), (2.0, True)])
def test_what_a_bristle_may_hold_at_rest_makes_no_log_odd(size: float, told: bool) -> None:
    """Where others pass it rests for a moment, and bears 0.3 N more: its friction holds 0.31 N."""

    def resting(force: np.ndarray) -> np.ndarray:
        force[20:90] += size
        return force

    coulomb = SLIDE["coulomb_viscous"].values
    bristle = {"Fc": coulomb["Fc"], "Fs": 1.1 * coulomb["Fc"], "sigma2": coulomb["sigma2"]}
    axis = having(SLIDE, "lugre", sigma0=1e5, sigma1=100.0, **bristle)
    logs = runs(axis)
    spoiled = {**logs, "run1": with_force(logs["run1"], resting)}
    found = identify.fit(replace(MODEL, axes={"x": axis}), spoiled)
    odd = odd_in(found.fits["x"].axis, found.datasets["x"])
    assert (odd is not None) == told
    if odd is not None:
        assert odd.log == "run1"
        assert odd.at_rest


def test_two_logs_that_are_surely_otherwise_tell_of_the_model() -> None:
    logs = runs()
    other = {
        name: with_force(logs[name], lambda force: 0.6 * force + 2.0) for name in ("run1", "run2")
    }
    found = identify.fit(MODEL, {**logs, **other})
    assert odd_in(found.fits["x"].axis, found.datasets["x"]) is None


def test_a_push_is_told_with_its_time() -> None:
    def pushed(force: np.ndarray) -> np.ndarray:
        force[2000:2200] += 3.0
        return force

    logs = runs()
    odd = fitted({**logs, "run1": with_force(logs["run1"], pushed)}).odd
    assert odd is not None
    assert odd.log == "run1"
    assert odd.span is not None
    assert 1.9 < odd.span[0] <= odd.span[1] < 2.3


def test_what_shakes_a_third_of_a_log_is_told_with_its_time() -> None:
    def shaken(force: np.ndarray) -> np.ndarray:
        t = np.arange(len(force)) / RATE
        return force + np.where((t > 1.5) & (t < 3.5), 2.0 * np.sin(25.0 * t), 0.0)

    logs = runs()
    odd = fitted({**logs, "run1": with_force(logs["run1"], shaken)}).odd
    assert odd is not None
    assert odd.log == "run1"
    assert odd.otherwise is None
    assert odd.span is not None
    assert 1.4 < odd.span[0] < 1.7
    assert 2.9 < odd.span[1] < 3.6


def test_a_glitch_at_rest_is_told_and_costs_no_log() -> None:
    logs = runs()
    speed = RIDES["run1"].speed()
    at = 2000 + int(np.argmax(np.convolve(speed[2000:] == 0.0, np.ones(100), "valid")))

    def glitch(force: np.ndarray) -> np.ndarray:
        force[at + 40 : at + 60] += 40.0
        return force

    training = {**logs, "run1": with_force(logs["run1"], glitch)}
    held = {"run3": training.pop("run3")}
    found = identify.diagnose(MODEL, training, held, catalogue=few("spring"))
    odd = found.axes["x"].dataset.odd
    assert odd is not None
    assert odd.log == "run1"
    assert odd.span is not None
    assert odd.span == pytest.approx(((at + 40) / RATE, (at + 60) / RATE), abs=0.02)
    assert len(found.axes["x"].dataset.training) == 3
    assert "at rest there, so that no fit uses it" in str(found)


def test_of_two_logs_none_is_told() -> None:
    heavy = replace(SLIDE, mass=1.5 * SLIDE.mass)
    logs = {name: log for name, log in runs(run1=heavy).items() if name in ("run0", "run1")}
    assert fitted(logs).odd is None


def test_a_diagnosis_is_made_without_it() -> None:
    machine = having(SLIDE, "cogging", p=0.02, a1=0.8)
    heavy = replace(machine, mass=1.6 * machine.mass)
    logs = runs(machine, run1=heavy)
    training = {name: logs[name] for name in ("run0", "run1", "run2")}
    found = identify.diagnose(
        MODEL, training, {"run3": logs["run3"]},
        catalogue=few("cogging", "spring"),
    )  # fmt: skip
    told = found.axes["x"]
    assert told.named == ("cogging",)
    assert told.dataset.odd is not None
    assert told.dataset.odd.log == "run1"
    assert "run1 disagrees with the other logs" in str(found)
    assert [log.motion.name for log in told.dataset.training] == ["run0", "run2"]


def test_of_each_set_of_logs_one_conclusion_is_made() -> None:
    """Beside what all prove a log is odd, and beside what the others prove it is not."""
    logs = runs()
    spoiled = {**logs, "run2": with_force(logs["run2"], lambda force: force + 0.2)}
    found = identify.fit(MODEL, spoiled)
    good, dataset = found.fits["x"], found.datasets["x"]
    poor = fit_axis(replace(SLIDE, effects=()), dataset.training)
    asked = []

    def concluded(base: Fit, logs: Dataset) -> Conclusion:
        asked.append(tuple(log.motion.name for log in logs.training))
        final = Judged(good if len(logs.training) == len(RIDES) else base, logs)
        return Conclusion(Found(logs, Judged(base, logs), final, (), (), (), ()), ())

    assert odd_in(poor.axis, dataset) is None
    without_odd_log(poor, dataset, concluded)
    assert asked[:2] == [("run0", "run1", "run2", "run3"), ("run0", "run1", "run3")]
    assert len(asked) == len({*asked})


def test_a_late_test_log_contradicts_nothing_and_is_told() -> None:
    """Late by a quarter of a pitch at speed, of the cogging that it would refute."""
    logs = runs(having(SLIDE, "cogging", p=0.02, a1=0.8))
    late = with_force(logs.pop("run3"), lambda force: np.roll(force, 30))
    held = {"run2": logs.pop("run2")}
    found = identify.diagnose(MODEL, logs, held, {"late": late}, catalogue=FEW).axes["x"]
    assert found.answers == (("cogging",),)
    assert not found.contradicted
    assert found.dataset.odd is not None
    assert found.dataset.odd.log == "late"
    assert found.dataset.odd.otherwise is not None
    assert found.dataset.odd.otherwise.there == pytest.approx(30 / RATE, rel=0.2)


def test_less_friction_in_one_log_is_told_below_what_the_model_lacks() -> None:
    machine = having(SLIDE, "cogging", p=0.02, a1=0.3)
    warm = having(machine, "coulomb_viscous", Fc=0.6 * SLIDE["coulomb_viscous"].values["Fc"])
    logs = runs(machine, run1=warm)
    training = {name: logs[name] for name in ("run0", "run1", "run2")}
    found = identify.diagnose(MODEL, training, {"run3": logs["run3"]}, catalogue=few("spring"))
    odd = found.axes["x"].dataset.odd
    assert odd is not None
    assert odd.log == "run1"
    assert odd.otherwise is not None
    assert odd.otherwise.what == "coulomb_viscous.Fc"


def of_silence(seed: int, number: int, catalogue: Catalogue = FEW) -> tuple[Case, AxisDiagnosis]:
    """A drive of the second simulator with five logs, and what it is told by few effects."""
    case = list(cases(seed, number + 1))[number]
    plant = case.plants[1]
    logs = recordings(DRIVES[case.drive], plant, case.recorder, case.seed, case.spoiled, case.which)
    training, held = (
        {name: logs[name] for name in some} for some in (case.order[:3], case.order[3:4])
    )
    model = first_model(training, "m", catalogue)
    found = identify.diagnose(model, training, held, catalogue=catalogue)
    return case, found.axes[AXIS]


@pytest.mark.slow
def test_what_all_logs_lack_is_no_delay_of_one() -> None:
    """A late motor, which nothing here explains: sines seemed 0.45 ms early, 1.7 times as far.

    Of all that is asked, the friction of such a drive alone is there: it remembers.
    """
    case, told = of_silence(92, 4)
    assert case.spoiled is None
    assert {f.effect for f in told.findings} <= {"lugre"}
    assert told.dataset.odd is None


@pytest.mark.slow
def test_a_log_that_alone_shows_what_the_model_lacks_is_not_odd() -> None:
    """The slow one, of a friction that falls with speed: the others lacked nothing."""
    _, told = of_silence(106, 34, few("coulomb_viscous", "constant_force", "stribeck"))
    assert told.named == ("stribeck",)
    assert told.dataset.odd is None


@pytest.mark.slow  # 10 s
@pytest.mark.parametrize(("seed", "number"), [(108, 9), (109, 7)])
def test_a_log_that_alone_turns_back_without_a_rest_is_not_odd(seed: int, number: int) -> None:
    """Its sines left eight times as much: all of it where the friction turns, where others rest."""
    case, told = of_silence(seed, number)
    assert case.spoiled is None
    assert told.dataset.odd is None


@pytest.mark.slow  # 20 s
@pytest.mark.parametrize(
    ("seed", "number", "lacks", "log", "what"),
    [(84, 7, "spring", "sines", Recorded.GAIN), (86, 11, "lugre", "moves", None)],
)
def test_what_one_log_hides_is_found(seed, number, lacks, log, what) -> None:
    """Its sines have another gain: with them no spring was proved, and beside none they agreed.

    Or its moves were touched for a moment: with them a friction was left, told as noise.
    """
    case, told = of_silence(seed, number)
    assert case.which == log
    assert told.named[0] == lacks
    odd = told.dataset.odd
    assert odd is not None
    assert odd.log == log
    assert (odd.otherwise and odd.otherwise.what) == what


def test_where_one_log_alone_has_been_a_free_curve_makes_it_not_odd() -> None:
    """Others predict nothing of the curve there."""

    def bump(x: Array, v: Array) -> Array:
        return 3.0 * np.exp(-(((x - 0.06) / 0.003) ** 2))

    far = {n: replace(ride, reach=0.1 if n == "run1" else 0.06) for n, ride in RIDES.items()}
    logs = {name: logged(SLIDE, ride, bump) for name, ride in far.items()}
    axis = having(SLIDE, "empirical_map")
    found = identify.fit(replace(MODEL, axes={"x": axis}), logs)
    assert odd_in(found.fits["x"].axis, found.datasets["x"]) is None


def test_what_no_other_log_has_is_told_without_a_ratio() -> None:
    alone = Otherwise("coulomb_viscous.sigma2", 12.0, 0.0)
    odd = replace(fitted(runs()), odd=Disagreement("run2", 5.0, 1.0, otherwise=alone))
    assert "as if coulomb_viscous.sigma2 were there in it alone" in odd_in_words(odd)


def test_a_check_tells_the_log_that_disagrees_and_nothing_where_none_does() -> None:
    dataset = built_dataset("one", "two")
    reports = {"one": CheckReport(()), "two": CheckReport(())}
    assert with_odd(reports, {"x": dataset}) == reports
    odd = replace(dataset, odd=Disagreement("two", 5.0, 1.0, span=(0.3, 0.7)))
    made = with_odd(reports, {"x": odd})
    assert made["one"] == reports["one"]
    (finding,) = made["two"].findings
    assert (finding.fault, finding.axis) == (Fault.ODD, "x")
    assert "5" in finding.what
    assert made["two"].ok


@pytest.mark.short(2)
def test_the_odd_one_of_three_logs_is_told_though_a_test_log_decides_nothing() -> None:
    """README's way, one to fit, one to choose, one to test: a brake dragged in the first."""

    def braked(force: Array) -> Array:
        force[2000:3500] += 3.0
        return force

    logs = runs()
    spoiled = with_force(logs["run1"], braked)
    found = identify.diagnose(
        MODEL, {"run1": spoiled}, {"run2": logs["run2"]}, {"run3": logs["run3"]}, catalogue=FEW
    ).axes["x"]
    assert found.dataset.odd is not None
    assert found.dataset.odd.log == "run1"
    assert found.dataset.odd.span is not None
    assert 2.0 < found.dataset.odd.span[0] < found.dataset.odd.span[1] < 3.5
    assert [log.motion.name for log in found.dataset.training] == ["run1"]
    assert "run1 disagrees with the other logs: see the notes." in verdict_in_words(found)
