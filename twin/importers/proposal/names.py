"""What the name of a column says: its quantity, whether it was measured, its unit, its axis."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

from twin.importers.proposal.lexicon import (
    CHANNELS,
    CODES,
    COUNTING,
    EMPTY,
    HINTS,
    QUANTITIES,
    RATES,
    RAW,
    ROLES,
    SMOOTHED,
    UNITS,
    Quantity,
    SignalRole,
)
from twin.importers.units import is_unit

_GREEK = str.maketrans({"θ": " theta ", "φ": " phi ", "ω": " omega ", "τ": " tau ", "α": " alpha "})
_CJK = "\u3040-\u30ff\u3400-\u9fff"
_TOKENS = re.compile(rf"[{_CJK}]+|[a-zа-я]+|\d+")
_OF_ANOTHER = frozenset("%")  # parts of another size, which no place is
_LONE = re.compile(r"(?<![^\W\d_])[À-ÖØ-öø-ÿ](?![^\W\d_])")  # of Russian read as of the West
_BRACKETS = re.compile(r"[\[(<{]\s*([^\])>}]*?)\s*[\])>}]")
_PATH = re.compile(r"[./:](?=[^./:]*[^\W\d_]{2})")
_TAIL = re.compile(r"(?:\s+in\s+|[_ ,/.]\s*)([A-Za-zА-я·µμ°%²]+(?:[_/][A-Za-zА-я]+[2²]?)?)$")
_PER = re.compile(r"(?i)^(.+?)(?:\s*[/_ ]\s*(s|ms|min|second|с|мс|мин)|ps)(?:\^?2|²)?$")
_PERIODS = str.maketrans({"с": "s", "м": "m", "и": "i", "н": "n"})
_SHARE = re.compile(
    r"(?i)^(?:(0[.,]1 ?%|‰|0/00|o/oo|per ?mille?|promille)|%|percent|pct|prozent)"
    r"(?: (?:[a-z]n|of)?(?: ?rated| ?nominal| ?nenn\w*)?(?: ?torque| ?current| ?\w?moment)?)?$"
)
_SOME = re.compile(r"\d")  # so many of a unit
_SQUARED = re.compile(r"(?i)(?:\^?2|²)$")
_LETTER_OF_AXIS = re.compile(r"^([fmtivpau])([xyz])$")
AXIS_LETTERS = frozenset("abcxyz")
_SYMBOLS: Mapping[str, tuple[Quantity, SignalRole | None]] = {
    **{f"{q}{r}": (Quantity.POSITION, SignalRole.ASKED) for q in "qxy" for r in "rg"},
    **{f"{q}d": (Quantity.POSITION, SignalRole.ASKED) for q in "xy"},
    **{f"{q}m": (Quantity.POSITION, SignalRole.MEASURED) for q in "qxy"},
}
# what a "d" or "r" behind asks for: q_d, tau_J_d
_ASKED_BY_A_LETTER = frozenset(("q", "qd", "dq", "qdd", "ddq", "tau", *"xyzvwuif", "theta", "iq"))


@dataclass(frozen=True)
class Name:
    """What a name says of its column.

    quantity, role: None where it says none. sure: whether a word says the quantity, not only a
    letter, a role or a unit. unit: as the import map knows it. axis: what tells this axis from
    another. smoothed: whether it was filtered. parts: of a position that two columns make the
    first, "less" or "plus", and the second; of one that is an integral its rate, "integrated", and
    None.
    """

    column: str
    quantity: Quantity | None
    role: SignalRole | None
    unit: str | None
    axis: tuple[str, ...]
    sure: bool
    smoothed: bool
    parts: tuple[str, str, str | None] | None = None

    @property
    def is_integral(self) -> bool:
        """Whether it is a position made of a velocity."""
        return self.parts is not None and self.parts[2] is None


@cache
def _meanings() -> Mapping[str, frozenset[Quantity | SignalRole]]:
    """Every word of quantities and roles."""
    out: dict[str, set[Quantity | SignalRole]] = {}
    words: list[tuple[Quantity | SignalRole, str]] = [*QUANTITIES.items(), *ROLES.items()]
    for meaning, said in words:
        for word in said.split():
            out.setdefault(word, set()).add(meaning)
    return {word: frozenset(meanings) for word, meanings in out.items()}


@cache
def _hints() -> Mapping[str, Quantity]:
    return {word: quantity for quantity, words in HINTS.items() for word in words.split()}


@cache
def _known() -> frozenset[str]:
    words = {*_meanings(), *_hints(), *EMPTY, *SMOOTHED, *RATES}
    return frozenset(w for w in words if len(w) > 1)


# --- words ----------------------------------------------------------------------------------------


def words_of(text: str) -> list[str]:
    """The words of a name, in lower case; words written as one are taken apart."""
    plain = unicodedata.normalize("NFKC", text).translate(_GREEK).replace("ß", "ss")
    plain = _LONE.sub(" ", plain)
    parts = unicodedata.normalize("NFKD", plain)
    plain = unicodedata.normalize("NFC", "".join(c for c in parts if not _is_accent(c)))
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", plain)
    return [w for token in _TOKENS.findall(spaced.lower()) for w in _parts(token)]


def _is_accent(character: str) -> bool:
    return unicodedata.combining(character) > 0 and character not in "\u3099\u309a"


def _parts(token: str) -> Iterator[str]:
    """A word as it is where it is known or too short; else the known words that it is made of."""
    shortest = 3  # letters of words written as one
    if token in _known() or token.isdigit() or (token.isascii() and len(token) < shortest):
        yield token
    elif token.isascii():
        yield from _cut(token) or _head(token)
    else:
        yield from _longest_first(token)


@cache
def _cut(token: str) -> tuple[str, ...]:
    """The fewest known words that make up a word; a letter may stand at its ends, an s between."""
    best: dict[int, tuple[str, ...]] = {0: ()}
    for end in range(1, len(token) + 1):
        for start in (s for s in range(end) if s in best):
            piece = token[start:end]
            edge = len(piece) == 1 and (start == 0 or end == len(token)) and len(token) > 3
            letter = edge and (piece in _hints() or piece in AXIS_LETTERS)
            if letter or piece in _known() or (piece == "s" and start > 0 and end < len(token)):
                grown = best[start] if piece == "s" and start else (*best[start], piece)
                if end not in best or len(grown) < len(best[end]):
                    best[end] = grown
    return best.get(len(token), ())


def _head(token: str) -> tuple[str, ...]:
    """The word in front and the one that a compound ends with, where that is known."""
    shortest = 4  # letters of a word that another may end with, and mean it
    for start in range(1, len(token) - shortest + 1):
        if token[start:] in _meanings():
            return token[:start], token[start:]
    return (token,)


def _longest_first(token: str) -> Iterator[str]:
    while token:
        length = next((n for n in range(len(token), 0, -1) if token[:n] in _known()), 1)
        yield token[:length]
        token = token[length:]


# --- units ----------------------------------------------------------------------------------------


@cache
def _spellings() -> Mapping[str, tuple[tuple[Quantity, str], ...]]:
    """Spelling -> the units that it may be; in lower case too, where a word tells which."""
    out: dict[str, dict[tuple[Quantity, str], None]] = {}
    for quantity, units in UNITS.items():
        for unit, others in units.items():
            for spelling in (unit, *others.split()):
                out.setdefault(spelling, {})[quantity, unit] = None
    for spelling, found in tuple(out.items()):
        out.setdefault(spelling.lower(), {}).update(found)
    return {spelling: tuple(found) for spelling, found in out.items()}


def units_of(text: str) -> tuple[tuple[Quantity, str], ...]:
    """The quantities and units that a text may be, the likeliest first; nothing if it is none."""
    text = text.strip().replace("sec", "s")
    for spelling in (text, text.lower()):
        if found := _spellings().get(spelling):
            return found
    if share := _SHARE.match(text):  # of the rated torque: what one of it is, only a scale tells
        return ((Quantity.DRIVE, "1" if share[1] else "%"),)
    if rate := _PER.match(text):
        of = [u for q, u in units_of(rate[1]) if q is Quantity.POSITION]
        kind = Quantity.ACCELERATION if _SQUARED.search(text) else Quantity.VELOCITY
        suffix = f"/{(rate[2] or 's')[:3].translate(_PERIODS).replace('sec', 's')}"
        suffix += "^2" if kind is Quantity.ACCELERATION else ""
        return tuple((kind, u + suffix) for u in of)
    return ()


_KINDS: Mapping[Quantity, tuple[str, ...]] = {
    Quantity.POSITION: ("m", "rad"), Quantity.VELOCITY: ("m/s", "rad/s"),
    Quantity.FORCE: ("N", "N m"), Quantity.CURRENT: ("A",), Quantity.OTHER: ("s",),
}  # fmt: skip


def _stated(text: str) -> tuple[tuple[Quantity, str], ...]:
    """The same of a text in brackets, where a rarer unit, or so many of one, is stated as well."""
    words = {w for w in words_of(text) if len(w) > 1 and w not in _spellings()}
    no_unit = words & _known() or not (_SOME.match(text) or len(text) > 1)
    return units_of(text) or (() if no_unit else _rare(text))


@cache
def _rare(text: str) -> tuple[tuple[Quantity, str], ...]:
    return tuple((q, text) for q, kinds in _KINDS.items() if is_unit(text, *kinds))


def _unit_in(name: str) -> tuple[str, str | None]:
    """The name less its unit, and the unit as written."""
    for found in reversed(list(_BRACKETS.finditer(name))):
        if _stated(found[1]) or found[1] in ("-", ""):
            rest = f"{name[: found.start()]} {name[found.end() :]}".strip()
            return rest, found[1] or None
    tail = _TAIL.search(name)
    while tail:
        if units_of(tail[1]):
            return name[: tail.start()], tail[1]
        cut = tail[1].partition("_")[2]  # vel_mm_s may be so much a second, pos_act_mm is none
        tail = _TAIL.search(name, tail.end() - len(cut) - 1) if cut else None
    return name, None


def unit_of(name: str, *, bracketed: bool = False) -> str | None:
    """The unit that a name states, as it is written; bracketed: in brackets alone."""
    written = _unit_in(name)[1]
    return written if written and (not bracketed or _BRACKETS.search(name)) else None


# --- the name -------------------------------------------------------------------------------------


def names_of(columns: Sequence[str]) -> dict[str, Name]:
    """What the names of a file's columns say; a beginning that all share says nothing."""
    split = [words_of(_unit_in(c)[0]) for c in columns]
    shared = 0
    while len(split) > 2 and len({tuple(w[: shared + 1]) for w in split if len(w) > shared}) == 1:
        shared += 1
    every = frozenset(split[0][:shared]) if split else frozenset()
    behind = _ends_in_units(columns)
    return {c: _name(c, every, behind) for c in columns}


def _ends_in_units(columns: Sequence[str]) -> bool:
    """Whether letters behind names are units: two fit what their names say, as position_m, force_N.

    One alone may be that of a motor.
    """
    fit = set()
    for column in columns:
        bare, written = _unit_in(column)
        if written and len(written) == 1 and not _BRACKETS.search(column):
            said = _quantities(words_of(bare))
            fit |= {written for quantity, _ in units_of(written) if quantity in said}
    return len(fit) > 1


def _name(column: str, shared: frozenset[str], ends_in_unit: bool) -> Name:
    bare, written = _unit_in(column)
    open_ = _BRACKETS.sub(" ", column)
    coded = next((found for found in CODES.items() if re.search(found[0], open_)), None)
    words = words_of(bare) if coded is None else [*coded[1].split(), *_places(column, coded[0])]
    told = [w for w in words if w not in shared]
    if _quantity(told)[0] is None and not (written and _stated(written)):
        told = [w for w in words if w not in shared or _quantities([w])]
    last = words_of(_PATH.split(bare)[-1]) if coded is None else words
    quantity, sure = _quantity(last if _quantities(last) else told)
    unit: str | None = None
    if written is not None:
        worded = quantity
        quantity, unit, kept = _with_unit(quantity, sure, column, written, ends_in_unit)
        sure = sure and quantity is worded
        if not kept:
            told = words = last = words_of(column)
            quantity, sure = _quantity(told)
    role = _role([w for w in last if w in told], quantity) or _role(told, quantity)
    if role is None and (symbol := next((s for w in told if (s := _SYMBOLS.get(w))), None)):
        quantity, role = quantity or symbol[0], symbol[1]
    if quantity is None and [w for w in told if not w.isdigit()] == ["r"]:
        quantity, role = Quantity.POSITION, SignalRole.ASKED
    if quantity is None and role in (SignalRole.MEASURED, SignalRole.ASKED):
        quantity = Quantity.POSITION  # act, ref: of what, is not said
    letter = "a" if quantity is Quantity.ACCELERATION and not sure else ""
    axis = _axis([w for w in words if w != letter], sure) if quantity else ()
    smoothed = bool(SMOOTHED & set(told))
    return Name(column, quantity, role, unit, axis, sure, smoothed)


def _places(column: str, code: str) -> list[str]:
    """The numbers and the letter of an axis that stand beside a code."""
    return [w for w in words_of(re.sub(code, " ", column)) if w.isdigit() or w in AXIS_LETTERS]


def _quantities(words: Sequence[str]) -> list[Quantity]:
    return [m for w in words for m in _meanings().get(w, ()) if isinstance(m, Quantity)]


def _quantity(words: Sequence[str]) -> tuple[Quantity | None, bool]:
    """The quantity that words say, and whether more than a letter does."""
    if COUNTING & set(words):
        without = _quantity([w for w in words if w not in COUNTING])
        if without[1]:
            return without
    said = _quantities(words)
    if Quantity.OTHER in said:
        return Quantity.OTHER, True
    if channel := next((q for q in CHANNELS if q in said), None):
        return channel, True
    others = [q for q in said if q is not Quantity.CURRENT]
    if Quantity.CURRENT in said and others and others[-1] is not Quantity.DRIVE:
        return _rate_of(others[-1], words), True  # the current position: that of now
    hints = [_hints()[w] for w in words if w in _hints()]
    hints += [_hints()[m[1]] for w in words if (m := _LETTER_OF_AXIS.match(w))]
    worded = [_hints()[w] for w in words if w in _hints() and len(w) > 1]
    found = (said or worded)[-1] if said or worded else hints[0] if hints else None
    if found is Quantity.CURRENT and "d" in words:
        return Quantity.OTHER, True  # of the d axis: that makes no force
    return (None if found is None else _rate_of(found, words)), bool(said or worded)


def _rate_of(quantity: Quantity, words: Sequence[str]) -> Quantity:
    for word in words:
        quantity = RATES.get(word, {}).get(quantity, quantity)
    return quantity


def _with_unit(
    quantity: Quantity | None, sure: bool, column: str, written: str, ends_in_unit: bool
) -> tuple[Quantity | None, str | None, bool]:
    """Quantity and unit with what the unit tells; False where it is none but part of the name."""
    bracketed = column.rstrip().endswith(("]", ")", ">", "}"))
    may = _stated(written) if bracketed else units_of(written)
    own = [u for q, u in may if q is quantity]
    if quantity is Quantity.OTHER or (quantity in CHANNELS and not own and not _is_raw(may)):
        return quantity, None, True
    if own:
        return quantity, own[0], True
    is_letter = len(written) == 1 and not bracketed and not ends_in_unit
    if is_letter and (sure or not written.isupper()):
        return quantity, None, False  # x_m, pos_A: of a motor, of an axis
    if not may:
        return quantity, None, True
    of, unit = may[0]
    if unit in _OF_ANOTHER and not sure and quantity in (Quantity.POSITION, Quantity.VELOCITY):
        return of, unit, True
    if of is Quantity.CURRENT and "d" in words_of(column):
        return Quantity.OTHER, None, True  # of the d axis: that makes no force
    if unit in RAW and quantity in (
        Quantity.POSITION,
        Quantity.VELOCITY,
        Quantity.FORCE,
        Quantity.CURRENT,
        *CHANNELS,
    ):
        return quantity, unit, True
    return of, unit, True


def _is_raw(may: Sequence[tuple[Quantity, str]]) -> bool:
    return bool(may) and may[0][1] in RAW


def _role(words: Sequence[str], quantity: Quantity | None) -> SignalRole | None:
    said = {m for w in words for m in _meanings().get(w, ()) if isinstance(m, SignalRole)}
    current = "current" in words and quantity not in (Quantity.CURRENT, None)
    *first, last = [w for w in words if not w.isdigit()] or [""]
    if SignalRole.PART in said and quantity in (Quantity.FORCE, Quantity.CURRENT):
        return SignalRole.PART
    by_letter = last in ("d", "r") and bool(_ASKED_BY_A_LETTER & set(first))
    if SignalRole.ASKED in said or (by_letter and quantity not in (Quantity.OTHER, *CHANNELS)):
        return SignalRole.ASKED
    return SignalRole.MEASURED if SignalRole.MEASURED in said or current else None


def _axis(words: Sequence[str], sure: bool) -> tuple[str, ...]:
    """The words that tell one axis from another."""
    out = []
    for word in words:
        pair = _LETTER_OF_AXIS.match(word)
        if pair and not sure:
            out.append(pair[2])
        elif word.isdigit():
            out.append(str(int(word)))
        elif word in AXIS_LETTERS or (len(word) > 1 and word not in _known()):
            if word not in _SYMBOLS:
                out.append(word)
            elif word[0] in "xy":
                out.append(word[0])
    return tuple(dict.fromkeys(out))
