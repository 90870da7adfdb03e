"""Links of a planar robot: their motion, and the forces of loads on them."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Load, Strips, Water, se2

from .links import Link


class PlaneBody(eqx.Module):
    """A link with all parts fixed to it, at zero joint coordinates, in the axes of the plane."""

    part: int = eqx.field(static=True)  # of the robot
    parent: int = eqx.field(static=True)  # body, or -1
    offset: se2.Vector  # of its joint from the parent's root [m]
    slides: tuple[se2.Vector, ...]  # sliding axes of its joint
    turn: tuple[Array, ...]  # sense of its joint's rotation about z; () without rotation
    inertia: se2.Inertia  # about its root, with added mass


class MovingLink(NamedTuple):
    """Motion of a link."""

    heading: se2.Vector  # cosine and sine of its rotation
    place: se2.Vector  # of its root [m]
    step: se2.Vector  # from its parent's root [m]
    twist: se2.Twist
    bias: se2.Twist  # acceleration due to velocities and prescribed joints
    motions: tuple[se2.Twist, ...]  # of its joint, one per coordinate


class LinkBatch(eqx.Module):
    """Links of one structure and their loads, stacked along the first axis for one vectorised call."""

    body: Link
    loads: tuple[Load, ...]
    plane: Float[Array, "*m 3 3"]  # axes of the plane in the world, as columns
    rotation: Float[Array, "*m n 3 3"]  # of the stations, to the axes of the plane
    position: Float[Array, "*m n 3"]
    inertia: Float[Array, "*m n 6 6"]

    def link_forces(
        self, t: Array, links: list[MovingLink], states: list[tuple[Any, ...]], water: Water
    ) -> list["LinkForces"]:
        """Forces of the loads on each link."""
        moves = jnp.stack([jnp.stack([*link.heading, *link.place, *link.twist]) for link in links])
        if len(links) == 1:
            return [forces_on_link(jax.tree.map(lambda x: x[0], self), t, moves[0], states[0], water)]
        z = jax.tree.map(lambda *x: jnp.stack(x), *states)
        found = jax.vmap(lambda one, move, z: forces_on_link(one, t, move, z, water))(self, moves, z)
        return [jax.tree.map(lambda x, k=k: x[k], found) for k in range(len(links))]


class LinkForces(NamedTuple):
    """Forces of loads on one link, about its root."""

    wrench: se2.Wrench  # in the axes of the plane
    carried: se2.Inertia | None  # variable added mass, at zero joint coordinates; None without any
    rates: tuple[Any, ...]  # of the loads' states


def ground() -> MovingLink:
    """Fixed base of the first link."""
    zero = jnp.zeros(())
    still, origin = (zero, zero, zero), (zero, zero)
    return MovingLink((jnp.ones(()), zero), origin, origin, still, still, ())


def joint_angle(body: PlaneBody, q: Array) -> se2.Number:
    """Angle [rad] of a rotating joint."""
    return body.turn[0] * q[-1]


def link_motion(
    body: PlaneBody, before: MovingLink, turn: se2.Vector | None, q: Array, v: Array, a: Array | None
) -> MovingLink:
    """Motion of a link by its joint: coordinates q, heading change `turn`, velocities v; a of a prescribed joint."""
    zero = jnp.zeros(())
    w = before.twist[0]
    x, y = se2.rotate(before.heading, body.offset)
    for i, axis in enumerate(body.slides):
        ex, ey = se2.rotate(before.heading, axis)
        x, y = x + q[i] * ex, y + q[i] * ey
    step, heading, spin = (x, y), before.heading, zero
    if turn is not None:
        (sense,) = body.turn
        heading = se2.rotate(heading, turn)
        spin = sense * v[-1]
    # velocities are in axes that rotate with the link
    motions: list[se2.Twist] = [(zero, *se2.rotate(heading, axis)) for axis in body.slides]
    gone = spin, zero, zero
    for i, S in enumerate(motions):
        gone = se2.add(gone, se2.scale(v[i], S))
    twist = se2.add(se2.shift_twist(before.twist, step), gone)
    bias = zero, -w * w * x - (2 * w + spin) * gone[2], -w * w * y + (2 * w + spin) * gone[1]
    motions += [(sense, zero, zero) for sense in body.turn]
    if a is not None:
        for i, S in enumerate(motions):
            bias = se2.add(bias, se2.scale(a[i], S))
    place = before.place[0] + x, before.place[1] + y
    return MovingLink(heading, place, step, twist, bias, tuple(motions))


def forces_on_link(
    alike: LinkBatch, t: Array, moves: Float[Array, "7"], z: tuple[Any, ...], water: Water
) -> LinkForces:
    """Forces of all loads with states z on one link with the motion (heading, position, twist)."""
    body, R, at = alike.body, alike.rotation, alike.position
    c, s, X, Y, w, x, y = moves
    # in axes that rotate with the link
    own = w, c * x + s * y, c * y - s * x
    x, y = own[1] - w * at[:, 1], own[2] + w * at[:, 0]
    Rx, Ry, Rz = R[:, 0], R[:, 1], R[:, 2]
    place = [X + c * at[:, 0] - s * at[:, 1], Y + s * at[:, 0] + c * at[:, 1], at[:, 2]]
    turned = [c * Rx - s * Ry, s * Rx + c * Ry, Rz]
    strips = Strips(
        rotation=jnp.stack([_combined(row, turned) for row in alike.plane], axis=1),
        position=jnp.stack([_combined(row, place) for row in alike.plane], axis=1),
        angular_velocity=Rz * w,
        velocity=Rx * x[:, None] + Ry * y[:, None],
        x=body.x,
        weight=body.weight,
        half_width=body.half_width,
        volume=body.volume,
        inertia=alike.inertia,
    )
    acting = [load.force(t, strips, state, water) for load, state in zip(alike.loads, z, strict=True)]
    wrenches = [wrench for wrench, _ in acting if wrench is not None]
    # by component, so that XLA skips those that are always 0
    total = [sum((wrench[:, i] for wrench in wrenches), jnp.zeros(at.shape[0])) for i in range(6)]
    fx, fy = (_combined(axis.T, total[3:]) for axis in (Rx, Ry))
    m = _combined(Rz.T, total[:3]) + at[:, 0] * fy - at[:, 1] * fx
    m, fx, fy = jnp.sum(m), jnp.sum(fx), jnp.sum(fy)
    carried = None
    for load, state in zip(alike.loads, z, strict=True):
        if load.reshapes:
            now, growth = (about_root(A[None], R[:1], at[:1]) for A in load.carried(t, strips, state, water))
            carried = tuple(now) if carried is None else se2.add_inertias(carried, tuple(now))
            lost = se2.times(tuple(growth), own)
            m, fx, fy = m - lost[0], fx - lost[1], fy - lost[2]
    return LinkForces((m, *se2.rotate((c, s), (fx, fy))), carried, tuple(rate for _, rate in acting))


def _combined(row: Float[Array, "3 *n"], x: list[Array]) -> Array:
    """Linear combination of three arrays."""
    return row[0] * x[0] + row[1] * x[1] + row[2] * x[2]


def about_root(
    inertia: Float[Array, "n 6 6"], rotation: Float[Array, "n 3 3"], position: Float[Array, "n 3"]
) -> Float[Array, "6"]:
    """Inertia of all stations for motions (w, x, y) of the root: an `se2.Inertia`."""
    Rx, Ry, Rz = rotation[:, 0], rotation[:, 1], rotation[:, 2]
    none = jnp.zeros_like(Rx)
    spin = jnp.concatenate([Rz, position[:, :1] * Ry - position[:, 1:2] * Rx], axis=1)
    B = jnp.stack([spin, jnp.concatenate([none, Rx], axis=1), jnp.concatenate([none, Ry], axis=1)], axis=2)
    M = jnp.einsum("nia,nij,njb->ab", B, inertia, B)
    return jnp.stack([M[0, 0], M[0, 1], M[0, 2], M[1, 1], M[1, 2], M[2, 2]])
