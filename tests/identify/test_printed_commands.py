"""Every command that is printed can be typed as it stands: it is run, or parsed.

On machines of one axis and of two, linear and rotary, with names that hurt.
"""

import ast
import inspect
import re
import shlex
from pathlib import Path

import pytest
import typer
from check_drive import drive
from cli_runs import twin

import identify
import twin as toolbox
from identify.cli.shared import app
from identify.dataset.dataset import Role
from identify.output.words.next_step import WRITE, Source
from twin.logs import LINEAR_UNITS, ROTARY_UNITS, Log, write_log

NAMES = ("MODEL_A.mcap", "Lauf 1 für Übung.mcap", "LOG....mcap", "it's $HOME.mcap")
FILLED = (
    "twin plan MODEL LOG... --axis {axis} --between cogging wear -o next.toml",
    WRITE,
    "twin add link_mass MODEL LOG... -o corrected.toml",
    "twin add empirical_map MODEL LOG... -o better.toml",
)


def late(seconds: float, kind: dict[str, str], axes: str) -> Log:
    """A log with a warning: the setpoint is early."""
    one = drive(1000.0, 4.0, late={"force": seconds}, kind=kind).axes["x"]
    return Log(1000.0, dict.fromkeys(axes, one))


@pytest.fixture(params=["x", "xy"], ids=["one axis", "two axes"])
def folder(request, tmp_path) -> Path:
    kind = LINEAR_UNITS if request.param == "x" else ROTARY_UNITS
    for name in NAMES:
        write_log(late(-5e-3, kind, request.param), tmp_path / name)
    return tmp_path


def commands_in(text: str) -> list[list[str]]:
    """The words of what is printed between marks of code, as a shell takes them."""
    return [shlex.split(line) for line in re.findall(r"`(twin [^`]*)`", text)]


def parsed(words: list[str]) -> dict[str, object]:
    """What the command line takes from a command. Fails where it does not take it."""
    group = typer.main.get_command(app)
    context = group.commands[words[1]].make_context(words[1], words[2:])
    return context.params


@pytest.mark.parametrize("name", NAMES)
def test_what_new_and_its_warnings_print_is_run_as_it_stands(folder, name):
    model = f"{Path(name).stem} Modell.toml"
    done = twin("new", name, "-o", model, folder=folder)
    assert done.returncode == 0, done.stderr
    (check,), (diagnose,) = commands_in(done.stderr), commands_in(done.stdout)
    assert check == ["twin", "check", name]
    assert "give position delay_samples = 5" in twin(*check[1:], folder=folder).stdout
    found = parsed(diagnose)
    assert (found["model"], found["logs"]) == (model, [Path(name)])


@pytest.mark.parametrize("text", FILLED)
@pytest.mark.parametrize("model", ["MODEL_A.toml", "better.toml", "Achse ü 1.toml", "LOG.toml"])
def test_a_next_step_names_the_files_that_were_given(text, model):
    training, selection, test = NAMES[:2], NAMES[2:3], NAMES[3:]
    names = {Role.TRAINING: training, Role.SELECTION: selection, Role.TEST: test}
    source = Source(model=model, options=("--effects", "my effects.py"))
    found = parsed(shlex.split(source.filled(text.format(axis="x"), names)))
    assert found["model"] == model
    assert found["logs"] == [Path(n) for n in training]
    assert found["holdout"] == [Path(n) for n in selection]
    if "plan" not in text:
        assert found["test"] == [Path(n) for n in test]
    assert found["effects"] == [Path("my effects.py")]
    written = found.get("better") or found["out"]
    assert Path(str(written)).suffix == ".toml"
    assert str(written) != model


@pytest.mark.parametrize("text", FILLED)
def test_what_a_result_in_memory_prints_is_a_call_from_python(text):
    """It printed "twin diagnose MODEL 'training 1'", which no shell runs."""
    line = Source().filled(text.format(axis="x"), {Role.TRAINING: ["training 1"]})
    called = ast.parse(line, mode="eval").body
    assert isinstance(called, ast.Call)
    package, name = ast.unparse(called.func).split(".")
    taken = inspect.signature(getattr({"identify": identify, "twin": toolbox}[package], name))
    named = {k.arg: k.value for k in called.keywords}
    taken.bind(*called.args, **named)
