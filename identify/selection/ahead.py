"""Which changes are ahead while they are tried, told as soon as it is known."""

from __future__ import annotations

from threading import Lock

from identify.selection.changes import Change, Screening
from twin.parallel import AHEAD, Progress

SHOWN = 5  # more are no help while they still climb and fall


class Ahead:
    """The shares that changes take of the error: those of a linear step, then those of a refit."""

    def __init__(self, progress: Progress) -> None:
        self._progress, self._lock = progress, Lock()
        self._shares: dict[str, float] = {}
        self._told = ""

    def screened(self, screening: Screening) -> Screening:
        """The same; what it promises is told."""
        self.note(screening.change, screening.promise)
        return screening

    def note(self, change: Change, share: float) -> None:
        """Tell who is ahead, where that has changed. share: of the error, above the noise floor."""
        with self._lock:
            self._shares[change.name] = share
            first = sorted(self._shares.items(), key=lambda pair: -pair[1])[:SHOWN]
            # 0.01: less is printed as 0 %
            shown = [f"{name} {100.0 * part:.0f} %" for name, part in first if part >= 0.01]
            told = ", ".join(shown)
            if told != self._told:
                self._told = told
                self._progress(f"{AHEAD}{told}", 0, 0)
