r"""Motion in the plane, number by number: each is a scalar of its own, so that batches of them fill vector registers.

A twist is (w, x, y): angular velocity about z, and the velocity of a point; a wrench (m, x, y): moment about the point,
and force; all along the axes of the world. An inertia is symmetric: (zz, zx, zy, xx, xy, yy).
"""

from jaxtyping import Array, Float

Number = Float[Array, ""]
Vector = tuple[Number, Number]
Twist = tuple[Number, Number, Number]
Wrench = tuple[Number, Number, Number]
Inertia = tuple[Number, Number, Number, Number, Number, Number]


def turned(heading: Vector, x: Vector) -> Vector:
    """R x, with the heading (cos, sin)."""
    c, s = heading
    return c * x[0] - s * x[1], s * x[0] + c * x[1]


def dot(a: Twist, b: Wrench) -> Number:
    """Power a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def add(a: Twist, b: Twist) -> Twist:
    """Sum of two."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def scale(s: Number, a: Twist) -> Twist:
    """S times a."""
    return s * a[0], s * a[1], s * a[2]


def carried(twist: Twist, step: Vector) -> Twist:
    """Twist of the same body at a point that lies a step further: (w, v + w x step)."""
    w, x, y = twist
    return w, x - w * step[1], y + w * step[0]


def taken_back(wrench: Wrench, step: Vector) -> Wrench:
    """Wrench about the point that lies a step before: (m + step x f, f)."""
    m, x, y = wrench
    return m + step[0] * y - step[1] * x, x, y


def times(inertia: Inertia, a: Twist) -> Wrench:
    """Inertia times a twist or an acceleration."""
    zz, zx, zy, xx, xy, yy = inertia
    w, x, y = a
    return zz * w + zx * x + zy * y, zx * w + xx * x + xy * y, zy * w + xy * x + yy * y


def turned_inertia(heading: Vector, inertia: Inertia) -> Inertia:
    """Inertia of a body that has turned by the heading."""
    c, s = heading
    zz, zx, zy, xx, xy, yy = inertia
    cc, cs, ss = c * c, c * s, s * s
    return (
        zz,
        *turned(heading, (zx, zy)),
        cc * xx - 2 * cs * xy + ss * yy,
        cs * (xx - yy) + (cc - ss) * xy,
        ss * xx + 2 * cs * xy + cc * yy,
    )


def inertia_before(inertia: Inertia, step: Vector) -> Inertia:
    """Inertia about the point that lies a step before."""
    zz, zx, zy, xx, xy, yy = inertia
    dx, dy = step
    x, y = zx - dy * xx + dx * xy, zy - dy * xy + dx * yy
    return zz - dy * zx + dx * zy - dy * x + dx * y, x, y, xx, xy, yy


def sum_of(a: Inertia, b: Inertia) -> Inertia:
    """Sum of two inertias."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


def freed(inertia: Inertia, force: Wrench, per: Number) -> Inertia:
    """Inertia less force force^T / per: what is left of it along the other motions."""
    m, x, y = force
    zz, zx, zy, xx, xy, yy = inertia
    a, b, c = m / per, x / per, y / per
    return zz - a * m, zx - a * x, zy - a * y, xx - b * x, xy - b * y, yy - c * y


def gyroscopic(twist: Twist, momentum: Wrench) -> Wrench:
    """Rate of momentum of an even motion: (v x f, w x f)."""
    w, x, y = twist
    _, fx, fy = momentum
    return x * fy - y * fx, -w * fy, w * fx
