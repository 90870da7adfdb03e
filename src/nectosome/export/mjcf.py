"""A robot as a model of MuJoCo: bodies, joints, springs, actuators, water, and buoyancy where it acts.

MuJoCo lifts a body at its centre of mass only. So what a body displaces hangs on it as a small body of its own at the
centre of buoyancy, with a millionth of the mass, which the body lacks, and all of the lift (`gravcomp`).

MuJoCo's water has no inertia. Added mass across a rod hangs on its pieces as bodies without weight, so that all that
bends is coupled; as a mass has no direction, it resists motion along the rod too. Other added mass along coordinates
of hinges and slides, on what they move together, stands as `armature`, without what couples them; that of a rigid body
that is free in the world or in a plane has no place.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple
from xml.etree import ElementTree as ET

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core.programs.remember import remembered
from nectosome.description import RobotDescription, Rod
from nectosome.mechanism import Robot
from nectosome.mechanism.shapes import Solid
from nectosome.units import InputError

from .body_tree import BodyJoint, BodyTree, TreeBody, body_tree_of
from .rigid_bodies import about, summed

STEP = 1e-3  # s
# loads by which water resists or lifts what moves in it; added mass is fitted too
FITTED = {"drag", "lumped_drag", "plate_drag", "stokes_drag", "skin_friction", "foil", "trailing_edge", "near_floor"}
# loads that drive the robot
_DRIVING = {"chamber", "muscle", "tendon", "jet", "pulsed_thrust", "leg", "thruster", "force", "distributed_force"}
_QUICK = 200.0  # rad/s, of the actuators that follow motions
_LIFTED = 1e-6  # share of the mass that has the lift
_TINY = 1e-9  # m2, inertia over mass of what has no size
_SPECK = 1e-6  # m
_FAR = 1e3  # rad or m, where no stop is
_DRAWN_GROUP, _WATER_GROUP = "2", "3"  # of geoms that are drawn and of those that only the water sees
_UNTOUCHED = {"contype": "0", "conaffinity": "0", "mass": "0"}
_WATER = {"fluidshape": "ellipsoid", "fluidcoef": "0 0 0 0 0"}


class MuJoCoModel(NamedTuple):
    """A model, with MuJoCo's own order of bodies, and words for each thing of the robot that is not in it."""

    root: ET.Element
    bodies: tuple[TreeBody, ...]
    armature: dict[str, float]  # added mass along the coordinates of joints [kg m2, kg]
    added: tuple[str, ...]  # bodies that stand for added mass of rods
    geoms: tuple[str, ...]  # those that the water acts on
    fitted: frozenset[tuple[str, str]]  # parts and names of the loads that MuJoCo's water stands for
    left_out: tuple[str, ...]
    drives_left_out: tuple[str, ...]  # those of them that drive the robot

    @property
    def carrying(self) -> tuple[BodyJoint, ...]:
        """Joints by which the first body moves along, and which no motion prescribes."""
        joints = self.bodies[0].joints
        return tuple(joint for joint in joints if joint.kind in ("free", "slide") and joint.drive != "motion")

    @property
    def text(self) -> str:
        """The file."""
        ET.indent(self.root)
        return ET.tostring(self.root, encoding="unicode") + "\n"

    def set_coefficients(self, of_each: Mapping[str, Sequence[float]]) -> None:
        """Write the five coefficients of the water on geoms, by their names."""
        for geom in self.root.iter("geom"):
            if geom.get("name") in of_each:
                geom.set("fluidcoef", " ".join(f"{x:.6g}" for x in of_each[geom.get("name", "")]))


def mjcf_of(robot: Robot, description: RobotDescription) -> MuJoCoModel:
    """The model of a robot; the water's coefficients are 0 until they are set.

    Joints are called as coordinates in results, `tail.bending_z.3` the third hinge of a rod; actuators as their joints:
    those that follow motions take the coordinate as control, others the torque or the force. Raises InputError where a
    part is free against another one, which MuJoCo does not take.
    """
    return _MjcfWriter(robot, description).model()


def coordinates(
    bodies: Sequence[TreeBody], q: Float[np.ndarray, "nq"], v: Float[np.ndarray, "nv"]
) -> tuple[np.ndarray, np.ndarray]:
    """MuJoCo's `qpos` and `qvel` of bodies in its order, from all coordinates and velocities of the robot."""
    positions, rates = [], []
    for body in bodies:
        for joint in body.joints:
            if joint.kind == "free":
                own, w, u = q[joint.q], v[joint.v[:3]], v[joint.v[3:]]
                turn = body.rotation @ _rotation(own[3:])
                positions.append([*(body.position + body.rotation @ own[:3]), *_quaternion(turn)])
                rates.append([*(turn @ u), *w])
            elif joint.kind == "ball":
                positions.append(q[joint.q] / np.linalg.norm(q[joint.q]))
                rates.append(v[joint.v])
            else:
                positions.append([joint.share @ q[joint.q]])
                rates.append([joint.share @ v[joint.v]])
        if [joint.kind for joint in body.joints] == ["slide", "slide", "hinge"]:  # whose velocities turn with it
            angle = positions[-1][0]
            (a,), (b,) = rates[-3:-1]
            rates[-3:-1] = [a * np.cos(angle) - b * np.sin(angle)], [a * np.sin(angle) + b * np.cos(angle)]
    return np.concatenate([*positions, []]), np.concatenate([*rates, []])


def accelerations(
    bodies: Sequence[TreeBody], q: Float[np.ndarray, "nq"], v: Float[np.ndarray, "nv"], a: Float[np.ndarray, "nv"]
) -> np.ndarray:
    """MuJoCo's `qacc`, likewise: linear ones along the axes of what a body moves in, ours along axes that turn."""
    a = a.copy()
    for body in bodies:
        joints = body.joints
        if [joint.kind for joint in joints] == ["free"]:
            w, u = np.split(v[joints[0].v], 2)
            a[joints[0].v[3:]] += np.cross(w, u)
        elif [joint.kind for joint in joints] == ["slide", "slide", "hinge"]:
            x, y, turn = (joint.v for joint in joints)
            a[x] -= v[turn] * v[y]
            a[y] += v[turn] * v[x]
    return coordinates(bodies, q, a)[1]


def actuated(bodies: Sequence[TreeBody]) -> Iterator[BodyJoint]:
    """The joints with actuators, in their order."""
    for body in bodies:
        for joint in body.joints:
            if joint.drive and joint.kind in ("hinge", "slide"):
                yield joint


class _MjcfWriter:
    def __init__(self, robot: Robot, description: RobotDescription):
        self.water, self.tree = description.water, body_tree_of(robot, description)
        self.bodies = _in_order(self.tree)
        self.left_out, self.fitted = [*self.tree.left_out], set[tuple[str, str]]()
        self.drives = [f"tendon {name}" for name, tendon in description.tendons.items() if tendon.pulled_by is not None]
        for name, part in description.parts.items():
            for key, load in part.loads.items():
                if load.kind in FITTED:
                    self.fitted.add((name, key))
                elif not load.kind.endswith("added_mass"):
                    self.left_out.append(words := f"{name}: load {key}, {load.kind.replace('_', ' ')}")
                    if load.kind in _DRIVING:
                        self.drives.append(words)
        self.root = ET.Element("mujoco", model=description.name)
        self.armature, self.geoms = dict[str, float](), list[str]()
        self.wet = {
            i
            for i, part in enumerate(description.parts.values())
            if any(load.kind in FITTED or load.kind.endswith("added_mass") for load in part.loads.values())
        }
        self.start = remembered(_start, robot)
        rods = [i for i, part in enumerate(description.parts.values()) if isinstance(part, Rod)]
        self.across, self.added = {i: _across(self.tree, i) for i in rods}, list[str]()
        bodies = self.tree.bodies
        self.moved = _composite(self.tree, [body.inertia + body.added * (body.part in rods) for body in bodies])
        self.carried = _composite(self.tree, [body.added * (body.part not in rods) for body in bodies])

    def model(self) -> MuJoCoModel:
        water = self.water
        _child(self.root, "compiler", angle="radian", autolimits="true")
        flow = {} if water.current is None else {"wind": _row(np.array(water.current))}
        _child(
            self.root,
            "option",
            timestep=repr(STEP),
            integrator="implicitfast",
            gravity=f"0 0 {-water.gravity!r}",
            density=repr(water.density),
            viscosity=repr(water.viscosity),
            **flow,
        )
        if any(_moments(body.added)[0].any() for body in self.bodies if body.part in self.across):
            self.left_out.append("rods: direction of their added mass, which resists motion along them too")
        for name in ("surface", "floor", "walls"):
            if getattr(water, name) is not None:
                self.left_out.append(f"water: {name}")
        self.left_out += [f"water: {name}, {flow.kind}" for name, flow in water.flows.items()]
        self.assets = _child(self.root, "asset")
        elements = {-1: _child(self.root, "worldbody")}
        places = {id(body): k for k, body in enumerate(self.tree.bodies)}
        for body in self.bodies:
            k = places[id(body)]
            elements[k] = self._body(elements[body.parent], body, self.carried[k])
        actuators = _child(self.root, "actuator")
        for body in self.bodies:
            for joint in body.joints:
                if joint.drive:
                    self._actuator(actuators, joint, _along(joint, self.moved[places[id(body)]]))
        qpos, qvel = coordinates(self.bodies, *map(np.asarray, self.start))
        frames = _child(self.root, "keyframe")
        _child(frames, "key", name="start", qpos=_row(qpos), qvel=_row(qvel))
        return MuJoCoModel(
            self.root,
            self.bodies,
            self.armature,
            tuple(self.added),
            tuple(self.geoms),
            frozenset(self.fitted),
            tuple(self.left_out),
            tuple(self.drives),
        )

    def _body(self, parent: ET.Element, body: TreeBody, carried: np.ndarray) -> ET.Element:
        place = {"pos": _row(body.position), "quat": _row(_quaternion(body.rotation))}
        element, numbers = _child(parent, "body", name=body.name, **place), body.numbers
        for joint in body.joints:
            self._joint(element, body, joint, carried)
        lift = body.volume > 0 and self.water.gravity > 0
        mass = numbers.mass
        if mass > 0 or body.joints:
            own = about(body.inertia, numbers.centre_of_mass)[:3, :3]
            if np.linalg.eigvalsh(own)[0] <= 0:  # a point: MuJoCo wants a size, here one of 50 micrometres
                own = own + mass * _TINY * np.eye(3)
            six = [own[0, 0], own[1, 1], own[2, 2], own[0, 1], own[0, 2], own[1, 2]]
            left = mass * (1 - _LIFTED) if lift else mass
            place = _row(numbers.centre_of_mass)
            _child(element, "inertial", pos=place, mass=repr(left), fullinertia=_row(np.array(six)))
        wet = body.part in self.wet
        for k, solid in enumerate(body.solids):
            self._geom(element, f"{body.name}.{k}", solid, wet)
        if not wet or not body.solids:
            ball = body.volume or mass / self.water.density
            if wet:
                self.geoms.append(f"{body.name}.ball")
            self._speck(element, f"{body.name}.ball", (0.75 / np.pi * ball) ** (1 / 3) if wet else 0.0)
        if lift:
            small = (mass or self.water.density * body.volume) * _LIFTED
            share = repr(self.water.density * body.volume / small)
            lifted = _child(element, "body", name=f"{body.name}.buoyancy", gravcomp=share)
            at = _row(numbers.centre_of_buoyancy)
            _child(lifted, "inertial", pos=at, mass=repr(small), diaginertia=_row(np.full(3, _TINY * small)))
            self._speck(lifted, f"{body.name}.buoyancy.ball")
        if body.part in self.across:
            self._added(element, body, self.across[body.part])
        return element

    def _added(self, element: ET.Element, body: TreeBody, across: np.ndarray) -> None:
        """Added mass of a piece of a rod, as a body: its mass, and moments of it, are those across the rod."""
        mass, first, second = (float(across @ moment) for moment in _moments(body.added))
        if mass <= 0:
            return
        self.added.append(name := f"{body.name}.added")
        own = _child(element, "body", name=name, gravcomp="1")
        about_centre = max(second - first**2 / mass, _TINY * mass)
        turns = np.array([_TINY * mass, about_centre, about_centre])
        at = np.array([first / mass, 0.0, 0.0])
        _child(own, "inertial", pos=_row(at), mass=repr(mass), diaginertia=_row(turns))
        self._speck(own, f"{name}.ball")

    def _joint(self, element: ET.Element, body: TreeBody, joint: BodyJoint, carried: np.ndarray) -> None:
        if joint.kind == "free":
            if body.parent >= 0:
                why = "is free against the part that it sits on, which MuJoCo does not take. Let it sit on the world."
                raise InputError(why, field=body.name)
            _child(element, "freejoint", name=joint.name)
            return
        numbers = {"damping": joint.damping, "stiffness": joint.stiffness, "springref": joint.rest}
        numbers["frictionloss"] = joint.friction
        if joint.drive == "motion":
            numbers = {}  # whatever it needs, the motion is made
        if _keeps_its_axis(body, joint):
            numbers["armature"] = self.armature[joint.name] = _along(joint, carried)
        options = {key: repr(float(value)) for key, value in numbers.items() if value}
        axis = {} if joint.kind == "ball" else {"axis": _row(joint.axis)}
        if joint.stops != (None, None):
            ends = (far if stop is None else stop for far, stop in zip((-_FAR, _FAR), joint.stops, strict=True))
            options["range"] = _row(np.array([*ends]))
            self.left_out.append(f"{joint.name}: how soft its stops are")
        _child(element, "joint", name=joint.name, type=joint.kind, **axis, **options)

    def _actuator(self, actuators: ET.Element, joint: BodyJoint, inertia: float) -> None:
        if joint.kind not in ("hinge", "slide"):
            self.left_out.append(words := f"{joint.name}: {joint.drive} that drives it")
            self.drives.append(words)
            return
        if joint.drive == "force":
            _child(actuators, "motor", name=joint.name, joint=joint.name)
            return
        inertia += self.armature.get(joint.name, 0.0)
        gains = {"kp": repr(inertia * _QUICK**2), "kv": repr(2 * inertia * _QUICK)}
        _child(actuators, "position", name=joint.name, joint=joint.name, **gains)

    def _speck(self, element: ET.Element, name: str, radius: float = 0.0) -> None:
        """A ball of water for a point, and a speck for what the water does not act on, or MuJoCo would choose a box."""
        size = repr(radius or _SPECK)
        _child(element, "geom", name=name, type="sphere", size=size, group=_WATER_GROUP, **_UNTOUCHED, **_WATER)

    def _geom(self, element: ET.Element, name: str, solid: Solid, wet: bool) -> None:
        """A shape, which the water sees as an ellipsoid of its size; a mesh is drawn beside that."""
        place = {"pos": _row(solid.position), "quat": _row(_quaternion(solid.rotation))}
        kind, size, group = solid.kind, solid.half, _DRAWN_GROUP
        if solid.mesh is not None:
            surface = solid.mesh.drawn
            drawn = {"vertex": _row(surface.vertices.ravel()), "face": " ".join(map(str, surface.faces.ravel()))}
            _child(self.assets, "mesh", name=name, **drawn)
            _child(element, "geom", type="mesh", mesh=name, group=group, **_UNTOUCHED)
            kind, group = "ellipsoid", _WATER_GROUP
        if kind in ("cylinder", "capsule"):
            radius = (size[0] * size[1]) ** 0.5
            size = np.array([radius, size[2] - (radius if kind == "capsule" else 0.0)])
        if wet:
            self.geoms.append(name)
        if wet or group == _DRAWN_GROUP:
            water = _WATER if wet else {}
            own = {"name": name, "type": kind, "size": _row(size), "group": group}
            _child(element, "geom", **own, **place, **_UNTOUCHED, **water)


def _keeps_its_axis(body: TreeBody, joint: BodyJoint) -> bool:
    """Whether the water that a joint moves is the same whatever the joints before it do, but for their coupling."""
    planar = [one.kind for one in body.joints] == ["slide", "slide", "hinge"]
    return joint.kind in ("hinge", "slide") and not planar


def _along(joint: BodyJoint, inertia: np.ndarray) -> float:
    """Inertia along the coordinate of a hinge or a slide."""
    axis = np.concatenate([joint.axis, np.zeros(3)] if joint.kind == "hinge" else [np.zeros(3), joint.axis])
    return float(axis @ inertia @ axis)


def _start(robot: Robot) -> tuple[Array, Array]:
    x = robot.initial()
    q, v, _ = robot.tree.complete(jnp.zeros(()), x.q, x.v)
    return q, v


def _in_order(tree: BodyTree) -> tuple[TreeBody, ...]:
    """Bodies in the order of MuJoCo: each one, then all that hangs on it."""
    children = dict[int, list[int]]()
    for k, body in enumerate(tree.bodies):
        children.setdefault(body.parent, []).append(k)
    ahead, order = children[-1][::-1], []
    while ahead:
        order.append(tree.bodies[k := ahead.pop()])
        ahead += children.get(k, [])[::-1]
    return tuple(order)


def _across(tree: BodyTree, rod: int) -> np.ndarray:
    """How much of what moves across a rod as it bends does so along y and along z."""
    hinges = [joint.axis for body in [body for body in tree.bodies if body.part == rod][1:] for joint in body.joints]
    _, about_y, about_z = np.sum(hinges, axis=0) if hinges else np.zeros(3)
    bends = about_y + about_z
    return np.array([about_z, about_y]) / bends if bends else np.full(2, 0.5)


def _moments(added: np.ndarray) -> np.ndarray:
    """Added mass of a piece along y and along z, and its first and second moments along x [kg, kg m, kg m2]."""
    return np.array([[added[4, 4], added[5, 5]], [added[2, 4], -added[1, 5]], [added[2, 2], added[1, 1]]])


def _composite(tree: BodyTree, inertia: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Inertia, or added mass, of each body and all that hangs on it, about its origin, while all joints are at 0."""
    total = [own.copy() for own in inertia]
    for k, body in reversed([*enumerate(tree.bodies)]):
        if body.parent >= 0:
            total[body.parent] += summed(total[k][None], body.rotation[None], body.position[None])
    return total


def _child(parent: ET.Element, tag: str, **attributes: str) -> ET.Element:
    return ET.SubElement(parent, tag, attributes)


def _row(values: np.ndarray) -> str:
    return " ".join(repr(float(x)) for x in values)


def _rotation(quaternion: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(np.roll(quaternion, -1)).as_matrix()


def _quaternion(rotation: np.ndarray) -> np.ndarray:
    """Scalar first."""
    from scipy.spatial.transform import Rotation

    return np.roll(Rotation.from_matrix(rotation).as_quat(), 1)
