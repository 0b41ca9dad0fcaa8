"""The exported C gives the feedforward of the model, and that makes the model follow."""

import ctypes
import math
import re
from collections.abc import Callable
from dataclasses import replace
from math import floor

import numpy as np
import pytest
from c_compiler import UNDEFINED, given, library, needs_compiler
from cli_runs import refusal, twin
from effect_runs import CATALOGUE
from numpy.polynomial import Polynomial

from twin.effect import OUT, Effect, Kind, V, X
from twin.export.c_law import SLOTS, CannotTranslate, CLaws
from twin.export.formats.c import CSource, c_source
from twin.feedforward import feedforward, followed
from twin.laws.trials import TrialMotion, companion, forces, moderate
from twin.model.file import load_model, save_model
from twin.model.machine import AxisIntervals, AxisModel, Fitted, Hardware, MachineModel
from twin.signals import Array

PERIOD = 1e-4
FRICTION = CATALOGUE["lugre"]


def with_friction(effect: Effect, seed: int = 5) -> AxisModel:
    """An axis with an effect of moderate size, and a friction beside it."""
    own = Fitted.at_start(effect, moderate(effect, np.random.default_rng(seed)))
    beside = () if effect.kind is Kind.FRICTION else (companion(FRICTION),)
    return AxisModel(3.0, Hardware(force_constant=20.0), (*beside, own))


RUN = [e for e in CATALOGUE.values() if not (e.of_joints or e.channels)]
AXES = {e.name: with_friction(e) for e in RUN}
OF_TWO = [n for n, a in AXES.items() if any(f.effect.reads_other_axis for f in a.effects)]
ALONE = MachineModel("alone", {n: a for n, a in AXES.items() if n not in OF_TWO}, 1.0 / PERIOD)


def moves(duration: float, seed: int = 1) -> Array:
    """Position, velocity, acceleration (3, n) of smooth moves with rests in between."""
    rng, rise = np.random.default_rng(seed), Polynomial([0, 0, 0, 0, 0, 126, -420, 540, -315, 70])
    each, moving = 5000, 4000
    t = np.arange(1, moving + 1) / moving
    along, parts = 0.0, []
    for _ in range(round(duration / PERIOD) // each):
        to = rng.uniform(-0.1, 0.1)
        one = np.zeros((3, each))
        one[0] = to
        for k in range(3):
            scale = (to - along) / (moving * PERIOD) ** k
            one[k, :moving] = scale * rise.deriv(k)(t) + (along if k == 0 else 0.0)
        along = to
        parts.append(one)
    return np.concatenate(parts, axis=1)


def driver(made: CSource) -> str:
    """C that calls each axis along a whole motion of n samples."""
    loops = [f'#include "{made.name}.h"']
    for a in made.axes:
        names = ", ".join(f"const double *{n}" for n in a.arguments)
        each = ", ".join(f"{n}[k]" for n in a.arguments)
        head = f"void run_{a.prefix}(int n, double *out, {names})"
        loops.append(
            f"{head};\n{head}\n{{\n    {a.prefix}_state state = {{0}};\n"
            f"    for (int k = 0; k < n; k++) out[k] = {a.prefix}_force(&state, {each});\n}}"
        )
    return "\n\n".join(loops) + "\n"


def made_from(model: MachineModel, folder, *options: str) -> tuple[CSource, ctypes.CDLL]:
    made = c_source(model)
    files = {f"{made.name}.h": made.header, f"{made.name}.c": made.source, "run.c": driver(made)}
    return made, library(folder, files, *options)


def run(made: CSource, code: ctypes.CDLL, axis: str, *motion: Array) -> Array:
    own = next(a for a in made.axes if a.name == axis)
    out = np.zeros(motion[0].shape[1])
    columns = [c.copy() for m in motion for c in m][: len(own.arguments)]
    getattr(code, f"run_{own.prefix}")(len(out), *given(out, *columns))
    return out


@pytest.fixture(scope="module")
def alone(tmp_path_factory) -> tuple[CSource, ctypes.CDLL]:
    return made_from(ALONE, tmp_path_factory.mktemp("alone"), UNDEFINED)


@pytest.fixture(scope="module")
def motion() -> Array:
    return moves(4.0)


@needs_compiler
@pytest.mark.parametrize("axis", ALONE.axes)
def test_c_is_the_feedforward_of_the_model(alone, motion, axis, capfd) -> None:
    found = run(*alone, axis, motion)
    still = np.zeros_like(motion)
    wanted = feedforward(ALONE.axes[axis], motion, still, PERIOD)
    assert np.abs(found - wanted).max() <= 1e-9 * np.abs(wanted).max()
    assert "runtime error" not in capfd.readouterr().err


@needs_compiler
@pytest.mark.parametrize("name", OF_TWO)
def test_c_of_an_axis_that_feels_the_other_one(tmp_path, name) -> None:
    model = MachineModel("two", {"x": AXES[name], "y": AxisModel(2.0)}, 1.0 / PERIOD)
    made, code = made_from(model, tmp_path, UNDEFINED)
    own, other = moves(2.0), moves(2.0, seed=2)
    wanted = feedforward(model.axes["x"], own, other, PERIOD)
    found = run(made, code, "x", own, other)
    assert np.abs(found - wanted).max() <= 1e-9 * np.abs(wanted).max()
    assert np.ptp(found - run(made, code, "x", own, np.zeros_like(own))) > 0.0


@pytest.mark.parametrize("axis", [n for n in AXES if n not in OF_TWO])
def test_under_its_feedforward_the_equation_of_motion_holds(axis) -> None:
    """Along moves, and with all effects, the lost ones apart, mass x acceleration is the force."""
    motion = moves(1.0)
    kept = followed(AXES[axis]).axis
    command = feedforward(kept, motion, np.zeros_like(motion), PERIOD)
    found = forces(kept.effects, TrialMotion(PERIOD, motion[0], motion[1], command))
    moving = motion[1] != 0.0
    structure = [f for f in kept.effects if f.effect.kind is Kind.STRUCTURE]
    assert set(found) == {f.effect.name for f in kept.effects}
    scale = kept.mass if structure else 1.0  # ``forces`` moves 1 kg
    added = {f.effect.name: scale for f in structure}
    total = command + sum(added.get(name, 1.0) * force for name, force in found.items())
    left = (total - kept.mass * motion[2])[moving]
    assert np.abs(left).max() <= 1e-9 * np.abs(command).max()


def test_what_cannot_be_fed_forward_is_told(tmp_path) -> None:
    lost = {n for n, a in AXES.items() if followed(a).lost}
    assert {e.name for e in CATALOGUE.values() if e.kind is Kind.SENSING} <= lost
    assert {"actuator_deadband", "actuator_saturation"} <= lost
    assert (
        not {"actuator_lag", "force_constant_ripple", "flexible_mode", "base_vibration", "leuven"}
        & lost
    )
    for name in ("actuator_delay", "actuator_lag"):
        found = followed(AXES[name])
        assert found.late == pytest.approx(AXES[name][name].values["tau"], rel=0.01)
        assert f"{found.late:.3g} s late" in found.approximated[name]
        assert name not in found.axis.names
        header = c_source(MachineModel("alone", {"x": AXES[name]}, 1.0 / PERIOD)).header
        (ahead,) = re.findall(r"#define ALONE_X_AHEAD (\S+)", header)
        assert float(ahead) == pytest.approx(0.5 * PERIOD + found.late)
    assert set(followed(AXES["periodic_disturbance"]).approximated) == {"periodic_disturbance"}
    stage = load_model("proton_xy", CATALOGUE)
    axis = stage.axes["x"].with_effect(AXES["encoder_ripple"]["encoder_ripple"])
    made = c_source(stage.with_axis("x", axis))
    assert [(a.name, r.part) for a in made.axes for r in a.held.lost] == [("x", "encoder_ripple")]
    assert "Lost: encoder_ripple, it changes the reading" in made.header
    assert "encoder_ripple" not in made.source


def test_what_is_told_to_be_held_nearly_or_not_at_all_is_not_told_to_be_kept() -> None:
    for axis in AXES.values():
        (made,) = c_source(MachineModel("one", {"x": axis}, 1.0 / PERIOD)).axes
        others = {r.part for r in (*made.held.approximated, *made.held.lost)}
        assert not others & {*made.held.kept}
        assert others | {*made.held.kept} == {axis.units.mass_name, *axis.names}


def test_bands_of_the_last_fit_stand_beside_the_values() -> None:
    stage = load_model("proton_xy", CATALOGUE)
    stage = stage.with_intervals("x", AxisIntervals({"lugre.Fc": (0.27, 0.2912)}, 1.0))
    assert (
        "0.285 /* lugre.Fc: N, Coulomb friction; 90 % 0.27 to 0.2912 */" in c_source(stage).source
    )


def test_the_command_writes_the_files_and_says_what_is_in_them(tmp_path) -> None:
    done = twin("export", "proton_xy", "--to", "c", "-o", "into", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "axis x: keeps mass, lugre" in done.stdout
    for suffix in (".c", ".h"):
        assert (tmp_path / "into" / f"proton_motion_stage{suffix}").stat().st_size > 1000
    assert "did you mean 'c'" in refusal("export", "proton_xy", "--to", "c9", folder=tmp_path)
    imposed = replace(load_model("proton_xy", CATALOGUE).axes["x"], mass=0.0, effects=())
    save_model(MachineModel("held", {"x": imposed}), tmp_path / "held.toml")
    assert "imposed" in refusal("export", "held.toml", "--to", "c", folder=tmp_path)


def compiled(folder, law: Callable) -> ctypes.CDLL:
    """A library in which the law has the name ``tried``."""
    made = CLaws()
    arrays = "const double *p, double *s, double *io"
    called = f"void tried({arrays});\nvoid tried({arrays}) {{ {made.law(law)}(p, s, io); }}"
    slots = ", ".join(f"IO_{name} = {value}" for name, value in SLOTS.items())
    text = "\n\n".join(["#include <math.h>", f"enum {{ {slots} }};", made.text, called])
    return library(folder, {"laws.c": text}, UNDEFINED)


@needs_compiler
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


@needs_compiler
def test_functions_and_constants_may_be_given_by_their_module(tmp_path) -> None:
    def law(p, s, io):
        io[OUT] = math.exp(io[X]) + math.pi * io[V]

    in_c = compiled(tmp_path, law).tried
    io, wanted = np.zeros(30), np.zeros(30)
    io[[X, V]] = wanted[[X, V]] = 0.3, -2.0
    law(None, None, wanted)
    in_c(*given(np.zeros(1), np.zeros(1), io))
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
