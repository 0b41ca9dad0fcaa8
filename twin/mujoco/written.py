"""What is written into the user's MuJoCo file, whose order and comments stay as they are."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from twin.errors import InputError
from twin.signals import Array

_TAG = re.compile(
    r"<!--.*?-->|<(?P<end>/?)(?P<kind>[\w:.-]+)(?:[^>\"']|\"[^\"]*\"|'[^']*')*>", re.DOTALL
)


def in_mjcf(text: str, name: str) -> str:
    """The text itself, or what a URDF text is in MJCF."""
    if "<mujoco" in re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL).lstrip()[:200]:
        return text
    from twin.mujoco.reading import read_bodies  # MuJoCo takes long to load

    spec = read_bodies(text, name)
    spec.compile()
    return str(spec.to_xml())


def inertial(mass: float, centre: Array, inertia: Array) -> str:
    """The element of a body of that mass kg, centre (3,) m and inertia (3, 3) kg m^2 about it."""
    full = [*inertia.diagonal(), *inertia[[0, 0, 1], [1, 2, 2]]]
    pos, fullinertia = (" ".join(f"{v:.6g}" for v in values) for values in (centre, full))
    return f'<inertial mass="{mass:.6g}" pos="{pos}" fullinertia="{fullinertia}"/>'


def with_joint(text: str, joint: str, attributes: Mapping[str, float], tag: str = "joint") -> str:
    """An MJCF text with these attributes of the joint of that name; tag: of what is no joint."""

    def changed(found: re.Match[str]) -> str:
        element = found[0]
        # An equality constraint of that name is a joint as well, by its tag.
        if (
            found["kind"] != tag
            or _attribute(element, "name") != joint
            or re.search(r"\sjoint1\s*=", element)
        ):
            return element
        return _with(element, {key: f"{value:.9g}" for key, value in attributes.items()})

    return _TAG.sub(changed, text)


def with_motor(text: str, joint: str, attributes: Mapping[str, str]) -> str:
    """An MJCF text with these attributes of the DC motor of that joint or tendon."""

    def changed(found: re.Match[str]) -> str:
        driven = (_attribute(found[0], key) for key in ("joint", "tendon"))
        own = found["kind"] == "dcmotor" and joint in driven
        return _with(found[0], attributes) if own else found[0]

    return _TAG.sub(changed, text)


def _with(tag: str, attributes: Mapping[str, str]) -> str:
    for key, value in attributes.items():
        own, pattern = f'{key}="{value}"', rf"\b{key}\s*=\s*(\"[^\"]*\"|'[^']*')"
        tag, count = re.subn(pattern, own, tag)
        if not count:
            tag = re.sub(r"\s*(/?>)$", rf" {own}\1", tag)
    return tag


def with_inertial(
    text: str, name: str, joints: Mapping[str, str], axis: str, element: str, wanted: Array
) -> str:
    """An MJCF text with this inertial element in the body that an axis moves.

    name: of the file, for messages. joints: of all axes. wanted (10,): the body's parameters, as
    ``Mechanism.inertial`` has them. Raises InputError where the file takes them from elsewhere.
    """
    from twin.mujoco.mechanism import mechanism_of

    at = list(joints).index(axis)
    joint = mechanism_of(text, name, joints).joints[at]
    place = _place_of(text, joint)
    made = text if place is None else text[: place[0]] + element + text[place[1] :]
    has = mechanism_of(made, name, joints).inertial(at)
    accuracy = 1e-4  # relative, to which the file holds what is written into it
    if not np.allclose(has, wanted, rtol=accuracy, atol=accuracy * np.abs(wanted).max()):
        raise InputError(
            f"{name}: the body of joint '{joint}' does not take its inertia from an "
            f"inertial element in it; write {element} where its inertia is made"
        )
    return made


@dataclass
class _Open:
    """A body that a text is within: where its content begins, its own inertial element, joints."""

    begin: int
    own: tuple[int, int] | None
    joints: list[str | None]


def _place_of(text: str, joint: str) -> tuple[int, int] | None:
    """Where the inertial element of the body of that joint is, or belongs; None without a body."""
    within = [_Open(0, None, [])]
    for found in _TAG.finditer(text):
        kind, closes = found["kind"], found["end"] or found[0].endswith("/>")
        if kind == "body" and not closes:
            within.append(_Open(found.end(), None, []))
        elif kind == "body" and found["end"]:
            body = within.pop()
            if joint in body.joints:
                return body.own or (body.begin, body.begin)
        elif kind == "joint" and not found["end"]:
            within[-1].joints.append(_attribute(found[0], "name"))
        elif kind == "inertial":
            begin = within[-1].own[0] if found["end"] and within[-1].own else found.start()
            within[-1].own = (begin, found.end())
    return None


def _attribute(tag: str, name: str) -> str | None:
    found = re.search(rf"\s{name}\s*=\s*[\"']([^\"']*)[\"']", tag)
    return found[1] if found else None
