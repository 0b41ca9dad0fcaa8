"""A hint how to install names the folder where the package comes from one."""

import json
from importlib import invalidate_caches

import pytest

from twin.installed import pip_install

FOLDER = {"url": "file:///home/me/my%20twin", "dir_info": {}}


@pytest.mark.parametrize(
    ("source", "command"),
    [
        (None, 'pip install "proton-twin[import]"'),
        (
            {"url": "https://x.org/twin.whl", "archive_info": {}},
            'pip install "proton-twin[import]"',
        ),
        (FOLDER, "pip install '/home/me/my twin[import]'"),
        ({**FOLDER, "dir_info": {"editable": True}}, "pip install -e '/home/me/my twin[import]'"),
    ],
)
def test_it_is_that_of_the_installation(tmp_path, monkeypatch, source, command):
    info = tmp_path / "proton_twin-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: proton-twin\nVersion: 1.0\n")
    if source is not None:
        (info / "direct_url.json").write_text(json.dumps(source))
    monkeypatch.syspath_prepend(tmp_path)
    invalidate_caches()
    assert pip_install("import") == command
