"""How a structure effect attaches its bodies to the MuJoCo model of a machine."""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.errors import InputError
from twin.model.units import LINEAR, ROTARY, AxisUnits

# A joint of its own: no limits, whatever the defaults of the machine's file.
FREE = {
    "limited": mujoco.mjtLimited.mjLIMITED_FALSE,
    "actfrclimited": mujoco.mjtLimited.mjLIMITED_FALSE,
    "frictionloss": 0.0,
    "margin": 0.0,
}


@dataclass(frozen=True)
class Spring:
    """Spring and damper of an oscillator of unit mass: stiffness 1/s^2, damping 1/s."""

    stiffness: float
    damping: float

    @classmethod
    def of(cls, share: float, frequency: float, ratio: float, period: float) -> Spring:
        """Such that MuJoCo's step of ``period`` s oscillates and decays as the exact motion does.

        A step v += h (-k x - c v)/(1 + h c), x += h v has the poles exp(h (-D +- i w)), D and w the
        decay and frequency at ``frequency`` Hz and damping ``ratio``, for the k and c given here.
        Above a third of the sampling rate, and where with the ``share`` of mass that swings the
        free motion would be as fast, the spring is held where the step is stable.
        """
        angle = min(2.0 * math.pi * frequency * period, 3.0)
        grown = math.expm1(ratio * angle)
        half = math.sin(0.5 * math.sqrt(1.0 - ratio * ratio) * angle)
        stiffness = min(grown * grown + 4.0 * (1.0 + grown) * half * half, 2.0 * (1.0 - share))
        return cls(stiffness / period**2, math.expm1(2.0 * ratio * angle) / period)


@dataclass(frozen=True)
class Mount:
    """One axis of a machine's spec, for one effect.

    axis: name of its joint; joint: name of the joint to build, of the same type; mass: moved mass,
    kg, or moment of inertia, kg m^2, where ``rotary``.
    """

    spec: mujoco.MjSpec
    axis: str
    joint: str
    mass: float
    rotary: bool = False

    @property
    def units(self) -> AxisUnits:
        """Of the axis."""
        return ROTARY if self.rotary else LINEAR

    def hang(self, share: float, frequency: float, ratio: float, play: float = 0.0) -> None:
        """Take a share of the moved mass off the axis' body and hang it on a spring and damper.

        frequency (Hz) and damping ratio are those with the axis held; play (m) is the width within
        which the spring does not pull. Raises InputError where the body is not heavy enough.
        """
        slide = self.spec.joint(self.axis)
        body, load = slide.parent, share * self.mass
        own = body.inertia[0] if self.rotary else body.mass
        if load >= own:
            unit = self.units.mass
            raise InputError(
                f"axis {self.axis}: {self.joint} hangs {load:g} {unit} on a spring, but the axis "
                f"has only {own:g} {unit} of its own; give a smaller share of the moved mass"
            )
        spring = Spring.of(share, frequency, ratio, self.spec.option.timestep)
        hung = body.add_body(name=self.joint, pos=np.nan_to_num(body.ipos))
        hung.mass, hung.explicitinertial = body.mass * (load / own), True
        hung.inertia = np.asarray(body.inertia) * (load / own)
        if self.rotary:
            body.inertia = np.asarray(body.inertia) - hung.inertia
        body.mass -= hung.mass
        joint = hung.add_joint(name=self.joint, axis=slide.axis, type=slide.type, **FREE)
        joint.damping[0] = spring.damping * load
        if play == 0.0:
            joint.stiffness[0] = spring.stiffness * load
            return
        contact = self.spec.add_tendon(name=self.joint, springlength=[-0.5 * play, 0.5 * play])
        contact.wrap_joint(self.joint, 1.0)
        contact.stiffness[0] = spring.stiffness * load

    def stand(self, share: float, frequency: float, ratio: float) -> None:
        """Put what the axis stands on, up to the world, on a spring and damper along the axis.

        share: the moved mass over all that the spring carries; frequency (Hz) and damping ratio
        are those with the axis held. Raises InputError where the axis' guide alone is heavier.
        """
        frame = self.spec.joint(self.axis).parent
        while frame.parent.name != self.spec.worldbody.name:
            frame = frame.parent
        direction, guide = self._seen_from(frame)
        weight = self.mass * (1.0 - share) / share - guide
        if weight <= 0.0:
            unit = self.units.mass
            raise InputError(
                f"axis {self.axis}: {self.joint} leaves {weight + guide:g} {unit} for what the "
                f"axis stands on, of which its guide has {guide:g} {unit}; give a smaller share"
            )
        spring = Spring.of(share, frequency, ratio, self.spec.option.timestep)
        others = list(frame.joints)
        kind = self.spec.joint(self.axis).type
        joint = frame.add_joint(name=self.joint, axis=direction, type=kind, **FREE)
        joint.stiffness[0] = spring.stiffness * self.mass / share
        joint.damping[0] = spring.damping * self.mass / share
        if self.rotary:
            frame.mass, frame.inertia, frame.explicitinertial = 1.0, [weight] * 3, True
            return
        # Where both directions are on springs, the heavier has the difference on its joint alone.
        least = min(weight, frame.mass) if others else weight
        joint.armature = weight - least
        for other in others:
            other.armature += frame.mass - least
        frame.mass = least

    def _seen_from(self, frame: mujoco.MjsBody) -> tuple[NDArray[np.float64], float]:
        """The axis' direction in the frame's coordinates, and the mass between the two, kg."""
        model = self.spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        slide, body = model.joint(self.axis), self.spec.joint(self.axis).parent
        if body.id == frame.id:
            raise InputError(
                f"axis {self.axis}: {self.joint} needs a body that the axis stands on, but its "
                "body stands in the world; put it into another body of the MuJoCo file"
            )
        direction = data.xmat[frame.id].reshape(3, 3).T @ data.xaxis[slide.id]
        carried = model.body_subtreemass[frame.id] - model.body_subtreemass[body.id]
        if self.rotary:
            if body.parent.id != frame.id:
                raise InputError(
                    f"axis {self.axis}: {self.joint} needs the axis to turn on the body that "
                    "stands in the world; take out the bodies between"
                )
            return direction, 0.0
        return direction, float(carried - model.body_mass[frame.id])
