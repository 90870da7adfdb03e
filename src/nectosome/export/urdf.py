"""A robot as a URDF file: links with mass and inertia, joints, shapes; rods as chains of links."""

from collections.abc import Iterator
from typing import NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from nectosome.description import RobotDescription
from nectosome.description.orientation import to_rpy
from nectosome.geometry import UNITS
from nectosome.mechanism import Robot

from .body_tree import BodyJoint, Solid, TreeBody, body_tree_of
from .rigid_bodies import about

_TYPES = {"hinge": "continuous", "slide": "prismatic", "ball": "floating", "free": "floating"}
_ENDLESS = 1e9  # of a limit that URDF wants and the robot has not


class UrdfText(NamedTuple):
    """The text of a URDF file, and words for each thing of the robot that is not in it."""

    text: str
    left_out: tuple[str, ...]


def urdf_of(robot: Robot, description: RobotDescription) -> UrdfText:
    """The URDF of a robot. Its meshes are named as in the robot file, relative to the file.

    Link frames are those of the parts, and joints are at 0 where theirs are. A robot whose first part is free in the
    world begins with that link; others hang on a link called world.
    """
    return _Writer(robot, description).written()


class _Writer:
    def __init__(self, robot: Robot, description: RobotDescription):
        found = body_tree_of(robot, description, apart=True)
        self.bodies, self.left_out, self.parts = found.bodies, [*found.left_out], description.parts
        self.root = ET.Element("robot", name=description.name)
        roots = [body for body in self.bodies if body.parent < 0]
        self.floats = len(roots) == 1 and [joint.kind for joint in roots[0].joints] == ["free"]

    def written(self) -> UrdfText:
        if not self.floats:
            ET.SubElement(self.root, "link", name="world")
        for body in self.bodies:
            self._link(body)
            if body.parent >= 0 or not self.floats:
                self._joint(body)
            else:
                self.left_out.append(f"{body.name}: where it is in the world at the start")
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
            for tag in ("visual", "collision"):
                self._shape(ET.SubElement(link, tag), solid)
            self.left_out += _unlike(body.name, solid)

    def _shape(self, element: ET.Element, solid: Solid) -> None:
        at = np.zeros(3) if solid.mesh else solid.position
        ET.SubElement(element, "origin", xyz=_row(at), rpy=_rpy(solid.rotation @ _turned(solid)))
        geometry = ET.SubElement(element, "geometry")
        a, b, c = (float(x) for x in solid.half)
        if solid.mesh:
            scale = np.full(3, UNITS[solid.mesh.unit]) * ([1, -1, 1] if solid.mesh.mirrored else 1)
            ET.SubElement(geometry, "mesh", filename=solid.mesh.mesh, scale=_row(scale))
        elif solid.kind == "box":
            ET.SubElement(geometry, "box", size=_row(2 * solid.half))
        elif solid.kind == "ellipsoid" and a == b == c:
            ET.SubElement(geometry, "sphere", radius=repr(a))
        elif solid.kind == "ellipsoid":
            ET.SubElement(geometry, "cylinder", radius=repr(b * (2 / 3) ** 0.5), length=repr(2 * a))
        else:
            ET.SubElement(geometry, "cylinder", radius=repr((a * b) ** 0.5), length=repr(2 * c))

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
        if own.damping and kind not in ("planar", "floating"):
            ET.SubElement(element, "dynamics", damping=repr(own.damping))
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


def _unlike(name: str, solid: Solid) -> Iterator[str]:
    """Words for a shape that is drawn as another one."""
    if solid.kind == "ellipsoid" and len({*map(float, solid.half)}) > 1:
        yield f"{name}: its shape, a spheroid: here it is a cylinder of the same length and volume"


def _turned(solid: Solid) -> np.ndarray:
    """What takes z, along which cylinders stand, to the x axis of a spheroid that is drawn as one."""
    if solid.kind == "ellipsoid" and len({*map(float, solid.half)}) > 1:
        return np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    return np.eye(3)


def _row(values: np.ndarray) -> str:
    return " ".join(repr(float(x)) for x in values)


def _rpy(rotation: np.ndarray) -> str:
    return _row(np.array(to_rpy(tuple(map(tuple, rotation.tolist())))))  # pyright: ignore[reportArgumentType]
