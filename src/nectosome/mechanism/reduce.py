"""The smallest equations that say all of a robot's motion."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Mechanical
from nectosome.core.remember import remembered
from nectosome.core.se3 import compose, dot, matmul3

from .joints import Fixed, Joint, Planar, Prismatic, Revolute, plane_frame
from .links import Link
from .plane import InPlane, acting_on
from .plane_links import Alike, PlaneBody, about_root
from .robot import Robot

_STRAIGHT = 1e-12  # how far an axis may lean


def reduced(system: Mechanical) -> Mechanical:
    """A robot that moves in a plane as `InPlane`, anything else as it is; states are the same."""
    return remembered(in_plane, system) if isinstance(system, Robot) and moves_in_plane(system) else system


def moves_in_plane(robot: Robot) -> bool:
    """Whether nothing of a robot can leave a plane: all joints turn about its normal or slide in it, nothing flows.

    Pairs of parts are left to the robot's own equations.
    """
    links = all(isinstance(part.body, Link) for part in robot.tree.parts)
    joints = all(isinstance(part.joint, Fixed | Revolute | Prismatic | Planar) for part in robot.tree.parts)
    if not (links and joints and robot.water.current is None and not robot.pairs):
        return False
    return float(remembered(_lean, robot)) < _STRAIGHT


def in_plane(robot: Robot) -> InPlane:
    """The robot's equations in the plane; `moves_in_plane` says whether that is all of its motion."""
    plane = _plane(robot)
    lying = _lying(robot, plane.T)
    carriers = _carriers(robot)
    order = {k: i for i, k in enumerate(dict.fromkeys(carriers))}
    inertias: dict[int, list[Array]] = {k: [] for k in order}
    wetted: dict[tuple[int, int], Alike] = {}
    for k, (carrier, place) in enumerate(zip(carriers, robot.tree.layout, strict=True)):
        link, R, p = lying[k]
        rotation, position = matmul3(R, link.rotation), dot(R, link.position) + p - lying[carrier][2]
        inertia = robot.inertia[place.stations] + robot.added[place.stations]
        inertias[carrier].append(about_root(inertia, rotation, position))
        if acting := acting_on(robot, k):
            own = robot.inertia[place.stations]
            height = position.at[:, 2].add(lying[carrier][2][2])
            wetted[k, order[carrier]] = Alike(link, tuple(acting.values()), plane, rotation, height, own)
    bodies = []
    for k in order:
        part, (_, R, p) = robot.tree.parts[k], lying[k]
        parent = carriers[part.parent] if part.parent >= 0 else -1
        root = lying[parent][2] if parent >= 0 else jnp.zeros(3)
        slides = tuple(tuple(R[:2] @ axis) for axis in _slides(part.joint))
        turns = tuple(R[2] @ axis for axis in _turns(part.joint))
        bodies.append(
            PlaneBody(
                k, order.get(parent, -1), tuple((p - root)[:2]), slides, turns, tuple(sum(inertias[k], jnp.zeros(6)))
            )
        )
    groups = _alike(wetted)
    stacked = tuple(jax.tree.map(lambda *x: jnp.stack(x), *group.values()) for group in groups)
    return InPlane(robot, tuple(bodies), stacked, tuple(tuple(group) for group in groups))


def _carriers(robot: Robot) -> list[int]:
    """The part that each part moves with: itself, or what it is fixed to."""
    out: list[int] = []
    for k, part in enumerate(robot.tree.parts):
        out.append(out[part.parent] if part.parent >= 0 and isinstance(part.joint, Fixed) else k)
    return out


def _alike(wetted: dict[tuple[int, int], Alike]) -> list[dict[tuple[int, int], Alike]]:
    """Links of one structure together."""
    groups: dict[Any, dict[tuple[int, int], Alike]] = {}
    for k, one in wetted.items():
        numbers, structure = jax.tree.flatten(one)
        groups.setdefault((structure, tuple(x.shape for x in numbers)), {})[k] = one
    return list(groups.values())


def _lean(robot: Robot) -> Array:
    """How far the axis that leans most is from the normal, or from the plane."""
    leans = [jnp.zeros(())]
    for part, (_, R, _) in zip(robot.tree.parts, _lying(robot, _plane(robot).T), strict=True):
        leans += [jnp.abs(R[2] @ axis) for axis in _slides(part.joint)]
        leans += [jnp.max(jnp.abs((R @ axis)[:2])) for axis in _turns(part.joint)]
    return jnp.max(jnp.stack(leans))


def _plane(robot: Robot) -> Float[Array, "3 3"]:
    """Axes of the plane in the world, as columns; the last is its normal: what the first hinge turns about, else z."""
    for part, (_, R, _) in zip(robot.tree.parts, _lying(robot, jnp.eye(3)), strict=True):
        for axis in _turns(part.joint):
            return plane_frame(dot(R, axis))
    return jnp.eye(3)


def _lying(robot: Robot, turn: Float[Array, "3 3"]) -> list[tuple[Link, Array, Array]]:
    """All links, and the poses of their frames where all joints are at 0, in a world that is turned."""
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
