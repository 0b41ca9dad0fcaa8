"""What every command does around its work: nothing that it reads is overwritten, one way to print.

Whether it can write is known before the work.
"""

from __future__ import annotations

import inspect
import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from itertools import combinations, product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand

from twin.errors import InputError
from twin.files import is_same_file, require_writable

if TYPE_CHECKING:
    from identify.output.answers.answer import Answer

FOLDER = "folder"
OUTPUTS = (
    FOLDER,
    "out",
    "html",
    "mcap",
    "plot",
    "setpoints",
    "video",
    "rerun",
)  # parameters: what is written
UPDATED = {"fit": "model", "add": "model"}  # what a command may write over: it holds all of it
AS_JSON = inspect.Parameter(
    "as_json",
    inspect.Parameter.KEYWORD_ONLY,
    default=False,
    annotation=Annotated[
        bool, typer.Option("--json", help="Print one JSON object and nothing else.")
    ],
)


@dataclass(frozen=True)
class Said:
    """What a command says: text or, with --json, the answer; warnings on standard error.

    fine: whether the exit code is 0, else 1.
    """

    text: str
    answer: Answer
    warnings: Sequence[str] = ()
    fine: bool = True


class Commands(typer.Typer):
    """The commands: each may print JSON, and none overwrites what it reads.

    In the list of commands each has the first sentence of its help, whole.
    """

    def command(self, name: str | None = None, **options: Any) -> Any:
        def register(job: Callable[..., Said]) -> Callable[..., Said]:
            own = inspect.signature(job, eval_str=True)

            @wraps(job)
            def run(as_json: bool, **given: Any) -> int:
                said = job(**given)
                for warning in said.warnings:
                    print(f"twin: {warning}", file=sys.stderr)
                print(json.dumps(said.answer.entries()) if as_json else said.text)
                return 0 if said.fine else 1

            parameters = [*own.parameters.values(), AS_JSON]
            run.__signature__ = own.replace(parameters=parameters)  # type: ignore[attr-defined]
            run.__annotations__[AS_JSON.name] = AS_JSON.annotation
            first = (job.__doc__ or "").split("\n\n")[0]
            known = {"short_help": " ".join(first.split()), **options}
            super(Commands, self).command(name, cls=Command, **known)(run)
            return job

        return register


class Command(TyperCommand):
    """A command that overwrites no file that it reads, and no output with another."""

    def invoke(self, ctx: Any) -> Any:
        outputs, inputs = {}, {}
        for param in self.params:
            given = ctx.params.get(param.name)
            if param.name in OUTPUTS and given is not None:
                outputs[min(param.opts, key=len)] = param.name, Path(given)
            elif param.name != UPDATED.get(self.name or ""):
                inputs[_called(param)] = given
        require_apart({option: path for option, (_, path) in outputs.items()}, inputs)
        for name, path in outputs.values():
            if name == "html" and path.suffix.lower() not in (".html", ".htm"):
                raise InputError(f"{path}: a report is an .html file; give such a name")
            if name == "rerun" and path.suffix.lower() != ".rrd":
                raise InputError(f"{path}: Rerun opens an .rrd file; give such a name")
            if name != FOLDER:
                require_writable(path)
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
