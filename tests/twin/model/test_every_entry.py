"""Every entry of a model and of an experiment with every wrong type, value and nesting."""

import copy
import datetime
import json
import math
import os
import runpy
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
import tomlkit
from machines import CATALOGUE

from twin.errors import InputError
from twin.experiments.file import load_experiment, parse_experiment
from twin.experiments.kinds import KINDS
from twin.importers import load_mapping
from twin.model.file import load_model, models_folder, parse_model, save_model
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.schemas import FOLDER, written

WRONG: tuple[Any, ...] = (
    True, 0, -1, 1e300, math.nan, -math.inf, 10**400, "", "2.0", "x\n\x00", "a" * 300, [],
    [1.0, 2.0, 3.0], [True, "x"], {}, {"a": {"b": 1}}, {"": []}, [{"mass": 1}],
    datetime.date(2020, 1, 1), None,
)  # fmt: skip
HISTORY = {"action": "add", "effect": "cogging", "axis": "x", "fit_error_before": 2.0,
           "fit_error_after": 1.0, "unit": "N", "notes": ["why"]}  # fmt: skip

MAP = """
format = "csv"
delimiter = ";"
decimal = ","
header_line = 1
time = {column = "t", unit = "s"}
[axes.x]
force_constant = 2.0
position = {column = "q", unit = "mm", sign = -1, offset = 1.0, delay_samples = 2}
force = {column = 3, unit = "V", scale = 35.0}
"""


def complete() -> dict[str, Any]:
    """A document that has every entry of a model, with a few effects."""
    text = (models_folder() / "proton_xy.toml").read_text()
    document = tomllib.loads(text)
    document.pop("mujoco")
    document["history"] = [dict(HISTORY)]
    document["axes"]["x"]["fixed"] = ["mass"]
    document["axes"]["x"]["effects"]["gms"] = {"elements": 3}
    del document["axes"]["x"]["effects"]["lugre"]
    return document


def places(document: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The path of every table, list and value."""
    if path:
        yield path
    if isinstance(document, dict):
        for key in document:
            yield from places(document[key], (*path, key))
    elif isinstance(document, list):
        for i, value in enumerate(document):
            yield from places(value, (*path, i))


def changed(document: Any, path: tuple[Any, ...], value: Any) -> Any:
    copied = copy.deepcopy(document)
    at = copied
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = value
    return copied


def test_every_entry_of_a_model_with_everything_wrong():
    """Where a number stands, nothing passes but a finite number, or none where it has a default."""
    document = complete()
    parse_model(document, CATALOGUE, None, "m.toml")
    refused, numbers = 0, 0
    for path in places(document):
        number = isinstance(value_at(document, path), float) and path[0] != "history"
        numbers += number
        for value in WRONG:
            text = answer(
                lambda p=path, v=value: parse_model(changed(document, p, v), CATALOGUE, None, "m")
            )
            if text is None:
                allowed = value is None or (type(value) in (int, float) and abs(value) < 1e308)
                assert allowed or not number, (path, value)
                continue
            refused += 1
            assert text.startswith("m: ")
            assert "\n" not in text
            assert len(text) < 800
    assert refused > 1000
    assert numbers > 20


def answer(load: Callable[[], object]) -> str | None:
    """What a refusal says; any other error is a fault of the program."""
    try:
        load()
    except InputError as error:
        return str(error)
    return None


def value_at(document: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        document = document[key]
    return document


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("samplerate",), 2000.0, r"unknown entry 'samplerate'; did you mean 'sample_rate'\?"),
        (("axes", "x", "encoder_noise"), -1e-9, "encoder_noise = -1e-09: give a number from 0"),
        (("axes", "x", "force_constant"), 0, "force_constant = 0: give a number above 0.* N/A"),
        (("axes", "x", "travel"), [1.0, 0.0], r"travel = \[1.0, 0.0\]: give two numbers, the low"),
        (("axes", "x", "effects", "coging"), {}, "did you mean 'cogging'"),
        (("axes", "x", "effects", "cogging"), {"pich": 1.0}, "'cogging' has no parameter 'pich'"),
        (("axes", "a b"), {"mass": 1.0}, "give a table for each of 1 to 64 axes"),
        (("mujoco",), "../other.xml", "without folders"),
        (("name",), "x\n\x00", "give a text of up to 200 characters on one line"),
        (("intervals",), {"x": {"above_floor": -0.1}}, "intervals.x.above_floor = -0.1: give "),
        (("intervals",), {"x": {"mass": [2.0, 1.0]}}, r"mass = \[2.0, 1.0\]: give two numbers, "),
        (("intervals",), {"q": {}}, "intervals: the model has no axis 'q'; it has x, y"),
        (("history", 0, "notes"), "why", r"history.0: notes = 'why': give a list of texts"),
    ],
)  # fmt: skip
def test_nonsense_is_refused_with_what_is_allowed(path, value, message) -> None:
    with pytest.raises(InputError, match=message):
        parse_model(changed(complete(), path, value), CATALOGUE, None, "m.toml")


def test_a_log_in_the_place_of_a_model_is_said_to_be_one(tmp_path: Path) -> None:
    (tmp_path / "run.mcap").write_bytes(b"\x89MCAP0\r\n")
    with pytest.raises(InputError, match="is an MCAP log and no TOML file; a model comes before"):
        load_model(tmp_path / "run.mcap", CATALOGUE)


def test_the_mark_that_editors_of_windows_begin_with_is_no_fault(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_bytes(b"\xef\xbb\xbf" + b'name = "m"\nsample_rate = 1000.0\n[axes.x]\nmass = 2.0\n')
    assert load_model(path, CATALOGUE).axes["x"].mass == 2.0


def test_a_number_in_quotes_is_shown_in_them(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text(
        'name = "m"\nsample_rate = 1000.0\n[axes.x]\nmass = 2.0\n'
        '[axes.x.effects.coulomb_viscous]\nFc = "1.0"\nFs = 1.0\nsigma2 = 0.0\n'
    )
    with pytest.raises(InputError, match=r"Fc = '1\.0': is not a finite number; give it in N"):
        load_model(path, CATALOGUE)


@pytest.mark.parametrize(
    "text", ["a = " + "[" * 5000, "a = " + "9" * 5000, "a = 1\na = 2", "\x00", "[axes.x"]
)
def test_a_file_that_is_no_toml_is_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "m.toml"
    path.write_text(text)
    for load in (lambda: load_model(path, CATALOGUE), lambda: load_experiment(path)):
        with pytest.raises(InputError, match=r"m\.toml: is not a TOML file") as refused:
            load()
        assert "\n" not in str(refused.value)


def test_what_could_not_be_read_is_not_written(tmp_path: Path) -> None:
    model = MachineModel("m", {"1": AxisModel(1.0)})
    text = answer(lambda: save_model(model, tmp_path / "m.toml"))
    assert text is not None
    assert text.startswith(f"{tmp_path / 'm.toml'}: axes.1: give")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("values", "fixed", "said"),
    [
        ({"a1": math.nan}, (), "cogging.a1 = nan: is not a finite number; give it in N"),
        ({"p": 1e99}, (), "cogging.p = 1e+99 m: outside ["),
        ({}, ("zz",), "cogging.zz: is no value of the effect; give p, a1"),
    ],
)
def test_a_value_that_no_effect_has_is_not_written(
    tmp_path: Path, values: dict[str, float], fixed: tuple[str, ...], said: str
) -> None:
    """They were written, and the file was refused when it was read."""
    law = Fitted.at_start(CATALOGUE["cogging"])
    law = Fitted(law.effect, {**law.values, **values}, frozenset(fixed))
    model = MachineModel("m", {"x": AxisModel(1.0, effects=(law,))})
    text = answer(lambda: save_model(model, tmp_path / "m.toml"))
    assert text is not None
    assert text.startswith(f"{tmp_path / 'm.toml'}: axes.x: {said}")
    assert not list(tmp_path.iterdir())


COARSE = {"travel": (-2e6, 2e6), "encoder_resolution": 1.83, "velocity": 3.0}


def test_hardware_that_a_file_may_not_hold_has_its_default() -> None:
    assert Hardware.of_allowed(**COARSE) == Hardware(velocity=3.0)
    assert Hardware.of_allowed(travel=(-1.0, 2.0)) == Hardware(travel=(-1.0, 2.0))


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: Hardware(force_constant=0.0), "force_constant = 0.0 N/A: give a number above 0"),
        (lambda: Hardware(force_limit=-5.0), "force_limit = -5.0 N: give a number above 0"),
        (lambda: Hardware(bandwidth=math.nan), "bandwidth = nan Hz: give a number above 0"),
        (lambda: Hardware(encoder_noise=-1.0), "encoder_noise = -1.0 m: give a number from 0"),
        (lambda: Hardware(travel=(1.0, 0.0)), "travel = [1.0, 0.0] m: give its low and its high"),
        (lambda: Hardware(**COARSE), "travel = [-2000000.0, 2000000.0] m: give its low"),
        (lambda: AxisModel(None), "mass = None kg: must be"),
        (lambda: AxisModel(1.0, test_function=math.nan), "test_function = nan s: give a number"),
        (lambda: AxisModel(1.0, channel_delay=1e9), "channel_delay = 1000000000.0 s: give a"),
        (lambda: MachineModel("m", {}, -1.0), "sample_rate = -1.0 Hz: give a number above 0"),
    ],
)
def test_what_no_file_may_hold_no_model_may_have(made: Callable[[], object], said: str) -> None:
    """From Python, force_constant = 0 logged no number for a force, and a limit below 0 pushed."""
    with pytest.raises(InputError) as refused:
        made()
    assert str(refused.value).startswith(said)


@pytest.mark.parametrize("kind", KINDS)
def test_every_entry_of_an_experiment_with_everything_wrong(kind: str) -> None:
    for f in fields(KINDS[kind]):
        for value in WRONG:
            text = answer(lambda n=f.name, v=value: parse_experiment({"kind": kind, n: v}))
            assert text is None or "\n" not in text


def test_every_entry_of_a_map_with_everything_wrong(tmp_path: Path) -> None:
    path = tmp_path / "map.toml"
    path.write_text(MAP)
    load_mapping(path)
    document = tomllib.loads(MAP)
    for place in places(document):
        for value in (w for w in WRONG if w is not None):  # which no file can say
            path.write_text(tomlkit.dumps(changed(document, place, value)))
            text = answer(lambda: load_mapping(path))
            assert text is None or (text.startswith(str(path)) and "\n" not in text)


def test_the_schemas_that_ship_are_those_that_the_command_writes() -> None:
    shipped = {path: path.read_text(encoding="utf-8") for path in written()}
    assert shipped == written(), "run python -m twin.schemas"
    for path in shipped:
        os.utime(path, (0, 0))
    runpy.run_module("twin.schemas", run_name="__main__")
    assert {path: path.read_text(encoding="utf-8") for path in shipped} == shipped
    assert all(path.stat().st_mtime > 0 for path in shipped)


def test_an_editor_finds_every_entry_effect_and_parameter_in_the_schema() -> None:
    schema = json.loads((FOLDER / "model.schema.json").read_text(encoding="utf-8"))
    entries = schema["$defs"]["AxisEntry"]["properties"]
    hardware, kept = {f.name for f in fields(Hardware)}, {"test_function", "channel_delay"}
    assert set(entries) == hardware | kept | {"mass", "inertia", "joint", "fixed", "effects"}
    effects = entries["effects"]["properties"]
    assert set(effects) == set(CATALOGUE)
    for name, effect in CATALOGUE.items():
        assert {p.name for p in effect.parameters} <= set(effects[name]["properties"])
