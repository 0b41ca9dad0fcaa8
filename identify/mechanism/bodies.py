"""A body of a mechanism whose inertia is not what its MuJoCo file says: a payload, a wrong link.

Which values a body can have is told by its pseudo-inertia, a matrix (4, 4) that is positive (P. M.
Wensing, S. Kim, J.-J. Slotine, IEEE Robotics and Automation Letters 3, 2018).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from identify.dataset.body import INERTIAL
from identify.estimation.errors import Errors
from identify.estimation.fit import Fit
from identify.selection.acceptance import Score
from identify.selection.findings import confidence
from twin.model.machine import MachineModel
from twin.signals import Array


@dataclass(frozen=True, eq=False)
class WrongBody:
    """A body whose inertial parameters are not those of the file.

    body: its name; axis: that moves it. tied: names of others that explain as much, bodies, or
    effects of joints ("rotor_inertia of elbow"). axes: whose forces it changes.
    inertial, change, band (10,): each of INERTIAL as the file has it, by how much it is more, and
    half the 90 % band of that; no number where the logs do not tell it. score: over all joints.
    errors: N, of each axis without and with all that was found. disagreeing: names of the
    logs that by themselves tell another change.
    """

    body: str
    axis: str
    tied: tuple[str, ...]
    axes: tuple[str, ...]
    inertial: Array
    change: Array
    band: Array
    score: Score
    errors: Mapping[str, Errors]
    disagreeing: tuple[str, ...] = ()

    @property
    def differing(self) -> dict[str, tuple[float, float]]:
        """Parameters that differ from the file by more than their band: change and band."""
        each = zip(INERTIAL, self.change.tolist(), self.band.tolist(), strict=True)
        return {name: (value, band) for name, value, band in each if band < abs(value)}

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Parameters that these joints do not tell, or only together with others."""
        return tuple(n for n, band in zip(INERTIAL, self.band, strict=True) if np.isnan(band))

    @property
    def element(self) -> tuple[float, Array, Array]:
        """Mass kg, centre (3,) m and inertia (3, 3) kg m^2 about it that the body has by the logs.

        Where these tell nothing, nearly as in the file.
        """
        mass, first, about = np.split(self.inertial + self.change, [1, 4])
        centre, (xx, yy, zz, xy, xz, yz) = first / mass, about
        matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        matrix -= mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        return float(mass[0]), centre, matrix

    @property
    def written(self) -> str:
        """The element of a MuJoCo file that says so."""
        from twin.mujoco.written import inertial

        return inertial(*self.element)

    @property
    def confidence(self) -> float:
        """How often answers with such a score were right, 0..1.

        Of what logs disagree about, that of a gain which hardly differs from chance.
        """
        return confidence(self.score.part, 0.0 if self.disagreeing else self.score.t)


def possible(found: Array, information: Array, bodies: Sequence[Array], most: int = 200) -> Array:
    """The parameters (10 k,) nearest to those found that k bodies can have.

    found (10 k,): of a fit without constraint. information (10 k, 10 k): of that fit, by which near
    is meant. bodies: the parameters (10,) of each to begin with, those of the file. most: turns.
    Each pseudo-inertia is L L^T, with the lower triangle L as the variables (Levenberg, Marquardt).
    """
    if all(_is_possible(own) for own in np.split(found, len(bodies))):
        return found
    from scipy.linalg import block_diag  # SciPy takes long to load
    from scipy.optimize import least_squares

    power, axes = np.linalg.eigh(information)
    root = (axes * np.sqrt(np.maximum(power, 0.0))).T
    begun = np.concatenate([_triangle(own) for own in bodies])
    size = np.concatenate([np.sqrt(np.diag(_pseudo(own)))[LOWER[0]] for own in bodies])
    squares = _squares()

    def left(x: Array) -> Array:
        """By how much the parameters are others than those found, in units of the fit's noise."""
        each = np.split(x * size, len(bodies))
        return root @ (np.concatenate([own @ squares @ own for own in each]) - found)

    def slopes(x: Array) -> Array:
        each = [2.0 * squares @ own for own in np.split(x * size, len(bodies))]
        return root @ block_diag(*each) * size

    done = least_squares(left, begun / size, slopes, method="lm", max_nfev=most)
    return np.concatenate([_thick(_inertial(own)) for own in np.split(done.x * size, len(bodies))])


LOWER = np.tril_indices(4)
# Of a body's extent about its centre, squared, the least along any direction: as flat as a file of
# six digits can have it.
FLAT = 1e-4


def _pseudo(inertial: Array) -> Array:
    """The pseudo-inertia (4, 4) of parameters (10,)."""
    mass, first, (xx, yy, zz, xy, xz, yz) = inertial[0], inertial[1:4], inertial[4:]
    about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    out = np.empty((4, 4))
    out[:3, :3] = 0.5 * np.trace(about) * np.eye(3) - about
    out[3, :3] = out[:3, 3] = first
    out[3, 3] = mass
    return out


def _spread(inertial: Array) -> tuple[Array, Array]:
    """Second moments (3,) of a body about its centre, kg m^2, and their directions (3, 3)."""
    mass, first = inertial[0], inertial[1:4]
    second = _pseudo(inertial)[:3, :3] - np.outer(first, first) / mass
    power, axes = np.linalg.eigh(second)
    return power, axes


def _is_possible(inertial: Array) -> bool:
    if inertial[0] <= 0.0:
        return False
    power, _ = _spread(inertial)
    return bool(power[0] > 0.5 * FLAT * power.sum() > 0.0)


def _thick(inertial: Array) -> Array:
    """The parameters (10,) of a body that is nowhere flatter than a file can have it."""
    mass, first = max(inertial[0], FLAT), inertial[1:4]
    power, axes = _spread(np.concatenate([[mass], inertial[1:]]))
    power = np.maximum(power, FLAT * np.maximum(power, 0.0).sum())
    second = (axes * power) @ axes.T + np.outer(first, first) / mass
    return _of_moments(mass, first, second)


def _triangle(inertial: Array) -> Array:
    """The lower triangle (10,) of the root of a body's pseudo-inertia."""
    matrix = _pseudo(inertial)
    power, axes = np.linalg.eigh(matrix)
    least = 1e-6 * float(np.trace(matrix))  # of bodies whose file has them flat
    return np.linalg.cholesky((axes * np.maximum(power, least)) @ axes.T)[LOWER]


@cache
def _squares() -> Array:
    """The parameters of a body as quadratic forms (10, 10, 10) of its triangle."""
    unit = np.eye(10)
    alone = np.array([_inertial(e) for e in unit])
    pairs = np.array([[_inertial(a + b) for b in unit] for a in unit])
    return np.moveaxis(0.5 * (pairs - alone[:, None] - alone[None]), -1, 0)


def _inertial(lower: Array) -> Array:
    """The parameters (10,) of a body of that triangle."""
    root = np.zeros((4, 4))
    root[LOWER] = lower
    matrix = root @ root.T
    return _of_moments(matrix[3, 3], matrix[3, :3], matrix[:3, :3])


def _of_moments(mass: float, first: Array, second: Array) -> Array:
    """The parameters (10,) of a body of that mass, first (3,) and second moments (3, 3)."""
    about = np.trace(second) * np.eye(3) - second
    return np.array([mass, *first, *about.diagonal(), *about[np.triu_indices(3, 1)]])


def corrected(
    model: MachineModel, bodies: Sequence[WrongBody], fits: Mapping[str, Fit], file: str
) -> MachineModel:
    """A model with the bodies as they were found in a MuJoCo file of another name.

    fits: of its joints beside these bodies.
    """
    from twin.mujoco.mechanism import joints_of
    from twin.mujoco.written import in_mjcf, with_inertial

    text, name = model.mjcf or "", model.mjcf_name or ""
    text = in_mjcf(text, name)
    for found in bodies:
        wanted = found.inertial + found.change
        text = with_inertial(text, name, model.joints, found.axis, found.written, wanted)
    own = joints_of(text, file, model.joints)
    refitted = {axis: fit.axis for axis, fit in fits.items()}
    axes = {a: replace(refitted.get(a, x), mass=own[a].inertia) for a, x in model.axes.items()}
    return replace(model, axes=axes, mjcf=text, mjcf_name=file, intervals={})
