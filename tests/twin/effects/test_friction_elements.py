"""Frictions of any number of elements, given in the model file."""

from pathlib import Path

import pytest
from effect_runs import CATALOGUE, FRICTIONS

from twin.effect import ELEMENTS, Effect
from twin.errors import InputError
from twin.model.file import load_model, save_model
from twin.model.machine import MachineModel
from twin.model.parameters import free_parameters

SIZED = [e for e in FRICTIONS if e.of_size is not None]
EVERY = pytest.mark.parametrize("effect", SIZED, ids=lambda e: e.name)
FILE = """
name = "one axis"
[axes.x]
mass = 2.0\ntravel = [-0.1, 0.1]
[axes.x.effects.{name}]
{lines}
"""


def loaded(folder: Path, name: str, lines: str) -> MachineModel:
    path = folder / "stage.toml"
    path.write_text(FILE.format(name=name, lines=lines))
    return load_model(path, CATALOGUE)


@EVERY
@pytest.mark.parametrize("count", [1, 4])
def test_the_model_file_says_how_many_elements(effect: Effect, count: int, tmp_path: Path) -> None:
    fitted = loaded(tmp_path, effect.name, f"elements = {count}").axes["x"][effect.name]
    assert fitted.effect.name == effect.name
    assert fitted.values[ELEMENTS] == count
    assert fitted.values[f"share_{count}"] == 1.0
    assert len(fitted.effect.states) in (count, 2 * count)
    assert f"share_{count + 1}" not in fitted.values


@EVERY
def test_elements_and_their_own_values_survive_saving(effect: Effect, tmp_path: Path) -> None:
    lines = "elements = 7\nFc = 0.2\nFs = 0.25\nstiff_7 = 0.125\nshare_2 = 3.0\nfixed = []"
    model = loaded(tmp_path, effect.name, lines)
    save_model(model, tmp_path / "again.toml")
    again = load_model(tmp_path / "again.toml", CATALOGUE)
    assert again.axes["x"][effect.name].values == model.axes["x"][effect.name].values
    assert again.axes["x"][effect.name].effect is model.axes["x"][effect.name].effect


@EVERY
def test_their_number_is_never_fitted_and_few_numbers_are_unless_asked(effect, tmp_path):
    def fitted(lines: str) -> set[str]:
        free = free_parameters(loaded(tmp_path, effect.name, lines).axes["x"])
        return {c.parameter.name for c in free}

    assert "stiff_2" in fitted("elements = 2\nfixed = []")
    assert ELEMENTS not in fitted("elements = 2\nfixed = []")
    assert {"Fc", "Fs", "v0", "sigma2", "sigma0", "spread"} <= fitted("elements = 2")
    assert len(fitted("elements = 2")) <= 8, "the mass too"


@EVERY
@pytest.mark.parametrize("count", ["0", "2.5", "1001", '"six"'])
def test_a_bad_number_of_elements_is_refused(effect: Effect, count: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"whole number of elements from 1 to 1000"):
        loaded(tmp_path, effect.name, f"elements = {count}")
