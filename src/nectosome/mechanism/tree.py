"""The kinematic tree of parts: poses, twists and twist rates of all stations."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Signal
from nectosome.core.se3 import bracket, compose, dot, matmul3, to_body, to_spatial

from .joints import Joint, JointMotion
from .links import Link
from .rods import SoftRod, rod_added, rod_added_rate, rod_shape


class TreePart(eqx.Module):
    """A body, its joint to the parent, and the position of that joint on the parent."""

    name: str = eqx.field(static=True)
    parent: int = eqx.field(static=True)  # index of an earlier part; -1: the world
    node: int = eqx.field(static=True)  # -1: the parent's tip; 0: its root; else a node of a parent rod
    rotation: Float[Array, "3 3"]  # joint frame in the frame of that node
    position: Float[Array, "3"]  # [m]
    joint: Joint
    body: Link | SoftRod
    prescribed: Signal | None = None  # the joint's coordinates as a function of time
    drive: Signal | None = None  # generalised force of a driven joint [N m, N]
    prescribed_strains: tuple[int, ...] = eqx.field(static=True, default=())  # indices of strain coordinates of a rod
    strain_signals: tuple[Signal, ...] = ()  # their values as functions of time, in order

    @property
    def free_strains(self) -> np.ndarray:
        """Indices of the free strain coordinates of a rod."""
        every = np.arange(self.body.nq)
        return np.setdiff1d(every, self.prescribed_strains) if self.prescribed_strains else every

    def strains(self, q: Array, v: Array, t: Array) -> tuple[Array, Array, Array]:
        """All strain coordinates of a rod and their first and second rates, from the free ones."""
        if not self.prescribed_strains:
            return q, v, jnp.zeros(v.shape)
        prescribed = [jnp.concatenate(x) for x in zip(*(signal(t) for signal in self.strain_signals), strict=True)]
        free = q, v, jnp.zeros(v.shape)
        whole = (jnp.zeros(self.body.nq).at[self.free_strains].set(x) for x in free)
        full_q, full_v, full_a = (
            x.at[np.array(self.prescribed_strains)].set(y) for x, y in zip(whole, prescribed, strict=True)
        )
        return full_q, full_v, full_a


def node_at(body: Link | SoftRod, at: str | float) -> int:
    """The node of a part at its "tip" (-1), its "root" (0) or a mark of a rod."""
    if at == "tip":
        return -1
    return body.nodes.index(at) if isinstance(body, SoftRod) and at != "root" else 0


class PartShape(NamedTuple):
    """Poses of all stations, and the frames of the motion increments of joints and rod intervals."""

    rotation: Float[Array, "n 3 3"]  # station frame to world frame
    position: Float[Array, "n 3"]  # [m], world frame
    joints: tuple[JointMotion, ...]
    rods: tuple[tuple[Array, Array] | None, ...]  # strains and steps of each part that is a rod
    frame_rotation: Float[Array, "k 3 3"]  # of each segment
    frame_position: Float[Array, "k 3"]


class TreeLayout(NamedTuple):
    """Slices of a part in the flat arrays; static."""

    q: slice  # joint coordinates, then rod coordinates
    v: slice
    stations: slice
    segments: slice  # motion increments: the joint, then a rod's intervals


class Tree(eqx.Module):
    """Parts, parents first."""

    parts: tuple[TreePart, ...]

    @property
    def layout(self) -> tuple[TreeLayout, ...]:
        """Layout of each part."""
        out, q, v, n, k = [], 0, 0, 0, 0
        for part in self.parts:
            dq, dv = part.joint.nq + part.body.nq, part.joint.nv + part.body.nq
            dn = part.body.weight.shape[0]
            dk = 1 + (dn - 1 if isinstance(part.body, SoftRod) else 0)
            out.append(TreeLayout(slice(q, q + dq), slice(v, v + dv), slice(n, n + dn), slice(k, k + dk)))
            q, v, n, k = q + dq, v + dv, n + dn, k + dk
        return tuple(out)

    def part(self, name: str) -> int:
        """Index of a part."""
        return [part.name for part in self.parts].index(name)

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """Names of all velocities, prescribed ones included, such as `filament.bending_y.2`."""
        names = []
        for part in self.parts:
            names += [f"{part.name}.{name}" for name in part.joint.names]
            names += [f"{part.name}.{name}" for name in (part.body.names if isinstance(part.body, SoftRod) else ())]
        return tuple(names)

    def _select(self, prescribed: bool) -> np.ndarray:
        index = []
        for part, place in zip(self.parts, self.layout, strict=True):
            first = place.v.start + part.joint.nv
            index += range(place.v.start, first) if (part.prescribed is not None) == prescribed else ()
            index += [first + i for i in (part.prescribed_strains if prescribed else part.free_strains)]
        return np.array(index, dtype=int)

    @property
    def free_v(self) -> np.ndarray:
        """Indices of the unknown velocities."""
        return self._select(False)

    @property
    def prescribed_v(self) -> np.ndarray:
        """Indices of the prescribed velocities."""
        return self._select(True)

    def complete(self, t: Array, q: Array, v: Array) -> tuple[Array, Array, Array]:
        """Coordinates, velocities and accelerations of all joints: prescribed ones from their signals, else a = 0."""
        full_q, full_v, full_a = [], [], []
        iq = iv = 0
        for part in self.parts:
            if part.prescribed is not None:
                follow = (jnp.broadcast_to(x, (part.joint.nv,)) for x in part.prescribed(t))
                joint = part.joint.prescribed(*follow)
            else:
                nq, nv = part.joint.nq, part.joint.nv
                joint = q[iq : iq + nq], v[iv : iv + nv], jnp.zeros(nv)
                iq, iv = iq + nq, iv + nv
            n = part.free_strains.size
            bent = part.strains(q[iq : iq + n], v[iv : iv + n], t)
            iq, iv = iq + n, iv + n
            for full, *own in zip((full_q, full_v, full_a), joint, bent, strict=True):
                full += own
        return jnp.concatenate(full_q), jnp.concatenate(full_v), jnp.concatenate(full_a)

    def advance(self, q: Array, v: Array, step: Array) -> Array:
        """Solve q1 = q + step N(q1) v for the unknown coordinates."""
        out, iq, iv = [], 0, 0
        for part in self.parts:
            if part.prescribed is None and part.joint.nv:
                nq, nv = part.joint.nq, part.joint.nv
                out.append(part.joint.advance(q[iq : iq + nq], v[iv : iv + nv], step))
                iq, iv = iq + nq, iv + nv
            n = part.free_strains.size
            out.append(q[iq : iq + n] + step * v[iv : iv + n])
            iq, iv = iq + n, iv + n
        return jnp.concatenate([jnp.zeros(0), *out])

    def start(self) -> tuple[Array, Array]:
        """Initial unknown coordinates and velocities: joints by their start values, rods at rest and unstressed."""
        qs, vs = [], []
        for part in self.parts:
            if part.prescribed is None:
                q, v = part.joint.start()
                qs.append(q)
                vs.append(v)
            n = part.free_strains.size
            qs.append(jnp.asarray(np.zeros(n)))
            vs.append(jnp.asarray(np.zeros(n)))
        return jnp.concatenate([jnp.zeros(0), *qs]), jnp.concatenate([jnp.zeros(0), *vs])

    def _over_rods(self, f: Callable, *args: dict[int, Any]) -> dict[int, Any]:
        """f(rod, *its arguments) for all rods, with one vectorised call for rods of one structure."""
        groups: dict[object, list[int]] = {}
        for i in args[0]:
            groups.setdefault(jax.tree.structure(self.parts[i].body), []).append(i)
        out = {}
        for members in groups.values():
            each = [(self.parts[i].body, *(arg[i] for arg in args)) for i in members]
            if len(members) == 1:
                out[members[0]] = f(*each[0])
                continue
            together = jax.vmap(f)(*jax.tree.map(lambda *x: jnp.stack(x), *each))
            for k, i in enumerate(members):
                out[i] = jax.tree.map(lambda x, k=k: x[k], together)
        return out

    def _of_rods(self, x: Array, what: str) -> dict[int, Array]:
        """Rod coordinates (what = "q") or velocities ("v") of each part that is a rod."""
        return {
            i: x[getattr(place, what)][getattr(part.joint, "n" + what) :]
            for i, (part, place) in enumerate(zip(self.parts, self.layout, strict=True))
            if isinstance(part.body, SoftRod)
        }

    def shape(self, q: Float[Array, "nq"]) -> PartShape:
        """Poses of all stations from the completed coordinates."""
        rods = self._over_rods(rod_shape, self._of_rods(q, "q"))
        R, p, frame_R, frame_p, joints = [], [], [], [], []
        places: list[tuple[Array, Array, Array, Array]] = []
        for i, (part, place) in enumerate(zip(self.parts, self.layout, strict=True)):
            base = (jnp.eye(3), jnp.zeros(3))
            if part.parent >= 0:
                Rn, pn, Rt, pt = places[part.parent]
                base = (Rt, pt) if part.node < 0 else (Rn[part.node], pn[part.node])
            joint = part.joint.motion(q[place.q][: part.joint.nq])
            carrier = compose(base, (part.rotation, part.position))
            R0, p0 = compose(carrier, (joint.rotation, joint.position))
            if isinstance(part.body, SoftRod):
                Rn, pn = matmul3(R0, rods[i].rotation), p0 + dot(R0, rods[i].position)
                places.append((Rn, pn, Rn[-1], pn[-1]))
                frame_R += [R0[None], Rn[:-1]]
                frame_p += [p0[None], pn[:-1]]
            else:
                Rn, pn = matmul3(R0, part.body.rotation), p0 + dot(R0, part.body.position)
                places.append(
                    (R0[None], p0[None], *compose((R0, p0), (part.body.tip_rotation, part.body.tip_position)))
                )
                frame_R.append(R0[None])
                frame_p.append(p0[None])
            R.append(Rn)
            p.append(pn)
            joints.append(joint)
        inner = tuple((rods[i].strains, rods[i].step) if i in rods else None for i in range(len(self.parts)))
        R, p, frame_R, frame_p = (jnp.concatenate(x) for x in (R, p, frame_R, frame_p))
        return PartShape(R, p, tuple(joints), inner, frame_R, frame_p)

    def _spatial(self, shape: PartShape, v: Array, rods: dict[int, Array]) -> Float[Array, "k 6"]:
        """Spatial twists of the segments in order: joints with velocities (or accelerations) v, rod intervals."""
        out = []
        for i, (part, place, joint) in enumerate(zip(self.parts, self.layout, shape.joints, strict=True)):
            out.append(jnp.sum(joint.subspace * v[place.v][: part.joint.nv, None], axis=0)[None])
            if i in rods:
                out.append(rods[i])
        return to_spatial(shape.frame_rotation, shape.frame_position, jnp.concatenate(out))

    def _added(self, shape: PartShape, v: Array) -> Float[Array, "k 6"]:
        """Spatial twist increment of each segment; linear in v."""
        vs = self._of_rods(v, "v")
        inner = {i: rod for i, rod in enumerate(shape.rods) if rod is not None}
        strains, steps = ({i: rod[k] for i, rod in inner.items()} for k in (0, 1))
        rods = self._over_rods(rod_added, strains, steps, vs) if vs else {}
        return self._spatial(shape, v, rods)

    def twists(self, shape: PartShape, v: Float[Array, "nv"]) -> Float[Array, "n 6"]:
        r"""Body twists of all stations; linear in v.

        In the world frame the twist of a station is the sum of the increments of the segments before it,
        $V = \sum_k S_k v$: a product with the constant ancestor matrix.
        """
        _, before_station = self._ancestors()
        return to_body(shape.rotation, shape.position, before_station @ self._added(shape, v))

    def jacobian(self, shape: PartShape, directions: Float[Array, "m nv"]) -> Float[Array, "m n 6"]:
        """Body twists of all stations for unit velocities: columns of the geometric Jacobian along `directions`."""
        return jax.vmap(lambda v: self.twists(shape, v))(directions)

    def twist_rates(
        self, shape: PartShape, q: Float[Array, "nq"], v: Float[Array, "nv"], a: Float[Array, "nv"]
    ) -> Float[Array, "n 6"]:
        r"""Rates of the body twists along the motion (q, v, a).

        $\dot V = \sum_k ad_{V_{k-1}} S_k v + Ad_{g_k} \dot s_k$ in the world frame, with the increment s_k of segment k
        in its own frame; the same vector in the body frame is the rate of the body twist.
        """
        vs = self._of_rods(v, "v")
        rods = self._over_rods(rod_added_rate, self._of_rods(q, "q"), vs, self._of_rods(a, "v")) if vs else {}
        local = self._spatial(shape, a, rods)
        before_segment, before_station = self._ancestors()
        added = self._added(shape, v)
        total = local + bracket(before_segment @ added, added)
        return to_body(shape.rotation, shape.position, before_station @ total)

    def _ancestors(self) -> tuple[Array, Array]:
        """Matrices of the segments before each segment [k, k], and before or at each station [n, k]."""
        layout = self.layout
        n, k = layout[-1].stations.stop, layout[-1].segments.stop
        to_segment, to_station = np.zeros((k, k)), np.zeros((n, k))
        for part, place in zip(self.parts, layout, strict=True):
            inherited = np.zeros(k)
            if part.parent >= 0:
                parent = layout[part.parent]
                rows = to_station[parent.stations]
                # the tip of a link is rigidly connected to its stations
                inherited = rows[part.node] if isinstance(self.parts[part.parent].body, SoftRod) else rows[0]
            for j, segment in enumerate(range(place.segments.start, place.segments.stop)):
                to_segment[segment] = inherited
                inherited = inherited.copy()
                inherited[segment] = 1
                if isinstance(part.body, SoftRod):
                    to_station[place.stations.start + j] = inherited
            if not isinstance(part.body, SoftRod):
                to_station[place.stations] = inherited
        return jnp.asarray(to_segment), jnp.asarray(to_station)
