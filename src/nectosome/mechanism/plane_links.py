"""The links of a robot that moves in the plane: how they move, and what loads do to them."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Load, Strips, Water, se2

from .links import Link


class Body(eqx.Module):
    """A link as it lies when all joints are at 0, along the axes of the world."""

    offset: se2.Vector  # of its joint from the parent's root [m]
    slides: tuple[se2.Vector, ...]  # along which its joint slides
    turn: tuple[Array, ...]  # sense in which its joint turns about z; () where it does not
    inertia: se2.Inertia  # about its root, with the water it carries


class Moving(NamedTuple):
    """A link as it moves."""

    heading: se2.Vector  # cosine and sine of the angle it has turned by
    place: se2.Vector  # of its root [m]
    step: se2.Vector  # from its parent's root [m]
    twist: se2.Twist
    bias: se2.Twist  # acceleration that comes with velocities and with prescribed joints
    motions: tuple[se2.Twist, ...]  # of its joint, one a coordinate


class Alike(eqx.Module):
    """Links of one structure and the loads on them, one after another along the first axis: computed together."""

    body: Link
    loads: tuple[Load, ...]
    rotation: Float[Array, "*m n 3 3"]
    position: Float[Array, "*m n 3"]
    inertia: Float[Array, "*m n 6 6"]

    def wrenches(self, t: Array, links: list[Moving], water: Water) -> list[se2.Wrench]:
        """What the loads do to the links about their roots, world axes."""
        moves = jnp.stack([jnp.stack([*link.heading, *link.place, *link.twist]) for link in links])
        total = jax.vmap(lambda one, move: loaded(one, t, move, water))(self, moves)
        return [tuple(row) for row in total]


def world() -> Moving:
    """What the first link hangs on: it does not move."""
    zero = jnp.zeros(())
    still, origin = (zero, zero, zero), (zero, zero)
    return Moving((jnp.ones(()), zero), origin, origin, still, still, ())


def turned_by(body: Body, q: Array) -> se2.Number:
    """Angle [rad] by which the joint has turned the link against its parent."""
    return body.turn[0] * q[-1] if body.turn else jnp.zeros(())


def moved(body: Body, before: Moving, turn: se2.Vector, q: Array, v: Array, a: Array | None) -> Moving:
    """Link behind a joint with coordinates q, which turn it so, and velocities v; a of a joint that is prescribed."""
    zero = jnp.zeros(())
    w = before.twist[0]
    x, y = se2.turned(before.heading, body.offset)
    for i, axis in enumerate(body.slides):
        ex, ey = se2.turned(before.heading, axis)
        x, y = x + q[i] * ex, y + q[i] * ey
    step, heading, spin = (x, y), before.heading, zero
    if body.turn:
        (sense,) = body.turn
        heading = se2.turned(heading, turn)
        spin = sense * v[-1]
    # velocities are along axes that turn with the link
    motions: list[se2.Twist] = [(zero, *se2.turned(heading, axis)) for axis in body.slides]
    gone = spin, zero, zero
    for i, S in enumerate(motions):
        gone = se2.add(gone, se2.scale(v[i], S))
    twist = se2.add(se2.carried(before.twist, step), gone)
    bias = zero, -w * w * x - (2 * w + spin) * gone[2], -w * w * y + (2 * w + spin) * gone[1]
    motions += [(sense, zero, zero) for sense in body.turn]
    if a is not None:
        for i, S in enumerate(motions):
            bias = se2.add(bias, se2.scale(a[i], S))
    place = before.place[0] + x, before.place[1] + y
    return Moving(heading, place, step, twist, bias, tuple(motions))


def loaded(alike: Alike, t: Array, moves: Float[Array, "7"], water: Water) -> Float[Array, "3"]:
    """Wrench of all loads on one link that moves as it says: heading, place, twist."""
    body, R, at = alike.body, alike.rotation, alike.position
    c, s, X, Y, w, x, y = moves
    # along axes that turn with the link
    x, y = c * x + s * y - w * at[:, 1], c * y - s * x + w * at[:, 0]
    Rx, Ry, Rz = R[:, 0], R[:, 1], R[:, 2]
    place = [X + c * at[:, 0] - s * at[:, 1], Y + s * at[:, 0] + c * at[:, 1], at[:, 2]]
    strips = Strips(
        rotation=jnp.stack([c * Rx - s * Ry, s * Rx + c * Ry, Rz], axis=1),
        position=jnp.stack(place, axis=1),
        angular_velocity=Rz * w,
        velocity=Rx * x[:, None] + Ry * y[:, None],
        x=body.x,
        weight=body.weight,
        half_width=body.half_width,
        volume=body.volume,
        inertia=alike.inertia,
    )
    wrenches = [load.force(t, strips, (), water)[0] for load in alike.loads]
    total = sum((wrench for wrench in wrenches if wrench is not None), jnp.zeros((at.shape[0], 6)))
    fx, fy = _dot(Rx, total[:, 3:]), _dot(Ry, total[:, 3:])
    m = _dot(Rz, total[:, :3]) + at[:, 0] * fy - at[:, 1] * fx
    fx, fy = jnp.sum(fx), jnp.sum(fy)
    return jnp.stack([jnp.sum(m), c * fx - s * fy, s * fx + c * fy])


def _dot(a: Float[Array, "n 3"], b: Float[Array, "n 3"]) -> Float[Array, "n"]:
    """Products of rows, number by number: XLA skips those that are 0 whatever the motion."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]
