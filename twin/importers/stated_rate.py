"""A sample rate that a file states in words: "Sample Period: 5 ms", "Abtastrate;1 kHz"."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

# How often, and how long a sample is; the time of a recording or a log is how long that lasts.
_SAMPLES = r"(?:sampl\w*|abtast\w*|scan\w*)"
_LOGS = r"(?:record\w*|logg?\w*|acqui\w*|mess\w*|aufzeichn\w*|frame|update)"
_RATE = (
    rf"(?:(?:{_SAMPLES}|{_LOGS})[\s_\-]*(?:rate|freq\w*|takt)|abtast(?:rate|frequenz)|samplerate"
    r"|fréquence d.échantillonnage|采样(?:频率|率)|サンプリング周波数|^\W*(?:rate|fps)"
    r"|\bf_?s(?:_log\w*)?)"
)
_PERIOD = (
    rf"(?:{_SAMPLES}[\s_\-]*(?:time|zeit|step)|(?:{_SAMPLES}|{_LOGS})[\s_\-]*(?:period|interval)\w*"
    r"|abtast(?:zeit|intervall|periode)|tastzeit|zykluszeit|taktzeit|cycle[\s_]*time|time[\s_]*step"
    r"|période d.échantillonnage|采样(?:周期|间隔)|サンプリング(?:周期|間隔)"
    r"|^\W*(?:period|interval|increment|delta[\s_]*t)|\bt_?s(?:_log\w*)?|\bd_?t(?:_log\w*)?)"
)
_RATES = {"hz": 1.0, "khz": 1e3, "mhz": 1e6, "s/s": 1.0, "sa/s": 1.0, "ks/s": 1e3, "sps": 1.0,
          "samples/s": 1.0, "1/s": 1.0, "fps": 1.0}  # fmt: skip
_PERIODS = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6,
            "μs": 1e-6, "ns": 1e-9, "min": 60.0}  # fmt: skip
_UNIT = "|".join(sorted(map(re.escape, {**_RATES, **_PERIODS}), key=len, reverse=True))
_STATEMENT = re.compile(
    rf"(?:(?P<rate>{_RATE})|{_PERIOD})(?:[\s_]*(?:in\s+)?[\[(]?(?P<own>{_UNIT})\b[\])]?)?"
    rf"[^\w+-]+(?P<number>\d+(?:[.,]\d+)?(?:e[-+]?\d+)?)[\s\"]*(?P<unit>(?:{_UNIT})(?![\w/]))?",
    re.IGNORECASE,
)
# Of how many cycles or samples one is kept.
_KEPT = re.compile(
    rf"(?:decimat\w*|down[\s_-]*sampl\w*|unterabtast\w*|(?:{_SAMPLES}|{_LOGS})[\s_]*(?:factor|faktor|gap"
    r"|divi[ds]\w*|every)|^\W*(?:gap|divider|prescaler))(?:[\s_]*(?:factor|faktor|ratio|by))?"
    r"[^\w+-]+(?:every[\s_]+)?(?P<every>\d+)(?![\d.,]*\d|[\s_]*(?:Hz|kHz|ms|us|s)\b)",
    re.IGNORECASE,
)
_EVERY = re.compile(
    r"(?:every|jeder?)\s+(?P<every>\d+)(?:st|nd|rd|th|\.)?\s+(?:cycle|sample|point|takt|zyklus|wert)",
    re.IGNORECASE,
)
_OF_SAMPLES = re.compile(
    rf"{_SAMPLES}|record|logg?|acqui|aufzeichn|\bf_?s\b|\bt_?s\b", re.IGNORECASE
)
SAME = 0.02  # of a rate or a time, by which two clocks that are one do not differ
SLOWEST = 20.0  # Hz, of a log that a drive is identified from
_LONGEST = 300  # characters of a line that states a rate


@dataclass(frozen=True)
class StatedRate:
    """A rate in Hz, None where it is not known; text: the words that state it.

    unsure: why it is not known.
    """

    rate: float | None
    text: str
    unsure: str = "without a unit"


def stated_rate(texts: Iterable[str]) -> StatedRate | None:
    """The rate that these texts state; one without a unit where no other is.

    Of several that of samples or of the recording counts, before that of a cycle or a frame; where
    they differ, none. Less where they state that only every so manieth sample of it is kept.
    """
    texts = list(texts)
    unsure, every = None, next((k for text in texts if (k := _kept(text)) > 1), 1)
    known: list[tuple[bool, StatedRate]] = []
    for text in texts:
        plain = re.sub(r"(?<!\d),|,(?!\d)|[;\t|]", " ", text[:_LONGEST])
        for found in _STATEMENT.finditer(plain):
            rate = _rate_of(found)
            words = " ".join(text.replace("\t", " ").split())[:80]
            if rate is not None and every > 1:
                return StatedRate(rate / every, f"{words}, one of {every} kept")
            if rate is not None:
                known.append((_OF_SAMPLES.search(found[0]) is None, StatedRate(rate, words)))
            unsure = unsure or StatedRate(rate, words)
    if not known:
        return unsure
    first = min(other for other, _ in known)
    rates = [stated for other, stated in known if other is first]
    if all(abs((r.rate or 0.0) / (rates[0].rate or 1.0) - 1.0) < SAME for r in rates):
        return rates[0]
    texts = [*dict.fromkeys(r.text for r in rates)]
    return StatedRate(None, "; ".join(texts), "and other rates")


def _kept(text: str) -> int:
    """Of how many samples one is kept by what a text states; 1 where it states nothing of it."""
    plain = re.sub(r"[;\t|]", " ", text[:_LONGEST])
    found = _KEPT.search(plain) or _EVERY.search(plain)
    return int(found["every"]) if found else 1


def _rate_of(found: re.Match[str]) -> float | None:
    number = float(found["number"].replace(",", "."))
    # 1,000 Hz are no 1 Hz
    if found["rate"] and number < SLOWEST and re.fullmatch(r"\d{1,2},\d{3}", found["number"]):
        number *= 1000.0
    unit = (found["unit"] or found["own"] or "").lower()
    if number <= 0.0:
        return None
    if unit in _RATES:
        return number * _RATES[unit]
    if unit in _PERIODS:
        return 1.0 / (number * _PERIODS[unit])
    rate = number if found["rate"] else 1.0 / number
    return rate if rate >= SLOWEST else None  # slower is in another unit
