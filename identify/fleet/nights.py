"""The parameters of all machines night by night, as arrays, of the records of a store."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date, timedelta
from typing import Any

import numpy as np

from identify.fleet.store import Contents
from identify.fleet.views import connected
from twin.signals import Array

FORCE_ERROR = "force_error"  # the residual of a fit, watched as its parameters are
EPOCH = date(1970, 1, 1)
TO_DEVIATION = 1.0 / 1.645  # standard deviation over half the width of a 90 % interval

# Of each machine the fits of one model and version: those of which there are most nights.
CHOSEN = """
CREATE TEMP TABLE chosen AS SELECT machine, model_sha256, version FROM (
  SELECT machine, model_sha256, version, row_number() OVER (
    PARTITION BY machine ORDER BY count(DISTINCT night) DESC, version DESC, model_sha256) AS place
  FROM fits GROUP BY machine, model_sha256, version) WHERE place = 1
"""
# A night may have several logs. One that does not tell a parameter has a value without a spread.
NIGHTLY = """
CREATE TEMP TABLE nightly AS
SELECT model, axis, parameter, any_value(unit) AS unit, machine,
       (night - DATE '1970-01-01')::INTEGER AS day, avg(value) AS value, avg(spread) AS spread,
       avg(temperature) AS temperature, sum(distance) AS distance
FROM (
  SELECT model, axis, parameter, unit, machine, model_sha256, version, night, value, spread,
         temperature, distance FROM fits WHERE spread IS NOT NULL
  UNION ALL
  SELECT DISTINCT model, axis, 'force_error', force_unit, machine, model_sha256, version, night,
         error, NULL, temperature, distance FROM fits)
SEMI JOIN chosen USING (machine, model_sha256, version)
WHERE night IS NOT NULL AND isfinite(value)
GROUP BY model, axis, parameter, machine, night
"""


@dataclass(frozen=True, eq=False)
class Panel:
    """A parameter of an axis of all m machines of a kind, over n nights.

    values (m, n): in ``unit``, not a number where there is no fit. deviations (m, n): standard
    deviation within the log. temperatures (m, n): K; distances (m, n): m or rad. days (n,): since
    1970-01-01.
    """

    kind: str
    axis: str
    parameter: str
    unit: str
    machines: tuple[str, ...]
    days: Array
    values: Array
    deviations: Array
    temperatures: Array
    distances: Array

    def night(self, column: int) -> date:
        """The date of a column."""
        return EPOCH + timedelta(days=int(self.days[column]))


def panels(contents: Contents) -> Iterator[Panel]:
    """The parameters of all machines, kind by kind."""
    with connected(contents) as base:
        base.execute(CHOSEN)
        base.execute(NIGHTLY)
        for kind, axis, parameter, unit in base.execute(
            "SELECT model, axis, parameter, any_value(unit) FROM nightly GROUP BY ALL ORDER BY ALL"
        ).fetchall():
            yield _panel(base, (kind, axis, parameter), unit)


def _panel(base: Any, which: Sequence[str], unit: str) -> Panel:
    where = "WHERE model = $1 AND axis = $2 AND parameter = $3"
    distinct = f"SELECT DISTINCT machine FROM nightly {where} ORDER BY ALL"
    machines = [row[0] for row in base.execute(distinct, which).fetchall()]
    found = base.execute(
        f"SELECT dense_rank() OVER (ORDER BY machine) - 1 AS row, day, value, spread, temperature, "
        f"distance FROM nightly {where}",
        which,
    ).fetchnumpy()
    days, columns = np.unique(_plain(found["day"]), return_inverse=True)
    rows = _plain(found["row"]).astype(int)
    filled = []
    for name in ("value", "spread", "temperature", "distance"):
        grid = np.full((len(machines), len(days)), np.nan)
        grid[rows, columns] = _plain(found[name])
        filled.append(grid)
    value, spread, temperature, distance = filled
    kind, axis, parameter = which
    return Panel(kind, axis, parameter, unit, tuple(machines), days, value,
                 spread * TO_DEVIATION, temperature, distance)  # fmt: skip


def median(values: Array, axis: int) -> Array:
    """The median along an axis of those that are numbers; not a number where none is."""
    ordered = np.sort(values, axis=axis)  # what is no number comes last
    count = np.isfinite(values).sum(axis=axis, keepdims=True)
    middle = (np.maximum(count - 1, 0) // 2, np.minimum(count // 2, values.shape[axis] - 1))
    low, high = (np.take_along_axis(ordered, i, axis) for i in middle)
    return np.squeeze(0.5 * (low + high), axis=axis)


def _plain(column: Any) -> Array:
    """A column of numbers; not a number where it is null."""
    return np.ma.filled(np.ma.asarray(column).astype(float), np.nan)
