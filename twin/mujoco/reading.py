"""MJCF and URDF texts as MuJoCo reads them."""

from __future__ import annotations

import mujoco

from twin.errors import InputError


def read_spec(text: str, name: str) -> mujoco.MjSpec:
    """The spec of an MJCF or URDF text; InputError, that names the file, where it is none."""
    try:
        return mujoco.MjSpec.from_string(text)
    except ValueError as error:
        said = " ".join(str(error).split())
        raise InputError(
            f"{name}: is not an MJCF or URDF file that MuJoCo reads: {said}"
        ) from error


def read_bodies(text: str, name: str) -> mujoco.MjSpec:
    """The spec of an MJCF or URDF text, less the geometry that the bodies' inertia does not need.

    name: of the file, for messages. Raises InputError where MuJoCo cannot read it.
    """
    spec = read_spec(text, name)
    spec.compiler.fusestatic = False  # a body keeps its name
    least_inertia = 1e-9  # kg, kg m^2: of a body whose file rounds its inertia to 0
    spec.compiler.boundmass = spec.compiler.boundinertia = least_inertia
    spec.compiler.balanceinertia = True
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    for body in spec.bodies[1:]:
        if not body.explicitinertial and any(_is_mesh(g) and g.mass != 0.0 for g in body.geoms):
            raise InputError(
                f"{name}: body '{body.name}' has its inertia from a mesh alone; give it an "
                "inertial element with mass (kg), pos (m) and inertia (kg m^2)"
            )
    for geom in [g for g in spec.geoms if _is_mesh(g) or g.parent.explicitinertial]:
        spec.delete(geom)
    for part in (*spec.meshes, *spec.hfields, *spec.skins, *spec.materials, *spec.textures):
        spec.delete(part)
    return spec


def _is_mesh(geom: mujoco.MjsGeom) -> bool:
    return geom.type in (mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_HFIELD)
