"""Chapter "cable": the force of the cable slab from passes at +-0.1 m/s over +-0.15 m.

The thesis averages 10 passes each way, -(F_pos + F_neg)/2, and smooths. Here the spikes of the
rollers are found first and kept out. The machine is simulated, so that what is found can be held
against what was planted; ``studies.curves.cable_force`` runs on any log of passes.
"""

from __future__ import annotations

import numpy as np

from identify.estimation.evidence import rms
from studies.curves.cable_force import CableForce, cable_force
from studies.drawing import BLUE, GREY, ORANGE, Picture
from studies.telling import Line, Panel, picture
from studies.thesis import shared
from studies.thesis.shared import Array, Found, Numbers
from twin.experiments.kinds import Passes
from twin.logs import Log
from twin.model.machine import AxisModel
from twin.simulation.simulate import simulate
from twin.simulation.simulators import MujocoSimulator, ReducedSimulator

TITLE = "Cable slab"
SPEED, SPAN = 0.1, 0.3  # m/s, m
REPEATS = 10  # passes each way
ROLLER_PITCH = 34e-3  # m, printed in the thesis


def run(small: bool, rng: np.random.Generator) -> Found:
    """Run the passes on the first axis of the stage, which has a cable and rollers."""
    model, name, axis = shared.machine("proton_xy")
    passes = Passes(name, span=SPAN, speed=SPEED, repeats=3 if small else REPEATS)
    simulator = ReducedSimulator if small else MujocoSimulator
    log = simulate(model, passes, seed=shared.seed_of(rng), simulator=simulator)
    found = cable_force(model, {"passes": log}, axis=name)
    true, pitch = planted(axis, log, name, found.position), None
    if found.pitch is not None:
        periods = [f.values[p.name] for f in axis.effects for p in f.effect.parameters if p.period]
        pitch = shared.recovered(periods[0], [found.pitch.value], "m", ROLLER_PITCH)
        pitch["standard_error"] = found.pitch.standard_error
    off = found.force - true
    numbers = {
        "repeats": passes.repeats, "pitch": pitch, "spikes": found.spikes,
        "position": found.position, "position_unit": "m", "found": found.force, "true": true,
        "band_90": found.band, "with_spikes": found.with_all, "unit": "N", "printed": None,
        "rms_error": rms(off), "largest_error": np.abs(off).max(),
        "rms_error_with_spikes": rms(found.with_all - true),
        "within_band": np.mean(np.abs(off) <= found.band),
    }  # fmt: skip
    return Found(numbers, words(numbers), pictures(found, true))


def planted(axis: AxisModel, log: Log, name: str, position: Array) -> Array:
    """The force (k,) N that the machine's smooth forces of position had at these places."""
    truth = log.truth[name]
    force = np.sum([truth[f.effect.name] for f in shared.of_position(axis)], axis=0)
    order = np.argsort(truth["position"])
    return np.interp(position, truth["position"][order], force[order])


def words(n: Numbers) -> list[str]:
    """How well the cable's force was recovered, and the pitch of the spikes."""
    said = [
        f"cable force from {n['repeats']} passes each way: {n['rms_error']:.2g} N RMS from the "
        f"planted one, at most {n['largest_error']:.2g} N; {100.0 * n['within_band']:.0f} % of it "
        "inside its 90 % band",
        f"with the spikes left in, as in the thesis: {n['rms_error_with_spikes']:.2g} N RMS",
    ]
    if n["pitch"] is None:
        return [*said, "fewer than three spikes were found, so there is no pitch"]
    pitch, error, true = (1e3 * n["pitch"][key] for key in ("mean", "standard_error", "true"))
    spikes = f"{len(n['spikes'])} spikes, pitch {pitch:.4f} +- {error:.2g} mm (planted {true:g} mm)"
    return [*said, spikes]


def pictures(found: CableForce, true: Array) -> list[Picture]:
    """The passes, and the force found beside the planted one."""
    place, x, out = 1e3 * found.position, "Position (mm)", ~found.kept
    means = {
        "forwards": (found.passes.forwards.mean(axis=0), BLUE),
        "backwards": (found.passes.backwards.mean(axis=0), ORANGE),
    }
    passes = [
        Panel(Line(place, force, label, color), Line(place[out], force[out], "", GREY, "."),
              xlabel=x, ylabel="Force (N)")
        for label, (force, color) in means.items()
    ]  # fmt: skip
    left_in, error = 1e3 * (found.with_all - true), 1e3 * (found.force - true)
    forces = Line(place, true, "planted", GREY, width=4.0), Line(place, found.force, "found")
    errors = (Line(place, left_in, "spikes left in", ORANGE),
              Line(place, error, "error", BLUE, half=1e3 * found.band))  # fmt: skip
    return [
        picture("The mean force over the passes of each direction. Grey: where a spike was found; "
                "it is kept out of the cable's force.", *passes),
        picture("The cable's force found and planted, and below the error with its 90 % band; "
                "orange: the error if the spikes are left in, as in the thesis.",
                Panel(*forces, xlabel=x, ylabel="Cable force (N)"),
                Panel(*errors, xlabel=x, ylabel="Error (mN)")),
    ]  # fmt: skip
