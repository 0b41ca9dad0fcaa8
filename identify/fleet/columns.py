"""The columns of a store: what each is called, its type, its unit and what it means.

One list for the records on disk, the views of ``twin fleet sql`` and their page in the docs.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StoreColumn:
    """A column. kind: its type in SQL; unit: SI, "" where it has none."""

    name: str
    kind: str
    unit: str
    meaning: str


LOG = (
    StoreColumn("machine", "VARCHAR", "", "which machine the log is of"),
    StoreColumn(
        "axis", "VARCHAR", "", "axis of the machine; null where the fault is of the whole log"
    ),
    StoreColumn("started", "TIMESTAMP", "", "when the log began, by its own clock"),
    StoreColumn("night", "DATE", "", "the day on which that night began: it ends at noon"),
    StoreColumn("log", "VARCHAR", "", "path of the log below the folder that was ingested"),
    StoreColumn("log_sha256", "VARCHAR", "", "of the bytes of the log"),
    StoreColumn("model", "VARCHAR", "", "name of the model: the kind of the machine"),
    StoreColumn(
        "model_sha256", "VARCHAR", "", "of the model that was fitted, with its MuJoCo file"
    ),
    StoreColumn("version", "VARCHAR", "", "of the program that fitted it"),
    StoreColumn("key", "VARCHAR", "", "of log, model and version; the name of the record"),
)
FIT = (
    StoreColumn("parameter", "VARCHAR", "", "effect and parameter, as coulomb_viscous.Fc, or mass"),
    StoreColumn("unit", "VARCHAR", "", "of value, low and high"),
    StoreColumn("value", "DOUBLE", "unit", "the estimate"),
    StoreColumn("low", "DOUBLE", "unit", "low end of its 90 % interval; null where it has none"),
    StoreColumn("high", "DOUBLE", "unit", "high end of it"),
    StoreColumn(
        "spread", "DOUBLE", "unit", "half the width within which parts of the log scatter (90 %)"
    ),
    StoreColumn(
        "no_interval", "VARCHAR", "", "why it has none: NotExcited, Inseparable, ModelWrong, ..."
    ),
    StoreColumn("error", "DOUBLE", "force_unit", "force error of the fit, RMS"),
    StoreColumn("floor", "DOUBLE", "force_unit", "noise floor of the log, RMS"),
    StoreColumn("force_unit", "VARCHAR", "", "N, or N m on a rotary axis"),
    StoreColumn("distance", "DOUBLE", "m or rad", "travelled by the axis within the log"),
    StoreColumn("temperature", "DOUBLE", "K", "mean of the logged temperature; null without one"),
    StoreColumn("duration", "DOUBLE", "s", "of the log"),
)
FINDING = (
    StoreColumn("severity", "VARCHAR", "", "error: the log was not fitted; warning: it was"),
    StoreColumn(
        "fault", "VARCHAR", "", "UNREADABLE, UNNAMED, NO_MODEL, UNFITTED, or as in `twin check`"
    ),
    StoreColumn("what", "VARCHAR", "", "the fault in words, with its place, size and remedy"),
)
ALARM = (
    StoreColumn("machine", "VARCHAR", "", "which machine; null where all changed at once"),
    StoreColumn("axis", "VARCHAR", "", "axis of the machine"),
    StoreColumn("model", "VARCHAR", "", "kind of the machine"),
    StoreColumn("parameter", "VARCHAR", "", "what changed; force_error: the residual of the fit"),
    StoreColumn("unit", "VARCHAR", "", "of before, after and size"),
    StoreColumn("night", "DATE", "", "night after which the alarm was raised"),
    StoreColumn("changed", "DATE", "", "first night of the change, as likely as any"),
    StoreColumn("earliest", "DATE", "", "low end of its 90 % band"),
    StoreColumn("latest", "DATE", "", "high end of its 90 % band"),
    StoreColumn("before", "DOUBLE", "unit", "mean before the change"),
    StoreColumn("after", "DOUBLE", "unit", "mean of the last nights"),
    StoreColumn("size", "DOUBLE", "unit", "after minus before"),
    StoreColumn("half_width", "DOUBLE", "unit", "of the 90 % band of size"),
    StoreColumn("strength", "DOUBLE", "1", "size less its dead band, over its standard deviation"),
    StoreColumn("scope", "VARCHAR", "", "machine, or hall: all of a kind changed at once"),
    StoreColumn("trend", "DOUBLE", "unit a night", "how fast it goes on; null where it stays"),
    StoreColumn("others", "VARCHAR", "", "other parameters of the axis that changed with it"),
)  # fmt: skip
TYPES = {"VARCHAR": "string", "DOUBLE": "float64", "DATE": "date32"}  # in Arrow
RECORD = (StoreColumn("kind", "VARCHAR", "", "fit or finding"), *LOG, *FIT, *FINDING)
VIEWS = {"fits": (*LOG, *FIT), "findings": (*LOG, *FINDING), "alarms": ALARM}
