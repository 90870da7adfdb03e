"""The smallest equations that say all of a robot's motion."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Load, Mechanical
from nectosome.core.remember import remembered
from nectosome.core.se3 import compose, dot, matmul3

from .joints import Fixed, Joint, Planar, Prismatic, Revolute
from .links import Link
from .plane import InPlane
from .plane_links import Alike, Body
from .robot import Robot

_STRAIGHT = 1e-12  # how far an axis may lean


def reduced(system: Mechanical) -> Mechanical:
    """A robot that moves in the plane as `InPlane`, anything else as it is; states are the same."""
    return remembered(in_plane, system) if isinstance(system, Robot) and moves_in_plane(system) else system


def moves_in_plane(robot: Robot) -> bool:
    """Whether nothing of a robot can leave the plane: all joints turn about z or slide across it, nothing flows."""
    links = all(isinstance(part.body, Link) for part in robot.tree.parts)
    joints = all(isinstance(part.joint, Fixed | Revolute | Prismatic | Planar) for part in robot.tree.parts)
    stateless = not jax.tree.leaves(robot.initial().z)
    reshaped = any(isinstance(a.load, Load) and a.load.reshapes for a in robot.loads)
    if not (links and joints and stateless and robot.water.current is None) or reshaped:
        return False
    return float(remembered(_lean, robot)) < _STRAIGHT


def in_plane(robot: Robot) -> InPlane:
    """The robot's equations in the plane; `moves_in_plane` says whether that is all of its motion."""
    lying = _lying(robot)
    bodies, wetted = [], {}
    for k, (part, place) in enumerate(zip(robot.tree.parts, robot.tree.layout, strict=True)):
        link, R, p = lying[k]
        root = lying[part.parent][2] if part.parent >= 0 else jnp.zeros(3)
        rotation, position = matmul3(R, link.rotation), dot(R, link.position)
        inertia = robot.inertia[place.stations] + robot.added[place.stations]
        slides = tuple(tuple(R[:2] @ axis) for axis in _slides(part.joint))
        turns = tuple(R[2] @ axis for axis in _turns(part.joint))
        bodies.append(Body(tuple((p - root)[:2]), slides, turns, _about_root(inertia, rotation, position)))
        loads = tuple(a.load for a in robot.loads if a.part == k and isinstance(a.load, Load) and not a.load.inertial)
        if loads:
            own = robot.inertia[place.stations]
            wetted[k] = Alike(link, loads, rotation, position.at[:, 2].add(p[2]), own)
    groups = _alike(wetted)
    stacked = tuple(jax.tree.map(lambda *x: jnp.stack(x), *group.values()) for group in groups)
    return InPlane(robot, tuple(bodies), stacked, tuple(tuple(group) for group in groups))


def _alike(wetted: dict[int, Alike]) -> list[dict[int, Alike]]:
    """Links of one structure together."""
    groups: dict[Any, dict[int, Alike]] = {}
    for k, one in wetted.items():
        numbers, structure = jax.tree.flatten(one)
        groups.setdefault((structure, tuple(x.shape for x in numbers)), {})[k] = one
    return list(groups.values())


def _lean(robot: Robot) -> Array:
    """How far the axis that leans most is from z, or from the plane."""
    leans = [jnp.zeros(())]
    for part, (_, R, _) in zip(robot.tree.parts, _lying(robot), strict=True):
        leans += [jnp.abs(R[2] @ axis) for axis in _slides(part.joint)]
        leans += [jnp.max(jnp.abs((R @ axis)[:2])) for axis in _turns(part.joint)]
    return jnp.max(jnp.stack(leans))


def _lying(robot: Robot) -> list[tuple[Link, Array, Array]]:
    """All links, and the poses of their frames where all joints are at 0."""
    out: list[tuple[Link, Array, Array]] = []
    for part in robot.tree.parts:
        pose = part.rotation, part.position
        if part.parent >= 0:
            link, *before = out[part.parent]
            if part.node < 0:
                before = compose((before[0], before[1]), (link.tip_rotation, link.tip_position))
            pose = compose((before[0], before[1]), pose)
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


def _about_root(inertia: Float[Array, "n 6 6"], rotation: Float[Array, "n 3 3"], position: Float[Array, "n 3"]):
    """Inertia of all stations together for motions (w, x, y) of the root."""
    Rx, Ry, Rz = rotation[:, 0], rotation[:, 1], rotation[:, 2]
    none = jnp.zeros_like(Rx)
    spin = jnp.concatenate([Rz, position[:, :1] * Ry - position[:, 1:2] * Rx], axis=1)
    B = jnp.stack([spin, jnp.concatenate([none, Rx], axis=1), jnp.concatenate([none, Ry], axis=1)], axis=2)
    M = jnp.einsum("nia,nij,njb->ab", B, inertia, B)
    return M[0, 0], M[0, 1], M[0, 2], M[1, 1], M[1, 2], M[2, 2]
