"""Where the numbers of each part stand in the arrays of a tree: known while tracing, computed once for a structure.

Numbers of equal things stand together: joints of a class, rods of a structure, signals of a kind. Coordinates,
velocities and stations go part by part.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from nectosome.core.rows import Spread

from .joints import Joint


class PartPlan(NamedTuple):
    """What of a part is structure."""

    name: str
    parent: int
    node: int
    joint: type[Joint]
    strains: tuple[str, ...] | None  # names of a soft body's coordinates; None for a link
    stations: int
    prescribed: bool  # the joint
    prescribed_strains: tuple[int, ...]
    strain_signals: tuple[int, ...]  # how many coordinates each one gives
    star: bool = False  # segments of a soft body start from its root, else one from the other
    between: tuple[tuple[int, int], ...] = ()  # of a web: the stations beside each of its own

    @property
    def link(self) -> bool:
        """Whether it is a rigid body."""
        return self.strains is None and not self.between

    @property
    def own(self) -> int:
        """Number of strain coordinates."""
        return len(self.strains or ())


class TreeLayout(NamedTuple):
    """Slices of a part in the flat arrays."""

    q: slice  # joint coordinates, then rod coordinates
    v: slice
    stations: slice


class Unknown(NamedTuple):
    """Places of unknown coordinates and velocities among the unknown ones, [m, nq] and [m, nv]."""

    q: Int[np.ndarray, "m nq"]
    v: Int[np.ndarray, "m nv"]


class Level(NamedTuple):
    """Parts that are equally far from the world."""

    parts: Int[np.ndarray, "m"]  # places in the order of joints
    parents: Int[np.ndarray, "m"]  # places in the level before


class TreeIndices(NamedTuple):
    """Constant indices of a tree."""

    layout: tuple[TreeLayout, ...]
    free_q: Int[np.ndarray, "nq"]  # unknown ones among all coordinates
    free_v: Int[np.ndarray, "nv"]
    prescribed_v: Int[np.ndarray, "np"]
    complete_q: Int[np.ndarray, "nq"]  # all coordinates in the unknown ones and those of the signals behind them
    complete_v: Int[np.ndarray, "nv"]
    unknown: tuple[Unknown, ...]  # joints of each class
    plain: Unknown  # joints whose coordinates are displacements, and strains
    joint_q: tuple[Int[np.ndarray, "m nq"], ...]
    joint_v: tuple[Int[np.ndarray, "m nv"], ...]
    rod_q: tuple[Int[np.ndarray, "m nq"], ...]
    rod_v: tuple[Int[np.ndarray, "m nq"], ...]
    in_order: Int[np.ndarray, "parts"]  # the place of each part in the order of joints, class by class
    bases: Int[np.ndarray, "parts"]  # of joints, among the world, tips of links and nodes of rods
    levels: tuple[Level, ...]
    after_levels: Int[np.ndarray, "parts"]  # from the order of levels to that of joints
    owners: Int[np.ndarray, "n"]  # place in the order of joints, of stations link by link, then rod by rod
    stations: Int[np.ndarray, "n"]  # part by part, among those
    frames: Int[np.ndarray, "k"]  # of segments, among roots in the order of joints and stations link by link, ...
    before_segment: Float[np.ndarray, "k k"]  # segments before each segment
    before_station: Float[np.ndarray, "n k"]  # segments before or at each station of links and rods
    to_v: Spread  # from joints class by class, then rods, to all velocities
    rods_to_v: Spread  # from rods
    part_of_station: Int[np.ndarray, "n"]
    beside: Int[np.ndarray, "w 2"]  # stations beside each one of webs, which come last


@cache
def indices_of(
    parts: tuple[PartPlan, ...],
    joints: tuple[tuple[int, ...], ...],
    rods: tuple[tuple[int, ...], ...],
    motions: tuple[tuple[int, ...], ...],
    strain_motions: tuple[tuple[tuple[int, int], ...], ...],
) -> TreeIndices:
    """Of parts, which are grouped by classes of joints, structures of rods and kinds of signals."""
    layout = _layout(parts)
    nq, nv, n = layout[-1].q.stop, layout[-1].v.stop, layout[-1].stations.stop
    free_q, free_v = (_unknown(parts, layout, what) for what in "qv")
    order = np.array([i for members in joints for i in members], dtype=int)
    in_order = np.argsort(order)
    joint_q, joint_v = ([_joint(parts, layout, members, what) for members in joints] for what in "qv")
    rod_q, rod_v = ([_strains(parts, layout, members, what) for members in rods] for what in "qv")

    among = {
        what: np.searchsorted(free, np.arange(size)) for what, free, size in (("q", free_q, nq), ("v", free_v, nv))
    }
    unknown, plain = [], ([], [])
    for members in joints:
        some = tuple(i for i in members if not parts[i].prescribed)
        at = Unknown(*(among[what][_joint(parts, layout, some, what)] for what in "qv"))
        ordinary = parts[members[0]].joint.plain
        unknown.append(Unknown(at.q[:0], at.v[:0]) if ordinary else at)
        if ordinary:
            plain[0].append(at.q.ravel())
            plain[1].append(at.v.ravel())
    for i, part in enumerate(parts):
        if part.own:
            left = np.setdiff1d(np.arange(part.own), part.prescribed_strains).astype(int)
            plain[0].append(among["q"][layout[i].q.start + part.joint.nq + left])
            plain[1].append(among["v"][layout[i].v.start + part.joint.nv + left])

    levels, bases = _levels(parts, order, in_order), _bases(parts, order, rods)
    walked = np.concatenate([level.parts for level in levels])
    by_kind = [i for i, part in enumerate(parts) if part.link] + [i for members in rods for i in members]
    beside = np.array([two for part in parts for two in part.between], dtype=int).reshape(-1, 2)
    of_kind = np.concatenate([np.arange(n)[layout[i].stations] for i in by_kind])
    station_of_kind = np.argsort(of_kind)
    frames = [np.arange(len(parts))]
    for i in (i for members in rods for i in members):
        own = np.arange(n)[layout[i].stations]
        frames.append(len(parts) + station_of_kind[np.full(own.size - 1, own[0]) if parts[i].star else own[:-1]])
    before_segment, before_station = _ancestors(parts, layout, in_order, rods)
    return TreeIndices(
        layout=layout,
        free_q=free_q,
        free_v=free_v,
        prescribed_v=np.setdiff1d(np.arange(nv), free_v).astype(int),
        complete_q=_complete(parts, layout, "q", free_q, nq, motions, strain_motions),
        complete_v=_complete(parts, layout, "v", free_v, nv, motions, strain_motions),
        unknown=tuple(unknown),
        plain=Unknown(*(np.concatenate([np.zeros(0, int), *x]) for x in plain)),
        joint_q=tuple(joint_q),
        joint_v=tuple(joint_v),
        rod_q=tuple(rod_q),
        rod_v=tuple(rod_v),
        in_order=in_order,
        bases=bases,
        levels=levels,
        after_levels=np.argsort(walked),
        owners=np.concatenate([np.full(parts[i].stations, in_order[i]) for i in by_kind]),
        stations=station_of_kind,
        frames=np.concatenate(frames),
        before_segment=before_segment,
        before_station=before_station[: n - len(beside)],
        to_v=Spread(nv, *joint_v, *rod_v),
        rods_to_v=Spread(nv, *rod_v),
        part_of_station=np.concatenate([np.full(part.stations, i) for i, part in enumerate(parts)]),
        beside=beside,
    )


def _layout(parts: tuple[PartPlan, ...]) -> tuple[TreeLayout, ...]:
    out, q, v, n = [], 0, 0, 0
    for part in parts:
        ends = q + part.joint.nq + part.own, v + part.joint.nv + part.own, n + part.stations
        out.append(TreeLayout(slice(q, ends[0]), slice(v, ends[1]), slice(n, ends[2])))
        q, v, n = ends
    return tuple(out)


def _first(layout: tuple[TreeLayout, ...], i: int, what: str) -> int:
    return getattr(layout[i], what).start


def _joint(parts: tuple[PartPlan, ...], layout: tuple[TreeLayout, ...], members: tuple[int, ...], what: str):
    """Coordinates ("q") or velocities ("v") of the joints of some parts of one class [m, n]."""
    size = getattr(parts[members[0]].joint, "n" + what) if members else 0
    return np.array([_first(layout, i, what) + np.arange(size) for i in members], dtype=int).reshape(len(members), size)


def _strains(parts: tuple[PartPlan, ...], layout: tuple[TreeLayout, ...], members: tuple[int, ...], what: str):
    """Coordinates ("q") or velocities ("v") of rods of one structure [m, n]."""
    return np.array(
        [_first(layout, i, what) + getattr(parts[i].joint, "n" + what) + np.arange(parts[i].own) for i in members],
        dtype=int,
    )


def _unknown(parts: tuple[PartPlan, ...], layout: tuple[TreeLayout, ...], what: str) -> np.ndarray:
    index: list[int] = []
    for i, part in enumerate(parts):
        first = _first(layout, i, what) + getattr(part.joint, "n" + what)
        index += [] if part.prescribed else range(_first(layout, i, what), first)
        index += [first + k for k in range(part.own) if k not in part.prescribed_strains]
    return np.array(index, dtype=int)


def _complete(
    parts: tuple[PartPlan, ...],
    layout: tuple[TreeLayout, ...],
    what: str,
    free: np.ndarray,
    size: int,
    motions: tuple[tuple[int, ...], ...],
    strain_motions: tuple[tuple[tuple[int, int], ...], ...],
) -> np.ndarray:
    given = [free, *(_joint(parts, layout, members, what).ravel() for members in motions)]
    for members in strain_motions:
        for i, k in members:
            counts = parts[i].strain_signals
            own = np.array(parts[i].prescribed_strains[sum(counts[:k]) : sum(counts[: k + 1])], dtype=int)
            given.append(_first(layout, i, what) + getattr(parts[i].joint, "n" + what) + own)
    place = np.concatenate(given)
    assert place.size == size
    return np.argsort(place)


def _levels(parts: tuple[PartPlan, ...], order: np.ndarray, in_order: np.ndarray) -> tuple[Level, ...]:
    depth: list[int] = []
    for part in parts:
        depth.append(0 if part.parent < 0 else depth[part.parent] + 1)
    out, before = [], {}
    for level in range(max(depth) + 1):
        here = [i for i in order if depth[i] == level]
        parents = [before[parts[i].parent] for i in here] if level else []
        out.append(Level(in_order[np.array(here, dtype=int)], np.array(parents, dtype=int)))
        before = {i: k for k, i in enumerate(here)}
    return tuple(out)


def _bases(parts: tuple[PartPlan, ...], order: np.ndarray, rods: tuple[tuple[int, ...], ...]) -> np.ndarray:
    """Places of the joints' parents: 0 the world or a root, then the tips of links, then the nodes of rods."""
    links = [i for i, part in enumerate(parts) if part.link]
    starts, k = {}, 1 + len(links)
    for i in (i for members in rods for i in members):
        starts[i], k = k, k + parts[i].stations
    out = []
    for i in order:
        parent, node = parts[i].parent, parts[i].node
        if parent < 0:
            out.append(0)
        elif parent in starts:
            out.append(starts[parent] + (node % parts[parent].stations))
        else:
            out.append(1 + links.index(parent) if node < 0 else 0)
    return np.array(out, dtype=int)


def _ancestors(
    parts: tuple[PartPlan, ...],
    layout: tuple[TreeLayout, ...],
    in_order: np.ndarray,
    rods: tuple[tuple[int, ...], ...],
) -> tuple[np.ndarray, np.ndarray]:
    """Segments (joints in their order, then those of soft bodies) before each segment and before or at each station."""
    intervals, k = {}, len(parts)
    for i in (i for members in rods for i in members):
        intervals[i], k = range(k, k + parts[i].stations - 1), k + parts[i].stations - 1
    to_segment, to_station = np.zeros((k, k)), np.zeros((layout[-1].stations.stop, k))
    for i, (part, place) in enumerate(zip(parts, layout, strict=True)):
        inherited = np.zeros(k)
        if part.parent >= 0:
            reached = to_station[layout[part.parent].stations]
            # the tip of a link is rigidly connected to its stations
            inherited = reached[part.node] if part.parent in intervals else reached[0]
        to_segment[in_order[i]] = inherited
        inherited = inherited.copy()
        inherited[in_order[i]] = 1
        to_station[place.stations] = inherited
        for j, segment in enumerate(intervals.get(i, ())):
            to_segment[segment] = inherited
            reached = inherited.copy()
            reached[segment] = 1
            to_station[place.stations.start + j + 1] = reached
            inherited = inherited if part.star else reached
    return to_segment, to_station
