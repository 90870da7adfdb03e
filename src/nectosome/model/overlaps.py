"""Solid parts that pass through each other at the start of the motion: nothing in a model keeps them apart."""

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.core.programs.remember import remembered
from nectosome.description import Rigid, RobotDescription, Rod
from nectosome.description.copies import BODY
from nectosome.mechanism import Fixed, Robot
from nectosome.mechanism.robot import start_poses
from nectosome.mechanism.shapes import shape_of

_FINE, _MOST = 4, 300  # balls along an axis: so many within a radius, and at most
_COARSE = 17  # places at which the shape of a rigid part is looked at
_END = 0.1  # share of an axis at each end that may lie inside of another part
_DEEP = 0.5  # of the larger radius: axes that are closer are told
_FREE = 0.25  # share of their length from their roots on which parts side by side may share a place


class _Balls(NamedTuple):
    """Balls inside of a part, along its axis."""

    centre: Float[np.ndarray, "n 3"]  # [m]
    radius: Float[np.ndarray, "n"]  # [m]


def overlaps(description: RobotDescription, robot: Robot) -> Iterator[tuple[str, str]]:
    """Yield the path of a part with a sentence where its axis passes through another part at the start.

    Parts that follow each other in the tree, or that a pair joins, may do so. Parts are taken as balls along their
    axes, as thick as their thinner side, without their ends, so that none is told that only touches; meshes and
    outlines are left out.
    """
    joined = _neighbours(description, robot)
    balls = _balls(description, robot)
    for (name, one), (other, two) in combinations(balls.items(), 2):
        if frozenset((name, other)) in joined:
            continue
        if name != BODY and description.parts[name].on == description.parts[other].on:
            one, two = (_Balls(*(x[round(_FREE * len(x)) :] for x in each)) for each in (one, two))
        if _meet(one, two):
            words = f"it passes through {other} at the start, and nothing in the model keeps them apart"
            yield description.place_of(name), f"{words}. Move or turn one of them."


def _meet(one: _Balls, two: _Balls) -> bool:
    near = _DEEP * max(one.radius.max(), two.radius.max())
    (low, high), (least, most) = ((each.centre.min(axis=0), each.centre.max(axis=0)) for each in (one, two))
    if np.any(low > most + near) or np.any(least > high + near):
        return False
    apart = np.linalg.norm(one.centre[:, None] - two.centre, axis=-1)
    return bool(np.any(apart < _DEEP * np.maximum(one.radius[:, None], two.radius)))


def _balls(description: RobotDescription, robot: Robot) -> dict[str, _Balls]:
    tree, (R, p) = robot.tree, map(np.asarray, remembered(start_poses, robot))
    found = dict[str, _Balls]()
    for name, part in description.parts.items():
        at = tree.layout[tree.part(name)].stations
        if isinstance(part, Rod):
            here = _Balls(p[at], np.asarray(tree.stations.half_width)[at].min(axis=-1))
        elif isinstance(part, Rigid) and isinstance(part.shape, str) and part.length is not None:
            shape = shape_of(part)
            there = shape.places(np.concatenate([[shape.middle], np.linspace(0.0, 1.0, _COARSE)]))
            turned, place = np.asarray(there.rotation)[0], np.asarray(there.position)
            centre = p[at.start] + (place[1:] - place[0]) @ turned @ R[at.start].T
            here = _Balls(centre, np.asarray(there.half_width)[1:].min(axis=-1))
        else:
            continue
        assert part.length is not None
        count = int(min(_MOST, 2 + _FINE * part.length / here.radius.max()))
        known, s = np.linspace(0, 1, len(here.radius)), np.linspace(_END, 1 - _END, count)
        centre = np.stack([np.interp(s, known, x) for x in here.centre.T], axis=-1)
        found[name] = _Balls(centre, np.interp(s, known, here.radius))
    return found


def _neighbours(description: RobotDescription, robot: Robot) -> set[frozenset[str]]:
    """Pairs of parts that may share a place: at most two steps along the tree, on which what is fixed is one part."""
    plan = robot.tree.structure
    first = dict[str, str]()  # of what is fixed together
    above = dict[str, str]()
    for part in plan[: len(description.parts)]:  # without webs
        parent = plan[part.parent].name if part.parent >= 0 else ""
        fixed = parent and part.link and issubclass(part.joint, Fixed)
        first[part.name] = first[parent] if fixed else part.name
        above.setdefault(first[part.name], first.get(parent, ""))
    joined = {frozenset(pair.between) for pair in description.pairs.values()}
    for one, other in combinations(description.parts, 2):
        a, b = first[one], first[other]
        if a == b or a in (above[b], above.get(above[b])) or b in (above[a], above.get(above[a])):
            joined.add(frozenset((one, other)))
    return joined
