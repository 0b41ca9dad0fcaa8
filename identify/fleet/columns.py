"""The columns of a store: what each is called, its type, its unit and what it means.

One list for the records on disk, the views of ``twin fleet sql`` and their page in the docs.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Column:
    """A column. kind: its type in SQL; unit: SI, "" where it has none."""

    name: str
    kind: str
    unit: str
    meaning: str


LOG = (
    Column("machine", "VARCHAR", "", "which machine the log is of"),
    Column("axis", "VARCHAR", "", "axis of the machine; null where the fault is of the whole log"),
    Column("started", "TIMESTAMP", "", "when the log began, by its own clock"),
    Column("night", "DATE", "", "the day on which that night began: it ends at noon"),
    Column("log", "VARCHAR", "", "path of the log below the folder that was ingested"),
    Column("log_sha256", "VARCHAR", "", "of the bytes of the log"),
    Column("model", "VARCHAR", "", "name of the model: the kind of the machine"),
    Column("model_sha256", "VARCHAR", "", "of the model that was fitted, with its MuJoCo file"),
    Column("version", "VARCHAR", "", "of the program that fitted it"),
    Column("key", "VARCHAR", "", "of log, model and version; the name of the record"),
)
FIT = (
    Column("parameter", "VARCHAR", "", "effect and parameter, as coulomb_viscous.Fc, or mass"),
    Column("unit", "VARCHAR", "", "of value, low and high"),
    Column("value", "DOUBLE", "unit", "the estimate"),
    Column("low", "DOUBLE", "unit", "low end of its 90 % interval; null where it has none"),
    Column("high", "DOUBLE", "unit", "high end of it"),
    Column(
        "spread", "DOUBLE", "unit", "half the width within which parts of the log scatter (90 %)"
    ),
    Column(
        "no_interval", "VARCHAR", "", "why it has none: NotExcited, Inseparable, ModelWrong, ..."
    ),
    Column("error", "DOUBLE", "force_unit", "force error of the fit, RMS"),
    Column("floor", "DOUBLE", "force_unit", "noise floor of the log, RMS"),
    Column("force_unit", "VARCHAR", "", "N, or N m on a rotary axis"),
    Column("distance", "DOUBLE", "m or rad", "travelled by the axis within the log"),
    Column("temperature", "DOUBLE", "K", "mean of the logged temperature; null without one"),
    Column("duration", "DOUBLE", "s", "of the log"),
)
FINDING = (
    Column("severity", "VARCHAR", "", "error: the log was not fitted; warning: it was"),
    Column(
        "fault", "VARCHAR", "", "UNREADABLE, UNNAMED, NO_MODEL, UNFITTED, or as in `twin check`"
    ),
    Column("what", "VARCHAR", "", "the fault in words, with its place, size and remedy"),
)
ALARM = (
    Column("machine", "VARCHAR", "", "which machine; null where all changed at once"),
    Column("axis", "VARCHAR", "", "axis of the machine"),
    Column("model", "VARCHAR", "", "kind of the machine"),
    Column("parameter", "VARCHAR", "", "what changed; force_error: the residual of the fit"),
    Column("unit", "VARCHAR", "", "of before, after and size"),
    Column("night", "DATE", "", "night after which the alarm was raised"),
    Column("changed", "DATE", "", "first night of the change, as likely as any"),
    Column("earliest", "DATE", "", "low end of its 90 % band"),
    Column("latest", "DATE", "", "high end of its 90 % band"),
    Column("before", "DOUBLE", "unit", "mean before the change"),
    Column("after", "DOUBLE", "unit", "mean of the last nights"),
    Column("size", "DOUBLE", "unit", "after minus before"),
    Column("half_width", "DOUBLE", "unit", "of the 90 % band of size"),
    Column("strength", "DOUBLE", "1", "the size over its standard deviation, dead band taken off"),
    Column("scope", "VARCHAR", "", "machine, or hall: all of a kind changed at once"),
    Column("trend", "DOUBLE", "unit a night", "how fast it goes on changing; null where it stays"),
    Column("others", "VARCHAR", "", "other parameters of the axis that changed with it"),
)  # fmt: skip
TYPES = {"VARCHAR": "string", "DOUBLE": "float64", "DATE": "date32"}  # in Arrow
RECORD = (Column("kind", "VARCHAR", "", "fit or finding"), *LOG, *FIT, *FINDING)
VIEWS = {"fits": (*LOG, *FIT), "findings": (*LOG, *FINDING), "alarms": ALARM}
