"""The kinematic tree of parts: poses, twists and twist rates of all stations.

Joints of a class, rods of a structure and signals of a kind go through one vectorised call each, their numbers stacked.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float, Int

from nectosome.core import Signal, Stations
from nectosome.core.rows import Alike, Spread, alike, joined, part_of, rows, stacked
from nectosome.core.se3 import bracket, to_body, to_spatial
from nectosome.units import InputError, did_you_mean, shorten

from .joints import Joint
from .parts import Link, TreePart, poses
from .rods import SoftRod
from .soft_bodies import SoftBody
from .tree_indices import PartPlan, TreeIndices, TreeLayout, indices_of
from .webs import Sides, Web

Split = tuple[tuple[Array, ...], tuple[Array, ...]]  # of joints class by class, of soft bodies structure by structure


class PartShape(NamedTuple):
    """Poses of all stations, and the frames of the motion increments of joints and rod intervals."""

    rotation: Float[Array, "n 3 3"]  # station frame to world frame
    position: Float[Array, "n 3"]  # [m], world frame
    subspaces: tuple[Float[Array, "m nv 6"], ...]  # unit twists of the joints of each class, child frame
    rods: tuple[Any, ...]  # of soft bodies of each structure, stacked
    frame_rotation: Float[Array, "k 3 3"]  # of each segment
    frame_position: Float[Array, "k 3"]


class Tree(eqx.Module):
    """Parts, parents first; `Tree.of` puts their numbers together."""

    structure: tuple[PartPlan, ...] = eqx.field(static=True)
    mounts: Float[Array, "parts 3 4"]  # joint frames on the parents, in the order of joints
    joints: tuple[Alike[Joint], ...]  # of each class
    link_stations: Float[Array, "n 3 4"]  # on their links, link by link
    link_tips: Float[Array, "links 3 4"]
    link_ends: Float[Array, "links 2 3"] | None  # rear and front on their links; None: roots and tips
    rods: tuple[Alike[SoftBody], ...]  # rods and soft plates of each structure, without stations
    stations: Stations  # of all parts
    motions: tuple[Alike[Signal], ...]  # of prescribed joints
    drives: tuple[Alike[Signal], ...]  # of driven joints
    strains: tuple[Alike[Signal], ...]  # of prescribed strains
    strain_places: tuple[tuple[tuple[int, int], ...], ...] = eqx.field(static=True)  # part and signal of each of those
    webs: Web | None  # of all parts that are one
    strain_starts: dict[int, Float[Array, "2 nq"]]  # of rods that do not start free of stress and at rest, by part
    beside: tuple[str, ...] = eqx.field(static=True, default=())  # what its robot has besides parts, loads and water

    @classmethod
    def of(cls, parts: Sequence[TreePart]) -> "Tree":
        """The tree of these parts."""
        structure = tuple(map(_plan, parts))
        joints = alike({i: part.joint for i, part in enumerate(parts)}, lambda i: type(parts[i].joint))
        order = [i for group in joints for i in group.members]
        links = [part.body for part in parts if isinstance(part.body, Link)]
        webs = [part.body for part in parts if isinstance(part.body, Web)]
        none = jnp.zeros((0, 3, 4))
        bent = {(i, k): signal for i, part in enumerate(parts) for k, signal in enumerate(part.strain_signals)}
        places = list(bent)
        strains = alike(dict(enumerate(bent.values())), lambda k: structure[places[k][0]].strain_signals[places[k][1]])
        return cls(
            structure=structure,
            mounts=stacked([poses(parts[i].rotation, parts[i].position) for i in order]),
            joints=joints,
            link_stations=joined([poses(link.rotation, link.position) for link in links]) if links else none,
            link_tips=stacked([poses(link.tip_rotation, link.tip_position) for link in links]) if links else none,
            link_ends=_ends(links),
            rods=alike({i: part.body for i, part in enumerate(parts) if isinstance(part.body, SoftBody)}),
            stations=jax.tree.map(lambda *x: jnp.concatenate(x), *(part.stations for part in parts)),
            motions=_signals({i: part.prescribed for i, part in enumerate(parts)}, parts),
            drives=_signals({i: part.drive for i, part in enumerate(parts)}, parts),
            strains=strains,
            strain_places=tuple(tuple(places[k] for k in group.members) for group in strains),
            webs=jax.tree.map(lambda *x: joined(x), *webs) if webs else None,
            strain_starts={i: part.strain_start for i, part in enumerate(parts) if part.strain_start is not None},
            beside=tuple(dict.fromkeys(what for part in parts for what in part.beside)),
        )

    @property
    def indices(self) -> TreeIndices:
        """Constant indices of the tree."""
        groups = (tuple(group.members for group in kind) for kind in (self.joints, self.rods, self.motions))
        return indices_of(self.structure, *groups, self.strain_places)

    @property
    def parts(self) -> tuple[TreePart, ...]:
        """The parts one by one."""
        return tuple(map(self.one, range(len(self.structure))))

    def joint_velocities(self, members: tuple[int, ...]) -> Int[np.ndarray, "m nv"]:
        """Indices of the velocities of the joints of some parts, each of one kind."""
        starts = np.array([self.layout[i].v.start for i in members])
        return starts[:, None] + np.arange(self.structure[members[0]].joint.nv)

    def one(self, i: int) -> TreePart:
        """The i-th part."""
        own, here = self.structure[i], self.layout[i].stations
        if own.link:
            links = [part.stations for part in self.structure[:i] if part.link]
            there = slice(sum(links), sum(links) + own.stations)
            ends = None if self.link_ends is None else self.link_ends[len(links)]
            body = Link(*_apart(self.link_stations, there), *_apart(self.link_tips, len(links)), ends)
        elif self.webs is not None and own.between:
            body = part_of(self.webs, slice(here.start - self.solid, here.stop - self.solid))
        else:
            body = _member(self.rods, i)
        rotation, position = _apart(self.mounts, int(self.indices.in_order[i]))
        places = [place for group in self.strain_places for place in group]
        return TreePart(
            name=own.name,
            parent=own.parent,
            node=own.node,
            rotation=rotation,
            position=position,
            joint=_member(self.joints, i),
            body=body,
            stations=part_of(self.stations, here),
            prescribed=_member(self.motions, i),
            drive=_member(self.drives, i),
            prescribed_strains=own.prescribed_strains,
            strain_signals=tuple(
                _member(self.strains, sorted(places).index((i, k))) for k in range(len(own.strain_signals))
            ),
            strain_start=self.strain_starts.get(i),
            between=own.between,
            beside=self.beside,
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parts."""
        return tuple(part.name for part in self.structure)

    @property
    def layout(self) -> tuple[TreeLayout, ...]:
        """Layout of each part."""
        return self.indices.layout

    def part(self, name: str) -> int:
        """Index of a part."""
        return self.names.index(name)

    def place(self, name: Any) -> int:
        """Index of a part by the name that a user gives. Raises InputError where there is no such part."""
        if name not in self.names:
            raise InputError(f'there is no part "{shorten(name)}".{did_you_mean(str(name), self.names)}', field="part")
        return self.part(name)

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """Names of all velocities, prescribed ones included, such as `filament.bending_y.2`."""
        return tuple(
            f"{part.name}.{name}" for part in self.structure for name in (*part.joint.names, *(part.strains or ()))
        )

    @property
    def free_v(self) -> np.ndarray:
        """Indices of the unknown velocities."""
        return self.indices.free_v

    @property
    def prescribed_v(self) -> np.ndarray:
        """Indices of the prescribed velocities."""
        return self.indices.prescribed_v

    def complete(self, t: Array, q: Array, v: Array, a: Array | None = None) -> tuple[Array, Array, Array]:
        """Coordinates, velocities and accelerations of all joints and strains: prescribed ones from their signals.

        Accelerations of the unknown ones are a, or 0.
        """
        every = [[q], [v], [jnp.zeros(v.shape) if a is None else a]]
        for motion in self.motions:
            joint = self.structure[motion.members[0]].joint
            size = (len(motion.members), joint.nv)
            u = (jnp.broadcast_to(x.reshape(size[0], -1), size) for x in _at(motion, t))
            for whole, own in zip(every, jax.vmap(joint.prescribed)(*u), strict=True):
                whole.append(own.ravel())
        for group in self.strains:
            for whole, own in zip(every, _at(group, t), strict=True):
                whole.append(own.ravel())
        index = self.indices.complete_q, self.indices.complete_v, self.indices.complete_v
        full_q, full_v, full_a = (rows(joined(x), i) for x, i in zip(every, index, strict=True))
        return full_q, full_v, full_a

    def advance(self, q: Array, v: Array, step: Array) -> Array:
        """Solve q1 = q + step N(q1) v for the unknown coordinates."""
        return self._converted("advance", {"q": q, "v": v}, lambda q, v: q + step * v, "q", step)

    def displacements(self, q: Float[Array, "nq"]) -> Float[Array, "nv"]:
        """Displacements of the unknown coordinates q, one per velocity; rotations as rotation vectors [rad]."""
        return self._converted("displacement", {"q": q}, lambda q: q, "v")

    def coordinates(self, displacements: Float[Array, "nv"]) -> Float[Array, "nq"]:
        """Unknown coordinates q of `displacements`."""
        return self._converted("coordinates", {"v": displacements}, lambda x: x, "q")

    def _converted(self, method: str, given: dict[str, Array], plain: Callable, result: str, *more: Array) -> Array:
        """A method of the joints for all unknown joints; coordinates that are displacements go as in `plain`."""
        out, place = [], []
        for group, unknown in zip(self.joints, self.indices.unknown, strict=True):
            if unknown.q.size:
                f = getattr(self.structure[group.members[0]].joint, method)
                x = (rows(x, getattr(unknown, what)) for what, x in given.items())
                out.append(jax.vmap(lambda *x, f=f: f(*x, *more))(*x).ravel())
                place.append(getattr(unknown, result).ravel())
        ordinary = self.indices.plain
        if ordinary.q.size or not out:
            out.append(plain(*(rows(x, getattr(ordinary, what)) for what, x in given.items())))
            place.append(getattr(ordinary, result))
        return rows(joined(out), np.argsort(np.concatenate(place)))

    def start(self) -> tuple[Array, Array]:
        """Initial unknown coordinates and velocities: joints by their start values, rods by those of their strains."""
        indices = self.indices
        begin = [group.map(lambda joint: joint.start()) for group in self.joints]
        driven = [k for k, group in enumerate(self.rods) if isinstance(group.things, SoftRod) and group.things.driven]
        starts = [x for x, _ in begin] + [self.rods[k].map(lambda rod: rod.start()) for k in driven]
        bent = {i: np.arange(-x.shape[1], 0) for i, x in self.strain_starts.items()}  # a rod's strains come last
        places = [*indices.joint_q, *(indices.rod_q[k] for k in driven)]
        places += [self.layout[i].q.stop + own for i, own in bent.items()]
        starts += [x for x, _ in self.strain_starts.values()]
        q = Spread(self.layout[-1].q.stop, *places)([x.ravel() for x in starts])
        moving = [*indices.joint_v, *(self.layout[i].v.stop + own for i, own in bent.items())]
        rates = [x for _, x in begin] + [x for _, x in self.strain_starts.values()]
        v = Spread(self.layout[-1].v.stop, *moving)([x.ravel() for x in rates])
        return rows(q, indices.free_q), rows(v, indices.free_v)

    def split(self, x: Array, what: str) -> Split:
        """All coordinates (what = "q") or velocities ("v") of joints and of rods."""
        indices = self.indices
        joints, rods = (indices.joint_q, indices.rod_q) if what == "q" else (indices.joint_v, indices.rod_v)
        return tuple(rows(x, i) for i in joints), tuple(rows(x, i) for i in rods)

    def shape(self, q: Float[Array, "nq"]) -> PartShape:
        """Poses of all stations from the completed coordinates."""
        indices, (joint_q, rod_q) = self.indices, self.split(q, "q")
        moved = [g.map(lambda joint, q: joint.motion(q), q) for g, q in zip(self.joints, joint_q, strict=True)]
        bent = [g.map(lambda rod, q: rod.shape(q), q) for g, q in zip(self.rods, rod_q, strict=True)]
        nodes = [poses(rod.rotation, rod.position).reshape(-1, 3, 4) for rod in bent]
        still = jnp.eye(3, 4)[None]
        base = rows(joined([still, self.link_tips, *nodes]), indices.bases)
        local = _compose(_compose(base, self.mounts), joined([poses(m.rotation, m.position) for m in moved]))
        before, roots = local, []
        for level in indices.levels:
            here = rows(local, level.parts)
            before = _compose(rows(before, level.parents), here) if level.parents.size else here
            roots.append(before)
        root = rows(joined(roots), indices.after_levels)
        placed = _compose(rows(root, indices.owners), joined([self.link_stations, *nodes]))
        station, frame = rows(placed, indices.stations), rows(joined([root, placed]), indices.frames)
        rotation, position = station[..., :3], station[..., 3]
        if self.webs is not None:
            own = self.webs.pose(self._beside(rotation, position))
            rotation, position = (joined(x) for x in zip((rotation, position), own, strict=True))
        return PartShape(
            rotation=rotation,
            position=position,
            subspaces=tuple(m.subspace for m in moved),
            rods=tuple(bent),
            frame_rotation=frame[..., :3],
            frame_position=frame[..., 3],
        )

    def _spatial(self, shape: PartShape, joint_v: tuple[Array, ...], rods: list[Array]) -> Float[Array, "k 6"]:
        """Spatial twists of the segments: joints with velocities (or accelerations) of each class, rod intervals."""
        joints = [jnp.sum(S * v[..., None], axis=1) for S, v in zip(shape.subspaces, joint_v, strict=True)]
        own = joined([*joints, *(rod.reshape(-1, 6) for rod in rods)])
        return to_spatial(shape.frame_rotation, shape.frame_position, own)

    def added(self, shape: PartShape, v: Split) -> Float[Array, "k 6"]:
        """Spatial twist increment of each segment; linear in v."""
        rods = [
            g.map(lambda body, *x: body.added(*x), rod, v)
            for g, rod, v in zip(self.rods, shape.rods, v[1], strict=True)
        ]
        return self._spatial(shape, v[0], rods)

    def twists(self, shape: PartShape, v: Float[Array, "nv"]) -> Float[Array, "n 6"]:
        r"""Body twists of all stations; linear in v.

        In the world frame the twist of a station is the sum of the increments of the segments before it,
        $V = \sum_k S_k v$: a product with the constant ancestor matrix.
        """
        return self.body_twists(shape, self.added(shape, self.split(v, "v")))

    def body_twists(self, shape: PartShape, added: Float[Array, "k 6"]) -> Float[Array, "n 6"]:
        """Body twists of all stations from the increments of the segments."""
        twist = self._solid_twists(shape, added)
        if self.webs is None:
            return twist
        return joined([twist, self.webs.twists(self._beside(*shape[:2]), rows(twist, self.indices.beside))])

    def _solid_twists(self, shape: PartShape, added: Float[Array, "k 6"]) -> Float[Array, "n 6"]:
        """Body twists of the stations of links and rods."""
        n = self.solid
        return to_body(shape.rotation[:n], shape.position[:n], jnp.asarray(self.indices.before_station) @ added)

    @property
    def solid(self) -> int:
        """Number of stations of links and rods, which come before those of webs."""
        return self.indices.before_station.shape[0]

    def _beside(self, rotation: Float[Array, "n 3 3"], position: Float[Array, "n 3"]) -> Sides:
        """Poses of the stations beside those of webs; sliced, so that frames of webs are worked out once."""
        n, beside = self.solid, self.indices.beside
        return rows(rotation[:n], beside), rows(position[:n], beside)

    def half_width(self, shape: PartShape) -> Float[Array, "n 2"]:
        """Half axes of all sections [m]; of strips of webs by the widths that these have in this shape."""
        own = self.stations.half_width
        if self.webs is None:
            return own
        return own.at[self.solid :, 0].set(self.webs.half_width(self._beside(*shape[:2])))

    def jacobian(self, shape: PartShape, directions: Float[Array, "m nv"]) -> Float[Array, "m n 6"]:
        """Body twists of all stations for unit velocities: columns of the geometric Jacobian along `directions`."""
        return jax.vmap(lambda v: self.twists(shape, v))(directions)

    def rates_of(self, shape: PartShape, added: Float[Array, "k 6"], v: Split, a: Split) -> Float[Array, "n 6"]:
        r"""Rates of the body twists, with the increments `added` of the segments.

        $\dot V = \sum_k ad_{V_{k-1}} S_k v + Ad_{g_k} \dot s_k$ in the world frame, with the increment s_k of segment k
        in its own frame; the same vector in the body frame is the rate of the body twist.
        """
        moving = zip(self.rods, shape.rods, v[1], a[1], strict=True)
        local = self._spatial(shape, a[0], [g.map(lambda body, *x: body.added_rate(*x), *x) for g, *x in moving])
        total = local + bracket(jnp.asarray(self.indices.before_segment) @ added, added)
        rate = self._solid_twists(shape, total)
        if self.webs is None:
            return rate
        twist, beside = self._solid_twists(shape, added), self.indices.beside
        own = self.webs.twist_rates(self._beside(*shape[:2]), rows(twist, beside), rows(rate, beside))
        return joined([rate, own])


def _ends(links: Sequence[Link]) -> Float[Array, "links 2 3"] | None:
    """Ends of all links where one of them has ends of its own."""
    if all(link.ends is None for link in links):
        return None
    whole = ([jnp.zeros(3), link.tip_position] if link.ends is None else link.ends for link in links)
    return jnp.stack([jnp.stack([*two]) for two in whole])


def _plan(part: TreePart) -> PartPlan:
    soft = part.body if isinstance(part.body, SoftBody) else None
    t = jnp.zeros(())
    return PartPlan(
        name=part.name,
        parent=part.parent,
        node=part.node,
        joint=type(part.joint),
        strains=None if soft is None else soft.names,
        star=soft is not None and soft.star,
        stations=part.stations.x.shape[0],
        prescribed=part.prescribed is not None,
        prescribed_strains=part.prescribed_strains,
        strain_signals=tuple(jax.eval_shape(signal, t)[0].size for signal in part.strain_signals),
        between=part.between,
    )


def _apart(poses: Float[Array, "n 3 4"], place: int | slice) -> tuple[Array, Array]:
    """Rotations and positions of some poses."""
    return part_of(poses, (place, *np.s_[..., :3])), part_of(poses, (place, ..., 3))


def _member(groups: tuple[Alike, ...], i: int) -> Any:
    """The one with index i; None if it is in no group."""
    return next((part_of(g.things, g.members.index(i)) for g in groups if i in g.members), None)


def _signals(signals: dict[int, Signal | None], parts: Sequence[TreePart]) -> tuple[Alike[Signal], ...]:
    """Those that are there, by kind of signal and class of joint."""
    given = {i: signal for i, signal in signals.items() if signal is not None}
    return alike(given, lambda i: type(parts[i].joint))


def _at(signals: Alike[Signal], t: Array) -> tuple[Array, Array, Array]:
    """Values and derivatives of signals of one kind."""
    return signals.map(lambda signal: signal(t))


def _compose(a: Float[Array, "n 3 4"], b: Float[Array, "n 3 4"]) -> Float[Array, "n 3 4"]:
    """Poses a followed by poses b, the latter given in a's frames."""
    turned = jnp.sum(a[..., :3, None] * b[..., None, :, :], axis=-2)
    return turned + lax.pad(a[..., 3:], 0.0, ((0, 0, 0), (0, 0, 0), (3, 0, 0)))
