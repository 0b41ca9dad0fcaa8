"""A stretch of a log is a log of its own, in Python and by the command that a check advises."""

import numpy as np
import pytest
from check_drive import drive
from cli_runs import twin

from twin import InputError, cut_log, read_log, write_log


@pytest.mark.parametrize(
    ("start", "stop", "first", "last"), [(0.0, None, 0, 4000), (1.0, 2.5, 1000, 2500)]
)
def test_a_stretch_has_the_samples_of_its_time(start, stop, first, last):
    log = drive(seconds=4.0)
    cut = cut_log(log, start, stop)
    for name, column in log.axes["x"].columns.items():
        assert np.array_equal(cut.axes["x"].columns[name], column[first:last])
    assert cut.metadata["cut"] == f"{first / 1000:g} to {last / 1000:g} s"
    assert cut.sample_rate == log.sample_rate


@pytest.mark.parametrize(
    ("start", "stop"), [(-1.0, 2.0), (0.0, 4.1), (2.0, 2.0), (3.0, 1.0), (float("nan"), 1.0)]
)
def test_a_stretch_that_the_log_has_not_is_refused_in_seconds(start, stop):
    with pytest.raises(InputError, match=r" s: (the log lasts 4 s; give a stretch|give numbers)"):
        cut_log(drive(seconds=4.0), start, stop)


def test_the_command_writes_it(tmp_path):
    write_log(drive(seconds=4.0), tmp_path / "run 1.mcap")
    done = twin(
        "cut", "run 1.mcap", "--from", "1", "--to", "3.5", "-o", "good.mcap", folder=tmp_path
    )
    assert done.stdout == "good.mcap: 2500 samples at 1000 Hz, 1 to 3.5 s of run 1.mcap\n"
    assert len(read_log(tmp_path / "good.mcap")) == 2500
    refused = twin("cut", "run 1.mcap", "--to", "9", "-o", "good.mcap", folder=tmp_path)
    assert refused.returncode == 2
    assert "the log lasts 4 s" in refused.stderr
