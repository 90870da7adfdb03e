r"""Motion in the plane, for robots of rigid links whose joints all turn about z or slide across it.

The equations are the robot's, with three numbers a twist instead of six. For a link with angular velocity w and
velocity v of its root, inertia M (3 x 3, with the water it carries) about its root and momentum
$(m, f) = M (w, v)$, along the axes of the world,

$$ M \begin{bmatrix} \dot w \\ \dot v - w \times v \end{bmatrix}
   + \begin{bmatrix} v \times f \\ w \times f \end{bmatrix} = F $$

Accelerations are found joint by joint with articulated inertias, without a mass matrix (Featherstone 2008, ch. 7).
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Load, Mechanical, State, se2
from nectosome.core.linear import kept

from .plane_links import Alike, Body, Moving, moved, turned_by, world
from .robot import Robot


class InPlane(Mechanical):
    """A robot that moves in the plane. Its states are those of the robot."""

    robot: Robot
    bodies: tuple[Body, ...]
    wetted: tuple[Alike, ...]
    members: tuple[tuple[int, ...], ...] = eqx.field(static=True)  # links of each of these

    def initial(self) -> State:
        """As the robot's."""
        return self.robot.initial()

    def advance(self, q: Float[Array, "n"], v: Float[Array, "n"], step: Float[Array, ""]) -> Float[Array, "n"]:
        """As the robot's."""
        return self.robot.advance(q, v, step)

    def displacements(self, q: Float[Array, "n"]) -> Float[Array, "n"]:
        """The coordinates themselves."""
        return q

    def state_rates(self, t: Array, x: State, u: Any = None) -> Any:
        """Loads with states are not taken into the plane."""
        return x.z

    def residual(self, t: Array, x: State, a: Float[Array, "n"], u: Array | None = None) -> Float[Array, "n"]:
        """Unbalanced forces [N m, N] at accelerations a: down the tree and up again (recursive Newton-Euler)."""
        links, missing = self._moving(t, x), -self._joint_forces(t, x, u)
        inertias, held = self._inertias(t, links)
        accelerations: list[se2.Twist] = []
        wrenches: list[se2.Wrench] = []
        for k, link in enumerate(links):
            A = se2.add(self._of_parent(k, accelerations, link), link.bias)
            for S, i in zip(link.motions, self._free(k), strict=False):
                A = se2.add(A, se2.scale(a[i], S))
            accelerations.append(A)
            wrenches.append(se2.add(se2.times(inertias[k], A), held[k]))
        for k, link in reversed([*enumerate(links)]):
            for S, i in zip(link.motions, self._free(k), strict=False):
                missing = missing.at[i].add(se2.dot(S, wrenches[k]))
            parent = self._parent(k)
            if parent >= 0:
                wrenches[parent] = se2.add(wrenches[parent], se2.taken_back(wrenches[k], link.step))
        return missing

    def rates(self, t: Array, x: State, u: Array | None = None) -> State:
        """Time derivative of the state, by articulated inertias."""
        links, force = self._moving(t, x), self._joint_forces(t, x, u)
        inertias, wrenches = self._inertias(t, links)
        pushed: list[list[tuple]] = [[] for _ in links]
        for k, link in reversed([*enumerate(links)]):
            inertia, wrench = inertias[k], wrenches[k]
            for S, i in reversed([*zip(link.motions, self._free(k), strict=False)]):
                U = se2.times(inertia, S)
                D = se2.dot(S, U)
                left = (force[i] - se2.dot(S, wrench)) / D
                inertia, wrench = se2.freed(inertia, U, D), se2.add(wrench, se2.scale(left, U))
                pushed[k].insert(0, (U, D, left, S, i))
            parent = self._parent(k)
            if parent >= 0:
                wrench = se2.add(wrench, se2.times(inertia, link.bias))
                wrenches[parent] = se2.add(wrenches[parent], se2.taken_back(wrench, link.step))
                inertias[parent] = se2.sum_of(inertias[parent], se2.inertia_before(inertia, link.step))
        accelerations: list[se2.Twist] = []
        out = [jnp.zeros(())] * x.v.shape[0]
        for k, link in enumerate(links):
            A = se2.add(self._of_parent(k, accelerations, link), link.bias)
            for U, D, left, S, i in pushed[k]:
                out[i] = left - se2.dot(U, A) / D
                A = se2.add(A, se2.scale(out[i], S))
            accelerations.append(A)
        _, moved = jax.jvp(lambda step: self.advance(x.q, x.v, step), (jnp.zeros(()),), (jnp.ones(()),))
        return State(moved, jnp.stack([*out]) if out else x.v, x.z)

    def _parent(self, k: int) -> int:
        return self.robot.tree.parts[k].parent

    def _free(self, k: int) -> range:
        """Indices of the unknown coordinates of a link's joint."""
        tree = self.robot.tree
        first = sum(part.joint.nv for part in tree.parts[:k] if part.prescribed is None)
        part = tree.parts[k]
        return range(first, first + (part.joint.nv if part.prescribed is None else 0))

    def _of_parent(self, k: int, of_links: list[se2.Twist], link: Moving) -> se2.Twist:
        """Twist or acceleration that a link's root shares with its parent."""
        parent = self._parent(k)
        return se2.carried(of_links[parent], link.step) if parent >= 0 else world().twist

    def _moving(self, t: Array, x: State) -> list[Moving]:
        joints = [self._joint(k, t, x) for k in range(len(self.bodies))]
        angles = jnp.stack([turned_by(body, q) for body, (q, _, _) in zip(self.bodies, joints, strict=True)])
        cosines, sines = kept(jnp.stack([jnp.cos(angles), jnp.sin(angles)]))
        links: list[Moving] = []
        for k, (body, motion) in enumerate(zip(self.bodies, joints, strict=True)):
            parent = self._parent(k)
            before = links[parent] if parent >= 0 else world()
            links.append(moved(body, before, (cosines[k], sines[k]), *motion))
        return links

    def _joint(self, k: int, t: Array, x: State) -> tuple[Array, Array, Array | None]:
        """Coordinates and velocities of a link's joint; accelerations of one that is prescribed."""
        part, free = self.robot.tree.parts[k], self._free(k)
        if part.prescribed is None:
            return x.q[free.start : free.stop], x.v[free.start : free.stop], None
        given = (jnp.broadcast_to(y, (part.joint.nv,)) for y in part.prescribed(t))
        q, v, a = kept(jnp.stack(part.joint.prescribed(*given)))
        return q, v, a

    def _inertias(self, t: Array, links: list[Moving]) -> tuple[list[se2.Inertia], list[se2.Wrench]]:
        """Inertias of the links along the axes of the world, and the wrenches that hold them without acceleration."""
        inertias, held = [], []
        for link, body in zip(links, self.bodies, strict=True):
            inertia = se2.turned_inertia(link.heading, body.inertia)
            w, x, y = link.twist
            even = se2.times(inertia, (jnp.zeros(()), w * y, -w * x))
            inertias.append(inertia)
            held.append(se2.add(even, se2.gyroscopic(link.twist, se2.times(inertia, link.twist))))
        for alike, members in zip(self.wetted, self.members, strict=True):
            each = alike.wrenches(t, [links[k] for k in members], self.robot.water)
            for k, wrench in zip(members, each, strict=True):
                held[k] = se2.add(held[k], se2.scale(-jnp.ones(()), wrench))
        return inertias, held

    def _joint_forces(self, t: Array, x: State, u: Array | None) -> Float[Array, "n"]:
        """Forces of springs, dampers, stops and drives along the unknown coordinates."""
        out = jnp.zeros(x.v.shape) if u is None else u
        for attached in self.robot.loads:
            free = self._free(attached.part)
            if len(free) and not isinstance(attached.load, Load):
                out = out.at[free.start : free.stop].add(
                    attached.load.force(x.q[free.start : free.stop], x.v[free.start : free.stop])
                )
        for k, part in enumerate(self.robot.tree.parts):
            free = self._free(k)
            if part.drive is not None:
                out = out.at[free.start : free.stop].add(part.drive(t)[0])
        return out
