r"""Limbs that all do the same: their motion is solved on one of them and its share of the body.

n equal limbs with equal drives stand evenly around an axis of the body. From a state in which all of them do the same,
and the body moves along the axis alone, only such states follow: the equations are those of one limb and of 1/n of all
that has mass or is pushed on the body, once, along that axis. The motion of the whole robot follows by repeating that
limb. A web that joins these limbs to a ring is there with one of its gaps, from that limb to its image at the next.

Two tests find it: the limbs are equal in the description, and random states of that kind have the same residual and the
same rates in the whole robot and in the part. A motion that grows out of rounding errors, because limbs that differ by
a little differ more and more, is not seen; neither are the multipliers of such disturbances.
"""

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import State
from nectosome.core.programs.remember import remembered
from nectosome.core.rows import on_device
from nectosome.core.tracers import Untraced, traced
from nectosome.description import FreeJoint, PrismaticJoint, RobotDescription, SignalDescription
from nectosome.description.orientation import Matrix, Vector, applied, from_rpy, product, to_rpy
from nectosome.description.parts import Limb, Rigid
from nectosome.description.robot import ReferenceDescription
from nectosome.description.webs import WebDescription
from nectosome.io.schema.structure import items
from nectosome.mechanism import Free, Robot, continuous_loops
from nectosome.model import build

from .integrate import AcceptedSteps

_SAME = 1e-9  # relative difference of residuals that counts as equal
_PLACED = 1e-9  # [m, rad] deviation of a limb from its place around the axis that is rounding
_ALIKE = 1e-12  # relative difference of coordinates of equal limbs that is rounding
_ROUNDING = 1e-15
_SAMPLES, _APART = 32, 0.381966  # states, and the time between them [s]: no common multiple of a period
EQUAL_LIMBS = "equal_limbs"  # their number, among `stats` of a motion that was solved on one of them


class Copies(NamedTuple):
    """Which limbs are copies of which."""

    times: int  # that each limb comes
    axis: Float[np.ndarray, "3"]  # about which they go around, unit vector in the frame of the first part
    first: dict[str, str]  # for each part but webs the copy that stands for it; itself of a part that comes once

    @property
    def once(self) -> set[str]:
        """Parts that come once."""
        return {name for name, n in Counter(self.first.values()).items() if n == 1}


class OneLimb(eqx.Module):
    """One of the equal limbs, with its share of the body, and what takes its states to those of the whole robot."""

    whole: Robot
    robot: Robot
    origin: Float[Array, "nq"]  # coordinates of the whole where those of the part are 0
    of_q: Float[Array, "nq mq"]
    of_v: Float[Array, "nv mv"]
    rows: tuple[tuple[int, ...], ...] = eqx.field(static=True)  # places of states of loads and motors in the part
    own_rows: tuple[tuple[int, ...], ...] = eqx.field(static=True)  # and of those of the part in the whole
    gaps: tuple[int, ...] = eqx.field(static=True)  # of each group, for which that of a web stands; 1 of other groups
    count: int = eqx.field(static=True)
    start: State  # of the part

    def whole_state(self, x: State) -> State:
        """State of the whole robot."""
        return self._repeated(x, (self.origin, self.of_q, self.of_v), 0)

    def whole_states(self, states: State, rates: bool = False) -> State:
        """States [n, ...] of the whole robot at some times, or their rates, by NumPy: nothing is compiled."""
        origin, of_q, of_v = map(np.asarray, (self.origin, self.of_q, self.of_v))
        return self._repeated(jax.tree.map(np.asarray, states), (0.0 * origin if rates else origin, of_q, of_v), 1)

    def _repeated(self, x: State, maps: tuple[Any, Any, Any], axis: int) -> State:
        origin, of_q, of_v = maps
        z = _at_rows(x.z, self.rows, axis)
        each = zip(z, self.gaps, strict=True)
        z = tuple(
            group if n == 1 else jax.tree.map(lambda leaf, n=n: _tiled(leaf, n, axis), group) for group, n in each
        )
        return _like(x, origin + x.q @ of_q.T, x.v @ of_v.T, z)

    def whole_steps(self, steps: AcceptedSteps) -> AcceptedSteps:
        """Steps of the whole robot, by NumPy."""
        ends = {name: self.whole_states(getattr(steps, name)) for name in ("x0", "x")}
        rates = {name: self.whole_states(getattr(steps, name), rates=True) for name in ("rate0", "rate")}
        return steps._replace(**ends, **rates)

    def own_state(self, x: State) -> State | None:
        """State of the part in a state of the whole robot; None where limbs differ or the body is off the axis."""
        inverse_q, inverse_v = np.linalg.pinv(self.of_q), np.linalg.pinv(self.of_v)
        q, v, z = jax.tree.map(np.asarray, (x.q, x.v, x.z))
        z = tuple(
            jax.tree.map(lambda leaf, n=n: leaf[:, : leaf.shape[1] // n], group) if n > 1 else group
            for group, n in zip(_at_rows(z, self.own_rows, 0), self.gaps, strict=True)
        )
        found = _like(x, inverse_q @ (q - np.asarray(self.origin)), inverse_v @ v, z)
        again = self.whole_states(jax.tree.map(lambda leaf: leaf[None], found))
        both = zip(jax.tree.leaves(again), jax.tree.leaves(x), strict=True)
        alike = all(np.allclose(a[0], b, rtol=_ALIKE, atol=_ALIKE) for a, b in both)
        return jax.tree.map(on_device, found) if alike else None


def _at_rows(z: tuple[Any, ...], rows: tuple[tuple[int, ...], ...], axis: int) -> tuple[Any, ...]:
    """States at some places of each group."""
    each = ((group, np.array(places, int)) for group, places in zip(z, rows, strict=True))
    return tuple(jax.tree.map(lambda leaf, i=i: leaf.take(i, axis=axis), group) for group, i in each)


def _tiled(leaf: Any, n: int, axis: int) -> Any:
    """States of one gap, whose strips are along the axis after that of the loads, of all n gaps."""
    return leaf.__array_namespace__().concatenate([leaf] * n, axis=axis + 1)


def _like(x: State, *numbers: Any) -> State:
    """State of the structure of x, which may hold arrays of NumPy."""
    return jax.tree.unflatten(jax.tree.structure(x), jax.tree.leaves(numbers))


def with_equal_limbs(reason: str, stats: Mapping[str, Any]) -> str:
    """Return the reason of a status, with what a motion leaves out that was solved on one of several equal limbs."""
    if EQUAL_LIMBS not in stats:
        return reason
    left_out = "disturbances that differ between limbs, or take the body off its axis, are not looked at"
    return f"{reason}, by one of {int(stats[EQUAL_LIMBS])} equal limbs: {left_out} without --whole"


def one_limb(robot: Robot, x: State) -> OneLimb | None:
    """One of the equal limbs of a robot and its share of the body; None where the symmetry is not exact, or not in x.

    None as well of what is traced, and of a robot that was changed since it was built from its description.
    """
    description = None if traced(robot, x) else robot.description
    copies = None if description is None or not robot.tree.free_v.size else copies_of(description)
    if description is None or copies is None or not _goes_along_axis(description, robot, copies):
        return None
    part = build(with_one_limb(description))
    share = np.array([1 / copies.times if name in copies.once else 1.0 for name in part.tree.names])
    of_stations = on_device(share[part.tree.indices.part_of_station])
    part = replace(part, water=robot.water, share=of_stations, made_from=Untraced())
    found = _with_maps(robot, part, copies)
    start = None if found is None else found.own_state(x)
    if found is None or start is None or not float(remembered(_difference, found)) < _SAME:
        return None
    return replace(found, start=start)


def copies_of(d: RobotDescription) -> Copies | None:
    """Copies around an axis of the first part, as many as there are; None without any."""
    first, *others = d.parts
    bare = {name: _bare(part) for name, part in d.parts.items()}
    left = [name for name in others if d.parts[name].on == first]
    while left:
        name, *left = left
        alike = [other for other in left if bare[name] == bare[other]]
        left = [other for other in left if other not in alike]
        turns = [_turn_between(d.parts[name], d.parts[other]) for other in alike]
        for turn in sorted(turns, key=lambda turn: _angle_axis(turn)[0]):
            found = _around(d.parts, bare, turn)
            if found is not None:
                return found
    return None


def _bare(limb: Limb) -> Limb:
    """A limb without its place."""
    return limb.model_copy(update={"on": "", "offset": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0)})


def _turn_between(limb: Limb, other: Limb) -> Float[np.ndarray, "3 3"]:
    return np.array(from_rpy(other.rotation)) @ np.array(from_rpy(limb.rotation)).T


def _around(parts: Mapping[str, Limb], bare: Mapping[str, Limb], turn: Float[np.ndarray, "3 3"]) -> Copies | None:
    """Copies that a turn takes to one another, all equally often; None where there are none."""
    angle, axis = _angle_axis(turn)
    count = round(2 * math.pi / angle) if angle > _PLACED else 0
    if count < 2 or abs(count * angle - 2 * math.pi) > _PLACED:
        return None
    images = _images(parts, bare, turn)
    if images is None:
        return None
    first = dict[str, str]()
    for name in parts:
        if name in first:
            continue
        cycle = [name]
        while (after := images[cycle[-1]]) != name:
            cycle.append(after)
        if len(cycle) not in (1, count):
            return None
        # of copies on copies, the one on that which stands for the others
        kept = next(one for one in cycle if len(cycle) == 1 or first.get(parts[one].on, one) in (parts[one].on, one))
        first |= dict.fromkeys(cycle, kept)
    return Copies(count, axis, first) if len({*first.values()}) < len(first) else None


def _angle_axis(turn: Float[np.ndarray, "3 3"]) -> tuple[float, Float[np.ndarray, "3"]]:
    """Angle [rad] and axis of a rotation."""
    from scipy.spatial.transform import Rotation

    vector = Rotation.from_matrix(turn).as_rotvec()
    angle = float(np.linalg.norm(vector))
    axis = vector / angle if angle else vector
    return angle, np.where(np.abs(axis) < _ROUNDING, 0.0, axis)


def _images(
    parts: Mapping[str, Limb], bare: Mapping[str, Limb], turn: Float[np.ndarray, "3 3"]
) -> dict[str, str] | None:
    """The part that stands where a turn of the first part takes each one; itself of one that comes once.

    None where what sits on a limb has no image on that limb's image.
    """
    first, *others = parts
    images = {first: first}
    rotations = np.array([from_rpy(parts[name].rotation) for name in others])
    places = np.concatenate([rotations, np.array([parts[name].offset for name in others])[..., None]], axis=-1)
    for k, name in enumerate(others):
        part = parts[name]
        on = images[part.on]
        away = np.abs(places - (turn @ places[k] if part.on == first else places[k])).max(axis=(1, 2))
        near = [others[i] for i in np.flatnonzero(away < _PLACED)]
        there = [other for other in near if parts[other].on == on and bare[other] == bare[name]]
        if not there and on != part.on:
            return None
        images[name] = there[0] if there else name
    return images if len({*images.values()}) == len(images) else None


def _goes_along_axis(d: RobotDescription, robot: Robot, copies: Copies) -> bool:
    """Whether nothing that random states may not show breaks the symmetry: walls, contacts, drives that come once.

    What comes once has no coordinates of its own but those of the first part.
    """
    first, once = next(iter(d.parts.values())), [d.parts[name] for name in copies.once]
    if not isinstance(first, Rigid) or d.pairs or d.tendons or d.water.walls or d.water.flows:
        return False
    if any(map(_comes_once, once)):
        return False
    if any(_ring(d, copies, web) is None for web in d.webs.values()):
        return False
    tree, loads = robot.tree, robot.load_groups
    own = zip(tree.names[1:], tree.layout[1:], strict=True)
    moving = {name for name, layout in own if np.isin(tree.free_v, np.arange(layout.v.start, layout.v.stop)).any()}
    if moving & copies.once:
        return False
    one_sided = [g for g in (*loads.on_bodies, *loads.on_joints) if g.one_sided]
    if any(tree.names[i] in copies.once for g in one_sided for i in g.parts):
        return False
    upright = abs(float(np.array(_start_pose(first)[0])[2] @ copies.axis)) > 1 - _PLACED
    return upright or (d.water.surface is None and d.water.floor is None)


def _ring(d: RobotDescription, copies: Copies, web: WebDescription) -> Matrix | None:
    """What turns each limb of a web to the next one, in the first part's frame; None where it is no ring of copies."""
    limbs = web.between
    if not web.closed or len(limbs) != copies.times or len({copies.first[limb] for limb in limbs}) > 1:
        return None
    first, *_ = d.parts

    def mounted(limb: str) -> Limb:
        part = d.parts[limb]
        return part if part.on == first else mounted(part.on)

    turns = [_turn_between(mounted(one), mounted(other)) for one, other in web.gaps]
    alike = all(np.abs(turn - turns[0]).max() < _PLACED for turn in turns)
    x, y, z = turns[0]
    return (_vector(x), _vector(y), _vector(z)) if alike else None


def _vector(row: np.ndarray) -> Vector:
    x, y, z = row.tolist()
    return x, y, z


def _comes_once(value: Any) -> bool:
    """Whether a signal in a part of a description has no period."""
    if isinstance(value, SignalDescription) and value.once[0]:
        return True
    return any(_comes_once(item) for _, item in items(value))


def _start_pose(first: Rigid) -> tuple[Matrix, Vector]:
    """Rotation and position of the first part in the world, at the start where it is free."""
    rotation, offset = from_rpy(first.rotation), first.offset
    if not isinstance(first.joint, FreeJoint):
        return rotation, offset
    start = first.joint.start
    x, y, z = np.array(offset) + applied(rotation, start.position)
    return product(rotation, from_rpy(start.orientation)), (float(x), float(y), float(z))


def with_one_limb(d: RobotDescription) -> RobotDescription:
    """The robot with one limb of each kind, a first part that slides along the axis, and batteries for one limb."""
    copies = copies_of(d)
    assert copies is not None
    first, *_ = d.parts
    limbs = {name: limb for name, limb in d.limbs.items() if copies.first[name] == name}
    rings = {name: web.with_one_limb(turn) for name, web in d.webs.items() if (turn := _ring(d, copies, web))}
    n = copies.times
    batteries = {
        name: one.model_copy(update={"resistance": n * one.resistance, "idle_power": one.idle_power / n})
        for name, one in d.batteries.items()
    }
    update = {"limbs": limbs, "webs": rings, "batteries": batteries, "aliases": {}, "reference": ReferenceDescription()}
    part, one = d.parts[first], d.model_copy(update=update)
    if not isinstance(part, Rigid) or not isinstance(part.joint, FreeJoint) or part.joint.motion:
        return one
    rotation, offset = _start_pose(part)
    axis, speed = tuple(copies.axis.tolist()), float(copies.axis @ np.array(part.joint.start.velocity))
    joint = PrismaticJoint(kind="prismatic", axis=axis, velocity=speed)
    return one.with_part(first, joint=joint, rotation=to_rpy(rotation), offset=offset)


def _with_maps(robot: Robot, part: Robot, copies: Copies) -> OneLimb | None:
    """The part with what takes its states to those of the whole; None where loads are not grouped alike."""
    webs = {name for name, plan in zip(part.tree.names, part.tree.structure, strict=True) if plan.between}
    first = copies.first | {name: name for name in webs}
    held, own = _held(robot, first), _held(part, first)
    if [sorted({*group}) for group in held] != [sorted(group) for group in own]:
        return None
    rows = tuple(tuple(mine.index(key) for key in group) for group, mine in zip(held, own, strict=True))
    own_rows = tuple(tuple(group.index(key) for key in mine) for group, mine in zip(held, own, strict=True))
    of_q, of_v = (_places(robot, part, copies, what) for what in "qv")
    origin = np.zeros(len(of_q))
    if issubclass(robot.tree.structure[0].joint, Free) and not robot.tree.structure[0].prescribed:
        root = robot.tree.one(0)
        origin[:7] = robot.start.q[:7]
        of_q[:3, 0] = np.asarray(root.joint.motion(robot.start.q[:7]).rotation) @ copies.axis
        of_v[3:6, 0] = copies.axis
    origin, of_q, of_v = map(on_device, (origin, of_q, of_v))
    gaps = tuple(copies.times if {name for name, _ in group} & webs else 1 for group in own)
    return OneLimb(robot, part, origin, of_q, of_v, rows, own_rows, gaps, copies.times, part.start)


def _held(robot: Robot, first: Mapping[str, str]) -> list[list[tuple[str, Any]]]:
    """What has states, group by group: a part, the one of its copies that stands for all, and a name."""
    loads, names = robot.load_groups, [first[name] for name in robot.tree.names]
    outside = [[*zip((names[i] for i in g.parts), g.names, strict=True)] for g in (*loads.on_bodies, *loads.inner)]
    return outside + [[*zip((names[i] for i in g.parts), g.strains, strict=True)] for g in robot.powered.groups]


def _places(robot: Robot, part: Robot, copies: Copies, what: str) -> Float[np.ndarray, "n m"]:
    """1 where an unknown coordinate ("q") or velocity ("v") of the whole is that of the part."""
    own = {name: getattr(place, what) for name, place in zip(part.tree.names, part.tree.layout, strict=True)}
    free, mine = (getattr(one.tree.indices, f"free_{what}") for one in (robot, part))
    matrix = np.zeros((free.size, mine.size))
    for name, layout in zip(robot.tree.names, robot.tree.layout, strict=True):
        here, there = getattr(layout, what), own[copies.first.get(name, name)]
        if here.stop - here.start == there.stop - there.start:
            shift = there.start - here.start
            for i in np.flatnonzero((free >= here.start) & (free < here.stop)):
                matrix[i, np.flatnonzero(mine == free[i] + shift)] = 1.0
    return matrix


def _difference(one: OneLimb) -> Float[Array, ""]:
    """Largest relative difference of residuals and rates of load states of the whole from those by the part.

    The generalised force along what comes once is n times that of the part.
    """
    whole, part = continuous_loops(one.whole), continuous_loops(one.robot)
    rest = part.initial()
    draws = 0.3 * jax.random.normal(jax.random.key(4), (_SAMPLES, 3, rest.v.shape[0]))
    onto = one.of_v * (one.count / jnp.sum(one.of_v**2, axis=0))

    def both(sample: tuple[Array, Array]) -> tuple[Any, Any]:
        (q, v, a), t = sample
        x = State(part.advance(rest.q, q, jnp.ones(())), rest.v + v, rest.z)
        there = one.whole_state(x)
        rates = one.whole_state(State(x.q, x.v, part.state_rates(t, x))).z
        return (onto @ part.residual(t, x, a), rates), (
            whole.residual(t, there, one.of_v @ a),
            whole.state_rates(t, there),
        )

    found, expected = jax.lax.map(both, (draws, _APART * jnp.arange(_SAMPLES)))
    pairs = [(a, b) for a, b in zip(jax.tree.leaves(found), jax.tree.leaves(expected), strict=True) if a.size]
    return jnp.max(jnp.stack([jnp.max(jnp.abs(a - b)) / jnp.maximum(jnp.max(jnp.abs(b)), 1e-12) for a, b in pairs]))
