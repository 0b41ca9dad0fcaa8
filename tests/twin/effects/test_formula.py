"""The equation that an effect states is read as people write it, or refused as words."""

import numpy as np
import pytest

from twin.effects import load_catalogue
from twin.laws.formula import NoFormula, formula

X, V = np.linspace(-0.3, 0.4, 50), np.linspace(0.5, -0.2, 50)
NAMES = {"k": 3.0, "w": 0.2, "c": 7.0, "n": 1.5, "place": 0.1}


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("F = -k d exp(-(d/w)^2),  d = x - place",
         -3.0 * (X - 0.1) * np.exp(-(((X - 0.1) / 0.2) ** 2))),
        ("F = -c |v/w|^n sgn(v);  with n = 2: drag", -7.0 * np.abs(V / 0.2) ** 1.5 * np.sign(V)),
        ("F = -c v |v|", -7.0 * V * np.abs(V)),
        ("F = -(k d + 2 d^3);  d = e/w, e = x - place",
         -(3.0 * (X - 0.1) / 0.2 + 2.0 * ((X - 0.1) / 0.2) ** 3)),
        ("F = k cos(2 pi x/w)", 3.0 * np.cos(2.0 * np.pi * X / 0.2)),
    ],
)  # fmt: skip
def test_it_is_computed_as_it_is_written(text, wanted):
    computed = formula(text, NAMES)
    np.testing.assert_allclose(computed({"x": X, "v": V, "t": 0.0 * X, **NAMES}), wanted)


@pytest.mark.parametrize(
    "text",
    ["a brake in proportion to speed", "F = sum_k a_k x", "F = -k x where it pushes", "F = k (x",
     "F = E(x) k", "F = -k x = -m g", "F = __import__(1)"],
)  # fmt: skip
def test_an_explanation_is_no_formula(text):
    with pytest.raises(NoFormula):
        formula(text, NAMES)({"x": X, "v": V, "t": X, **NAMES})


def test_effects_of_the_catalogue_are_among_what_is_compared():
    read = set()
    for effect in load_catalogue().values():
        try:
            formula(effect.equation, [p.name for p in effect.parameters])
        except NoFormula:
            continue
        read.add(effect.name)
    assert {"spring", "viscous_friction", "quadratic_drag", "constant_force"} <= read
