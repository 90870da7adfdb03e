"""Places of limbs, turned or reflected: 3 x 3 matrices, and the roll, pitch and yaw of a rotation."""

import math
from collections.abc import Sequence

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]


def reflection(axis: str) -> Matrix:
    """Return the reflection in the plane normal to x, y or z."""
    signs = [-1.0 if name == axis else 1.0 for name in "xyz"]
    return ((signs[0], 0.0, 0.0), (0.0, signs[1], 0.0), (0.0, 0.0, signs[2]))


def turn(axis: Sequence[float], angle: float) -> Matrix:
    """Return the rotation about an axis of any length by an angle [rad] (Rodrigues)."""
    size = math.hypot(*axis)
    x, y, z = (component / size for component in axis)
    c, s = math.cos(angle), math.sin(angle)
    d = 1 - c
    return (
        (c + d * x * x, d * x * y - s * z, d * x * z + s * y),
        (d * x * y + s * z, c + d * y * y, d * y * z - s * x),
        (d * x * z - s * y, d * y * z + s * x, c + d * z * z),
    )


def product(a: Matrix, b: Matrix) -> Matrix:
    """Return the matrix product a b."""
    columns = [applied(a, column) for column in zip(*b, strict=True)]
    x, y, z = zip(*columns, strict=True)
    return (x, y, z)


def applied(a: Matrix, v: Sequence[float]) -> Vector:
    """Return the product of a matrix and a vector, what rounding leaves of a zero put to 0."""
    size = 1e-15 * max(map(abs, v))
    x, y, z = (sum(i * j for i, j in zip(row, v, strict=True)) for row in a)
    return (_clean(x, size), _clean(y, size), _clean(z, size))


def from_rpy(rpy: Sequence[float]) -> Matrix:
    """Return the rotation Rz(yaw) Ry(pitch) Rx(roll) [rad]."""
    (cr, cp, cy), (sr, sp, sy) = map(math.cos, rpy), map(math.sin, rpy)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def to_rpy(a: Matrix) -> Vector:
    """Return roll, pitch and yaw [rad] of a rotation.

    The roll is what is left once the yaw is taken off, so that the three fit together where the pitch is 90 deg and
    any yaw would do.
    """
    yaw = math.atan2(a[1][0], a[0][0])
    c, s = math.cos(yaw), math.sin(yaw)
    pitch = math.atan2(-a[2][0], c * a[0][0] + s * a[1][0])
    roll = math.atan2(s * a[0][2] - c * a[1][2], c * a[1][1] - s * a[0][1])
    return (_clean(roll, 1e-15), _clean(pitch, 1e-15), _clean(yaw, 1e-15))


def _clean(value: float, size: float) -> float:
    return 0.0 if abs(value) <= size else value
