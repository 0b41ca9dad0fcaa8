"""`twin import`: a recording by a map, or by one that is proposed, shown, asked about and kept."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from identify.cli.command import Reply
from identify.cli.shared import app, was_kept, written
from twin.errors import InputError

if TYPE_CHECKING:
    from identify.analysis.map_proof import MapProof
    from twin.importers.guess import Proposal
    from twin.importers.mapping import ImportMap
    from twin.importers.proposal.text import Answers, Need
    from twin.logs import Log


@app.command("import")
def import_(
    sources: Annotated[
        list[Path],
        Argument(metavar="FILE...", help="CSV, MAT, JSON, Parquet, HDF5, TDMS or MCAP."),
    ],
    mapping: Annotated[
        Path | None,
        Option("--map", help="Columns, units, scale, sign, rate; proposed if left out."),
    ] = None,
    out: Annotated[
        Path | None, written("MCAP log to write, beside which a proposed map is kept; or the map.")
    ] = None,
    guess: Annotated[
        bool, Option("--guess", help="Propose a map for FILE, with reasons, and import nothing.")
    ] = False,
    yes: Annotated[bool, Option("--yes", help="Take the proposed map without a question.")] = False,
    entries: Annotated[
        list[str] | None,
        Option(
            "--set",
            metavar="NAME=VALUE",
            help="Entry of the map to set, as axes.x.position.unit=mm, or without a value to "
            "remove; the map is written beside the log.",
        ),
    ] = None,
) -> Reply:
    """Turn a machine's recording into an MCAP log, by a map or by one that is proposed.

    Example: twin import recording.csv --map map.toml -o run.mcap
    """
    if guess:
        return _guess(sources, out)
    if entries:
        return _by_edited(sources, mapping, entries, out)
    if mapping is None:
        return _by_proposal(sources, out, yes)
    if out is None:
        raise InputError(f"--map {mapping}: give -o LOG, the log to write")
    return _by_map(sources, mapping, out)


def _by_map(sources: Sequence[Path], mapping: Path, out: Path) -> Reply:
    """A log by the map of a user, with what its signals say against it."""
    from identify.analysis.map_proof import proofs_of
    from twin.importers import import_log, load_mapping

    known = load_mapping(mapping)
    log = import_log(sources, known)
    return _logged(log, known, mapping, out, proofs_of(log))


def _logged(
    log: Log, known: ImportMap, mapping: Path, out: Path, proofs: Mapping[str, MapProof]
) -> Reply:
    """Write a log that a map made. proofs: what it makes of each axis."""
    from identify.output.answers.machine import ImportAnswer
    from twin.checks import check_assumed
    from twin.importers import import_notes
    from twin.importers.guess import doubts_of
    from twin.importers.proposal.doubts import doubts_as_metadata
    from twin.logs import write_log

    unsure = [str(f) for axis in log.axes for f in check_assumed(axis, log.metadata)]
    doubts = doubts_as_metadata(log)  # for whoever checks it later
    write_log(replace(log, metadata={**log.metadata, **doubts}), out)
    answer = ImportAnswer.of(
        log=out, samples=len(log), sample_rate=log.sample_rate, map=mapping, proofs=proofs
    )
    told = (*doubts_of(known), *doubts.values())
    warnings = [
        *import_notes(log),
        *(f"{mapping}: warning: {doubt}" for doubt in told),
        *(f"{out}: warning: {finding}" for finding in unsure),
    ]
    return Reply(f"{out}: {len(log)} samples at {log.sample_rate:g} Hz", answer, warnings)


def _by_edited(
    sources: Sequence[Path], mapping: Path | None, entries: Sequence[str], out: Path | None
) -> Reply:
    """A log by a map, or by the one that is proposed, with entries that the user sets."""
    from twin.entries import toml_document
    from twin.errors import at
    from twin.importers.edits import with_entries

    if mapping is None:
        text = _proposal(sources, "--set without --map").map_text({})
    else:
        with at(str(mapping)):
            text = toml_document(mapping)[0]
    return _written(sources, with_entries(text, entries), out or Path(f"{sources[0].stem}.mcap"))


def _guess(sources: Sequence[Path], out: Path | None) -> Reply:
    """A proposed map, printed or written; exit code 1 where something is missing in it."""
    from identify.output.proposal import map_answer

    found = _proposal(sources, "--guess")
    text = found.map_text({})
    kept = [] if out is None else _kept(out, text)
    said = text if out is None else f"{out}: a map to be read and corrected"
    lacks = found.lacks({})
    return Reply(said, map_answer(found, {}), [*kept, *lacks], not lacks)


def _kept(path: Path, text: str) -> list[str]:
    """Write a map; that another one which was there is kept."""
    from twin.files import kept_beside, write_atomically

    kept = kept_beside(path, text.encode())
    write_atomically(path, text.encode())
    return [] if kept is None else [was_kept(path, kept)]


def _proposal(sources: Sequence[Path], option: str) -> Proposal:
    from twin.importers.guess import propose

    if len(sources) != 1:
        raise InputError(f"{option} was given {len(sources)} files; give one at a time")
    return propose(sources[0])


# --- the map that is proposed, taken --------------------------------------------------------------


def _by_proposal(sources: Sequence[Path], out: Path | None, yes: bool) -> Reply:
    """Show what is proposed, ask for what is not known, write the map, and import by it."""
    from identify.output.proposal import map_answer, proposal_text

    found = _proposal(sources, "import without --map")
    answers: Answers = {}
    shown = proposal_text(found)
    asks = sys.stdin.isatty() and sys.stderr.isatty() and "--json" not in sys.argv and not yes
    if asks:
        print(f"{shown}\n", file=sys.stderr)
        answers = _answers(found)
        yes = _is_yes(input_of("take this map? [Y/n] "))
        shown = ""
    if not yes:
        refused = "" if asks else "; --yes takes this map, --map MAP another"
        said = "\n\n".join(filter(None, (shown, f"nothing is written{refused}")))
        return Reply(said, map_answer(found, answers), found.lacks(answers), fine=False)
    log = out or Path(f"{sources[0].stem}.mcap")
    return _taken(sources[0], found, answers, log, shown)


def _taken(source: Path, found: Proposal, answers: Answers, log: Path, shown: str) -> Reply:
    """Write the map beside the log, and the log where the map is complete."""
    from identify.output.machine import in_shell
    from identify.output.proposal import map_answer

    text = found.map_text(answers)
    if lacks := found.lacks(answers):
        mapping = log.with_suffix(".map.toml")
        kept = _kept(mapping, text)
        said = (
            f"{mapping}: the map; the log is not written, for what is said above; mend that, then"
        )
        said += f"\n  {in_shell('import', source, '--map', mapping, '-o', log)}"
        parts = filter(None, (shown, said))
        return Reply("\n\n".join(parts), map_answer(found, answers), [*kept, *lacks], fine=False)
    return _written([source], text, log, shown)


def _written(sources: Sequence[Path], text: str, out: Path, shown: str = "") -> Reply:
    """Write a map beside the log that it makes, and say what it makes of each axis."""
    from identify.analysis.map_proof import proofs_of
    from identify.output.proposal import proof_text
    from twin.errors import at
    from twin.importers import import_log
    from twin.importers.mapping import parse_mapping

    mapping = out.with_suffix(".map.toml")
    with at(str(mapping)):
        known = parse_mapping(text)
    log = import_log(sources, known)
    kept = _kept(mapping, text)
    proofs = proofs_of(log)
    done = _logged(log, known, mapping, out, proofs)
    lines = [f"{mapping}: the map, to be used for other recordings of this machine", done.text]
    lines += [proof_text(axis, proof) for axis, proof in proofs.items()]
    told = "\n\n".join(filter(None, (shown, "\n".join(lines))))
    return replace(done, text=told, warnings=[*kept, *done.warnings])


def _answers(found: Proposal) -> Answers:
    """What the user says to what is not known; what is left open stays as it is."""
    from twin.importers.guess import RATE

    out: dict[tuple[str, str, str], str] = {}
    if found.asks_rate and (rate := _asked("the sample rate in Hz [not known] ", _no_number)):
        out[RATE] = rate
    for need in found.needs:
        open_ = f"[{need.assumed or 'not known'}]"
        hint = ", as in 1e6 per metre" if need.other else ""
        said = _asked(f"{need.axis}: {need.what}{hint} {open_} ", partial(_refused, need))
        if said:
            entry, value = _entry_of(need, said)
            out[need.axis, need.field, entry] = value
    return out


def _asked(question: str, refused: Callable[[str], str]) -> str:
    """What is typed behind a question, once it is an answer; nothing where nothing is typed."""
    while said := input_of(question):
        if not (wrong := refused(said)):
            break
        print(wrong, file=sys.stderr)
    return said


def _refused(need: Need, said: str) -> str:
    """Why something is no answer to what was asked; empty where it is one."""
    from twin.importers.proposal.text import UNIT
    from twin.importers.units import find_unit
    from twin.logs.log import LINEAR_UNITS, ROTARY_UNITS

    if need.entry == UNIT:
        try:
            find_unit(said, LINEAR_UNITS[need.field], ROTARY_UNITS[need.field])
        except InputError as error:
            return str(error)
        return ""
    return _no_number(_entry_of(need, said)[1])


def _entry_of(need: Need, said: str) -> tuple[str, str]:
    """The entry of the map that an answer is for, and its value: of counts so many per metre."""
    per = re.search(r" per m(etre|eter)?$", said)
    if need.other is None or per is None:
        return need.entry, said
    return need.other, said[: per.start()]


def _no_number(said: str) -> str:
    """Why something is no number other than 0; empty where it is one."""
    try:
        value = float(said)
    except ValueError:
        return f"'{said}' is not a number; give one such as 0.0015, or nothing"
    return "" if math.isfinite(value) and value != 0.0 else "give a finite number other than 0"


def input_of(question: str) -> str:
    """What is typed behind a question on the terminal; nothing at its end."""
    print(question, end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip()


def _is_yes(said: str) -> bool:
    return said.lower() in ("", "y", "yes", "j", "ja", "o", "oui")
