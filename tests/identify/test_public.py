"""What Python users are offered, fits without a meaning, which are refused; files for viewers."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import cli_runs
import numpy as np
import pytest
from cli_runs import in_small
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

import identify
import twin
from identify.output.words.fit import objectives_in_words
from identify.results.results import SimulationFit
from twin.errors import InputError
from twin.logs import Log, logs_by_name, write_log, write_topics
from twin.model.machine import AxisModel


@pytest.fixture(scope="module")
def log() -> Log:
    return twin.simulate(twin.load_model("proton_xy"), "tracking", seed=1, duration=2.0)


@pytest.fixture(scope="module")
def file(log, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("public") / "run.mcap"
    twin.write_log(log, path)
    return path


@pytest.mark.parametrize("package", [identify, twin])
def test_a_package_offers_ten_to_forty_names_and_lists_them(package) -> None:
    assert 10 <= len(package.__all__) <= 40
    assert sorted(package.__all__) == sorted(n for n in dir(package) if not n.startswith("_"))
    for name in package.__all__:
        assert getattr(package, name).__doc__
    assert (Path(package.__file__).parent / "py.typed").is_file()
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = package.nothing


def test_a_fit_takes_a_log_a_path_a_list_and_a_dict_and_a_model_by_name(log, file) -> None:
    assert list(identify.first_model(log).axes) == list(log.axes)
    given = [log, file, str(file), [log], (file,), {"a": log}, {"a": file}]
    other = twin.simulate(twin.load_model("proton_xy"), "tracking", seed=2, duration=2.0)
    found = [identify.fit("proton_xy", one, other) for one in given[:2]]
    assert found[0].model.axes["x"].mass == pytest.approx(found[1].model.axes["x"].mass, rel=1e-6)
    assert found[0].datasets["x"].selection
    names = [list(logs_by_name(one, "training")) for one in given]
    alone, there = "training 1", str(file)
    assert names == [[alone], [there], [there], [alone], [there], ["a"], ["a"]]
    assert all(
        len(logs_by_name(one, "training")[n]) == len(log)
        for one, (n,) in zip(given, names, strict=True)
    )


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (3, "training: a int is no log; give a Log"),
        ([3.0], "training: a float is no log; give a Log"),
        ({"a": None}, "training 'a': a NoneType is no log; give a Log"),
        (["none.mcap", "none.mcap"], "training: none.mcap is given twice"),
        ("none.mcap", "none.mcap: cannot be read: No such file"),
        ([], "training: none is given; give a Log, the path of one"),
        (None, "training: none is given; give a Log, the path of one"),
    ],
)
def test_what_is_no_log_is_one_line(given, said) -> None:
    with pytest.raises(InputError) as error:
        identify.fit("proton_xy", given)
    assert str(error.value).startswith(said)
    assert "\n" not in str(error.value)


def test_what_is_no_model_is_one_line(log) -> None:
    for call in (identify.fit, identify.compare, identify.diagnose, identify.plan):
        with pytest.raises(InputError, match="model: a Log is no machine model; give a Machine"):
            call(log, "proton_xy")


def test_a_file_may_name_an_effect_of_the_catalogue_that_is_given(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("brake.py").write_text((Path(twin.__file__).parent / "effects/spring.py").read_text())
    own = twin.load_catalogue([Path("brake.py")])
    model = twin.load_model("proton_xy")
    braked = model.axes["x"].with_effect(twin.Fitted.at_start(own["brake"]))
    twin.save_model(model.with_axis("x", braked), "m.toml")
    for call, given, said in (
        (identify.fit, ("m.toml", "none.mcap"), "none.mcap: cannot be read"),
        (identify.diagnose, ("m.toml", "none.mcap"), "none.mcap: cannot be read"),
        (identify.feedforward, ("m.toml", "none.mcap"), "none.mcap: cannot be read"),
        (identify.compare, ("m.toml", "none.mcap"), "none.mcap: cannot be read"),
        (identify.add_found, ("m.toml", "m.toml", "none.mcap"), "found nothing that this model"),
        (identify.agree, ("m.toml", "m.toml"), "no parameter has an interval in both"),
    ):
        with pytest.raises(InputError, match=said):
            call(*given, catalogue=own)
    with pytest.raises(InputError, match=r"m\.toml: axes\.x: unknown effect 'brake'"):
        identify.fit("m.toml", "none.mcap")


def test_logs_and_models_print_themselves_in_a_line(log) -> None:
    assert repr(log).startswith("<Log of 2 s at 10000 Hz, x: setpoint_position, ")
    least = f"{log.axes['x'].position.min():.4g}"
    assert f"xpositionm{least}" in re.sub(r"<.*?>|\s", "", log._repr_html_())
    assert repr(log.axes["x"]).startswith("<AxisLog of 20000 samples: setpoint_position (m), ")
    model = twin.load_model("proton_xy")
    assert repr(model).startswith("<MachineModel Proton Motion Stage at 10000 Hz, ")
    assert repr(model.axes["x"]).startswith(f"<AxisModel of {model.axes['x'].mass:g} kg: ")
    assert max(len(repr(one)) for one in (log, log.axes["x"], model, model.axes["x"])) < 300


def test_logs_are_equal_where_their_samples_are(log) -> None:
    same = twin.simulate("proton_xy", "tracking", seed=1, duration=2.0)
    other = twin.simulate("proton_xy", "tracking", seed=2, duration=2.0)
    assert (log == same, log == other, log == 3) == (True, False, False)
    assert log.axes["x"] == same.axes["x"] != other.axes["x"]
    assert log in [other, same]


def test_what_has_no_response_or_another_ending_is_one_line(tmp_path) -> None:
    empty = identify.FrequencyResponse((), {})
    for call, said in (
        (lambda: empty.write(str(tmp_path / "x.foo")), "x.foo: a frequency response is .csv or"),
        (lambda: identify.frequency_response([]), "log: none is given"),
    ):
        with pytest.raises(InputError, match=said):
            call()
    empty.write(str(tmp_path / "x.csv"))
    assert (tmp_path / "x.csv").is_file()


def test_a_comparison_for_viewers_is_told_from_a_log(log, tmp_path) -> None:
    from identify.workflow import side_by_side_of

    side_by_side_of(identify.compare("proton_xy", log)).write(tmp_path / "side.mcap")
    with pytest.raises(InputError, match=r"side.mcap: is a comparison for viewers .*, not a log"):
        twin.read_log(tmp_path / "side.mcap")


STAGE = twin.load_model("proton_xy")


def scaled(log: Log, field: str, factor: float) -> Log:
    axes = {
        name: replace(a, columns={n: factor * c if n == field else c for n, c in a.columns.items()})
        for name, a in log.axes.items()
    }
    return replace(log, axes=axes)


@pytest.mark.parametrize(
    ("field", "factor", "said"),
    [("force", -1.0, "one of them is reversed"), ("position", 1e3, "unit")],
)
def test_a_reversed_force_or_a_wrong_unit_writes_nothing(log, tmp_path, field, factor, said):
    wrong = scaled(log, field, factor)
    write_log(wrong, tmp_path / "wrong.mcap")
    for command in ("fit", "add cogging", "diagnose"):
        out = "m.html" if command == "diagnose" else "m.toml"
        given = ("proton_xy", "wrong.mcap", "-o", out, "--json")
        done = cli_runs.twin(*command.split(), *given, folder=tmp_path)
        assert done.returncode == 2
        error = json.loads(done.stdout)["error"]
        assert error.startswith("wrong.mcap: axis x")
        assert said in error
        assert "; nothing is fitted to it" in error
        assert not (tmp_path / out).exists()


def disagreements(after: AxisModel) -> list[str]:
    """What is said where the fit of simulated motion ends there, begun at the stage's values."""
    fit = SimpleNamespace(axis=after, begun=STAGE.axes["x"])
    return objectives_in_words(SimulationFit(STAGE, None, {"x": fit}, {"x": None}))


@pytest.mark.parametrize(
    ("factor", "told"), [(2.5, True), (0.4, True), (1.9, False), (0.55, False)]
)
def test_a_parameter_that_two_objectives_give_far_apart_is_an_alarm(factor, told):
    after = replace(STAGE.axes["x"], mass=factor * STAGE.axes["x"].mass)
    said = disagreements(after)
    assert len(said) == told
    if told:
        assert said[0].startswith(f"alarm: axis x: mass is {after.mass:.4g} kg, and ")


def test_a_force_that_may_have_either_sign_is_none():
    begun = STAGE.axes["x"]
    effect, parameter = next(
        (f, p.name)
        for f in begun.effects
        for p in f.effect.parameters
        if p.lower < 0.0 and p.name not in f.fixed
    )
    other = replace(effect, values={**effect.values, parameter: 77.0})
    assert disagreements(begun.with_effect(other)) == []


LAYOUT = Path(__file__).parents[2] / "examples" / "foxglove.json"
Columns = dict[str, np.ndarray]


def stock_read(path: Path) -> dict[str, Columns]:
    """Topic -> column -> values, by the stock reader."""
    found: dict[str, dict[str, list[float]]] = {}
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()], validate_crcs=True)
        for _, channel, _, message in reader.iter_decoded_messages():
            columns = found.setdefault(channel.topic, {})
            for field in message.DESCRIPTOR.fields:
                columns.setdefault(field.name, []).append(getattr(message, field.name))
    return {t: {n: np.array(v) for n, v in c.items()} for t, c in found.items()}


def test_every_message_is_what_was_written(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    topics = {f"/{k}/x": {n: rng.standard_normal(500) for n in "ab"} for k in ("model", "left")}
    topics["/model/x"]["a"][3] = 0.0
    write_topics(topics, {"/model/x/a": "m"}, 1000.0, tmp_path / "a.mcap")
    found = stock_read(tmp_path / "a.mcap")
    assert found.keys() == topics.keys()
    for topic, columns in topics.items():
        for name, column in columns.items():
            np.testing.assert_array_equal(found[topic][name], column)
    with pytest.raises(InputError, match="is nan at"):
        write_topics({"/a": {"b": np.array([np.nan])}}, {}, 1.0, tmp_path / "b.mcap")


def test_measured_is_model_and_residual_and_the_layout_shows_them(tmp_path: Path) -> None:
    with in_small(duration=2.0):
        cli_runs.twin("simulate", "tracking", "-o", "l.mcap", folder=tmp_path)
        done = cli_runs.twin("compare", "proton_xy", "l.mcap", "--mcap", "s.mcap", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    found = stock_read(tmp_path / "s.mcap")
    for axis in "xy":
        parts = [found[f"/{kind}/{axis}"]["position"] for kind in ("measured", "model", "residual")]
        np.testing.assert_allclose(parts[0], parts[1] + parts[2], atol=1e-15)
        assert np.std(found[f"/residual/{axis}"]["force"]) > 0.0
    shown = json.loads(LAYOUT.read_text(encoding="utf-8"))["configById"]
    for panel in shown.values():
        for path in panel["paths"]:
            topic, _, column = path["value"].partition(".")
            assert column in found[topic]
