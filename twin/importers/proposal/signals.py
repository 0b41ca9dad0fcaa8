"""What is proposed for one axis: its signals, how sure each is, and why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

from twin.importers.proposal.courses import ColumnCourse, TableColumn, course
from twin.importers.proposal.lexicon import Quantity
from twin.importers.proposal.motion import Explained, explained
from twin.importers.proposal.names import Name


class Certainty(Enum):
    """How sure a signal of the map is."""

    SURE = "sure"  # its name and the numbers say so
    LIKELY = "likely"  # one of them does
    UNSURE = "unsure"  # one of them says otherwise


@dataclass(frozen=True)
class Signal:
    """A column that is taken for a signal.

    sign: -1 where it is reversed. assumed: what its name says and the numbers deny; empty: nothing.
    """

    field: str
    name: Name
    certainty: Certainty
    reasons: tuple[str, ...]
    sign: int = 1
    assumed: str = ""

    @property
    def column(self) -> str:
        """The name of the column."""
        return self.name.column

    def because(self, reason: str, certainty: Certainty | None = None) -> Signal:
        """The same with one more reason."""
        return replace(self, reasons=(*self.reasons, reason), certainty=certainty or self.certainty)


@dataclass(frozen=True)
class ProposedAxis:
    """What is proposed for an axis.

    signals: by field. asked: by field, what is needed where the columns do not tell. not_used: by
    column, why not. twins: columns that go as the position and are as large, but no setpoint by
    their course. motion: what the motion explains of the force or current, None without one.
    sign: -1 where that is reversed. comes_round: whether its position is one within a turn.
    """

    name: str
    columns: tuple[str, ...]
    signals: Mapping[str, Signal] = field(default_factory=dict)
    asked: Mapping[str, str] = field(default_factory=dict)
    not_used: Mapping[str, str] = field(default_factory=dict)
    twins: tuple[Name, ...] = ()
    motion: Explained | None = None
    sign: int = 1
    comes_round: bool = False

    @property
    def among(self) -> str:
        """Among which columns something was looked for, as part of a sentence."""
        return f" of {', '.join(self.columns)}" if self.columns else " of numbers"

    def having(self, *signals: Signal) -> ProposedAxis:
        """The same with these signals too."""
        return replace(self, signals={**self.signals, **{s.field: s for s in signals}})

    def asking(self, what: Mapping[str, str]) -> ProposedAxis:
        """The same, with fields left open."""
        return replace(self, asked={**self.asked, **what})

    def without(self, reasons: Mapping[str, str]) -> ProposedAxis:
        """The same, with columns that are not used."""
        return replace(self, not_used={**self.not_used, **reasons})

    @property
    def free(self) -> tuple[str, ...]:
        """The columns of which nothing is said yet."""
        taken = {s.column for s in self.signals.values()}
        return tuple(c for c in self.columns if c not in taken and c not in self.not_used)


@dataclass(frozen=True)
class File:
    """The columns of a file that vary, what their names say, and s from row to row.

    step: None where the file does not tell.
    """

    names: Mapping[str, Name]
    columns: Mapping[str, TableColumn]
    step: float | None

    def some(self, columns: Sequence[str], *quantities: Quantity | None) -> list[Name]:
        """The names of these columns that say one of these quantities."""
        return [self.names[c] for c in columns if self.names[c].quantity in quantities]

    def column(self, name: Name) -> TableColumn:
        """The column of a name."""
        return self.columns[name.column]

    def explained(self, position: Name, forces: Sequence[Name]) -> list[Explained]:
        """What the motion of a position explains of columns."""
        short = [self.column(f).short for f in forces]
        return explained(self.column(position).short, short)

    def course(self, position: Name, other: Name) -> ColumnCourse | None:
        """Whether a column goes as a position."""
        return course(self.column(position), self.column(other))

    @property
    def samples_of_a_rate(self) -> int:
        """Rows over which a rate is compared with a column that is called one.

        A filter's lag is less, and so is the share of the noise of a coarse encoder.
        """
        long = 0.1  # s
        rows = len(next(iter(self.columns.values())).values)
        return max(min(round(long / self.step) if self.step else 50, rows // 20), 1)
