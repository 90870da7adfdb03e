"""From the pairs of a description to what acts between two parts."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome import loads as ld
from nectosome.core.se3 import compose, dot_t, matmul3, rotation_from_rpy
from nectosome.description import pairs as dr
from nectosome.description import parts as dp
from nectosome.mechanism import Link, SoftRod
from nectosome.mechanism.links import axis_poses

from .build_base import is_zero, node, number, vector

_Parts = Mapping[str, dp.Rigid | dp.Rod]
_Bodies = Mapping[str, Link | SoftRod]


def pair_of(pair: dr.BushingPair | dr.ContactPair, limbs: _Parts, bodies: _Bodies) -> ld.Bushing | ld.PartContact:
    """Pair of a description; `limbs` and `bodies` are the parts by name."""
    if isinstance(pair, dr.BushingPair):
        places = zip(pair.between, pair.at, pair.offset, strict=True)
        first, second = (_end(bodies[name], at, vector(offset)) for name, at, offset in places)
        turned = matmul3(first.rotation, rotation_from_rpy(vector(pair.rotation)))
        numbers = ("stiffness", "damping", "turning_stiffness", "turning_damping")
        return ld.Bushing(ld.BushingEnd(first.at, turned), second, *(number(getattr(pair, n)) for n in numbers))
    first, second = (limbs[name] for name in pair.between)
    beads, share = _sampled(first, bodies[pair.between[0]])
    return ld.PartContact(
        beads=beads,
        share=share,
        chain=_chain(second, bodies[pair.between[1]]),
        **{n: number(getattr(pair, n)) for n in ("stiffness", "damping", "softness")},
        friction=ld.Friction(*(number(getattr(pair, n)) for n in ("static_friction", "dynamic_friction", "creep"))),
    )


def _end(body: Link | SoftRod, at: str | float, offset: Float[Array, "3"]) -> ld.BushingEnd:
    """Where a tie holds on: a node of a rod, or a place of a link against its centre."""
    if isinstance(body, SoftRod):
        station = body.weight.shape[0] - 1 if at == "tip" else node(body, at)
        return ld.BushingEnd(ld.AttachedPlaces((station,), offset[None]), jnp.eye(3))
    base = (body.tip_rotation, body.tip_position) if at == "tip" else (jnp.eye(3), jnp.zeros(3))
    R, p = compose(base, (jnp.eye(3), offset))
    return ld.BushingEnd(_on_centre(body, p[None]), matmul3(body.rotation[0].T, R))


def _on_centre(body: Link, places: Float[Array, "m 3"]) -> ld.AttachedPlaces:
    """Places in a rigid part's frame, fixed to its centre."""
    return ld.AttachedPlaces((0,) * places.shape[0], dot_t(body.rotation[0], places - body.position[0]))


def _sampled(limb: dp.Rigid | dp.Rod, body: Link | SoftRod) -> tuple[ld.Beads, Float[Array, "m"]]:
    """Beads of the part that feels the other, and the share of its length that each stands for."""
    if isinstance(body, SoftRod):
        return _rod_beads(body), body.weight / body.length
    assert isinstance(limb, dp.Rigid)
    if limb.shape == "spheroid":
        return ld.Beads(ld.AttachedPlaces((0,), jnp.zeros((1, 3))), number(limb.radius)[None]), jnp.ones(1)
    s, w = np.polynomial.legendre.leggauss(limb.strips)
    return _cylinder_beads(limb, body, 0.5 * (s + 1)), jnp.asarray(0.5 * w)


def _chain(limb: dp.Rigid | dp.Rod, body: Link | SoftRod) -> ld.Beads:
    """Nodes of the part that is felt; a sphere has the same one twice, a straight cylinder its ends."""
    if isinstance(body, SoftRod):
        return _rod_beads(body)
    assert isinstance(limb, dp.Rigid)
    if limb.shape == "spheroid":
        return ld.Beads(ld.AttachedPlaces((0, 0), jnp.zeros((2, 3))), number(limb.radius) * jnp.ones(2))
    return _cylinder_beads(limb, body, np.linspace(0.0, 1.0, 2 if is_zero(limb.bend) else limb.strips + 1))


def _rod_beads(body: SoftRod) -> ld.Beads:
    n = body.weight.shape[0]
    return ld.Beads(ld.AttachedPlaces(tuple(range(n)), jnp.zeros((n, 3))), 0.5 * jnp.sum(body.half_width, axis=1))


def _cylinder_beads(limb: dp.Rigid, body: Link, fractions: Float[np.ndarray, "m"]) -> ld.Beads:
    _, p = axis_poses(number(limb.length), number(limb.bend), fractions)
    return ld.Beads(_on_centre(body, p), number(limb.radius) * jnp.ones(fractions.size))
