"""`twin fleet`: many logs of many machines, over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from identify.cli.command import Commands, Reply, progress_on_stderr, tried
from identify.cli.shared import Effects, Scheduler, app, written
from twin.errors import InputError
from twin.telling import heard

if TYPE_CHECKING:
    from identify.results.fleet import Floor

ABOUT = "Watch many machines: their logs over time, what changed and when."
fleet = Commands(
    help=f"{ABOUT}\n\nExample: twin fleet ingest nights --model stage.toml --store fleet",
    rich_markup_mode=None,
)
app.add_typer(fleet, name="fleet", short_help=ABOUT)

StoreOption = Annotated[Path, Option("--store", metavar="DIR", help="Folder of the records.")]
Workers = Annotated[
    int | None, Option(min=1, help="Processes on this computer; one a core if left out.")
]
Folder = Annotated[Path, Argument(metavar="FOLDER", help="Folder of MCAP logs, and those below.")]
ModelsOption = Annotated[
    str,
    Option(
        "--model",
        help="Machine model (.toml) of all machines, or a folder with MACHINE.toml of each and "
        "default.toml of the others.",
    ),
]
PatternOption = Annotated[
    str | None,
    Option(
        help="Where paths tell machine, axis and start and the logs do not, as "
        "'{machine}/{started}.mcap'."
    ),
]
Ingested = Annotated[
    Path | None,
    Option(
        "--logs",
        metavar="FOLDER",
        help="Folder that was ingested: the nights after an alarm of the force error are "
        "diagnosed.",
    ),
]
SameModels = Annotated[
    str | None, Option("--model", help="As for `twin fleet ingest`; with --logs.")
]


@fleet.command()
def ingest(
    logs: Folder,
    store: StoreOption,
    model: ModelsOption,
    pattern: PatternOption = None,
    scheduler: Scheduler = None,
    workers: Workers = None,
    effects: Effects = None,
) -> Reply:
    """Check and fit the logs of a folder that the store does not know yet, a record each.

    Example: twin fleet ingest nights --model stage.toml --store fleet
    """
    from identify.fleet.found_logs import Pattern
    from identify.fleet.ingest import ingest as run
    from identify.fleet.models import Models
    from identify.output.answers.fleet import IngestAnswer
    from identify.output.words.fleet import ingested_in_words
    from twin.engine import needed

    needed("pyarrow")
    known = Models.at(model, effects or ())
    read = None if pattern is None else Pattern(pattern)
    with progress_on_stderr() as progress:
        done = run(
            logs, store, known, pattern=read, scheduler=scheduler, workers=workers,
            progress=progress,
        )  # fmt: skip
    return Reply(ingested_in_words(done), IngestAnswer.of(done), done.told)


@fleet.command()
def sql(
    query: Annotated[
        str, Argument(metavar="SELECT", help="A question about fits, findings, alarms.")
    ],
    store: StoreOption,
    out: Annotated[Path | None, written("Table to write: .csv, .parquet.")] = None,
) -> Reply:
    """Answer a question in SQL over the views fits, findings and alarms.

    Example: twin fleet sql "SELECT machine, max(value) FROM fits GROUP BY machine" --store fleet
    """
    from identify.fleet.sql import ask
    from identify.fleet.store import Store
    from identify.output.answers.fleet import SqlAnswer
    from identify.output.words.fleet import table_text

    found = ask(query, Store.opened(store))
    if out:
        found.write(out)
    text = f"{out}: {len(found)} rows" if out else table_text(found.columns, found.rows)
    return Reply(text, SqlAnswer.of(columns=found.columns, rows=found.rows), found.faults)


@fleet.command()
def report(
    store: StoreOption,
    html: Annotated[Path | None, written("HTML page.")] = None,
    logs: Ingested = None,
    model: SameModels = None,
    effects: Effects = None,
) -> Reply:
    """Tell which machines changed, when and by how much, on a page ranked by what needs attention.

    Exit code 1 where a machine changed.

    Example: twin fleet report --store fleet -o fleet.html
    """
    from identify.output.answers.fleet import FloorAnswer
    from identify.output.shown.fleet import write_fleet
    from identify.output.words.fleet import floor_in_words
    from twin.engine import needed

    needed("duckdb")
    if (logs is None) != (model is None):
        raise InputError("--logs and --model: give both, or neither")
    floor, silent = _floor(store, logs, model, effects)
    failed = tried(lambda: write_fleet(html, floor)) if html else ()
    answer = FloorAnswer.of(floor, alarms=floor.alarms)
    said = Reply(floor_in_words(floor), answer, [*floor.faults, *silent], fine=not floor.alarms)
    return replace(said, unwritten=failed)


def _floor(
    store: Path, logs: Path | None, model: str | None, effects: Sequence[Path] | None
) -> tuple[Floor, list[str]]:
    """The floor of a store, with causes where the logs are given; what was told on the way."""
    from identify.fleet.cause import with_causes
    from identify.fleet.models import Models
    from identify.fleet.state import floor_of
    from identify.fleet.store import Store

    silent: list[str] = []
    with progress_on_stderr() as progress:
        progress("reading the records", 0, 1)
        floor = floor_of(Store.opened(store))
        if logs and model:
            with heard() as silent:
                floor = with_causes(floor, logs, Models.at(model, effects or ()), progress)
    return floor, silent


@fleet.command()
def demo(
    folder: Annotated[Path, written("Folder to write into.")] = Path("fleet-demo"),
    seed: Annotated[int, Option(help="Draws the machines and their nights.")] = 1,
    machines: Annotated[int, Option(min=1, help="How many machines.")] = 20,
    nights: Annotated[int, Option(min=1, help="How many nights.")] = 90,
    workers: Workers = None,
) -> Reply:
    """Draw a floor of machines of which three change, find these, and write one page.

    Example: twin fleet demo -o fleet-demo
    """
    from identify.fleet.demo import demo as run
    from identify.output.answers.fleet import FleetDemoAnswer
    from identify.output.words.fleet import demo_in_words
    from twin.engine import needed

    needed("duckdb")
    with progress_on_stderr() as progress, heard() as silent:
        made = run(
            folder, seed, machines=machines, nights=nights, workers=workers, progress=progress
        )
    text = demo_in_words(made.planted, made.floor, made.right, made.page)
    return Reply(text, FleetDemoAnswer.of(made), silent, fine=made.right)


@fleet.command()
def kind(
    model: Annotated[str, Argument(metavar="MODEL", help="Model (.toml) of the kind.")],
    store: StoreOption,
    machine: Annotated[
        str | None, Option(help="Machine whose own logs take part; a new one if left out.")
    ] = None,
    out: Annotated[Path | None, written("Model to write, with the values expected.")] = None,
    effects: Effects = None,
) -> Reply:
    """Tell how the machines of a kind differ, and what is to be expected of a new one.

    Example: twin fleet kind stage.toml --store fleet -o new_stage.toml
    """
    from identify.cli.shared import loaded
    from identify.fleet.kind import FEWEST, begun, kinds
    from identify.fleet.nights import panels
    from identify.fleet.store import Store
    from identify.output.answers.fleet import KindAnswer
    from identify.output.words.fleet import kind_in_words
    from twin.engine import needed
    from twin.model.file import save_model

    needed("duckdb")
    given, _ = loaded(model, effects)
    contents = Store.opened(store).contents()
    told = tuple(kinds(panels(contents), given.name, machine))
    if not told:
        raise InputError(
            f"{model}: the store has fewer than {FEWEST} machines of kind '{given.name}'; a kind "
            "is told by that many"
        )
    failed = tried(lambda: save_model(begun(given, told), out)) if out else ()
    answer = KindAnswer.of(kind=given.name, machine=machine, parameters=list(told), model=out)
    said = Reply(kind_in_words(given.name, told, machine), answer, contents.faults)
    return replace(said, unwritten=failed)
