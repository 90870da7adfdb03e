r"""Planar rigid motions (SE(2)) with scalar components, so that batches of them fill vector registers.

A twist is (w, x, y): angular velocity about z, and velocity of a point; a wrench (m, x, y): moment about the point, and
force; all in world axes. An inertia is symmetric: (zz, zx, zy, xx, xy, yy).
"""

from jaxtyping import Array, Float

Number = Float[Array, ""]
Vector = tuple[Number, Number]
Twist = tuple[Number, Number, Number]
Wrench = tuple[Number, Number, Number]
Inertia = tuple[Number, Number, Number, Number, Number, Number]


def rotate(heading: Vector, x: Vector) -> Vector:
    """Return R x, with the heading (cos, sin)."""
    c, s = heading
    return c * x[0] - s * x[1], s * x[0] + c * x[1]


def dot(a: Twist, b: Wrench) -> Number:
    """Power a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def add(a: Twist, b: Twist) -> Twist:
    """Sum of two twists or wrenches."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def scale(s: Number, a: Twist) -> Twist:
    """Product of a scalar and a twist or wrench."""
    return s * a[0], s * a[1], s * a[2]


def shift_twist(twist: Twist, step: Vector) -> Twist:
    """Twist of the same body at the point displaced by `step`: (w, v + w x step)."""
    w, x, y = twist
    return w, x - w * step[1], y + w * step[0]


def shift_wrench(wrench: Wrench, step: Vector) -> Wrench:
    """Wrench about the point displaced by -`step`: (m + step x f, f)."""
    m, x, y = wrench
    return m + step[0] * y - step[1] * x, x, y


def times(inertia: Inertia, a: Twist) -> Wrench:
    """Inertia times a twist or an acceleration."""
    zz, zx, zy, xx, xy, yy = inertia
    w, x, y = a
    return zz * w + zx * x + zy * y, zx * w + xx * x + xy * y, zy * w + xy * x + yy * y


def rotate_inertia(heading: Vector, inertia: Inertia) -> Inertia:
    """Inertia of a body rotated by the heading."""
    c, s = heading
    zz, zx, zy, xx, xy, yy = inertia
    cc, cs, ss = c * c, c * s, s * s
    return (
        zz,
        *rotate(heading, (zx, zy)),
        cc * xx - 2 * cs * xy + ss * yy,
        cs * (xx - yy) + (cc - ss) * xy,
        ss * xx + 2 * cs * xy + cc * yy,
    )


def shift_inertia(inertia: Inertia, step: Vector) -> Inertia:
    """Inertia about the point displaced by -`step`."""
    zz, zx, zy, xx, xy, yy = inertia
    dx, dy = step
    x, y = zx - dy * xx + dx * xy, zy - dy * xy + dx * yy
    return zz - dy * zx + dx * zy - dy * x + dx * y, x, y, xx, xy, yy


def add_inertias(a: Inertia, b: Inertia) -> Inertia:
    """Sum of two inertias."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


def project_inertia(inertia: Inertia, force: Wrench, per: Number) -> Inertia:
    """Articulated inertia without one motion: inertia - force force^T / per."""
    m, x, y = force
    zz, zx, zy, xx, xy, yy = inertia
    a, b, c = m / per, x / per, y / per
    return zz - a * m, zx - a * x, zy - a * y, xx - b * x, xy - b * y, yy - c * y


def gyroscopic(twist: Twist, momentum: Wrench) -> Wrench:
    """Rate of momentum at a constant twist: (v x f, w x f)."""
    w, x, y = twist
    _, fx, fy = momentum
    return x * fy - y * fx, -w * fy, w * fx
