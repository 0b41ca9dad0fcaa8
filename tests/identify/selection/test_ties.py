"""Which of those that explain as much is named, and that a doubted one is not."""

from __future__ import annotations

from dataclasses import replace

import pytest
from planted_logs import CATALOGUE, SLIDE, Ride, begun, few, having, logged

import identify
from benchmarks.drives import HIDDEN
from benchmarks.second_simulator.drives import DRIVES, log_of
from identify.analysis.first_model import first_model
from identify.selection.changes import Added, Reshaped
from identify.selection.search import search
from identify.selection.ties import with_ties

TRUE = having(replace(SLIDE, effects=()), "dahl", Fc=0.3, sigma0=300.0, sigma2=0.5)


def test_the_simpler_of_two_leads_unless_it_was_doubted() -> None:
    """One that was doubted and led again would be doubted again: the search would never end."""
    fit, dataset = begun(SLIDE, *({f"{i}": logged(TRUE, Ride(i, 5.0))} for i in (1, 2)))
    both = search(fit, dataset, few("lugre", "dahl"))
    found = replace(search(fit, dataset, few("lugre")), ranking=both.ranking)
    assert [s.change.name for s in with_ties(found).steps] == ["dahl"]
    doubted = replace(found, barred=frozenset({"dahl"}))
    assert [s.change.name for s in with_ties(doubted).steps] == ["lugre"]


def test_another_shape_goes_with_the_friction_that_it_was_of() -> None:
    """A friction that takes the place of a force takes that of the friction beside it as well."""
    machine = having(
        replace(SLIDE, effects=()), "lugre",
        Fc=0.8, Fs=1.6, v0=0.02, sigma0=2000.0, sigma1=1.0, sigma2=0.5,
    )  # fmt: skip
    fit, dataset = begun(SLIDE, *({f"{i}": logged(machine, Ride(i, 5.0))} for i in (1, 2)))
    (rival,) = search(fit, dataset, few("lugre")).steps
    found = search(fit, dataset, few("presliding_hysteresis"))
    assert {type(s.change) for s in found.steps} == {Added, Reshaped}
    steps = tuple(
        replace(s, tied=(rival.tried,)) if isinstance(s.change, Added) else s for s in found.steps
    )
    told = with_ties(replace(found, steps=steps))
    assert [s.change.name for s in told.steps] == ["lugre"]
    assert told.final.fit.axis.names == ("lugre",)


@pytest.mark.slow
def test_what_came_near_is_compared_again_beside_the_other_of_a_pair() -> None:
    """Neither a late motor nor its friction is proved alone, and a late reading had come first."""
    drive = DRIVES["cart"]
    recorder = next(r for r in drive.recorders if r.rate == 500)
    plant = HIDDEN["lag"][0](drive, recorder)
    logs = [log_of(drive, plant, recorder, 192105 + i) for i in range(2)]
    model = first_model({"log": logs[0]}, "cart", CATALOGUE)
    known = few("coulomb_viscous", "encoder_delay", "actuator_lag", "lugre")
    found = identify.diagnose(model, *logs, catalogue=known).axes["q"]
    assert [(s.change.name, s.with_others) for s in found.steps] == [
        ("encoder_delay", True), ("lugre", True), ("actuator_lag", False),
    ]  # fmt: skip
    named = {f.effect: f.parameters for f in found.findings}
    assert named.keys() == {"actuator_lag", "lugre"}
    assert named["actuator_lag"]["tau"] == pytest.approx(plant.lag, rel=0.06)


@pytest.mark.slow  # 4 s
def test_a_late_law_is_found_beside_the_friction_that_hid_it() -> None:
    """The force without the friction tells how late it is, while the bristle is missing still."""
    drive = DRIVES["cart"]
    recorder = next(r for r in drive.recorders if r.rate == 500)
    plant = HIDDEN["lag"][0](drive, recorder)
    logs = [log_of(drive, plant, recorder, 201105 + i) for i in (1, 0)]
    model = first_model({"log": logs[0]}, "cart", CATALOGUE)
    known = few("coulomb_viscous", "encoder_delay", "actuator_lag", "lugre")
    found = identify.diagnose(model, *logs, catalogue=known).axes["q"]
    assert {*found.answers} == {("lugre",), ("actuator_lag", "encoder_delay")}
    (late,) = (f for f in found.findings if f.effect == "actuator_lag")
    assert late.parameters["tau"] == pytest.approx(plant.lag, rel=0.06)
