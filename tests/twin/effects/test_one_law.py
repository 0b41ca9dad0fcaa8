"""A diagnosis offers each law once, by the name that fits the axis and what it has already."""

from effect_runs import CATALOGUE, FRICTIONS

from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted

CABLE = {"cable_slab", "cable_hysteresis"}
GENERAL = {"spring", "presliding_hysteresis"}
BARE = AxisModel(1.0)


def offered(axis: AxisModel) -> set[str]:
    return {e.name for e in CATALOGUE.after(axis.names) if axis.can_have(e)}


def having(*names: str, rotary: bool = False) -> AxisModel:
    fitted = tuple(Fitted.at_start(CATALOGUE[n]) for n in names)
    return AxisModel(1.0, effects=fitted, rotary=rotary)


def test_a_machine_without_a_cable_is_offered_no_cable() -> None:
    assert offered(BARE) >= GENERAL
    assert not CABLE & offered(BARE)
    for name in CABLE:
        beside = offered(having(name))
        assert not GENERAL & beside
        assert CABLE - {name} <= beside
    assert not CABLE & offered(having("spring"))


def test_viscous_friction_is_offered_where_no_friction_has_it() -> None:
    assert "viscous_friction" in offered(BARE)
    assert "viscous_friction" in offered(having("cogging"))
    for friction in FRICTIONS:
        assert "viscous_friction" not in offered(having(friction.name))


def test_gravity_is_offered_where_the_axis_turns() -> None:
    assert "gravity" in offered(having(rotary=True))
    assert "gravity" not in offered(BARE)
    assert "constant_force" in offered(BARE), "the weight of a tilted slide"


def test_the_stage_with_a_cable_keeps_its_names() -> None:
    stage = load_model("proton_xy", CATALOGUE)
    for axis in stage.axes.values():
        assert not GENERAL & offered(axis)
        assert "cable_hysteresis" in offered(axis)
