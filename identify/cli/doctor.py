"""`twin doctor`: what this installation has, what it lacks, and how to get that."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from identify.cli.command import Reply
from identify.cli.shared import app
from twin.installed import pip_install

NEEDED = (
    "numpy", "pydantic", "pint", "scipy", "numba", "mujoco", "matplotlib", "mcap", "protobuf",
    "zstandard", "lz4", "ruckig", "typer", "rich", "jinja2", "tomlkit", "threadpoolctl",
    "python-dateutil",
)  # fmt: skip
FOR_FLEET = ("dask", "distributed", "duckdb", "pyarrow")
FOR_LIVE = ("foxglove-sdk", "websockets")
FOR_IMPORT = ("h5py", "mcap-protobuf-support", "rosbags", "pyarrow", "npTDMS")
AGAIN = "pip install --upgrade proton-twin"


@dataclass(frozen=True)
class Line:
    """One line: what was looked at, what is there, and how to get what is missing, if anything.

    needed: whether `twin` does not work without.
    """

    about: str
    found: str
    remedy: str | None = None
    needed: bool = True

    def __str__(self) -> str:
        mark = "ok" if self.remedy is None else "MISSING" if self.needed else "without"
        tail = f"; {self.remedy}" if self.remedy else ""
        return f"{mark:8s}{self.about:10s} {self.found}{tail}"


@app.command()
def doctor() -> Reply:
    """Tell what this installation has, what is missing, and how to get it.

    Example: twin doctor
    """
    from identify.output.answers.machine import DoctorAnswer

    lines = [look() for look in LOOKS]
    ok = not any(line.needed and line.remedy for line in lines)
    return Reply("\n".join(map(str, lines)), DoctorAnswer.of(ok=ok, lines=lines), fine=ok)


def _twin() -> Line:
    from twin.logs.writer import software_version

    return Line("twin", f"{software_version()} in {Path(__file__).parent.parent.parent}")


def _python() -> Line:
    oldest = (3, 11)  # Python
    version = ".".join(map(str, sys.version_info[:3]))
    fits = sys.version_info >= oldest
    remedy = None if fits else f"install Python {'.'.join(map(str, oldest))} or newer"
    return Line("Python", f"{version}, {sys.executable}", remedy)


def _packages() -> Line:
    found, absent = _versions(NEEDED)
    return Line("packages", found, f"lacks {', '.join(absent)}: {AGAIN}" if absent else None)


def _importers() -> Line:
    found, absent = _versions(FOR_IMPORT)
    how = f"lacks {', '.join(absent)} (Parquet, HDF5, TDMS, foreign MCAP): "
    remedy = how + pip_install("import") if absent else None
    return Line("importers", found or "CSV, MAT and JSON alone", remedy, needed=False)


def _fleet() -> Line:
    found, absent = _versions(FOR_FLEET)
    how = f"lacks {', '.join(absent)} (`twin fleet`): "
    remedy = how + pip_install("fleet") if absent else None
    return Line("fleet", found or "none of its packages", remedy, needed=False)


def _live() -> Line:
    found, absent = _versions(FOR_LIVE)
    how = f"lacks {', '.join(absent)} (`twin watch` of topics): "
    remedy = how + pip_install("live") if absent else None
    return Line("live", found or "none of its packages", remedy, needed=False)


def _versions(names: tuple[str, ...]) -> tuple[str, list[str]]:
    from twin.logs.writer import software_version

    found = {name: software_version(name) for name in names}
    absent = [name for name, version in found.items() if version == "uninstalled"]
    return ", ".join(f"{n} {v}" for n, v in found.items() if n not in absent), absent


def _cache() -> Line:
    """Where the compiled laws are kept, so that they are compiled once."""
    import twin

    own = Path(twin.__file__).parent
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    folder = Path(chosen) if chosen else own
    count = len(list(folder.rglob("*.nbi"))) if folder.is_dir() else 0
    found = f"{folder}, {count} compiled functions"
    writable = os.access(folder if folder.is_dir() else folder.parent, os.W_OK)
    remedy = "cannot be written, so every start compiles anew: set NUMBA_CACHE_DIR to a folder"
    return Line("cache", found, None if writable else remedy, needed=False)


def _mujoco() -> Line:
    try:
        import mujoco

        model = mujoco.MjModel.from_xml_string("<mujoco/>")
        mujoco.mj_step(model, mujoco.MjData(model))
    except (ImportError, OSError, RuntimeError) as error:
        return Line("MuJoCo", f"does not run: {' '.join(str(error).split())}", AGAIN)
    return Line("MuJoCo", f"{mujoco.__version__} runs")


def _display() -> Line:
    from ctypes.util import find_library

    screen = next((n for n in ("WAYLAND_DISPLAY", "DISPLAY") if os.environ.get(n)), None)
    native = sys.platform in ("win32", "darwin")
    shown = "of the system" if native else screen or "none"
    egl = find_library("EGL") or "none"
    found = f"display {shown}, EGL {egl}; for `twin view` alone, a page (--html) needs neither"
    return Line("display", found)


def _threads() -> Line:
    from twin.parallel import cores
    from twin.threads import VARIABLES

    given = [f"{name}={os.environ[name]}" for name in VARIABLES if name in os.environ]
    return Line("threads", f"{cores()} cores; matrices: {', '.join(given) or 'one thread'}")


LOOKS: tuple[Callable[[], Line], ...] = (
    _twin, _python, _packages, _importers, _fleet, _live, _cache, _mujoco, _display, _threads,
)  # fmt: skip
