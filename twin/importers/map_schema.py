"""What an import map may hold; units and columns are checked where they are used."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from twin.entries import Entries
from twin.logs.log import FIELDS
from twin.logs.topics import IDENTIFIER

NUMBER = "a finite number"
AXIS_NAME = rf"^{IDENTIFIER.pattern}$"


class TimeEntry(Entries):
    """The column of the time stamps."""

    column: str | int = Field(description="a name, or a number where there are no names")
    unit: str = Field(description='a unit of time in quotes, such as "s", "ms" or "us"')


class ColumnEntry(Entries):
    """The column of a signal: SI value = sign x (scale x raw + offset) x unit."""

    column: str | int = Field(description="a name, or a number where there are no names")
    unit: str = Field(description='a unit in quotes, such as "mm", "A", "V" or "counts"')
    scale: float = Field(1.0, description=NUMBER + " other than 0: SI units a raw one")
    offset: float = Field(0.0, description=NUMBER + ", in the unit; in SI where a scale brings it")
    sign: Literal[1, -1] = Field(1, description="1 or -1")
    delay_samples: int = Field(
        0, ge=-(10**6), le=10**6,
        description="a whole number: by how many samples the column was recorded too late",
    )  # fmt: skip
    file: int = Field(
        1, ge=1, le=1000, description="a whole number: which of several files, the first is 1"
    )


class FileEntry(Entries):
    """One of several files that are given together, in their order."""

    format: str | None = Field(None, description='a format in quotes, such as "csv"')
    sample_rate: float | None = Field(None, gt=0.0, description=NUMBER + " above 0, in Hz")
    time: TimeEntry | None = Field(None, description='a table such as {column = "t", unit = "s"}')
    offset: float = Field(0.0, description=NUMBER + ", in s, which is added to its times")


_SIGNALS: dict[str, Any] = {
    field: (
        ColumnEntry | None,
        Field(None, description='a table such as {column = "name in the file", unit = "mm"}'),
    )
    for field in FIELDS
}
_CONSTANT = Field(None, gt=0.0, description="a number above 0, in N/A (N m/A on a rotary axis)")
AxisEntry = create_model(
    "AxisEntry", __base__=Entries, force_constant=(float | None, _CONSTANT), **_SIGNALS
)


class MapFile(Entries):
    """A whole map; at most one of sample_rate and time."""

    format: str | None = Field(None, description='a format in quotes, such as "csv"')
    sample_rate: float | None = Field(None, gt=0.0, description=NUMBER + " above 0, in Hz")
    time: TimeEntry | None = Field(None, description='a table such as {column = "t", unit = "s"}')
    resample: float | None = Field(
        None,
        gt=0.0,
        description="a number above 0, in Hz: uneven time stamps are brought onto this clock",
    )
    files: list[FileEntry] | None = Field(
        None, min_length=2, description="tables [[files]], one for each file; resample brings "
        "their columns onto one clock",
    )  # fmt: skip
    delimiter: str | None = Field(
        None, min_length=1, max_length=1, description="one character, such as ';'"
    )
    decimal: Literal[".", ","] | None = Field(None, description="'.' or ','")
    header_line: int | None = Field(None, ge=1, description="a whole number; lines count from 1")
    axes: dict[Annotated[str, Field(pattern=AXIS_NAME)], AxisEntry] = Field(  # type: ignore[valid-type]
        min_length=1,
        description="a table for each axis, as [axes.x]; an axis name has letters, digits and "
        "underscores",
    )  # fmt: skip


def json_schema() -> dict[str, Any]:
    """The JSON schema of an import map."""
    return {**MapFile.model_json_schema(), "title": "Import map of the Proton twin"}
