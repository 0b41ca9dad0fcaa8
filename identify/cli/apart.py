"""What a command writes is never what it reads: refused for all commands here, before the work."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations, product
from pathlib import Path
from typing import Any

from typer.core import TyperCommand

from twin.errors import InputError
from twin.files import is_same_file

# Parameters that name what is written.
OUTPUTS = ("out", "mcap", "plot", "setpoints", "html", "video")
UPDATED = {"fit": "model", "add": "model"}  # what a command may write over: it holds all of it


class Command(TyperCommand):
    """A command that overwrites no file that it reads, and no output with another."""

    def invoke(self, ctx: Any) -> Any:
        outputs, inputs = {}, {}
        for param in self.params:
            given = ctx.params.get(param.name)
            if param.name in OUTPUTS and given is not None:
                outputs[min(param.opts, key=len)] = Path(given)
            elif param.name != UPDATED.get(self.name or ""):
                inputs[_called(param)] = given
        require_apart(outputs, inputs)
        return super().invoke(ctx)


def require_apart(outputs: Mapping[str, Path], inputs: Mapping[str, Any]) -> None:
    """Raise InputError where an output is an input or another output.

    outputs, inputs: by what they are called in the command; inputs of any kind, whose files are
    looked at.
    """
    for (one, first), (other, second) in combinations(outputs.items(), 2):
        if is_same_file(first, second):
            raise InputError(f"{one} {first} and {other} {second} are one file; give two names")
    for (option, path), (name, given) in product(outputs.items(), inputs.items()):
        for read in _files(given):
            if is_same_file(path, read):
                raise InputError(
                    f"{option} {path}: is the file that is read as {name}; give another name"
                )


def _called(param: Any) -> str:
    """What the help calls a parameter: LOG, --holdout."""
    name: str = max(param.opts, key=len)
    return name if name.startswith("-") else str(param.metavar or name).strip("[].").upper()


def _files(given: Any) -> Iterator[Path]:
    """The files that a value of a parameter may name."""
    if isinstance(given, list | tuple):
        for one in given:
            yield from _files(one)
    elif isinstance(given, Path):
        yield given
    elif isinstance(given, str):
        from twin.model.file import model_files

        yield from model_files(given)
