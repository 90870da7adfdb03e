"""What solvers make of a robot: planar equations, if its motion is planar; loops of servos that act at all times."""

from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Mechanical
from nectosome.core.programs.remember import remembered
from nectosome.core.se3 import compose, dot, matmul3
from nectosome.core.tracers import known, traced
from nectosome.units import InputError

from .joints import Fixed, Joint, Planar, Prismatic, Revolute, plane_frame
from .parts import Link
from .plane import InPlane, LinkBatch, PlaneBody, about_root, acting
from .robot import Robot

_STRAIGHT = 1e-12  # largest deviation of an axis from the normal or from the plane


def reduced(system: Mechanical) -> Mechanical:
    """`InPlane` for a robot that moves in a plane, any other system unchanged; states are the same."""
    if not isinstance(system, Robot) or not _links_in_plane(system):
        return system
    if traced(system):
        return remembered(in_plane, system) if moves_in_plane(stand_in(system)) else system
    planar, deviation = remembered(_planar, system)
    return planar if float(deviation) < _STRAIGHT else system


def stand_in(robot: Robot) -> Robot:
    """A robot of the same structure whose numbers are known, for what is decided before anything is traced.

    Of derivatives it is the robot itself, of a batch its first one, inside `jit` the one that `bind` was given. Raises
    InputError where none is known.
    """
    if not traced(robot):
        return robot
    found = known(robot)
    if found is None and robot.example.value is None:
        raise InputError(
            "nothing is known of the numbers of this robot inside jax.jit, on which its symmetry and its plane depend. "
            "Build it in there, by build(theta) of theta, build = ns.bind(...)."
        )
    return robot.example.value if found is None else found


def moves_in_plane(robot: Robot) -> bool:
    """Whether a robot can only move in a plane: all joints rotate about its normal or slide in it, without a current.

    Robots with pair loads use the full equations.
    """
    return _links_in_plane(robot) and float(remembered(_deviation, robot)) < _STRAIGHT


def _links_in_plane(robot: Robot) -> bool:
    """Whether a robot moves in a plane if the axes of its joints are straight."""
    links = all(part.link for part in robot.tree.structure)
    joints = all(issubclass(part.joint, Fixed | Revolute | Prismatic | Planar) for part in robot.tree.structure)
    whole = robot.share is None and not robot.load_groups.pairs
    return links and joints and whole and robot.water.current is None


def _planar(robot: Robot) -> tuple[InPlane, Array]:
    return in_plane(robot), _deviation(robot)


def in_plane(robot: Robot) -> InPlane:
    """Planar equations of a robot for which `moves_in_plane` is true."""
    plane, parts = _plane(robot), robot.tree.parts
    at_zero = _zero_poses(robot, plane.T)
    carriers, loads, on_parts = _rigid_groups(robot), robot.loads, acting(robot)
    order = {k: i for i, k in enumerate(dict.fromkeys(carriers))}
    inertias: dict[int, list[Array]] = {k: [] for k in order}
    wetted: dict[tuple[int, int], LinkBatch] = {}
    for k, (carrier, place) in enumerate(zip(carriers, robot.tree.layout, strict=True)):
        link, R, p = at_zero[k]
        rotation, position = matmul3(R, link.rotation), dot(R, link.position) + p - at_zero[carrier][2]
        added = robot.added[place.stations]
        inertia = robot.inertia[place.stations] + (0.0 if robot.emerges else added)
        inertias[carrier].append(about_root(inertia, rotation, position))
        own = on_parts.get(k, [])
        if own or robot.emerges:
            height = position.at[:, 2].add(at_zero[carrier][2][2])
            on_link: tuple[Any, ...] = tuple(loads[i].load for i in own)
            there = added if robot.emerges else None
            wetted[k, order[carrier]] = LinkBatch(parts[k].stations, on_link, there, plane, rotation, height)
    bodies = []
    for k in order:
        part, (_, R, p) = parts[k], at_zero[k]
        parent = carriers[part.parent] if part.parent >= 0 else -1
        root = at_zero[parent][2] if parent >= 0 else jnp.zeros(3)
        slides = tuple(tuple(R[:2] @ axis) for axis in _slides(part.joint))
        turns = tuple(R[2] @ axis for axis in _turns(part.joint))
        bodies.append(
            PlaneBody(
                k, order.get(parent, -1), tuple((p - root)[:2]), slides, turns, tuple(sum(inertias[k], jnp.zeros(6)))
            )
        )
    groups = _batches(wetted)
    stacked = tuple(jax.tree.map(lambda *x: jnp.stack(x), *group.values()) for group in groups)
    return InPlane(robot, tuple(bodies), stacked, tuple(tuple(group) for group in groups))


def _rigid_groups(robot: Robot) -> list[int]:
    """Index of the part to which each part is rigidly fixed, or its own."""
    out: list[int] = []
    for k, part in enumerate(robot.tree.structure):
        out.append(out[part.parent] if part.parent >= 0 and issubclass(part.joint, Fixed) else k)
    return out


def _batches(wetted: dict[tuple[int, int], LinkBatch]) -> list[dict[tuple[int, int], LinkBatch]]:
    """Group links of one structure."""
    groups: dict[Any, dict[tuple[int, int], LinkBatch]] = {}
    for k, one in wetted.items():
        numbers, structure = jax.tree.flatten(one)
        groups.setdefault((structure, tuple(x.shape for x in numbers)), {})[k] = one
    return list(groups.values())


def _deviation(robot: Robot) -> Array:
    """Largest deviation of a joint axis from the normal, or from the plane."""
    deviations = [jnp.zeros(())]
    for part, (_, R, _) in zip(robot.tree.parts, _zero_poses(robot, _plane(robot).T), strict=True):
        deviations += [jnp.abs(R[2] @ axis) for axis in _slides(part.joint)]
        deviations += [jnp.max(jnp.abs((R @ axis)[:2])) for axis in _turns(part.joint)]
    return jnp.max(jnp.stack(deviations))


def _plane(robot: Robot) -> Float[Array, "3 3"]:
    """Axes of the plane in the world, as columns; the last is its normal: the axis of the first hinge, else z."""
    for part, (_, R, _) in zip(robot.tree.parts, _zero_poses(robot, jnp.eye(3)), strict=True):
        for axis in _turns(part.joint):
            return plane_frame(dot(R, axis))
    return jnp.eye(3)


def _zero_poses(robot: Robot, turn: Float[Array, "3 3"]) -> list[tuple[Link, Array, Array]]:
    """All links and the poses of their frames at zero joint coordinates, in a world rotated by `turn`."""
    out: list[tuple[Link, Array, Array]] = []
    for part in robot.tree.parts:
        before = turn, jnp.zeros(3)
        if part.parent >= 0:
            link, *pose = out[part.parent]
            before = pose[0], pose[1]
            if part.node < 0:
                before = compose(before, (link.tip_rotation, link.tip_position))
        pose = compose(before, (part.rotation, part.position))
        assert isinstance(part.body, Link)
        out.append((part.body, *pose))
    return out


def _slides(joint: Joint) -> tuple[Array, ...]:
    if isinstance(joint, Planar):
        return joint.frame[:, 0], joint.frame[:, 1]
    return (joint.axis,) if isinstance(joint, Prismatic) else ()


def _turns(joint: Joint) -> tuple[Array, ...]:
    if isinstance(joint, Planar):
        return (joint.frame[:, 2],)
    return (joint.axis,) if isinstance(joint, Revolute) else ()


def continuous_loops(robot: Robot) -> Robot:
    """The robot with loops that act at all times, as for equilibria and symmetries; its states are of one structure."""
    if robot.update_rates is None:
        return robot
    return replace(robot, powered=robot.powered.continuous()).described(robot.description)
