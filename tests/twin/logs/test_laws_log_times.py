"""Laws of times: evenly spaced within a tenth of a period, complete, and of one rate.

Every tolerance is entered from both sides, with the sample and the times named.
"""

import pytest
from mcap.records import Metadata
from mcap_bytes import json_channel, json_schema
from plain_cases import HEAD, MS, accepted, refused, sample

from twin.logs import container as chunks

RATED = [json_schema(1), json_channel(1, "/axis/x", {"sample_rate_hz": "1000"}, 1)]


def at_times(head, offsets: dict[int, float], count: int = 12):
    """Samples every ms but for those that are ``offsets`` of a period late."""
    return [
        *head,
        *(sample(k, time=round(MS * (5 + k + offsets.get(k, 0.0)))) for k in range(count)),
    ]


@pytest.mark.parametrize("head", [RATED, HEAD], ids=["stated", "counted"])
@pytest.mark.parametrize("k", [1, 5, 10])
def test_a_time_may_be_off_by_a_tenth_of_a_period_and_no_more(tmp_path, head, k):
    for off in (0.09, -0.09):
        log = accepted(tmp_path / "a.mcap", at_times(head, {k: off}))
        assert (log.sample_rate, len(log)) == (1000.0, 12)
    for off in (0.11, -0.11, 0.45, -0.45):
        text = refused(tmp_path / "a.mcap", at_times(head, {k: off}), "uneven time")
        before, after = 5 + k - 1, 5 + k + off
        assert f"{before / 1e3:g} s is followed by {after / 1e3:.9g} s at sample {k}, " in text
        assert "every 0.001 s (1000 Hz)" in text


@pytest.mark.parametrize("head", [RATED, HEAD], ids=["stated", "counted"])
@pytest.mark.parametrize("k", [2, 5, 11])
def test_a_gap_and_a_step_back_are_called_so(tmp_path, monkeypatch, head, k):
    late = dict.fromkeys(range(k, 12), 1.0)
    text = refused(tmp_path / "a.mcap", at_times(head, late), f"gap: .* at sample {k},")
    assert f"{(4 + k) / 1e3:g} s is followed by {(6 + k) / 1e3:g} s" in text
    assert "expected a sample every 0.001 s (1000 Hz)" in text
    refused(tmp_path / "a.mcap", at_times(head, {k: -1.0}), f"not increase: .* at sample {k},")
    monkeypatch.setattr(chunks, "LOOSE_BYTES", 1)  # likewise where every message comes alone
    text = refused(tmp_path / "a.mcap", at_times(head, late), f"gap: .* at sample {k},")
    assert "expected a sample every 0.001 s (1000 Hz)" in text


def test_sequence_numbers_count_or_are_not_used(tmp_path):
    """They may begin anywhere and overflow; one missing is named."""
    path = tmp_path / "a.mcap"
    for first in (0, 7, 2**32 - 3):
        items = [sample(k, sequence=(first + k) % 2**32) for k in range(6)]
        assert len(accepted(path, [*HEAD, *items])) == 6
        items = [sample(k, sequence=(first + k + (k > 3)) % 2**32) for k in range(6)]
        found, expected = (first + 5) % 2**32, (first + 4) % 2**32
        refused(
            path, [*HEAD, *items], f"message 4 has sequence number {found}, expected {expected}"
        )


@pytest.mark.parametrize("rate", [1000.0, 999.5, 100.24, 100.26, 44.3, 7.5])
def test_the_counted_rate_is_whole_only_where_the_times_allow_it(tmp_path, rate):
    """Over 40 periods, 100.24 Hz and 100 Hz differ by less than a tenth of one, 100.26 Hz not."""
    count = 41
    items = [sample(k, time=round(k * 1e9 / rate)) for k in range(count)]
    got = accepted(tmp_path / "a.mcap", [*HEAD, *items]).sample_rate
    whole = abs(round(rate) - rate) * (count - 1) < 0.1 * rate
    assert got == pytest.approx(round(rate) if whole else rate, rel=1e-7)
    assert whole == (rate in (1000.0, 999.5, 100.24))


@pytest.mark.parametrize(("stated", "right"), [("1000.0000005", True), ("1000.000002", False)])
def test_rates_may_differ_by_a_rounding_only(tmp_path, stated, right):
    items = [Metadata("twin", {"sample_rate_hz": stated}), *at_times(RATED, {})]
    if right:
        assert accepted(tmp_path / "a.mcap", items).sample_rate == 1000.0
    else:
        refused(tmp_path / "a.mcap", items, "x is sampled at 1000 Hz, the metadata says")
