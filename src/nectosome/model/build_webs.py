"""From a description to the strips of a web: where they lie between the limbs, and how much of the sheet each has."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome import loads as ld
from nectosome.core import Stations
from nectosome.core.described import number
from nectosome.core.se3 import dot, dot_t, matmul3
from nectosome.description import Rigid, RobotDescription, Rod
from nectosome.description.webs import WebDescription
from nectosome.loads.places import Carrier, SheetCarrier, WebGaps
from nectosome.mechanism import Fixed, Robot, TreePart, Web
from nectosome.mechanism.parts import poses
from nectosome.mechanism.rods import gauss, grid
from nectosome.mechanism.tree import PartShape, Tree
from nectosome.mechanism.webs import ACROSS, sheet_reach
from nectosome.units import InputError, show_quantity

_POINTS = 5  # along webs between rigid parts


class _Rail(NamedTuple):
    """Places along a limb, from its root to its tip, at which strips of webs are fixed."""

    station: tuple[int, ...]  # of the robot, on which each is
    place: Float[Array, "n 3"]  # of the limb's axis on that station, in its frame [m]
    along: Float[Array, "n 3"]  # direction of the limb, in the same frame
    half_width: Float[Array, "n 2"]  # of the limb there [m]
    x: Float[Array, "n"]  # from the root [m]
    weight: Float[Array, "n"]  # length of a strip [m]
    length: Float[Array, ""]


def web_part(
    name: str, web: WebDescription, carriers: Mapping[str, Carrier], tree: Tree, shape: PartShape
) -> tuple[TreePart, SheetCarrier, ld.Membrane]:
    """A web as a part of the robot, as its loads see it, and its tension.

    `tree` has the limbs, and `shape` their poses with rods unbent.

    Two strips across each gap, at Gauss points, have mass and loads exactly where these are even across.
    """
    limbs = {limb: carriers[limb] for limb in web.between if limb in carriers}
    s, w = _along([carrier.limb for carrier in limbs.values()])
    rails = {limb: _rail(carrier, tree, limb, s, w) for limb, carrier in limbs.items()}
    to_all = _images(web, tree)
    if to_all is None:
        joined, to_next = web.gaps, None
    else:
        (kept,) = limbs
        joined, to_next = ((kept, kept),), to_all[1]
    gaps = [_gap(rails[one], rails[other], shape, to_next) for one, other in joined]
    first, second = ([rails[gap[k]] for gap in joined] for k in (0, 1))

    def two(values: Sequence[Array] | Array) -> Array:
        """Values of the places of each gap, of both strips across."""
        return jnp.repeat(jnp.concatenate([*values]), 2, axis=0)

    width = jnp.stack([gap.width for gap in gaps])  # [gaps, n]
    x = jnp.stack([0.5 * (a.x + b.x) for a, b in zip(first, second, strict=True)])
    weight = jnp.stack([0.5 * (a.weight + b.weight) for a, b in zip(first, second, strict=True)])
    length = jnp.stack([0.5 * (a.length + b.length) for a, b in zip(first, second, strict=True)])[:, None]
    apart = jnp.stack([gap.width + gap.edges[0] + gap.edges[1] for gap in gaps])
    rest = jnp.cumsum(apart, axis=0) - apart + jnp.stack([gap.edges[0] for gap in gaps]) + gaps[0].edges[0]
    whole = jnp.sum(apart, axis=0) + gaps[0].edges[0] + gaps[-1].edges[1]  # with the limbs at both sides
    to_sides = _mean_root(rest, width, whole)
    ends = (length - x) * (length + x if web.root == "closed" else x)
    to_ends = jnp.broadcast_to(jnp.sqrt(ends)[:, :, None], to_sides.shape)
    chord = length * (2.0 if web.root == "closed" else 1.0)
    reach = to_ends if web.closed else sheet_reach(to_ends, to_sides)
    short = jnp.broadcast_to(chord if web.closed else jnp.minimum(chord, whole), width.shape)

    unstressed = width * (1 + number(web.slack))
    thickness, density = number(web.thickness), number(web.density)
    volume = 0.5 * thickness * unstressed * weight
    inertia = density * two(volume)[:, None, None] * jnp.diag(jnp.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]))
    half = jnp.stack([0.25 * two(width), jnp.full(2 * width.size, 0.5 * thickness)], axis=-1)
    body = Web(
        place=two([jnp.stack([gap.first, gap.second], axis=1) for gap in gaps]),
        along=two([jnp.stack([a.along, b.along], axis=1) for a, b in zip(first, second, strict=True)]),
    )
    if to_next is not None:
        body = replace(body, to_next=jnp.broadcast_to(to_next, (2 * width.size, 3, 4)))
    between = [pair for a, b in zip(first, second, strict=True) for pair in zip(a.station, b.station, strict=True)]
    stations = Stations.along(two(x), two(weight), half, two(volume), inertia, 0.0)
    part = TreePart(
        name=name,
        parent=tree.part(next(iter(limbs))),  # by which it belongs to a root
        node=-1,
        rotation=jnp.eye(3),
        position=jnp.zeros(3),
        joint=Fixed(),
        body=body,
        stations=stations,
        between=tuple(pair for pair in between for _ in ACROSS),
    )
    carried = 4 * reach.ravel() * half[:, 0] * stations.weight
    rows = tuple(np.repeat(np.arange(width.size), len(ACROSS)).tolist())
    where = WebGaps(reach.ravel(), jnp.mean(length), s, to_all)
    stretched = number(web.young) * thickness * weight.ravel()
    return (
        part,
        SheetCarrier(stations, carried, jnp.zeros_like(carried), two(short), rows, where),
        ld.Membrane(stretched, unstressed.ravel()),
    )


def check_gaps(description: RobotDescription, robot: Robot) -> None:
    """Raise InputError where limbs overlap, so that a web of the robot built from a description has no gap there."""
    for name, web in description.webs.items():
        part = next(i for i, part in enumerate(robot.tree.structure) if part.name == name)
        here = robot.tree.layout[part].stations
        nowhere = np.flatnonzero(np.isnan(np.asarray(robot.tree.stations.half_width)[here, 0]))
        if nowhere.size:
            count = here.stop - here.start
            one, other = web.gaps[nowhere[0] * len(web.gaps) // count]
            place = show_quantity(float(robot.tree.stations.x[here.start + nowhere[0]]), "length")
            words = f"there is no gap for a sheet between {one} and {other}: they overlap at {place} from their roots"
            raise InputError(f"{words}. Move these apart, or make the limbs narrower.", field=f"webs.{name}")


class _Gap(NamedTuple):
    """The space between two limbs at each place along them."""

    first: Float[Array, "n 3"]  # of the edge at the first limb, on its station [m]
    second: Float[Array, "n 3"]
    width: Float[Array, "n"]  # between the edges, across the limbs [m]
    edges: tuple[Float[Array, "n"], Float[Array, "n"]]  # from the axes of the limbs to the edges there [m]


def _images(web: WebDescription, tree: Tree) -> Float[Array, "n 3 4"] | None:
    """Rotations and shifts in the world from a limb that stands for all of a ring to each of them; None of others."""
    if web.turn is None:
        return None
    root = tree.one(0)
    turn, found = matmul3(matmul3(root.rotation, jnp.asarray(web.turn)), root.rotation.T), [jnp.eye(3)]
    for _ in web.between[1:]:
        found.append(matmul3(turn, found[-1]))
    return jnp.stack([poses(R, root.position - dot(R, root.position)) for R in found])


def _gap(a: _Rail, b: _Rail, shape: PartShape, to_next: Float[Array, "3 4"] | None) -> _Gap:
    """Edges lie on the limbs' sections, taken as ellipses, where these face each other."""
    (Ra, pa), (Rb, pb) = _placed(a, shape), _placed(b, shape)
    if to_next is not None:
        Rb, pb = matmul3(to_next[:, :3], Rb), dot(to_next[:, :3], pb) + to_next[:, 3]
    way = pb - pa
    first, second = _towards(a, dot_t(Ra, way)), _towards(b, dot_t(Rb, -way))
    across = pb + dot(Rb, second) - pa - dot(Ra, first)
    along = dot(Ra, a.along) + dot(Rb, b.along)
    width = jnp.linalg.norm(jnp.cross(along, across), axis=-1) / jnp.linalg.norm(along, axis=-1)
    width = jnp.where(jnp.sum(across * way, axis=-1) > 0, width, jnp.nan)  # sections that overlap: see `check_gaps`
    edges = jnp.linalg.norm(first, axis=-1), jnp.linalg.norm(second, axis=-1)
    return _Gap(a.place + first, b.place + second, width, edges)


def _mean_root(
    start: Float[Array, "gaps n"], width: Float[Array, "gaps n"], whole: Float[Array, "n"]
) -> Float[Array, "gaps n 2"]:
    """Mean of the root of the distances y and W - y to the sides of a sheet over both halves of each gap [m]."""
    half = 0.5 * whole
    u = start[..., None] + width[..., None] * jnp.array([0.0, 0.5, 1.0]) - half[:, None]
    area = 0.5 * (u * jnp.sqrt(half[:, None] ** 2 - u**2) + half[:, None] ** 2 * jnp.arcsin(u / half[:, None]))
    return jnp.diff(area, axis=-1) / (0.5 * width[..., None])


def _placed(rail: _Rail, shape: PartShape) -> tuple[Array, Array]:
    here = np.asarray(rail.station)
    R = shape.rotation[here]
    return R, shape.position[here] + dot(R, rail.place)


def _towards(rail: _Rail, way: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """From the axis to the edge of an elliptic section in a direction, in the frame of the station [m]."""
    across = way - jnp.sum(way * rail.along, axis=-1, keepdims=True) * rail.along
    unit = across / jnp.linalg.norm(across, axis=-1, keepdims=True)
    (ry, rz), (y, z) = rail.half_width.T, unit[:, 1:].T
    under = (y * rz) ** 2 + (z * ry) ** 2
    there = under > 0
    r = jnp.where(there, ry * rz / jnp.sqrt(jnp.where(there, under, 1.0)), 0.0)
    return r[:, None] * unit


def _along(limbs: Sequence[Rigid | Rod]) -> tuple[np.ndarray, np.ndarray]:
    """Fractions of the length at which strips lie, and their shares: of rods, which are alike, else Gauss points."""
    rod = next((limb for limb in limbs if isinstance(limb, Rod)), None)
    if rod is None:
        return gauss(_POINTS, ())
    found = grid(rod.points, rod.marks, rod.steps)
    carries = found.weights > 0
    return found.nodes[carries], found.weights[carries]


def _rail(carrier: Carrier, tree: Tree, name: str, s: np.ndarray, w: np.ndarray) -> _Rail:
    start, n, ex = tree.layout[tree.part(name)].stations.start, len(s), jnp.eye(3)[0]
    length = number(carrier.limb.length)
    if isinstance(carrier.limb, Rod):
        own = np.searchsorted(carrier.rod.nodes, s)
        place, along, half = jnp.zeros((n, 3)), jnp.tile(ex, (n, 1)), carrier.stations.half_width[own]
        station = tuple(start + own)
    else:
        place = carrier.from_centre(length * jnp.asarray(s)[:, None] * ex)
        along = jnp.broadcast_to(carrier.at_centre(ex), (n, 3))
        half = jnp.broadcast_to(carrier.stations.half_width[0], (n, 2))
        station = (start,) * n
    return _Rail(tuple(map(int, station)), place, along, half, length * s, length * w, length)
