"""The demonstration: what it hides in a machine, it finds again."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from built_fits import CATALOGUE, HARDWARE, axis_of, fitted
from cli_runs import in_small, refusal, twin
from planted_logs import SLIDE

from identify import demo
from identify.dataset.preparation import datasets
from identify.estimation.evidence import rms
from identify.estimation.fit import error_on
from twin.effects import Catalogue
from twin.errors import InputError
from twin.experiments.named import simulate
from twin.logs import read_log
from twin.model.file import load_model, save_model
from twin.model.machine import MachineModel
from twin.simulator import ReducedSimulator


@pytest.mark.slow
def test_a_demonstration_hides_what_it_finds_again(tmp_path):
    """By its command, among few effects."""
    own = MachineModel("s", {"x": replace(SLIDE, hardware=HARDWARE)}, 1000.0)
    save_model(own, tmp_path / "m.toml")
    asked = ("demo", "-o", "new", "--seed", "3", "--model", "m.toml")
    with in_small("coulomb_viscous", "periodic_disturbance", "constant_force"):
        done = twin(*asked, "--json", folder=tmp_path)
    told, said = json.loads(done.stdout), done.stderr.splitlines()
    assert (done.returncode, told["named"]) == (0, True)
    assert [line[:2] for line in said if line[1] == "."] == ["1.", "2.", "3.", "4.", "5."]
    hidden = told["hidden"]
    assert told["addition"]["effect"] == hidden
    assert f"names {hidden} on x" in done.stderr
    logs = {p.name: read_log(p) for p in sorted((tmp_path / "new").glob("*.mcap"))}
    assert [log.metadata["experiment"] for log in logs.values()] == [*("tracking", "moves") * 2]
    assert len({log.metadata["seed"] for log in logs.values()}) == 4
    written = load_model(tmp_path / "new" / "better.toml", CATALOGUE)
    assert written.axes["x"].names == ("coulomb_viscous", hidden)
    (step,) = written.history
    assert step.test_error_before > 2.0 * step.test_error_after
    assert f"{step.test_error_before / step.test_error_after:.0f} times" in done.stderr
    tracked = told["feedforward"]["axes"]["x"]
    assert tracked["diagnosed"]["rms"] < tracked["before"]["rms"] < tracked["without"]["rms"]
    assert (tmp_path / told["report"]).read_text(encoding="utf-8").count("<section") > 3
    assert "cannot be made" in refusal(*asked[:1], "-o", "m.toml/in", folder=tmp_path)


def test_only_what_shows_is_hidden():
    model = MachineModel("m", {"x": axis_of(fitted("cogging"))}, 1000.0)
    names = ("cogging", "constant_force", "gms", "encoder_delay", "periodic_disturbance")
    some = Catalogue([CATALOGUE[n] for n in names])
    found, hidden = demo.hidden_machine(model, some, np.random.default_rng(1))
    assert hidden.effect.name in ("constant_force", "periodic_disturbance")
    assert found.axes["x"].names == (*model.axes["x"].names, hidden.effect.name)
    log = simulate(found, "tracking", seed=1, duration=3.0, simulator=ReducedSimulator)
    dataset = datasets(found, {"a": log}, {})["x"]
    without = rms(error_on(found.axes["x"].without(hidden.effect.name), dataset.fit))
    assert without == pytest.approx(demo.FORCE, rel=0.1)
    with pytest.raises(InputError, match="another seed"):
        demo.hidden_machine(model, Catalogue([some["gms"]]), np.random.default_rng(1))
