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
from pathlib import Path
from xml.sax.saxutils import quoteattr

from twin.export import Exported, Exporter, Remark, identifier
from twin.export.c_source import AxisCode, CSource, c_source
from twin.logs import Log
from twin.model.machine import MachineModel

WRAPPER = Path(__file__).parent.parent / "fmi2.c"
BINARIES = {"Linux": ("linux", ".so"), "Darwin": ("darwin", ".dylib"), "Windows": ("win", ".dll")}

Signal = tuple[str, str, str]  # name, unit, what it is


def export(model: MachineModel, logs: Mapping[str, Log]) -> Exported:
    """One .fmu file."""
    made = c_source(model)
    wrapper = WRAPPER.read_text(encoding="utf-8")
    guid = hashlib.sha256((made.header + made.source + wrapper).encode()).hexdigest()[:32]
    sources = {"fmi2.c": wrapper, "model.h": _model_header(made, guid)}
    sources |= {f"{made.name}.c": made.source, f"{made.name}.h": made.header}
    binary, why = _compiled(made.name, sources)
    files: dict[str, str | bytes] = {"modelDescription.xml": _description(model, made, guid)}
    files |= {f"sources/{name}": text for name, text in sources.items()}
    files |= binary
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            # of a file in a zip: the same model gives the same bytes
            oldest = (1980, 1, 1, 0, 0, 0)
            archive.writestr(zipfile.ZipInfo(name, oldest), content)
    lost = (*made.lost, *(Remark(a.name, "binary", why) for a in made.axes if why))
    return Exported({f"{made.name}.fmu": stream.getvalue()}, made.kept, made.approximated, lost)


def _inputs(a: AxisCode) -> list[Signal]:
    units = {n: getattr(a.axis.units, n.removeprefix("other_")) for n in a.arguments}
    return [(f"{identifier(a.name)}_{n}", unit, f"setpoint, {n}") for n, unit in units.items()]


def _outputs(a: AxisCode) -> list[Signal]:
    units, name = a.axis.units, identifier(a.name)
    force = (f"{name}_{units.words('force')}", units.force, "that follows the setpoint")
    current = (f"{name}_current", "A", "the same as a current")
    return [force, *([current] if a.axis.hardware.force_constant != 1.0 else [])]


def _model_header(made: CSource, guid: str) -> str:
    """What fmi2.c needs of the machine."""
    members = "\n".join(f"    {a.prefix}_state {identifier(a.name)};" for a in made.axes)
    calls, at, to = [], 0, 0
    for a in made.axes:
        given = ", ".join(f"in[{at + i}]" for i in range(len(a.arguments)))
        calls.append(f"    out[{to}] = {a.prefix}_force(&state->{identifier(a.name)}, {given});")
        if len(_outputs(a)) > 1:
            calls.append(f"    out[{to + 1}] = out[{to}] / {a.axis.hardware.force_constant!r};")
        at, to = at + len(a.arguments), to + len(_outputs(a))
    return "\n".join(
        [
            f'#include "{made.name}.h"\n',
            f'#define MODEL_GUID "{guid}"',
            f"#define MODEL_PERIOD {made.name.upper()}_PERIOD",
            f"enum {{ N_INPUTS = {at}, N_OUTPUTS = {to} }};\n",
            f"typedef struct {{\n{members}\n}} model_state;\n",
            "static void model_call(model_state *state, const double *in, double *out)\n{",
            *calls,
            "}\n",
        ]
    )


def _description(model: MachineModel, made: CSource, guid: str) -> str:
    """modelDescription.xml."""
    from twin.logs.writer import software_version

    inputs = [signal for a in made.axes for signal in _inputs(a)]
    outputs = [signal for a in made.axes for signal in _outputs(a)]
    units = dict.fromkeys(unit for _, unit, _ in [*inputs, *outputs])
    variables = []
    for reference, (name, unit, what) in enumerate([*inputs, *outputs]):
        causality = "input" if reference < len(inputs) else "output"
        start = ' start="0"' if causality == "input" else ""
        variables.append(
            f'    <ScalarVariable name="{name}" valueReference="{reference}" '
            f'description={quoteattr(what)} causality="{causality}" variability="discrete">\n'
            f'      <Real unit={quoteattr(unit)}{start}/>\n    </ScalarVariable>'
        )  # fmt: skip
    unknown = [f'      <Unknown index="{len(inputs) + i + 1}"/>' for i in range(len(outputs))]
    return "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            f'<fmiModelDescription fmiVersion="2.0" modelName={quoteattr(model.name)} '
            f'guid="{guid}" generationTool="proton-twin {software_version()}" '
            'numberOfEventIndicators="0">',
            f'  <CoSimulation modelIdentifier="{made.name}" '
            'canHandleVariableCommunicationStepSize="true" '
            'canNotUseMemoryManagementFunctions="true" canGetAndSetFMUstate="true" '
            'canSerializeFMUstate="true">',
            '    <SourceFiles>\n      <File name="fmi2.c"/>',
            f'      <File name="{made.name}.c"/>\n    </SourceFiles>\n  </CoSimulation>',
            "  <UnitDefinitions>",
            *(f"    <Unit name={quoteattr(unit)}/>" for unit in units),
            f'  </UnitDefinitions>\n  <DefaultExperiment stepSize="{model.period!r}"/>',
            "  <ModelVariables>",
            *variables,
            "  </ModelVariables>\n  <ModelStructure>\n    <Outputs>",
            *unknown,
            "    </Outputs>\n    <InitialUnknowns>",
            *unknown,
            "    </InitialUnknowns>\n  </ModelStructure>\n</fmiModelDescription>\n",
        ]
    )


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
