r"""Joints: the motion of a body relative to its parent.

A joint gives the pose of the child in the parent's joint frame and the motion subspace S in the child's frame. S is
constant there, so that the relative body twist is S v and its rate S dv/dt. Coordinates q and velocities v differ only
for a rotation in space, a quaternion (scalar first, any non-zero length).
"""

from abc import abstractmethod
from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core.described import DescribedModule, number, unit, vector
from nectosome.core.se3 import (
    cross,
    dot,
    dot_t,
    matmul3,
    quaternion_from_rpy,
    rotation_about,
    rotation_from_quaternion,
    rotation_from_rpy,
    safe_norm,
    skew,
)
from nectosome.description import joints as dj

SLIDES = {"position", "x", "y", "vx", "vy", "vz"}  # names of the velocities of joints that are along a line


class JointMotion(NamedTuple):
    """Relative motion of a joint."""

    rotation: Float[Array, "3 3"]
    position: Float[Array, "3"]
    subspace: Float[Array, "nv 6"]  # unit twists, child frame


class Joint(DescribedModule):
    """A joint with `nq` coordinates and `nv` velocities."""

    nq: ClassVar[int]
    nv: ClassVar[int]
    names: ClassVar[tuple[str, ...]]  # of the velocities
    plain: ClassVar[bool] = False  # the coordinates change at the velocities

    @abstractmethod
    def motion(self, q: Float[Array, "nq"]) -> JointMotion:
        """Pose and subspace."""

    @staticmethod
    def advance(q: Float[Array, "nq"], v: Float[Array, "nv"], step: Float[Array, ""]) -> Float[Array, "nq"]:
        """Solve q1 = q + step N(q1) v."""
        return q + step * v

    @staticmethod
    def displacement(q: Float[Array, "nq"]) -> Float[Array, "nv"]:
        """Displacement for springs: the coordinates, or the rotation vector [rad]."""
        return q

    @staticmethod
    def coordinates(displacement: Float[Array, "nv"]) -> Float[Array, "nq"]:
        """Coordinates of a displacement."""
        return displacement

    @staticmethod
    def prescribed(u: Array, du: Array, ddu: Array) -> tuple[Array, Array, Array]:
        """Coordinates, velocities and accelerations of a joint with the prescribed motion u [nv]."""
        return u, du, ddu

    @abstractmethod
    def start(self) -> tuple[Float[Array, "nq"], Float[Array, "nv"]]:
        """Initial coordinates and velocities."""


class Fixed(Joint):
    """No motion."""

    nq = nv = 0
    names = ()
    plain = True
    described_by = dj.FixedJoint

    def motion(self, q: Float[Array, "0"]) -> JointMotion:
        """Identity."""
        return JointMotion(jnp.eye(3), jnp.zeros(3), jnp.zeros((0, 6)))

    def start(self) -> tuple[Float[Array, "0"], Float[Array, "0"]]:
        """Empty."""
        return jnp.zeros(0), jnp.zeros(0)


class AxialJoint(Joint):
    """A joint with one coordinate, along or about the unit vector `axis`."""

    axis: Float[Array, "3"]
    position: Float[Array, "1"]  # at the start [rad or m]
    velocity: Float[Array, "1"]  # at the start [rad/s or m/s]
    nq = nv = 1
    plain = True

    @classmethod
    def from_description(cls, described: Any) -> "AxialJoint":
        """The joint of a description, by its axis and its start."""
        return cls(unit(described.axis), number(described.position)[None], number(described.velocity)[None])

    def start(self) -> tuple[Float[Array, "1"], Float[Array, "1"]]:
        """Start coordinate and speed."""
        return self.position, self.velocity


class Revolute(AxialJoint):
    """Rotation by q [rad] about the unit vector `axis`."""

    names = ("angle",)
    described_by = dj.RevoluteJoint

    def motion(self, q: Float[Array, "1"]) -> JointMotion:
        """R = exp(q [axis]), S = (axis, 0)."""
        S = jnp.concatenate([self.axis, jnp.zeros(3)])[None]
        return JointMotion(rotation_about(self.axis, q[0]), jnp.zeros(3), S)


class Prismatic(AxialJoint):
    """Translation by q [m] along the unit vector `axis`."""

    names = ("position",)
    described_by = dj.PrismaticJoint

    def motion(self, q: Float[Array, "1"]) -> JointMotion:
        """p = q axis, S = (0, axis)."""
        S = jnp.concatenate([jnp.zeros(3), self.axis])[None]
        return JointMotion(jnp.eye(3), self.axis * q, S)


class Planar(Joint):
    """Motion in the plane through the origin normal to `axis`: q = (along e1 [m], along e2 [m], angle [rad]).

    e1, e2 span the plane in the parent's frame, e1 x e2 = axis; v = the same in the child's frame [m/s, m/s, rad/s].
    """

    frame: Float[Array, "3 3"]  # columns e1, e2, axis
    position: Float[Array, "3"]
    velocity: Float[Array, "3"]
    nq = nv = 3
    names = ("x", "y", "angle")
    described_by = dj.PlanarJoint

    @classmethod
    def from_description(cls, described: dj.PlanarJoint) -> "Planar":
        """The joint of a description, whose start is in the parent's axes."""
        frame, start = plane_frame(unit(described.axis)), described.start
        position = dot_t(frame, vector(start.position)).at[2].set(number(start.angle))
        velocity = dot_t(frame, vector(start.velocity)).at[2].set(number(start.angular_speed))
        return cls(frame, position, velocity)

    def motion(self, q: Float[Array, "3"]) -> JointMotion:
        """R = exp(angle [axis]), S = ((0, e1), (0, e2), (axis, 0))."""
        e1, e2, n = self.frame.T
        o = jnp.zeros(3)
        S = jnp.stack([jnp.concatenate([o, e1]), jnp.concatenate([o, e2]), jnp.concatenate([n, o])])
        return JointMotion(rotation_about(n, q[2]), e1 * q[0] + e2 * q[1], S)

    @staticmethod
    def advance(q: Float[Array, "3"], v: Float[Array, "3"], step: Float[Array, ""]) -> Float[Array, "3"]:
        """Implicit step of d(angle)/dt = v3, d(e1, e2)/dt = R(angle) (v1, v2)."""
        angle = q[2] + step * v[2]
        return jnp.append(q[:2] + step * dot(_turn(angle), v[:2]), angle)

    @staticmethod
    def prescribed(u: Array, du: Array, ddu: Array) -> tuple[Array, Array, Array]:
        """From the coordinates and their rates."""
        R, w = _turn(u[2]), du[2]
        v = dot_t(R, du[:2])
        along = dot_t(R, ddu[:2]) - w * jnp.stack([-v[1], v[0]])
        return u, jnp.append(v, w), jnp.append(along, ddu[2])

    def start(self) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
        """Start coordinates and velocities."""
        return self.position, self.velocity


def _turn(angle: Array) -> Array:
    """Rotation in the plane."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    return jnp.stack([jnp.stack([c, -s]), jnp.stack([s, c])])


def _advance_quaternion(quaternion: Array, w: Array, step: Array) -> Array:
    """Solve Q1 = Q + step/2 Q1 w in closed form: Q1 = (Q + step/2 Q w) / (1 + |step w|^2/4)."""
    half = 0.5 * step * w
    s, u = quaternion[0], quaternion[1:]
    product = jnp.concatenate([-jnp.sum(u * half)[None], s * half + cross(u, half)])
    return (quaternion + product) / (1 + jnp.sum(half * half))


def _rotation_vector(quaternion: Array) -> Array:
    """Rotation vector [rad] of length at most pi."""
    quaternion = jnp.where(quaternion[0] < 0, -quaternion, quaternion)
    n = safe_norm(quaternion[1:])
    angle = 2 * jnp.arctan2(n, quaternion[0])
    return quaternion[1:] * jnp.where(n > 0, angle / jnp.where(n > 0, n, 1.0), 2 / quaternion[0])


def _quaternion(vector: Array) -> Array:
    """Quaternion (cos(a/2), sin(a/2) n) of a rotation vector a n [rad]."""
    half = 0.5 * safe_norm(vector)
    return jnp.concatenate([jnp.cos(half)[None], 0.5 * vector * jnp.sinc(half / jnp.pi)])


def _angular_rates(angles: Array, rates: Array, seconds: Array) -> tuple[Array, Array]:
    """Body angular velocity and its rate from roll, pitch, yaw and their derivatives."""

    def velocity(angles: Array, rates: Array) -> Array:
        R, dR = jax.jvp(rotation_from_rpy, (angles,), (rates,))
        W = matmul3(R.T, dR)
        return jnp.stack([W[2, 1], W[0, 2], W[1, 0]])

    return jax.jvp(velocity, (angles, rates), (rates, seconds))


class Spherical(Joint):
    """Free rotation; q a quaternion, v the angular velocity in the child's frame [rad/s]."""

    orientation: Float[Array, "3"]  # roll, pitch, yaw at the start [rad]
    angular_velocity: Float[Array, "3"]  # at the start [rad/s]
    nq, nv = 4, 3
    names = ("wx", "wy", "wz")
    described_by = dj.SphericalJoint

    @classmethod
    def from_description(cls, described: dj.SphericalJoint) -> "Spherical":
        """The joint of a description, by its start."""
        return cls(vector(described.start.orientation), vector(described.start.angular_velocity))

    def motion(self, q: Float[Array, "4"]) -> JointMotion:
        """S = (I, 0)."""
        return JointMotion(rotation_from_quaternion(q), jnp.zeros(3), jnp.eye(6)[:3])

    @staticmethod
    def advance(q: Float[Array, "4"], v: Float[Array, "3"], step: Float[Array, ""]) -> Float[Array, "4"]:
        """Implicit step of dQ/dt = Q w / 2."""
        return _advance_quaternion(q, v, step)

    @staticmethod
    def displacement(q: Float[Array, "4"]) -> Float[Array, "3"]:
        """Rotation vector [rad]."""
        return _rotation_vector(q)

    @staticmethod
    def coordinates(displacement: Float[Array, "3"]) -> Float[Array, "4"]:
        """Quaternion of a rotation vector."""
        return _quaternion(displacement)

    @staticmethod
    def prescribed(u: Array, du: Array, ddu: Array) -> tuple[Array, Array, Array]:
        """From roll, pitch, yaw [rad]."""
        return quaternion_from_rpy(u), *_angular_rates(u, du, ddu)

    def start(self) -> tuple[Float[Array, "4"], Float[Array, "3"]]:
        """Start orientation and angular velocity."""
        return quaternion_from_rpy(self.orientation), self.angular_velocity


class Free(Joint):
    """All six motions; q = (position [m] in the parent's frame, quaternion), v = body twist (angular, linear)."""

    position: Float[Array, "3"]
    orientation: Float[Array, "3"]  # roll, pitch, yaw at the start [rad]
    angular_velocity: Float[Array, "3"]  # at the start, child frame [rad/s]
    velocity: Float[Array, "3"]  # at the start, child frame [m/s]
    nq, nv = 7, 6
    names = ("wx", "wy", "wz", "vx", "vy", "vz")
    described_by = dj.FreeJoint

    @classmethod
    def from_description(cls, described: dj.FreeJoint) -> "Free":
        """The joint of a description, by its start."""
        start = described.start
        return cls(*map(vector, (start.position, start.orientation, start.angular_velocity, start.velocity)))

    def motion(self, q: Float[Array, "7"]) -> JointMotion:
        """S = I."""
        return JointMotion(rotation_from_quaternion(q[3:]), q[:3], jnp.eye(6))

    @staticmethod
    def advance(q: Float[Array, "7"], v: Float[Array, "6"], step: Float[Array, ""]) -> Float[Array, "7"]:
        """Implicit step of dQ/dt = Q w / 2, dp/dt = R v."""
        turned = _advance_quaternion(q[3:], v[:3], step)
        return jnp.concatenate([q[:3] + step * dot(rotation_from_quaternion(turned), v[3:]), turned])

    @staticmethod
    def displacement(q: Float[Array, "7"]) -> Float[Array, "6"]:
        """Rotation vector [rad] and position [m]."""
        return jnp.concatenate([_rotation_vector(q[3:]), q[:3]])

    @staticmethod
    def coordinates(displacement: Float[Array, "6"]) -> Float[Array, "7"]:
        """Position and quaternion."""
        return jnp.concatenate([displacement[3:], _quaternion(displacement[:3])])

    @staticmethod
    def prescribed(u: Array, du: Array, ddu: Array) -> tuple[Array, Array, Array]:
        """From x, y, z [m] and roll, pitch, yaw [rad] in the parent's frame."""
        w, dw = _angular_rates(u[3:], du[3:], ddu[3:])
        R = rotation_from_rpy(u[3:])
        v = dot_t(R, du[:3])
        q = jnp.concatenate([u[:3], quaternion_from_rpy(u[3:])])
        return q, jnp.concatenate([w, v]), jnp.concatenate([dw, dot_t(R, ddu[:3]) - cross(w, v)])

    def start(self) -> tuple[Float[Array, "7"], Float[Array, "6"]]:
        """Start pose and twist."""
        quaternion = quaternion_from_rpy(self.orientation)
        return (
            jnp.concatenate([self.position, quaternion]),
            jnp.concatenate([self.angular_velocity, self.velocity]),
        )


def plane_frame(axis: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Columns e1, e2, axis, right-handed; for axis = z these are x, y, z."""
    helper = jnp.where(jnp.abs(axis[0]) < 0.9, jnp.array([1.0, 0.0, 0.0]), jnp.array([0.0, 1.0, 0.0]))
    e1 = helper - axis * jnp.sum(helper * axis)
    e1 = e1 / jnp.sqrt(jnp.sum(e1 * e1))
    return jnp.stack([e1, dot(skew(axis), e1), axis], axis=-1)
