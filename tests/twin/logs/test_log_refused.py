"""What is no log at all is refused in one clear line, by reading and by recovery."""

import pytest

from twin.errors import InputError
from twin.logs import read_log, recover_log


@pytest.mark.parametrize("read", [read_log, recover_log])
@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda p: None, "cannot be read: No such file or directory"),
        (lambda p: p.mkdir(), "cannot be read: Is a directory"),
        (lambda p: p.write_bytes(b""), "the file is empty|nothing can be recovered"),
        (lambda p: p.write_bytes(b"time,position\n" * 50), "not an MCAP file|nothing can be"),
        (lambda p: p.write_bytes(b"\x89MCAP0\r\n"), "truncated: ends at byte 8|nothing can be"),
    ],
)
def test_what_is_no_log_is_one_clear_line(tmp_path, read, make, message):
    path = tmp_path / "a.mcap"
    make(path)
    with pytest.raises(InputError, match=message) as caught:
        read(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
