"""What a command says and writes is what its call from Python gives, with every option given."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import numpy as np
import pytest
from cli_runs import twin
from planted_logs import SLIDE, Ride, having, logged
from strict_json import strict, valid

from identify import workflow
from identify.output import as_json
from identify.output import text as as_text
from identify.output.words.next_step import Source
from twin.effects import Catalogue, load_catalogue
from twin.experiments.file import load_experiment
from twin.experiments.named import simulate
from twin.logs import read_log, write_log
from twin.model.file import load_model, save_model
from twin.model.machine import MachineModel

OWN = Path(__file__).parents[2] / "examples" / "my_effect.py"
HELD, TESTED = ("--holdout", "b.mcap"), ("--test", "c.mcap")
COMMON = ("--test-function", "0.07")
TYPED = (*COMMON, "--effects", str(OWN))  # that the next command needs as well


FEW = ("coulomb_viscous", "quadratic_drag", "cogging", "wear", OWN.stem)


def few(user_files=()) -> Catalogue:
    """The catalogue in small, so that a diagnosis takes seconds."""
    return Catalogue([e for n, e in load_catalogue(user_files).items() if n in FEW])


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A model of one axis, and logs of it with a drag that it lacks."""
    path = tmp_path_factory.mktemp("machine")
    save_model(MachineModel("slide", {"x": SLIDE}, 1000.0), path / "m.toml")
    dragged = having(SLIDE, "quadratic_drag", c=3.0)
    for seed, name in enumerate("abc", start=1):
        write_log(logged(dragged, Ride(seed, 4.0)), path / f"{name}.mcap")
    return path


def logs_of(folder: Path, *names: str) -> dict:
    return {f"{n}.mcap": read_log(folder / f"{n}.mcap") for n in names}


def called(name: str, folder: Path) -> object:
    """The call from Python that a command with HELD, TESTED and COMMON stands for."""
    catalogue = few([OWN] if name == "diagnose" else ())
    model = load_model(folder / "m.toml", catalogue)
    fit, held, test = (logs_of(folder, n) for n in "abc")
    if name == "compare":
        return workflow.compare(model, fit, test_function=0.07)
    if name == "plan":
        between = [catalogue["quadratic_drag"], catalogue["cogging"]]
        return workflow.plan(
            model, fit, held, between=between, catalogue=catalogue, axis="x", duration=3.0,
            test_function=0.07,
        )  # fmt: skip
    if name == "add":
        effect = catalogue["quadratic_drag"]
        return workflow.add(effect, model, fit, held, test, axis="x", test_function=0.07)
    call = {"fit": workflow.fit, "diagnose": workflow.diagnose}[name]
    return call(model, fit, held, test, catalogue=catalogue, test_function=0.07)


ARGUMENTS = {
    "fit": ("m.toml", "a.mcap", *HELD, *TESTED),
    "compare": ("m.toml", "a.mcap"),
    "diagnose": ("m.toml", "a.mcap", *HELD, *TESTED, "--effects", OWN),
    "add": ("quadratic_drag", "m.toml", "a.mcap", *HELD, *TESTED, "--axis", "x"),
    "plan": ("m.toml", "a.mcap", *HELD, "--between", "quadratic_drag", "cogging", "--axis", "x",
             "--duration", "3"),
}  # fmt: skip
OUT = {"fit": "f.toml", "add": "n.toml", "plan": "e.toml"}


@pytest.mark.parametrize("name", ARGUMENTS)
def test_a_command_tells_and_writes_what_its_call_gives(folder, name, monkeypatch):
    monkeypatch.setattr("twin.effects.load_catalogue", few)
    out = OUT.get(name, f"{name}.html")
    done = twin(name, *ARGUMENTS[name], *COMMON, "-o", out, "--json", folder=folder)
    found = called(name, folder)
    wanted, told = strict(as_json.json_of(found)), json.loads(done.stdout)
    added = {"left_out", "data_faults", "file", "setpoints"}
    assert {k: v for k, v in told.items() if k not in added} == {
        k: v for k, v in wanted.items() if k not in added
    }
    valid(told)
    assert done.returncode == 0, done.stderr
    assert (folder / out).is_file()
    text = twin(name, *ARGUMENTS[name], *COMMON, "-o", out, folder=folder).stdout
    source = () if name != "diagnose" else (Source(model="m.toml", options=shlex.join(TYPED)),)
    assert text.startswith(getattr(as_text, f"{name}_text")(found, *source))
    if name in ("fit", "add"):
        again = load_model(folder / out, load_catalogue())
        assert again.axes["x"].names == found.model.axes["x"].names
        assert again.axes["x"].mass == pytest.approx(found.model.axes["x"].mass)
    if name == "plan":
        assert (found.favoured, found.supposed) == ("quadratic_drag", False)
        assert found.gap.share is not None
        assert load_experiment(folder / out) == found.chosen.experiment
        assert f"twin simulate {out}" in text
        assert (folder / told["setpoints"]).name == "e.setpoints.csv"
        assert (folder / told["setpoints"]).is_file()
    if out.endswith(".html"):
        assert (folder / out).read_text(encoding="utf-8").count("<section") > 3


def test_a_simulation_is_that_of_its_seed_duration_and_axis(folder):
    asked = ("--model", "m.toml", "--seed", "5", "--duration", "1.5", "--axis", "x")
    done = twin("simulate", "cable_pass", *asked, "-o", "r.mcap", "--json", folder=folder)
    log = read_log(folder / "r.mcap")
    assert valid(json.loads(done.stdout)) == {
        "log": "r.mcap", "samples": len(log), "sample_rate": 1000.0, "unit": "Hz",
        "setpoints": None,
    }  # fmt: skip
    model = load_model(folder / "m.toml", load_catalogue())
    wanted = simulate(model, "cable_pass", seed=5, duration=1.5, axis="x")
    np.testing.assert_array_equal(log.axes["x"].position, wanted.axes["x"].position)


def test_the_catalogue_is_printed_and_one_effect_drawn(tmp_path):
    every = json.loads(twin("effects", "--json", folder=tmp_path).stdout)["effects"]
    assert [e["name"] for e in every] == list(load_catalogue())
    one = valid(json.loads(twin("effects", "wear", "--json", folder=tmp_path).stdout))
    assert one in every
    done = twin("effects", "--plot", "w.svg", folder=tmp_path)
    said = "twin: --plot w.svg: draws one effect; give its NAME\n"
    assert (done.returncode, done.stderr) == (2, said)
    assert "wear" in twin("effects", "wear", "--plot", "w.svg", folder=tmp_path).stdout
    assert "<svg" in (tmp_path / "w.svg").read_text(encoding="utf-8")


def test_a_check_ends_with_one_where_a_log_is_unfit(folder):
    log = read_log(folder / "a.mcap")
    log.axes["x"].columns["force"][:] *= -1.0  # of the other sign
    write_log(log, folder / "h.mcap")
    for first, code in (("h.mcap", 1), ("a.mcap", 0)):
        done = twin("check", first, "b.mcap", "--json", folder=folder)
        told = json.loads(done.stdout)
        assert (done.returncode, told["ok"]) == (code, code == 0)
        assert list(told["logs"]) == [first, "b.mcap"]
