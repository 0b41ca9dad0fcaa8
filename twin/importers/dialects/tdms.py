"""TDMS of LabVIEW: a channel is named ``group/channel``; its waveform may state the rate."""

from __future__ import annotations

from pathlib import Path

from twin.errors import InputError
from twin.importers.dialects import Dialect
from twin.importers.mapping import ImportMap
from twin.importers.table import (
    SignalTable,
    chosen,
    extra,
    notes_of,
    parsing,
    require_fits,
    with_unit,
)  # fmt: skip

_PERIOD = "wf_increment"  # s a sample
_UNIT = "unit_string"


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a TDMS file; raises InputError."""
    nptdms = extra("nptdms")
    with parsing("TDMS"), nptdms.TdmsFile.open(path) as file:
        asked, every = mapping.column_names(), (c for g in file.groups() for c in g.channels())
        channels = {
            with_unit(f"{c.group_name}/{c.name}", str(c.properties.get(_UNIT, "")), asked): c
            for c in every
        }
        read = {name: channels[name] for name in chosen(asked, channels)}
        require_fits(sum(8.0 * len(channel) for channel in read.values()), path)
        stated = {n: c.properties[_PERIOD] for n, c in read.items() if _PERIOD in c.properties}
        # 1 s is what writers leave it at, and no drive is recorded at
        periods = {n: period for n, period in stated.items() if period != 1.0}
        for name, period in periods.items():
            first, expected = next(iter(periods.items()))
            if period != expected or not period > 0.0:
                raise InputError(
                    f"channel '{first}' has a sample every {expected:.9g} s, '{name}' every "
                    f"{period:.9g} s; export them at one rate"
                )
        rate = 1.0 / next(iter(periods.values())) if periods else None
        said = (file, *file.groups(), *read.values())
        entries = ({k: v for k, v in one.properties.items() if k != _PERIOD} for one in said)
        notes = dict.fromkeys(note for one in entries for note in notes_of(one))
        return SignalTable({n: c[:] for n, c in read.items()}, rate, notes=tuple(notes))


DIALECT = Dialect("TDMS of LabVIEW", (".tdms",), read)
