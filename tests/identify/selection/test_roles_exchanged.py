"""What only the choice of the logs' roles decides is told, whichever log chooses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_results import FOUND, score_of
from planted_logs import SLIDE, Array, Ride, begun, few, having, logged

from benchmarks.drives import CATALOGUE, HIDDEN
from benchmarks.roles import of_machine
from benchmarks.second_simulator.drives import DRIVES, Recorder, log_of
from benchmarks.second_simulator.recordings import recordings
from benchmarks.silence import cases
from identify import diagnose
from identify.analysis.first_model import first_model
from identify.selection.acceptance import least_t
from identify.selection.diagnosis import AxisDiagnosis, diagnose_axis
from identify.selection.refusal import Instead

KNOWN = few("cogging", "spring", "quadratic_drag")


def diagnosed(size: float, ride: Ride, noise: float = 0.05) -> AxisDiagnosis:
    """A cogging of so many N, fitted to a good log and judged by a short one with more noise."""
    true = having(SLIDE, "cogging", p=0.021, a1=size, b1=0.0)
    good, poor = logged(true, Ride(1)), logged(true, ride, noise=noise)
    return diagnose_axis(*begun(SLIDE, {"good": good}, {"poor": poor}), KNOWN)


@pytest.mark.parametrize(
    ("size", "ride", "named"), [(0.006, Ride(2, 2.0), True), (0.012, Ride(4, 2.0), False)]
)
def test_a_law_that_one_log_alone_proves_is_told_to_depend_on_which_log_chooses(
    size: float, ride: Ride, named: bool
) -> None:
    found = diagnosed(size, ride)
    assert found.named == (("cogging",) if named else ())
    (law,) = found.depends_on_roles
    assert (law.effect, law.named) == ("cogging", named)
    assert all(f.confidence is not None and f.confidence <= 0.75 for f in found.findings)


def test_a_law_that_other_logs_prove_by_a_hair_is_told_to_depend_on_which_log_chooses() -> None:
    (law,) = diagnosed(0.008, Ride(2, 2.0)).depends_on_roles
    assert law.named
    assert least_t(1) < law.t < least_t(1) + 1.0
    assert law.part > 0.5 > law.control
    assert not diagnosed(0.012, Ride(2, 2.0)).depends_on_roles


def test_of_a_law_that_both_logs_prove_nothing_of_the_kind_is_told() -> None:
    found = diagnosed(0.1, Ride(2))
    assert found.named == ("cogging",)
    assert not found.depends_on_roles
    assert found.findings[0].confidence == pytest.approx(0.99)


def test_a_law_that_a_touched_log_hides_is_told_to_depend_on_roles_whichever_log_chooses() -> None:
    def touched(x: Array, v: Array) -> Array:
        between = (np.arange(len(x)) > 2000) & (np.arange(len(x)) < 3500)
        return 2.0 * np.exp(-(((x - 0.01) / 0.01) ** 2)) * (v > 0) * between

    true = having(SLIDE, "cogging", p=0.021, a1=0.03, b1=0.0)
    good, poor = {"good": logged(true, Ride(1))}, {"poor": logged(true, Ride(4), touched)}
    for pair, named in (((good, poor), True), ((poor, good), False)):
        (law,) = diagnose_axis(*begun(SLIDE, *pair), KNOWN).depends_on_roles
        assert (law.effect, law.named) == ("cogging", named)


@pytest.mark.slow  # 4 s
def test_what_one_log_does_not_propose_and_both_prove_is_named_whichever_log_chooses() -> None:
    def sticky(x: Array, v: Array) -> Array:
        return 0.4 * np.sign(v) * np.exp(-((v / 0.01) ** 2))

    true = having(SLIDE, "cogging", p=0.021, a1=0.06, b1=0.0)
    one = {"one": logged(true, Ride(3, 3.0), sticky)}
    two = {"two": logged(true, Ride(13, 6.0), sticky)}
    for pair in ((one, two), (two, one)):
        assert diagnose_axis(*begun(SLIDE, *pair), KNOWN).named == ("cogging",)


def test_other_logs_choose_in_turn_where_the_others_have_been() -> None:
    rides = {"near": Ride(1, reach=0.03), "far": Ride(2, reach=0.06), "too": Ride(3, reach=0.05)}
    logs = {name: logged(SLIDE, ride) for name, ride in rides.items()}
    held = {"held": logged(SLIDE, Ride(4, reach=0.02))}

    def turns(names: list[str]) -> list[tuple[set[str], set[str]]]:
        dataset = begun(SLIDE, {n: logs[n] for n in names}, held)[1]
        both = ((d.training, d.selection) for d in dataset.exchanged)
        return [({w.motion.name for w in a}, {w.motion.name for w in b}) for a, b in both]

    assert turns(["near"]) == [({"held"}, {"near"})]
    assert turns(["near", "far"]) == [({"far", "held"}, {"near"}), ({"near", "held"}, {"far"})]
    chosen = [names for _, names in turns(["near", "far", "too"])]
    assert len(chosen) == 2
    assert set.union(*chosen) == {"near", "far", "too"}
    (first, second) = begun(SLIDE, {n: logs[n] for n in ("near", "far")}, held)[1].exchanged
    assert all(w.reached.all() for w in first.selection)
    assert 0.2 < np.mean(second.selection[0].reached) < 0.9
    assert begun(SLIDE, logs, {})[1].exchanged == ()


@pytest.mark.parametrize(
    ("part", "t", "control", "unsure"),
    [
        (0.41, 0.7, 0.1, True),  # as large as it is elsewhere, in too short a log
        (0.41, -0.7, 0.1, False),
        (0.12, 3.5, 0.0, True),  # half as much, as it may be of other logs
        (0.09, 3.5, 0.0, False),
        (0.41, 0.7, 0.5, False),  # its force shifted in time takes as much
    ],
)
def test_logs_that_are_unsure_alone_leave_a_law_to_all_others(part, t, control, unsure) -> None:
    finding = replace(FOUND[0], score=score_of(part, t, control))
    assert finding.refused
    witnessed = replace(finding, score=replace(finding.score, in_turn=True))
    assert (witnessed.refused is None) == unsure
    wrong = replace(witnessed, doubt=Instead.ANY_FORCE_OF_THE_MOTION)
    assert wrong.refused is wrong.doubt


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hidden", "seed"), [("nothing", 54), ("asymmetric_friction", 54), ("dwell_stiction", 55)]
)
def test_three_logs_tell_the_same_whichever_of_them_chooses(hidden: str, seed: int) -> None:
    """One chose by itself: its answer was "unexplained", lacked the bumps' shape, or a law."""
    found = of_machine(hidden, seed)
    assert found["same"] or found["told"], found["answers"]
    assert all(["cable_slab"] in answer for answer in found["answers"])


@pytest.mark.slow
def test_what_a_test_log_refuses_takes_no_other_law_with_it() -> None:
    """Without the bristle a cogging had twice its period, and both were refused for that."""
    drive, recorder = DRIVES["actuator"], Recorder(2000, 2000, mean=False, coarse=True)
    plant = HIDDEN["two coggings"][0](drive, recorder)
    one, other, test = (log_of(drive, plant, recorder, 3 * 70039 + i) for i in range(3))
    model = first_model({"one": one}, "drive", CATALOGUE)
    found = diagnose(model, other, one, test, catalogue=CATALOGUE).axes["q"]
    assert {"cogging", "cogging_2"} <= set(found.named)


@pytest.mark.slow
def test_a_lag_that_one_order_refuses_alone_is_followed_to_the_friction_that_hides_it() -> None:
    """In that order the friction out of step took as much, and nothing was named at ten floors."""
    drive, recorder = DRIVES["actuator"], Recorder(2000, 2000, mean=False, coarse=True)
    plant = HIDDEN["lag"][0](drive, recorder)
    one, other, test = (log_of(drive, plant, recorder, 3 * 73047 + i) for i in range(3))
    model = first_model({"one": one, "other": other}, "drive", CATALOGUE)
    for pair in ((one, other), (other, one)):
        found = diagnose(model, *pair, test, catalogue=CATALOGUE).axes["q"]
        families = [{f.effect, *f.tied} for f in found.findings]
        assert any("actuator_lag" in family for family in families)
        assert any("presliding_hysteresis" in f or "lugre" in f for f in families)
        assert found.final.ratio < 1.5


@pytest.mark.slow  # 20 s
def test_a_log_that_hardly_excites_a_law_does_not_refuse_it() -> None:
    """A slow and clipped one chose: of a load that swings at 18 floors it said that it is nothing.

    The three others prove it in turn.
    """
    case = cases(110, 13)[12]
    drive = DRIVES[case.drive]
    logs = recordings(drive, case.plants[1], case.recorder, case.seed, case.spoiled, case.which)
    training = {name: logs[name] for name in ("speeds", "again", "sines")}
    model = first_model(training, "drive", CATALOGUE)
    catalogue = few("coulomb_viscous", "flexible_mode", "cogging", "spring", "backlash")
    found = diagnose(model, training, {"slow": logs["slow"]}, catalogue=catalogue).axes["q"]
    assert any("flexible_mode" in {f.effect, *f.tied} for f in found.findings)
    assert found.final.ratio < 1.5
