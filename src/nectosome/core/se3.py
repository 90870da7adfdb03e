r"""Rigid motions: SO(3), SE(3), their exponentials and tangents (Selig 2005; Murray, Li, Sastry 1994).

A pose is a pair (R, p): R [3, 3] rotates from the body frame to the outer frame, p [3] is the body's origin in the
outer frame. A twist is (angular, linear) = (w, v) [6] in the body frame; a "spatial" twist is that of the body point at
the outer origin. All functions broadcast over leading axes.
"""

from collections.abc import Callable
from math import factorial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

Vector = Float[Array, "*batch 3"]
Twist = Float[Array, "*batch 6"]
Rotation = Float[Array, "*batch 3 3"]


# skew(w) = w . _SKEW: as a product with constants it stays small when traced
_SKEW = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _SKEW[_i, _k, _j], _SKEW[_i, _j, _k] = 1.0, -1.0


# ad_x = x . _AD: the same for twists
_AD = np.zeros((6, 6, 6))
_AD[:3, :3, :3] = _AD[:3, 3:, 3:] = _AD[3:, 3:, :3] = _SKEW


def dot(R: Array, x: Array) -> Array:
    """R x as a broadcast sum (a batched product of small matrices is slow as a library call)."""
    return jnp.sum(R * x[..., None, :], axis=-1)


def dot_t(R: Array, x: Array) -> Array:
    """R^T x as a broadcast sum."""
    return jnp.sum(R * x[..., :, None], axis=-2)


def matmul3(A: Array, B: Array) -> Array:
    """A B of small matrices as a broadcast sum."""
    return jnp.sum(A[..., :, :, None] * B[..., None, :, :], axis=-2)


def skew(w: Array) -> Array:
    """Matrix [w] with [w] x = w x x (vector product)."""
    return jnp.tensordot(w, _SKEW, axes=1)


def cross(a: Array, b: Array) -> Array:
    """Vector product along the last axis: a_yzx b_zxy - a_zxy b_yzx."""
    aa, bb = jnp.concatenate([a, a], axis=-1), jnp.concatenate([b, b], axis=-1)
    return _part(aa, 1, 4) * _part(bb, 2, 5) - _part(aa, 2, 5) * _part(bb, 1, 4)


def _part(x: Array, start: int, stop: int) -> Array:
    """Return x[..., start:stop], with less tracing time."""
    return lax.slice_in_dim(x, start, stop, axis=-1)


def compose(a: tuple[Array, Array], b: tuple[Array, Array]) -> tuple[Array, Array]:
    """Pose a followed by pose b, the latter given in a's frame."""
    return matmul3(a[0], b[0]), a[1] + dot(a[0], b[1])


_TERMS = 12  # of a series, in three rows of four


def _table(*terms: Callable[[int], float]) -> np.ndarray:
    """Taylor coefficients in s = theta^2 [4, 3, functions]: of s^(i + 4 j)."""
    whole = np.array([[term(k) for term in terms] for k in range(_TERMS)])
    return whole.reshape(3, 4, len(terms)).swapaxes(0, 1)


_EXP = (
    lambda k: (-1.0) ** k / factorial(2 * k + 1),
    lambda k: (-1.0) ** k / factorial(2 * k + 2),
    lambda k: (-1.0) ** k / factorial(2 * k + 3),
)
_TANGENT = (
    lambda k: (-1.0) ** (k + 1) * (k - 1) / factorial(2 * k + 2),
    lambda k: (-1.0) ** (k + 1) * (k - 1) / factorial(2 * k + 3),
    lambda k: (-1.0) ** k * (k + 1) / factorial(2 * k + 4),
    lambda k: (-1.0) ** k * (k + 1) / factorial(2 * k + 5),
)
_EXP_TABLE, _TABLE = _table(*_EXP), _table(*_EXP, *_TANGENT)


def _exp_closed(t: Array, sin: Array, cos: Array) -> list[Array]:
    return [sin / t, (1 - cos) / t**2, (t - sin) / t**3]


def _tangent_closed(t: Array, sin: Array, cos: Array) -> list[Array]:
    return [
        (4 - t * sin - 4 * cos) / (2 * t**2),
        (4 * t - 5 * sin + t * cos) / (2 * t**3),
        (2 - t * sin - 2 * cos) / (2 * t**4),
        (2 * t - 3 * sin + t * cos) / (2 * t**5),
    ]


def _even(s: Float[Array, "*batch 1"], tangents: bool) -> Float[Array, "*batch functions"]:
    """Coefficients of the exponential, and of its tangent: series below 1 rad, closed form above.

    As functions of s = theta^2 they and their derivatives are smooth at 0.
    """
    small, table = s < 1.0, _TABLE if tangents else _EXP_TABLE
    square = s * s
    powers = jnp.concatenate([jnp.ones_like(s), s, square, square * s], axis=-1)
    low, middle, high = jnp.moveaxis(jnp.sum(powers[..., None, None] * table, axis=-3), -2, 0)
    fourth = square * square
    series = low + fourth * (middle + fourth * high)
    t = jnp.sqrt(jnp.where(small, 1.0, s))
    sin, cos = jnp.sin(t), jnp.cos(t)
    closed = _exp_closed(t, sin, cos) + (_tangent_closed(t, sin, cos) if tangents else [])
    return jnp.where(small, series, jnp.concatenate(closed, axis=-1))


def _square(twist: Twist) -> Float[Array, "*batch 1"]:
    theta = _part(twist, 0, 3)
    return jnp.sum(theta * theta, axis=-1, keepdims=True)


def exp_so3(theta: Vector) -> Rotation:
    r"""Rotation by the vector theta [rad]: I + (sin t/t) [theta] + ((1 - cos t)/t^2) [theta]^2 (Rodrigues)."""
    return exp_se3(jnp.concatenate([theta, jnp.zeros_like(theta)], axis=-1))[0]


def rotation_about(axis: Float[Array, "3"], angle: Float[Array, "*batch"]) -> Rotation:
    """Rotation by an angle [rad] about a unit vector: I + sin(angle) [axis] + (1 - cos(angle)) [axis]^2."""
    K = skew(axis)
    angle = angle[..., None, None]
    return jnp.eye(3) + jnp.sin(angle) * K + (1 - jnp.cos(angle)) * matmul3(K, K)


def exp_se3(twist: Twist) -> tuple[Array, Array]:
    r"""Pose reached by moving along a constant body twist for unit time.

    $$ R = 1 + a[\theta] + b[\theta]^2, \quad p = (1 + b[\theta] + c[\theta]^2)\,\rho $$ with twist = (theta, rho),
    a = sin t/t, b = (1 - cos t)/t^2, c = (t - sin t)/t^3.
    """
    return _exp(twist, _even(_square(twist), False))


def _exp(twist: Twist, coefficients: Float[Array, "*batch 3"]) -> tuple[Array, Array]:
    a, b, c = (_part(coefficients, k, k + 1) for k in range(3))
    K, rho = skew(_part(twist, 0, 3)), _part(twist, 3, 6)
    once = dot(K, rho)
    p = rho + b * once + c * dot(K, once)
    return jnp.eye(3) + a[..., None] * K + b[..., None] * matmul3(K, K), p


def bracket(x: Twist, y: Twist) -> Twist:
    """Lie bracket ad_x y. The barrier keeps XLA from recomputing nested brackets."""
    return lax.optimization_barrier(dot(ad(x), y))


def ad(x: Twist) -> Float[Array, "*batch 6 6"]:
    """Matrix of the Lie bracket: ad_x y = [x, y]."""
    return jnp.tensordot(x, _AD, axes=1)


def tangent(twist: Twist, x: Twist) -> Twist:
    r"""Tangent of the exponential applied to x: $T x = \sum_k ad^k x/(k+1)!$, so that $\dot g g^{-1} = T\,\dot\Omega$.

    Closed form of degree four in ad (Selig 2005, sec. 4.3), series below 1 rad.
    """
    return exponential(twist).tangent(x)


class Exponential(NamedTuple):
    """Exponential of a twist, with what its tangent and the rate of its tangent need."""

    twist: Float[Array, "*batch 6"]
    coefficients: Float[Array, "*batch 4"]  # c_k of ad^k in the tangent
    derivatives: Float[Array, "*batch 4"]  # of the coefficients by the square of the angle
    rotation: Float[Array, "*batch 3 3"]
    position: Float[Array, "*batch 3"]

    def tangent(self, x: Twist) -> Twist:
        r"""$T x = x + \sum_k c_k ad^k x$."""
        matrix, total, power = ad(self.twist), x, x
        for k in range(4):
            power = lax.optimization_barrier(dot(matrix, power))
            total = total + _part(self.coefficients, k, k + 1) * power
        return total

    def tangent_rate(self, x: Twist, rate: Twist) -> Twist:
        r"""Rate of T x along x, which changes at `rate`: $\dot x + \sum_k \dot c_k ad^k x + c_k (ad^k x)\dot{}$."""
        matrix, moved = ad(self.twist), ad(x)
        rates = self.derivatives * (2 * jnp.sum(_part(self.twist, 0, 3) * _part(x, 0, 3), axis=-1, keepdims=True))
        power, change, total = x, rate, rate
        for k in range(4):
            change = lax.optimization_barrier(dot(matrix, change) + dot(moved, power))
            power = lax.optimization_barrier(dot(matrix, power))
            total = total + _part(self.coefficients, k, k + 1) * change + _part(rates, k, k + 1) * power
        return total


def exponential(twist: Twist) -> Exponential:
    """Pose of `exp_se3`, and its tangent."""
    s = _square(twist)
    every, derivatives = jax.jvp(lambda s: _even(s, True), (s,), (jnp.ones_like(s),))
    return Exponential(twist, every[..., 3:], derivatives[..., 3:], *_exp(twist, every[..., :3]))


def to_spatial(R: Array, p: Array, twist: Array) -> Array:
    """Adjoint of a pose: body twist (axis -1) to spatial twist, (R w, R v + p x R w)."""
    w, v = dot(R, _part(twist, 0, 3)), dot(R, _part(twist, 3, 6))
    return jnp.concatenate([w, v + cross(p, w)], axis=-1)


def to_body(R: Array, p: Array, twist: Array) -> Array:
    """Inverse adjoint: spatial twist (axis -1) to body twist, (R^T w, R^T (v + w x p))."""
    w, v = _part(twist, 0, 3), _part(twist, 3, 6)
    return jnp.concatenate([dot_t(R, w), dot_t(R, v - cross(p, w))], axis=-1)


def coadjoint(twist: Twist, momentum: Twist) -> Twist:
    """Gyroscopic wrench -ad^T_V P = (w x m + v x f, w x f) of a body with momentum P = (m, f), body frame."""
    w, v, m, f = _part(twist, 0, 3), _part(twist, 3, 6), _part(momentum, 0, 3), _part(momentum, 3, 6)
    return jnp.concatenate([cross(w, m) + cross(v, f), cross(w, f)], axis=-1)


def rotation_from_quaternion(quaternion: Float[Array, "*batch 4"]) -> Rotation:
    """Rotation of a quaternion (scalar first) of any length but zero."""
    w, u = quaternion[..., :1], quaternion[..., 1:]
    n = 1 / jnp.sum(quaternion**2, axis=-1)[..., None, None]
    K = skew(u)
    return jnp.eye(3) + 2 * n * (w[..., None] * K + matmul3(K, K))


def quaternion_of(R: Float[Array, "3 3"]) -> Float[Array, "4"]:
    """Unit quaternion (scalar first) of a rotation: the row of 4 q q^T with the largest diagonal (Shepperd 1978)."""
    trace = jnp.trace(R)
    u = jnp.stack([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    inner = R + R.T + (1 - trace) * jnp.eye(3)
    rows = jnp.concatenate([jnp.append(1 + trace, u)[None], jnp.concatenate([u[:, None], inner], axis=1)])
    k = jnp.argmax(jnp.diagonal(rows))
    return rows[k] / (2 * jnp.sqrt(rows[k, k]))


def rotation_from_rpy(angles: Vector) -> Rotation:
    """Rz(yaw) Ry(pitch) Rx(roll) from (roll, pitch, yaw) [rad]."""
    roll, pitch, yaw = (rotation_about(jnp.eye(3)[i], angles[..., i]) for i in range(3))
    return matmul3(yaw, matmul3(pitch, roll))


def quaternion_from_rpy(angles: Float[Array, "3"]) -> Float[Array, "4"]:
    """Unit quaternion (scalar first) of Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, cp, cy), (sr, sp, sy) = jnp.cos(angles / 2), jnp.sin(angles / 2)
    return jnp.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


def safe_norm(x: Array) -> Array:
    """Euclidean length along the last axis with derivative 0 at 0."""
    s = jnp.sum(x * x, axis=-1)
    zero = s == 0
    return jnp.where(zero, 0.0, jnp.sqrt(jnp.where(zero, 1.0, s)))
