r"""A robot as a tree of rigid bodies on hinges and slides, as other programs have it: soft rods as chains.

A rod of length L is cut into n cells. In the middle of each it has a hinge about each of the axes of its torsion and
bending, with the stiffness of the rod there over the length of a cell, n E J/L, and the angle of its curvature over
that length. Extension and shear are held.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from nectosome.description import (
    STRAIN_NAMES,
    FreeJoint,
    PlanarJoint,
    PrismaticJoint,
    RevoluteJoint,
    Rigid,
    RobotDescription,
    Rod,
    SoftPlate,
)
from nectosome.description.joints import SphericalJoint
from nectosome.description.parts import Limb
from nectosome.mechanism import Link, RitzPlate, Robot, SoftRod
from nectosome.mechanism.joints import plane_frame
from nectosome.mechanism.parts import TreePart
from nectosome.mechanism.rod_matter import matter_at
from nectosome.mechanism.rods import legendre, strain_rows
from nectosome.mechanism.shapes import STANDING, Solid, shape_of
from nectosome.units import InputError

from .rigid_bodies import RigidBody, rigid_bodies, summed

CELLS = 10  # of a rod
_HINGED = ("torsion", "bending_y", "bending_z")  # strains, about x, y and z
Pose = tuple[np.ndarray, np.ndarray]


class BodyJoint(NamedTuple):
    """A joint of a body against the one before it, at the origin of the body's frame."""

    name: str
    kind: str  # hinge, slide, ball or free
    axis: Float[np.ndarray, "3"]
    q: Int[np.ndarray, "k"]  # coordinates of the robot that it has; of a hinge in a rod its coordinate is their sum ...
    v: Int[np.ndarray, "k"]  # velocities of the robot, likewise
    share: Float[np.ndarray, "k"]  # ... times these
    stiffness: float = 0.0  # [N m/rad, N/m]
    damping: float = 0.0
    rest: float = 0.0  # [rad, m]
    friction: float = 0.0  # dry [N m, N]
    stops: tuple[float | None, float | None] = (None, None)  # smallest and largest coordinate
    drive: str = ""  # motion or force, of what drives it


class TreeBody(NamedTuple):
    """A rigid body, in its own frame, and where that sits on the body before it while all joints are at 0."""

    name: str
    part: int  # of the robot
    parent: int  # body; -1: the world
    rotation: Float[np.ndarray, "3 3"]
    position: Float[np.ndarray, "3"]
    joints: tuple[BodyJoint, ...]
    inertia: Float[np.ndarray, "6 6"]  # about its origin
    added: Float[np.ndarray, "6 6"]  # added mass, all of it under water
    volume: float
    moment: Float[np.ndarray, "3"]  # first moment of the displaced volume [m4]
    solids: tuple[Solid, ...]
    stations: Int[np.ndarray, "k"]  # of the robot that it carries
    station_rotation: Float[np.ndarray, "k 3 3"]
    station_position: Float[np.ndarray, "k 3"]

    @property
    def numbers(self) -> RigidBody:
        """The same numbers as those of a part."""
        return RigidBody(self.name, np.eye(3), np.zeros(3), self.inertia, self.added, self.volume, self.moment)


class BodyTree(NamedTuple):
    """Bodies, parents first, and words for each thing of the robot that is not in them."""

    bodies: tuple[TreeBody, ...]
    left_out: tuple[str, ...]


def body_tree_of(robot: Robot, description: RobotDescription, *, apart: bool = False) -> BodyTree:
    """The robot as a tree of bodies; with `apart` no body has two hinges: those of a rod take turns along it."""
    return _Bodies(robot, description, apart).tree()


class _Bodies:
    def __init__(self, robot: Robot, description: RobotDescription, apart: bool):
        self.robot, self.description, self.apart = robot, description, apart
        self.bodies: list[TreeBody] = []
        self.segments: list[list[int]] = []  # bodies of each part
        self.places: list[np.ndarray] = []  # fractions of a rod's length where its bodies begin; of a link [0]
        self.left_out: list[str] = []
        self.taken = set(robot.tree.names)
        self.added = np.asarray(robot.added)

    def tree(self) -> BodyTree:
        weighed = rigid_bodies(self.robot)
        for i, (part, own) in enumerate(zip(self.robot.tree.parts, weighed, strict=True)):
            if part.between:
                self.left_out.append(f"web {part.name}: its mass, its tension and all that the water does to it")
                continue
            limb = self.description.parts[part.name]
            first, here = len(self.bodies), self._mount(part)
            self.left_out += _unsaid(part.name, limb)
            if isinstance(limb, Rod) and isinstance(part.body, SoftRod):
                self._rod(i, part, limb, part.body, here)
            elif isinstance(limb, SoftPlate):
                self._plate(i, part, limb, own, here)
            else:
                assert isinstance(limb, Rigid)
                self._link(i, part, limb, own, here)
            self.segments.append([*range(first, len(self.bodies))])
        pairs = [f"pair {name}: {pair.kind}" for name, pair in self.description.pairs.items()]
        tendons = [f"tendon {name}" for name in self.description.tendons]
        return BodyTree(tuple(self.bodies), (*self.left_out, *pairs, *tendons))

    def _mount(self, part: TreePart) -> tuple[int, Pose]:
        """The body that a part sits on, and the pose of its joint there."""
        own = np.asarray(part.rotation), np.asarray(part.position)
        if part.parent < 0:
            return -1, own
        parent = self.robot.tree.parts[part.parent].body
        if isinstance(parent, SoftRod):
            s = 1.0 if part.node == -1 else parent.nodes[part.node]
            places = self.places[part.parent]
            k = int(np.searchsorted(places, s, side="right")) - 1
            along = np.array([(s - places[k]) * float(parent.length), 0.0, 0.0])
            return self.segments[part.parent][k], _after((np.eye(3), along), own)
        if isinstance(parent, RitzPlate):
            end = np.append(np.asarray(parent.place[-1]), 0.0) if part.node == -1 else np.zeros(3)
            return self.segments[part.parent][-1], _after((np.eye(3), end), own)
        assert isinstance(parent, Link)  # nothing sits on a web
        tip = np.asarray(parent.tip_rotation), np.asarray(parent.tip_position)
        return self.segments[part.parent][-1], _after(tip if part.node == -1 else (np.eye(3), np.zeros(3)), own)

    def _link(self, i: int, part: TreePart, limb: Rigid, own: RigidBody, here: tuple[int, Pose]) -> None:
        body, place = part.body, self.robot.tree.layout[i]
        assert isinstance(body, Link)
        self.places.append(np.zeros(1))
        stations = np.arange(place.stations.start, place.stations.stop)
        poses = np.asarray(body.rotation), np.asarray(body.position)
        numbers, solids = (own.inertia, own.volume, own.moment), shape_of(limb).solids()
        self.left_out += [f"{part.name}: {solid.unlike}" for solid in solids if solid.unlike]
        self._add(part.name, i, here, self._joints(part, limb, i), numbers, solids, (stations, *poses))

    def _plate(self, i: int, part: TreePart, limb: SoftPlate, own: RigidBody, here: tuple[int, Pose]) -> None:
        """A stiff box of its mean sizes, with the mass of the plate."""
        body, place = part.body, self.robot.tree.layout[i].stations
        assert isinstance(body, RitzPlate)
        self.places.append(np.zeros(1))
        flat = np.column_stack([np.asarray(body.place), np.zeros(len(body.place))])
        poses = np.tile(np.eye(3), (len(flat) + 1, 1, 1)), np.concatenate([np.zeros((1, 3)), flat])
        half, middle = 0.5 * np.array(limb.mean_sizes), own.centre_of_mass
        solids = (Solid("box", half, np.eye(3), middle),)
        self.left_out.append(f"{part.name}: its bending and its outline; here it is a stiff box of its mean sizes")
        numbers = own.inertia, own.volume, own.moment
        self._add(
            part.name,
            i,
            here,
            self._joints(part, limb, i),
            numbers,
            solids,
            (np.arange(place.start, place.stop), *poses),
        )

    def _rod(self, i: int, part: TreePart, limb: Rod, rod: SoftRod, here: tuple[int, Pose]) -> None:
        names = [name for name in _HINGED if strain_rows(rod, name)]
        held = {name.partition(".")[0] for name in rod.names} - {*_HINGED}
        if held:
            self.left_out.append(f"{part.name}: {', '.join(sorted(held))}, which is held")
        length, n = float(rod.length), CELLS
        m = n * len(names) if self.apart else n
        at = (np.arange(m) + 0.5) / m  # of the hinges
        ends = np.concatenate([[0.0], at, [1.0]])
        self.places.append(ends[:-1])
        layout = self.robot.tree.layout[i]
        stations = np.arange(layout.stations.start, layout.stations.stop)
        nodes = np.asarray(rod.nodes)
        owner = np.clip(np.searchsorted(ends, nodes, side="right") - 1, 0, m)
        joints, parent, pose = self._joints(part, limb, i), *here
        for k in range(m + 1):
            if k:
                hinged = [_in_turn(names, k - 1)] if self.apart else names
                joints = tuple(self._hinge(part.name, limb, rod, i, name, at[k - 1], k, n) for name in hinged)
                along = np.array([(ends[k] - ends[k - 1]) * length, 0.0, 0.0])
                parent, pose = len(self.bodies) - 1, (_rest(limb, hinged, at[k - 1], length / n), along)
            mine = owner == k
            places = np.outer((nodes[mine] - ends[k]) * length, [1.0, 0.0, 0.0])
            carried = stations[mine], np.tile(np.eye(3), (mine.sum(), 1, 1)), places
            numbers, solid = _segment(limb, ends[k], ends[k + 1])
            name = self._free_name(f"{part.name}_{k}") if k else part.name
            self._add(name, i, (parent, pose), joints, numbers, (solid,), carried)

    def _add(self, name, part, here, joints, numbers, solids, carried) -> None:
        (parent, (R, p)), (inertia, volume, moment) = here, numbers
        added = summed(self.added[carried[0]], *carried[1:])
        self.bodies.append(TreeBody(name, part, parent, R, p, joints, inertia, added, volume, moment, solids, *carried))

    def _free_name(self, name: str) -> str:
        while name in self.taken:
            name += "_"
        self.taken.add(name)
        return name

    def _joints(self, part: TreePart, limb: Limb, i: int) -> tuple[BodyJoint, ...]:
        joint, place = limb.joint, self.robot.tree.layout[i]
        q, v = place.q.start, place.v.start
        own = f"{part.name}.{joint.coordinate}" if joint.coordinate else part.name
        driven = joint.powered is not None or getattr(joint, "motion", None) is not None
        drive = "motion" if driven else "force" if getattr(joint, joint.drive_field, None) is not None else ""
        one, none = np.ones(1), np.zeros(0)
        if isinstance(joint, FreeJoint | SphericalJoint):
            kind, nq, nv = ("free", 7, 6) if isinstance(joint, FreeJoint) else ("ball", 4, 3)
            rows = q + np.arange(nq), v + np.arange(nv)
            springs = float(getattr(joint, "stiffness", 0.0)), float(getattr(joint, "damping", 0.0))
            return (BodyJoint(f"{part.name}.{kind}", kind, np.zeros(3), *rows, none, *springs, drive=drive),)
        if isinstance(joint, PlanarJoint):
            e1, e2, normal = np.asarray(plane_frame(jnp.asarray(_unit(joint.axis)))).T
            each = (("x", "slide", e1), ("y", "slide", e2), ("angle", "hinge", normal))
            return tuple(
                BodyJoint(f"{part.name}.{name}", kind, axis, np.array([q + k]), np.array([v + k]), one, drive=drive)
                for k, (name, kind, axis) in enumerate(each)
            )
        if isinstance(joint, RevoluteJoint | PrismaticJoint):
            kind, flexure = ("slide", None) if isinstance(joint, PrismaticJoint) else ("hinge", joint.flexure)
            stiffness = joint.stiffness if flexure is None else flexure.spring
            lower, upper = (None if stop is None else float(stop.at) for stop in (joint.lower, joint.upper))
            numbers = float(stiffness), float(joint.damping), float(joint.rest), float(joint.friction), (lower, upper)
            return (BodyJoint(own, kind, _unit(joint.axis), np.array([q]), np.array([v]), one, *numbers, drive),)
        return ()

    def _hinge(self, part: str, limb: Rod, rod: SoftRod, i: int, name: str, s: float, k: int, n: int) -> BodyJoint:
        """One that stands for a strain at the fraction s of the length."""
        if limb.constant_loss is not None:
            given = f"{{loss_factor: {limb.constant_loss[0]:g}, frequency: 2 Hz}}"
            words = f"a loss factor over a band has no counterpart in that format. Give its frequency, as in {given}."
            raise InputError(words, field=f"{part}.damping")
        rows = strain_rows(rod, name)
        place = self.robot.tree.layout[i]
        driven = name in rod.driven
        share = (
            np.asarray(rod.driven[name].along(np.array([s]))) if driven else legendre(len(rows) - 1, np.array([s]))[0]
        )
        here, row = matter_at(limb, np.array([s])), STRAIN_NAMES.index(name)
        over, one = n / limb.length, jnp.ones((1, 1))
        prescribed = driven or getattr(limb.motion, name) is not None
        return BodyJoint(
            name=f"{part}.{name}.{k}",
            kind="hinge",
            axis=np.eye(3)[_HINGED.index(name)],
            q=place.q.stop - rod.nq + np.array(rows),
            v=place.v.stop - rod.nq + np.array(rows),
            share=np.ravel(share) / n,
            stiffness=float(here.stiffness(one)[0, row]) * over,
            damping=float(here.damping(one)[0, row]) * over,
            drive="motion" if prescribed else "",
        )


def _in_turn(names: Sequence[str], k: int) -> str:
    """The k-th of all hinges: forward in one cell and backward in the next, so that none is nearer to the root."""
    cell, own = divmod(k, len(names))
    return names[own if cell % 2 == 0 else -1 - own]


def _rest(limb: Rod, hinged: Sequence[str], s: float, cell: float) -> np.ndarray:
    """Rotation over one hinge of a rod that is free of stress: by its curvatures there times the length of a cell."""
    from scipy.spatial.transform import Rotation

    turn = np.zeros(3)
    for k, name in enumerate(_HINGED):
        row = getattr(limb.rest, name)
        if row and name in hinged:
            turn[k] = legendre(len(row) - 1, np.array([s]))[0] @ np.array(row) * cell
    return Rotation.from_rotvec(turn).as_matrix()


def _segment(limb: Rod, start: float, end: float) -> tuple[tuple[np.ndarray, float, np.ndarray], Solid]:
    """Inertia, volume and its first moment of a piece of a rod, in a frame at its start; and its mean shape."""
    g, w = np.polynomial.legendre.leggauss(4)
    s, length = start + 0.5 * (end - start) * (g + 1), (end - start) * limb.length
    x, w = 0.5 * length * (g + 1), 0.5 * length * w
    matter = matter_at(limb, s)
    area = np.asarray(matter.area)
    about_x, about_y, about_z, line = np.asarray(matter.inertia(jnp.asarray(w)[:, None]))[:, :4].T
    mass, first, second = line.sum(), line @ x, line @ (x * x)
    inertia = np.diag([about_x.sum(), about_y.sum() + second, about_z.sum() + second, mass, mass, mass])
    inertia[1, 5] = inertia[5, 1] = -first
    inertia[2, 4] = inertia[4, 2] = first
    half = (w @ np.asarray(matter.outline.half_width)) / length
    middle = np.array([0.5 * length, 0.0, 0.0])
    if limb.section == "circle":
        solid = Solid("cylinder", np.array([half[0], half[1], 0.5 * length]), STANDING, middle)
    else:
        solid = Solid("box", np.array([0.5 * length, *half]), np.eye(3), middle)
    return (inertia, float(w @ area), np.array([float(w @ (area * x)), 0.0, 0.0])), solid


def _unsaid(name: str, limb: Limb) -> Iterator[str]:
    """Words for what of a part has no place in a tree of rigid bodies."""
    if isinstance(limb, Rigid) and limb.bend:
        yield f"{name}: bend of its shape, which is drawn straight; its mass and its tip are those of the bent one"
    if limb.joint.powered is not None:
        yield f"{name}: motor of its joint, with its electrics and its inertia"


def _unit(axis: Sequence[float]) -> np.ndarray:
    return np.array(axis) / np.linalg.norm(axis)


def _after(a: Pose, b: Pose) -> Pose:
    """Pose a, then pose b in its frame."""
    return a[0] @ b[0], a[1] + a[0] @ b[1]
