"""Logs that are checked together: what one has that the first has not is told."""

import numpy as np
import pytest
from check_drive import drive

from twin.checks import Fault, Severity
from twin.checks.long import check_files
from twin.logs import ROTARY_UNITS, write_log


def other(**of):
    """The same drive later, with noise of its own, as no copy."""

    def change(columns):
        noise = np.random.default_rng(7).standard_normal(len(columns["force"]))
        columns["force"] += 0.05 * noise

    return drive(seconds=5.0, late={"position": 20.0, "force": 20.0}, change=change, **of)


@pytest.mark.parametrize(
    ("log", "said", "severity"),
    [
        (other(), None, None),
        (other(rate=500.0), "sampled at 500 Hz, a.mcap at 1000 Hz", Severity.WARNING),
        (other(kind=ROTARY_UNITS), "it is rotary, in a.mcap linear", Severity.ERROR),
        (other(factor={"position": 1e3, "force": 1e3}), "mm for m", Severity.WARNING),
    ],
)  # fmt: skip
def test_a_log_that_differs_is_told(tmp_path, log, said, severity):
    write_log(drive(), tmp_path / "a.mcap")
    write_log(log, tmp_path / "b.mcap")
    found = check_files([tmp_path / "a.mcap", tmp_path / "b.mcap"])
    first, second = (report.findings for report in found.values())
    assert first == ()
    of_both = [
        f for f in second if f.fault in (Fault.UNIT, Fault.UNEVEN) and "travels 1" not in f.what
    ]
    if said is None:
        assert of_both == []
    else:
        assert said in " ".join(f.what for f in of_both).replace(f"{tmp_path}/", "")
        assert severity in {f.severity for f in of_both}
