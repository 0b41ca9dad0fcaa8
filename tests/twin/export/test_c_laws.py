"""What Python says otherwise than C is translated, or refused.

That the laws of the catalogue do the same in C is seen by the feedforward of each.
"""

import ctypes
from collections.abc import Callable
from math import floor

import numpy as np
import pytest
from c_compiler import UNDEFINED, given, library, needs_compiler

from twin.effect import OUT, V, X
from twin.export.c_law import SLOTS, CannotTranslate, CLaws

pytestmark = needs_compiler


def compiled(folder, law: Callable) -> ctypes.CDLL:
    """A library in which the law has the name ``tried``."""
    made = CLaws()
    arrays = "const double *p, double *s, double *io"
    called = f"void tried({arrays});\nvoid tried({arrays}) {{ {made.law(law)}(p, s, io); }}"
    slots = ", ".join(f"IO_{name} = {value}" for name, value in SLOTS.items())
    text = "\n\n".join(["#include <math.h>", f"enum {{ {slots} }};", made.text, called])
    return library(folder, {"laws.c": text}, UNDEFINED)


def test_what_python_says_otherwise_than_c(tmp_path) -> None:
    """Division and remainder of negative numbers, values that change places, whole numbers."""

    def law(p, s, io):
        a, b = io[X], io[V]
        a, b = b, a
        count, total = int(p[0]), 0
        for i in range(count):
            if i == 2:
                continue
            total += i // 2 - (i - 3) % 2
        while a > 1.0:
            a -= 1.0
        io[OUT] = a % 0.3 + b // 0.4 + total / count + (-(b**2) if a < b <= 2.0 else floor(b))

    in_c = compiled(tmp_path, law).tried
    for x, v in ((-0.7, 3.2), (0.5, -1.7), (2.0, -0.1), (1.3, 0.4)):
        p, s, io, wanted = np.array([5.0]), np.zeros(1), np.zeros(30), np.zeros(30)
        io[[X, V]] = wanted[[X, V]] = x, v
        law(p, s, wanted)
        in_c(*given(p, s, io))
        np.testing.assert_allclose(io, wanted, rtol=1e-14)


TABLE = (0.1, 0.2)


def test_what_cannot_be_written_in_c_is_said() -> None:
    def of_table(p, s, io):
        io[OUT] = TABLE[int(io[X])]

    def of_text(p, s, io):
        io[OUT] = float(f"{io[X]:.3f}")

    def of_two_kinds(p, s, io):
        a = 1.0
        a = p
        io[OUT] = a[0]

    for law, what in ((of_table, "TABLE"), (of_text, "counterpart"), (of_two_kinds, "number")):
        with pytest.raises(CannotTranslate, match=what):
            CLaws().law(law)
