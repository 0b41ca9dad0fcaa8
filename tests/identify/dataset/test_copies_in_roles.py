"""A recording takes part once: no copy of it tests what was fitted to it, or counts beside it."""

from __future__ import annotations

import json
import logging
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from check_drive import DAMPING, MASS, drive
from cli_runs import refusal, twin
from constructed import effect

from identify.dataset.preparation import datasets
from identify.output.as_json import json_of
from identify.workflow import compare, fit
from twin.errors import InputError
from twin.logs import Log, write_log
from twin.logs.log import Array, thinned
from twin.model.file import save_model
from twin.model.machine import AxisModel, MachineModel

FRICTION = effect("coulomb_viscous", {"Fc": 1.5, "Fs": 1.5, "sigma2": DAMPING})
MODEL = MachineModel("m", {"x": AxisModel(MASS, effects=(FRICTION,))}, 1000.0)


@cache
def run(seed: int) -> Log:
    """The motion of the drive once more, with noise of its own."""
    rng = np.random.default_rng(seed)

    def noisy(columns: dict[str, Array]) -> None:
        columns["position"] += 1e-7 * rng.normal(size=len(columns["position"]))
        columns["force"] += 0.05 * rng.normal(size=len(columns["force"]))

    return drive(change=noisy)


def mirrored(log: Log) -> Log:
    return log.changed(lambda name, column: -column)


def changed(log: Log) -> Log:
    """Later, displaced, mirrored, thinned to means, and rounded."""
    part = thinned(log.part(203, len(log)), 2)
    return part.changed(
        lambda name, c: 0.02 - np.round(c, 6) if name == "position" else np.round(c, 1)
    )


COPIES = {
    "": lambda log: log,
    "position and force mirrored": mirrored,
    "thinned to 500 Hz": changed,
}


@pytest.mark.parametrize("way", COPIES)
@pytest.mark.parametrize(
    ("roles", "why"),
    [
        (("training", "selection"), "as a selection log it proves nothing"),
        (("training", "test"), "as a test log it proves nothing"),
        (("selection", "test"), "as a test log it proves nothing"),
    ],
)
def test_no_copy_tests_what_its_recording_decided(way: str, roles: tuple[str, str], why: str):
    given: dict[str, dict[str, Log]] = {"training": {"c": run(3)}, "selection": {}, "test": {}}
    for role, name, log in zip(roles, "ab", (run(1), COPIES[way](run(1))), strict=True):
        given[role] = {**given[role], name: log}
    with pytest.raises(
        InputError, match=f"^b is a copy of a.*{way}.*: {why}; give another"
    ) as told:
        datasets(MODEL, given["training"], given["selection"], test=given["test"])
    assert "\n" not in str(told.value)


def test_another_run_of_the_same_motion_tests_it():
    found = datasets(MODEL, {"a": run(1)}, {"b": changed(run(2))}, test={"c": mirrored(run(3))})
    assert [log.motion.name for log in found["x"].logs] == ["a", "b", "c"]


def test_the_copy_is_named_that_was_fitted():
    with pytest.raises(InputError, match=r"^a is a copy of b \(.*\): as a selection log b proves"):
        datasets(MODEL, {"a": changed(run(1))}, {"b": run(1)})


def test_a_recording_fitted_twice_counts_once(caplog):
    once, more = ({"a": run(1), **others} for others in ({}, {"b": mirrored(run(1))}))
    with caplog.at_level(logging.WARNING, "identify"):
        found = fit(MODEL, more)
    assert "b is left out: it is a copy of a (position and force mirrored)" in caplog.text
    assert json_of(found)["axes"]["x"]["left_out"] == ["b"]
    assert found.estimates == fit(MODEL, once).estimates
    assert list(compare(MODEL, more).axes["x"].position_error) == ["a"]


def test_logs_of_one_role_that_share_a_part_both_stay(caplog):
    parts = {"a": run(1).part(0, 2500), "b": run(1).part(2000, 4000)}
    with caplog.at_level(logging.WARNING, "identify"):
        found = datasets(MODEL, parts, {})
    assert [log.motion.name for log in found["x"].training] == ["a", "b"]
    assert "b: is in 25 % a copy of a" in caplog.text


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("copies")
    save_model(MODEL, path / "m.toml")
    logs = {"a": run(1), "other": run(2), "mirror": mirrored(run(1)), "slow": changed(run(1))}
    for name, log in logs.items():
        write_log(log, path / f"{name}.mcap")
    return path


@pytest.mark.parametrize(
    "command",
    ["fit m.toml", "diagnose m.toml", "add stribeck m.toml -o n.toml", "plan m.toml -o e.toml"],
)
def test_every_command_with_roles_refuses_it_in_a_line(folder: Path, command: str):
    told = refusal(*command.split(), "a.mcap", "--holdout", "slow.mcap", folder=folder)
    assert told.startswith("twin: slow.mcap is a copy of a.mcap (position mirrored")


def test_check_tells_which_logs_are_copies(folder: Path):
    done = twin(
        "check", "a.mcap", "other.mcap", "mirror.mcap", "slow.mcap", "--json", folder=folder
    )
    found = json.loads(done.stdout)["logs"]
    faults = {
        log: [f["fault"] for f in told if f["fault"] == "copy"] for log, told in found.items()
    }
    copied = {"mirror.mcap": ["copy"], "slow.mcap": ["copy"]}
    assert faults == {"a.mcap": [], "other.mcap": [], **copied}
    assert done.returncode == 1
    alone = twin("check", "mirror.mcap", "--json", folder=folder)
    assert "copy" not in alone.stdout
