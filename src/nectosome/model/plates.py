"""Rigid parts that are plates by their outlines: where their stations are, what these weigh and displace."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from nectosome.core import Stations, Water
from nectosome.core.described import number, vector
from nectosome.description import Rigid
from nectosome.description.plates import PlateShape
from nectosome.mechanism import Link
from nectosome.mechanism.links import spatial_inertia
from nectosome.mechanism.plates import outline_moments, outline_range, outline_widths, plate_inertia


def plate(limb: Rigid, shape: PlateShape, water: Water) -> tuple[Link, Stations]:
    """Plate and its stations: its inertia at the centre of its area, strips across x for loads per length.

    A strip sits in the middle of the plate's width there. Strips also carry the uplift under a surface, since the whole
    has no closed form.
    """
    points, thickness, upright = jnp.asarray(shape.outline, float), number(shape.thickness), shape.plane == "xz"
    moments, (start, end) = outline_moments(points), outline_range(points)
    length, area = end - start, moments.area
    strips = water.surface is not None or any(load.per_length for load in limb.loads.values())
    n = limb.strips if strips else 0
    s, w = np.polynomial.legendre.leggauss(max(n, 1))
    s, share = 0.5 * (s + 1)[:n], 0.5 * w[:n]
    width, middle = outline_widths(points, start + length * s)

    def across(in_plane, normal):
        """Two columns, along y and z."""
        return jnp.stack([normal, in_plane] if upright else [in_plane, normal], axis=-1)

    position = jnp.concatenate([moments.centre[None], jnp.stack([start + length * s, middle], axis=-1)])
    position = jnp.concatenate([position[:, :1], across(position[:, 1], jnp.zeros(n + 1))], axis=1)
    in_plane = jnp.concatenate([(area / length)[None], width])
    half_width = 0.5 * across(in_plane, jnp.broadcast_to(thickness, (n + 1,)))

    whole = area * thickness
    volume = whole if limb.volume is None else number(limb.volume)
    mass = number(limb.mass) if limb.mass is not None else number(limb.density) * whole
    along = jnp.concatenate([jnp.zeros(1), share * width])
    by_strips = water.surface is not None
    split = volume * along / jnp.sum(along) if by_strips else jnp.zeros(n + 1).at[0].set(volume)
    about = plate_inertia(mass, moments, thickness, upright)
    if limb.inertia is not None:
        xy, xz, yz = jnp.zeros(3) if limb.products is None else vector(limb.products)
        about = jnp.diag(vector(limb.inertia)) + jnp.array([[0.0, xy, xz], [xy, 0.0, yz], [xz, yz, 0.0]])
    own = spatial_inertia(mass, about, vector(limb.centre_of_mass))
    x = length * np.concatenate([[0.5], s])
    weight = length * np.concatenate([[0.0], share])
    inertia = jnp.zeros((n + 1, 6, 6)).at[0].set(own)
    stations = Stations.along(x, weight, half_width, split, inertia, jnp.zeros(n + 1))
    stations = eqx.tree_at(lambda s: s.half_length, stations, stations.half_length.at[0].set(0.5 * length))
    rotation = jnp.broadcast_to(jnp.eye(3), (n + 1, 3, 3))
    return Link(rotation, position, jnp.eye(3), jnp.stack([end, *jnp.zeros(2)])), stations
