"""FMU: the feedforward as FMI 2.0 co-simulation, the version that Simulink and Modelica open.

The same C as ``--to c``, with its sources, compiled for the machine where it is exported.
"""

from __future__ import annotations

import hashlib
import io
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from twin.export import Exported, Exporter, Remark, filled, identifier
from twin.export.formats.c import AxisCode, c_source
from twin.logs import Log
from twin.logs.writer import software_version
from twin.model.machine import MachineModel

WRAPPER = Path(__file__).parent.parent / "fmi2.c"
BINARIES = {"Linux": ("linux", ".so"), "Darwin": ("darwin", ".dylib"), "Windows": ("win", ".dll")}

Signal = tuple[str, str, str]  # name, unit, what it is


def export(model: MachineModel, logs: Mapping[str, Log]) -> Exported:
    """One .fmu file."""
    made = c_source(model)
    wrapper = WRAPPER.read_text(encoding="utf-8")
    guid = hashlib.sha256((made.header + made.source + wrapper).encode()).hexdigest()[:32]
    inputs = [signal for a in made.axes for signal in _inputs(a)]
    outputs = [signal for a in made.axes for signal in _outputs(a)]
    header, description = (
        filled(
            name, model=model, made=made, guid=guid, inputs=inputs, outputs=outputs,
            units=dict.fromkeys(unit for _, unit, _ in [*inputs, *outputs]),
            version=software_version(),
        )
        for name in ("fmu.h", "modelDescription.xml")
    )  # fmt: skip
    sources = {"fmi2.c": wrapper, "model.h": header}
    sources |= {f"{made.name}.c": made.source, f"{made.name}.h": made.header}
    binary, why = _compiled(made.name, sources)
    files: dict[str, str | bytes] = {"modelDescription.xml": description}
    files |= {f"sources/{name}": text for name, text in sources.items()}
    files |= binary
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            # of a file in a zip: the same model gives the same bytes
            oldest = (1980, 1, 1, 0, 0, 0)
            archive.writestr(zipfile.ZipInfo(name, oldest), content)
    held = {}
    for a in made.axes:
        absent = (Remark(a.name, "binary", why),) if why else ()
        held[a.name] = replace(a.held, lost=(*a.held.lost, *absent))
    return Exported({f"{made.name}.fmu": stream.getvalue()}, held)


def _inputs(a: AxisCode) -> list[Signal]:
    units = {n: getattr(a.axis.units, n.removeprefix("other_")) for n in a.arguments}
    return [(f"{identifier(a.name)}_{n}", unit, f"setpoint, {n}") for n, unit in units.items()]


def _outputs(a: AxisCode) -> list[Signal]:
    units, name = a.axis.units, identifier(a.name)
    force = (f"{name}_{units.words('force')}", units.force, "that follows the setpoint")
    current = (f"{name}_current", "A", "the same as a current")
    return [force, *([current] if a.by_current else [])]


def _compiled(name: str, sources: Mapping[str, str]) -> tuple[dict[str, bytes], str]:
    """The library for this machine by its place in the archive, or why there is none."""
    compiler = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    if compiler is None:
        return {}, "no C compiler was found: only tools that compile the sources open it"
    system, suffix = BINARIES.get(platform.system(), ("linux", ".so"))
    bits = 64 if sys.maxsize > 2**32 else 32
    with tempfile.TemporaryDirectory() as folder:
        for file, text in sources.items():
            (Path(folder) / file).write_text(text, encoding="utf-8")
        done = subprocess.run(
            [compiler, "-std=c99", "-O2", "-shared", "-fPIC", "-fvisibility=hidden", "fmi2.c",
             f"{name}.c", "-o", "made", "-lm"],
            cwd=folder, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            said = done.stderr.splitlines() or ["nothing said"]
            return {}, f"the C compiler failed: {said[0]}"
        content = (Path(folder) / "made").read_bytes()
    return {f"binaries/{system}{bits}/{name}{suffix}": content}, ""


EXPORTER = Exporter("FMI 2.0 co-simulation for Simulink, Modelica and others", export, ".fmu")
