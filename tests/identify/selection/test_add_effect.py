"""A user's own effect, one file outside the package, is part of all that the package does."""

from pathlib import Path

import numpy as np
import pytest
from effect_runs import CATALOGUE

from twin.effect import Effect
from twin.effects import Catalogue, load_catalogue
from twin.errors import InputError
from twin.experiments.named import simulate
from twin.laws.verdict import check_effect
from twin.logs import Log
from twin.model.file import load_model, save_model
from twin.model.machine import Fitted, MachineModel
from twin.simulator import MujocoSimulator, ReducedSimulator

NAME = "guide_waviness"
SOURCE = '''\
"""A wavy guide: a force with the sine of position, and a brake with the cube of speed."""

from math import pi, sin

from twin.effect import OUT, Effect, Kind, Parameter, V, X


def law(p, s, io):
    s[0] += abs(io[V]) * 1e-4
    io[OUT] = p[0] * sin(2.0 * pi * io[X] / p[1]) - p[2] * io[V] ** 3


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="wavy guide with a brake that grows with the cube of speed",
    equation="F = a sin(2 pi x/pitch) - c v^3",
    source="this test",
    parameters=(
        Parameter("a", "N", 0.0, -100.0, 100.0, "height of the wave", strength=True),
        Parameter("pitch", "m", 0.05, 1e-3, 1.0, "length of the wave"),
        Parameter("c", "N s^3/m^3", 0.0, 0.0, 1e4, "cubic brake", strength=True),
    ),
    states=("distance",),
    law=law,
    fingerprint="residual is a sine along the track",
    excited_by="passes over several waves",
)
'''


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / f"{NAME}.py"
    path.write_text(SOURCE)
    return path


@pytest.fixture
def catalogue(file: Path) -> Catalogue:
    return load_catalogue([file])


@pytest.fixture
def effect(catalogue: Catalogue) -> Effect:
    return catalogue[NAME]


def with_it(effect: Effect, **values: float) -> MachineModel:
    model = load_model("proton_xy", CATALOGUE)
    fitted = Fitted.at_start(effect, values)
    return model.with_axis("x", model.axes["x"].with_effect(fitted))


def test_it_takes_its_place_in_the_catalogue(catalogue: Catalogue, file: Path) -> None:
    assert list(catalogue) == sorted([*CATALOGUE, file.stem])
    assert catalogue[NAME].name == NAME
    assert NAME not in CATALOGUE


def test_it_obeys_the_laws_of_every_effect(effect: Effect) -> None:
    report = check_effect(effect)
    assert report.ok, report


@pytest.mark.parametrize("stage", [MujocoSimulator, ReducedSimulator])
def test_it_acts_in_the_simulation(
    effect: Effect, stage: type[MujocoSimulator] | type[ReducedSimulator]
) -> None:
    """Its force and state are logged, and are those of its equation on the logged motion."""
    a, pitch, c = 0.7, 0.04, 25.0
    log = simulate(with_it(effect, a=a, pitch=pitch, c=c), "moves", duration=2.0, simulator=stage)
    true = log.truth["x"]
    x = true["position"] + 0.5 * log.period * true["velocity"]  # where the step evaluates the law
    wanted = a * np.sin(2.0 * np.pi * x / pitch) - c * true["velocity"] ** 3
    np.testing.assert_allclose(true[NAME], wanted, rtol=0, atol=1e-9)
    distance = np.cumsum(np.abs(true["velocity"])) * log.period
    np.testing.assert_allclose(true[f"{NAME}_distance"], distance, rtol=1e-9)
    assert np.abs(wanted).max() > a


def test_mujoco_and_the_reduced_model_agree_on_it(effect: Effect) -> None:
    def position(stage: type[MujocoSimulator] | type[ReducedSimulator], a: float) -> np.ndarray:
        log: Log = simulate(with_it(effect, a=a), "moves", duration=1.0, simulator=stage)
        return log.truth["x"]["position"]

    found = position(MujocoSimulator, 5.0)
    np.testing.assert_allclose(position(ReducedSimulator, 5.0), found, rtol=0, atol=2e-9)
    assert np.abs(position(MujocoSimulator, 0.0) - found).max() > 1e-6


def test_a_model_with_it_is_saved_and_read_again(
    catalogue: Catalogue, effect: Effect, tmp_path: Path
) -> None:
    save_model(with_it(effect, a=0.3, c=2.0), tmp_path / "stage.toml")
    read = load_model(tmp_path / "stage.toml", catalogue)
    assert read.axes["x"][NAME].values == {"a": 0.3, "pitch": 0.05, "c": 2.0}
    with pytest.raises(InputError, match=f"unknown effect '{NAME}'"):
        load_model(tmp_path / "stage.toml", CATALOGUE)


def test_an_edited_file_acts_as_it_reads_now(file: Path) -> None:
    """Native code of the old text must not live on in a cache."""
    file.write_text(SOURCE.replace("io[OUT] = p[0]", "io[OUT] = -2.0 * p[0]"))
    edited = load_catalogue([file])[NAME]
    log = simulate(with_it(edited, a=0.7), "moves", duration=0.5)
    true = log.truth["x"]
    x = true["position"] + 0.5 * log.period * true["velocity"]
    np.testing.assert_allclose(true[NAME], -1.4 * np.sin(2.0 * np.pi * x / 0.05), atol=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1\n", "defines no EFFECT"),
        ("EFFECT = 3\n", "defines no EFFECT"),
        ("import no_such_module_anywhere\n", "cannot be loaded as an effect"),
        ("def law(:\n", "cannot be loaded as an effect"),
        (SOURCE.replace('"N", 0.0, -100.0', '"", 0.0, -100.0'), "has no unit"),
        (SOURCE.replace("0.05, 1e-3", "5.0, 1e-3"), "outside its bounds"),
        (SOURCE.replace('"pitch"', '"a"'), "used twice"),
    ],
)
def test_a_file_that_is_no_effect_is_refused_in_one_line(
    file: Path, text: str, message: str
) -> None:
    file.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        load_catalogue([file])
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such effect file"):
        load_catalogue([tmp_path / "absent.py"])


def test_a_law_that_cannot_be_compiled_is_refused_in_one_line(file: Path) -> None:
    file.write_text(SOURCE.replace("io[OUT] = p[0]", "io[OUT] = float('%g' % p[0])"))
    with pytest.raises(InputError, match=f"effect '{NAME}': its law cannot be compiled") as caught:
        load_catalogue([file])
    assert "\n" not in str(caught.value)
