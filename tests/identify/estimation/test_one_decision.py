"""An interval is told in the text, in JSON and in the model's file, or in none of them."""

from __future__ import annotations

import numpy as np
import pytest
from check_drive import drive

from identify.output.as_json import json_of
from identify.validation.agreement import agreement
from identify.workflow import fit
from twin.effects import Catalogue, load_catalogue
from twin.errors import InputError
from twin.logs.log import Array
from twin.model.file import load_model, save_model
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel

CATALOGUE = load_catalogue()
FRICTION = Fitted.at_start(CATALOGUE["coulomb_viscous"], {"Fc": 1.5, "Fs": 1.5, "sigma2": 3.5})
OFFSET = Fitted.at_start(CATALOGUE["constant_force"])


def noisy(columns: dict[str, Array]) -> None:
    """A force that is read with noise, so that there is a floor."""
    force = columns["force"]
    force += np.random.default_rng(5).normal(0.0, 0.2, len(force))


@pytest.mark.parametrize(("effects", "refused"), [((FRICTION, OFFSET), False), ((FRICTION,), True)])
def test_what_is_refused_is_not_written(tmp_path, effects, refused):
    """The drive has a constant force; without it the model is wrong, and no interval is kept."""
    model = MachineModel("m", {"x": AxisModel(2.0, Hardware(), effects)}, 1000.0)
    found = fit(model, {"l": drive(seconds=8.0, change=noisy)})
    assert (found.fits["x"].ratio > 1.3) is refused
    save_model(found.model, tmp_path / "m.toml")
    written = load_model(tmp_path / "m.toml", CATALOGUE)
    kept = written.intervals["x"].ends
    told = json_of(found)["axes"]["x"]["parameters"]
    ends = {label: tuple(p["interval_90"]) for label, p in told.items() if p["interval_90"]}
    assert kept == ends
    assert bool(kept) is not refused
    assert str(found).count("90 % in") == len(kept)
    if refused:
        with pytest.raises(InputError, match="its model is wrong: find what it lacks") as why:
            agreement(written, written, Catalogue([]))
        assert "\n" not in str(why.value)
