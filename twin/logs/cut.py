"""A stretch of a log as a log of its own."""

from __future__ import annotations

import math
from dataclasses import replace

from twin.errors import InputError
from twin.logs.log import Log


def cut_log(log: Log, start: float = 0.0, stop: float | None = None) -> Log:
    """The samples of a log from ``start`` to ``stop`` (s), its end where None; time begins anew.

    Its metadata tell from where it is. Raises InputError for a stretch that the log has not.
    """
    first, last = _samples(log, start, stop)
    cut = f"{first / log.sample_rate:.9g} to {last / log.sample_rate:.9g} s"
    return replace(log.part(first, last), metadata={**log.metadata, "cut": cut})


def _samples(log: Log, start: float, stop: float | None) -> tuple[int, int]:
    """The first sample and that behind the last."""
    lasts = len(log) * log.period
    end = lasts if stop is None else stop
    least = 2  # samples of a log
    if not (math.isfinite(start) and math.isfinite(end)):
        raise InputError(f"{start:g} to {end:g} s: give numbers of seconds")
    first, last = round(start * log.sample_rate), round(end * log.sample_rate)
    if not (first >= 0 and last <= len(log) and last - first >= least):
        raise InputError(
            f"{start:g} to {end:g} s: the log lasts {lasts:.9g} s; give a stretch within it, of "
            f"at least {least} samples at {log.sample_rate:g} Hz"
        )
    return first, last
