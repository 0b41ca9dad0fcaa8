"""A comparison as MCAP: what any reader finds in it, and the layout that shows it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli_runs import in_small, twin
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from twin.errors import InputError
from twin.logs import write_topics

LAYOUT = Path(__file__).parents[3] / "examples" / "foxglove.json"
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
        twin("simulate", "tracking", "-o", "l.mcap", folder=tmp_path)
        done = twin("compare", "proton_xy", "l.mcap", "--mcap", "s.mcap", folder=tmp_path)
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
