"""A robot as a URDF file: links with mass and inertia, joints, shapes; rods as chains of links."""

from collections.abc import Iterator
from typing import NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from nectosome.description import RobotDescription
from nectosome.description.orientation import to_rpy
from nectosome.geometry import UNITS
from nectosome.mechanism import Robot
from nectosome.mechanism.shapes import STANDING, Solid

from .body_tree import BodyJoint, TreeBody, body_tree_of
from .rigid_bodies import about

_TYPES = {"hinge": "continuous", "slide": "prismatic", "ball": "floating", "free": "floating"}
_ENDLESS = 1e9  # of a limit that URDF wants and the robot has not


class UrdfText(NamedTuple):
    """The text of a URDF file, and words for each thing of the robot that is not in it."""

    text: str
    left_out: tuple[str, ...]


def urdf_of(robot: Robot, description: RobotDescription) -> UrdfText:
    """The URDF of a robot. Its meshes are named as in the robot file, relative to the file.

    Link frames are those of the parts, and joints are at 0 where theirs are. All hangs on a link called world: what is
    free there by a floating joint.
    """
    return _UrdfWriter(robot, description).written()


class _UrdfWriter:
    def __init__(self, robot: Robot, description: RobotDescription):
        bodies = body_tree_of(robot, description, apart=True)
        self.bodies, self.left_out, self.parts = bodies.bodies, [*bodies.left_out], description.parts
        self.root = ET.Element("robot", name=description.name)

    def written(self) -> UrdfText:
        ET.SubElement(self.root, "link", name="world")
        for body in self.bodies:
            self._link(body)
            self._joint(body)
        ET.indent(self.root)
        loads = [f"{name}: load {key}" for name, part in self.parts.items() for key in part.loads]
        general = "water, and what it does to the robot", "how joints start", *loads
        text = f'<?xml version="1.0"?>\n{ET.tostring(self.root, encoding="unicode")}\n'
        return UrdfText(text, (*general, *self.left_out))

    def _link(self, body: TreeBody) -> None:
        link, numbers = ET.SubElement(self.root, "link", name=body.name), body.numbers
        if numbers.mass:
            inertial = ET.SubElement(link, "inertial")
            ET.SubElement(inertial, "origin", xyz=_row(numbers.centre_of_mass), rpy="0 0 0")
            ET.SubElement(inertial, "mass", value=repr(numbers.mass))
            own = about(body.inertia, numbers.centre_of_mass)[:3, :3]
            six = {f"i{'xyz'[i]}{'xyz'[j]}": repr(float(own[i, j])) for i in range(3) for j in range(i, 3)}
            ET.SubElement(inertial, "inertia", six)
        for solid in body.solids:
            for place, rotation, kind, sizes in _shapes(solid):
                for tag in ("visual", "collision"):
                    element = ET.SubElement(link, tag)
                    ET.SubElement(element, "origin", xyz=_row(place), rpy=_rpy(rotation))
                    ET.SubElement(ET.SubElement(element, "geometry"), kind, sizes)
            if solid.kind == "ellipsoid" and len({*map(float, solid.half)}) > 1:
                words = "its shape, a spheroid: here it is a cylinder of the same length and volume"
                self.left_out.append(f"{body.name}: {words}")

    def _joint(self, body: TreeBody) -> None:
        parent = "world" if body.parent < 0 else self.bodies[body.parent].name
        joints = {joint.kind for joint in body.joints}
        planar = joints == {"slide", "hinge"}
        kind = "planar" if planar else next((_TYPES[kind] for kind in joints), "fixed")
        own = body.joints[-1] if body.joints else None
        stops = (None, None) if own is None else own.stops
        if kind == "continuous" and None not in stops:
            kind = "revolute"
        element = ET.SubElement(self.root, "joint", name=f"{body.name}_joint", type=kind)
        ET.SubElement(element, "origin", xyz=_row(body.position), rpy=_rpy(body.rotation))
        ET.SubElement(element, "parent", link=parent)
        ET.SubElement(element, "child", link=body.name)
        if own is None:
            return
        if kind in ("continuous", "revolute", "prismatic", "planar"):
            ET.SubElement(element, "axis", xyz=_row(own.axis))
        losses = {name: repr(value) for name, value in (("damping", own.damping), ("friction", own.friction)) if value}
        if losses and kind not in ("planar", "floating"):
            ET.SubElement(element, "dynamics", losses)
        if kind in ("revolute", "prismatic"):
            ends = (end if other is None else other for end, other in zip((-_ENDLESS, _ENDLESS), stops, strict=True))
            lower, upper = map(repr, map(float, ends))
            ET.SubElement(element, "limit", lower=lower, upper=upper, effort=repr(_ENDLESS), velocity=repr(_ENDLESS))
        self.left_out += [f"{joint.name}: {words}" for joint in body.joints for words in _unsaid(joint)]


def _unsaid(joint: BodyJoint) -> Iterator[str]:
    if joint.stiffness:
        yield f"spring of {joint.stiffness:.4g} {'N/m' if joint.kind == 'slide' else 'N m/rad'}"
    if joint.kind == "ball":
        yield "that it only turns: URDF knows no such joint, here it is floating"
    if joint.drive:
        yield f"{joint.drive} that drives it"
    if joint.kind == "hinge" and (joint.stops[0] is None) != (joint.stops[1] is None):
        yield "its only stop: URDF wants two or none"
    elif joint.stops != (None, None):
        yield "how soft its stops are"


def _shapes(solid: Solid) -> Iterator[tuple[np.ndarray, np.ndarray, str, dict[str, str]]]:
    """Shapes that URDF knows: place, rotation, element and its sizes; a capsule is a cylinder and two spheres."""
    (a, b, c), place, rotation = map(float, solid.half), solid.position, solid.rotation
    if solid.mesh:
        scale = np.full(3, UNITS[solid.mesh.unit]) * ([1, -1, 1] if solid.mesh.mirrored else 1)
        yield np.zeros(3), rotation, "mesh", {"filename": solid.mesh.mesh, "scale": _row(scale)}
    elif solid.kind == "box":
        yield place, rotation, "box", {"size": _row(2 * solid.half)}
    elif solid.kind == "ellipsoid" and a == b == c:
        yield place, rotation, "sphere", {"radius": repr(a)}
    elif solid.kind == "ellipsoid":
        yield place, rotation @ STANDING, "cylinder", {"radius": repr(b * (2 / 3) ** 0.5), "length": repr(2 * a)}
    else:
        straight = c - a if solid.kind == "capsule" else c
        yield place, rotation, "cylinder", {"radius": repr((a * b) ** 0.5), "length": repr(2 * straight)}
        for end in (-straight, straight) if solid.kind == "capsule" else ():
            yield place + end * rotation[:, 2], rotation, "sphere", {"radius": repr(a)}


def _row(values: np.ndarray) -> str:
    return " ".join(repr(float(x)) for x in values)


def _rpy(rotation: np.ndarray) -> str:
    return _row(np.array(to_rpy(tuple(map(tuple, rotation.tolist())))))  # pyright: ignore[reportArgumentType]
