"""A friction with a memory is told with those as good, not as a hysteresis beside friction."""

from dataclasses import replace

from planted_logs import CATALOGUE, SLIDE, asked, few

from twin.model.machine import AxisModel, Fitted


def with_friction(law: str, **values: float) -> AxisModel:
    """The slide with another friction, of the same level and bristle."""
    alike = {"Fc": 0.3, "v0": 0.01, "sigma2": 0.5, "sigma0": 300.0, "n": 0.8}
    bare = replace(SLIDE, effects=())
    return bare.with_effect(Fitted.at_start(CATALOGUE[law], {**alike, **values}))


def test_of_a_friction_those_that_explain_as_much_are_told_with_the_same_values_free() -> None:
    """The exponent is another than the laws hold: it is free in the one found, so in all."""
    true = with_friction("modified_leuven", Fs=0.4, sigma1=0.7, spread=8.0, reserve=3.0)
    found = asked(SLIDE, true, few("dahl", "leuven", "modified_leuven"))
    assert {*found.answers[0]} == {"leuven", "modified_leuven"}
    assert found.findings[0].bend is not None


def test_a_hysteresis_that_leaves_no_friction_is_another_friction() -> None:
    true = with_friction("gms", Fs=0.3, spread=4.0, C=68.0)
    found = asked(SLIDE, true, few("presliding_hysteresis"))
    refused = next(c.refused for c in found.ranking if c.effect.name == "presliding_hysteresis")
    assert refused is not None
    assert "the place of the friction" in refused
    assert "presliding_hysteresis" not in found.named
    assert asked(SLIDE, true, few("presliding_hysteresis", "gms")).named == ("gms",)
