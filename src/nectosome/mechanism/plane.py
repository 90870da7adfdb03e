r"""Planar dynamics of robots of rigid links whose joints rotate about the plane's normal or slide in the plane.

The equations are the robot's, with three components per twist instead of six. For a link with angular velocity w and
velocity v of its root, inertia M (3 x 3, with added mass) about its root and momentum $(m, f) = M (w, v)$, in the
fixed axes of the plane,

$$ M \begin{bmatrix} \dot w \\ \dot v - w \times v \end{bmatrix}
   + \begin{bmatrix} v \times f \\ w \times f \end{bmatrix} = F $$

Accelerations follow from articulated-body inertias, without a mass matrix (Featherstone 2008, ch. 7).
"""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import JointLoad, Load, Mechanical, State, se2
from nectosome.core.linear_algebra import computed_once

from .plane_links import LinkBatch, MovingLink, PlaneBody, ground, joint_angle, link_motion
from .robot import Robot


class InPlane(Mechanical):
    """A robot that moves in a plane, with the states of the robot."""

    robot: Robot
    bodies: tuple[PlaneBody, ...]
    wetted: tuple[LinkBatch, ...]
    members: tuple[tuple[tuple[int, int], ...], ...] = eqx.field(static=True)  # part and body of each member

    def initial(self) -> State:
        """Initial state of the robot."""
        return self.robot.initial()

    def advance(self, q: Float[Array, "n"], v: Float[Array, "n"], step: Float[Array, ""]) -> Float[Array, "n"]:
        """Advance the coordinates as the robot."""
        return self.robot.advance(q, v, step)

    def displacements(self, q: Float[Array, "n"]) -> Float[Array, "n"]:
        """The coordinates themselves."""
        return q

    def state_rates(self, t: Array, x: State, u: Any = None) -> Any:
        """Rates of the load states."""
        return self._inertias(t, x, self._moving(t, x, self._turns(t, x)))[2]

    def residual(self, t: Array, x: State, a: Float[Array, "n"], u: Array | None = None) -> Float[Array, "n"]:
        """Unbalanced forces [N m, N] at accelerations a, by recursive Newton-Euler."""
        links, missing = self._moving(t, x, self._turns(t, x)), -self._joint_forces(t, x, u)
        inertias, bias_wrenches, _ = self._inertias(t, x, links)
        accelerations: list[se2.Twist] = []
        wrenches: list[se2.Wrench] = []
        for k, link in enumerate(links):
            A = se2.add(self._of_parent(k, accelerations, link), link.bias)
            for S, i in zip(link.motions, self._free(self.bodies[k].part), strict=False):
                A = se2.add(A, se2.scale(a[i], S))
            accelerations.append(A)
            wrenches.append(se2.add(se2.times(inertias[k], A), bias_wrenches[k]))
        for k, link in reversed([*enumerate(links)]):
            for S, i in zip(link.motions, self._free(self.bodies[k].part), strict=False):
                missing = missing.at[i].add(se2.dot(S, wrenches[k]))
            parent = self.bodies[k].parent
            if parent >= 0:
                wrenches[parent] = se2.add(wrenches[parent], se2.shift_wrench(wrenches[k], link.step))
        return missing

    def rates(self, t: Array, x: State, u: Array | None = None) -> State:
        """Time derivative of the state, by articulated inertias."""
        turns = self._turns(t, x)
        links, force = self._moving(t, x, turns), self._joint_forces(t, x, u)
        inertias, wrenches, z = self._inertias(t, x, links)
        eliminated: list[list[tuple]] = [[] for _ in links]
        for k, link in reversed([*enumerate(links)]):
            inertia, wrench = inertias[k], wrenches[k]
            for S, i in reversed([*zip(link.motions, self._free(self.bodies[k].part), strict=False)]):
                U = se2.times(inertia, S)
                D = se2.dot(S, U)
                left = (force[i] - se2.dot(S, wrench)) / D
                inertia, wrench = se2.project_inertia(inertia, U, D), se2.add(wrench, se2.scale(left, U))
                eliminated[k].insert(0, (U, D, left, S, i))
            parent = self.bodies[k].parent
            if parent >= 0:
                wrench = se2.add(wrench, se2.times(inertia, link.bias))
                wrenches[parent] = se2.add(wrenches[parent], se2.shift_wrench(wrench, link.step))
                inertias[parent] = se2.add_inertias(inertias[parent], se2.shift_inertia(inertia, link.step))
        accelerations: list[se2.Twist] = []
        out = [jnp.zeros(())] * x.v.shape[0]
        for k, link in enumerate(links):
            A = se2.add(self._of_parent(k, accelerations, link), link.bias)
            for U, D, left, S, i in eliminated[k]:
                out[i] = left - se2.dot(U, A) / D
                A = se2.add(A, se2.scale(out[i], S))
            accelerations.append(A)
        return State(self._drift(x, turns), jnp.stack([*out]) if out else x.v, z)

    def _free(self, part: int) -> range:
        """Indices of the unknown coordinates of a part's joint."""
        parts = self.robot.tree.parts
        first = sum(before.joint.nv for before in parts[:part] if before.prescribed is None)
        return range(first, first + (parts[part].joint.nv if parts[part].prescribed is None else 0))

    def _of_parent(self, k: int, of_links: list[se2.Twist], link: MovingLink) -> se2.Twist:
        """Twist or acceleration of the parent at a link's root."""
        parent = self.bodies[k].parent
        return se2.shift_twist(of_links[parent], link.step) if parent >= 0 else ground().twist

    def _turns(self, t: Array, x: State) -> dict[int, se2.Vector]:
        """Cosine and sine of the angle of each rotating joint."""
        turning = [k for k, body in enumerate(self.bodies) if body.turn]
        if not turning:
            return {}
        angles = jnp.stack([joint_angle(self.bodies[k], self._joint(self.bodies[k].part, t, x)[0]) for k in turning])
        cosines, sines = computed_once(jnp.stack([jnp.cos(angles), jnp.sin(angles)]))
        return {k: (cosines[i], sines[i]) for i, k in enumerate(turning)}

    def _moving(self, t: Array, x: State, turns: dict[int, se2.Vector]) -> list[MovingLink]:
        links: list[MovingLink] = []
        for k, body in enumerate(self.bodies):
            before = links[body.parent] if body.parent >= 0 else ground()
            links.append(link_motion(body, before, turns.get(k), *self._joint(body.part, t, x)))
        return links

    def _drift(self, x: State, turns: dict[int, se2.Vector]) -> Float[Array, "n"]:
        """Rates of the coordinates: the velocities, rotated for joints with rotating axes."""
        out = [x.v[i] for i in range(x.v.shape[0])]
        for k, body in enumerate(self.bodies):
            free = self._free(body.part)
            if len(free) and len(body.slides) == 2:
                c, s = turns[k]
                i, j = free[:2]
                out[i], out[j] = se2.rotate((c, body.turn[0] * s), (x.v[i], x.v[j]))
        return jnp.stack(out) if out else x.v

    def _joint(self, index: int, t: Array, x: State) -> tuple[Array, Array, Array | None]:
        """Coordinates and velocities of a part's joint; accelerations of one that is prescribed."""
        part, free = self.robot.tree.parts[index], self._free(index)
        if part.prescribed is None:
            return x.q[free.start : free.stop], x.v[free.start : free.stop], None
        given = (jnp.broadcast_to(y, (part.joint.nv,)) for y in part.prescribed(t))
        q, v, a = computed_once(jnp.stack(part.joint.prescribed(*given)))
        return q, v, a

    def _inertias(
        self, t: Array, x: State, links: list[MovingLink]
    ) -> tuple[list[se2.Inertia], list[se2.Wrench], tuple[Any, ...]]:
        """Inertias of the links, their wrenches at zero acceleration, and the rates of load states."""
        at_zero, rates = [body.inertia for body in self.bodies], [*x.z]
        load_wrenches = [ground().twist for _ in links]
        for batch, members in zip(self.wetted, self.members, strict=True):
            acting = [acting_on(self.robot, part) for part, _ in members]
            states = [tuple(x.z[i] for i in each) for each in acting]
            forces = batch.link_forces(t, [links[k] for _, k in members], states, self.robot.water)
            for (_, k), each, found in zip(members, acting, forces, strict=True):
                load_wrenches[k] = se2.add(load_wrenches[k], found.wrench)
                if found.carried is not None:
                    at_zero[k] = se2.add_inertias(at_zero[k], found.carried)
                for i, rate in zip(each, found.rates, strict=True):
                    rates[i] = rate
        inertias, bias_wrenches = [], []
        for link, unrotated, wrench in zip(links, at_zero, load_wrenches, strict=True):
            inertia = se2.rotate_inertia(link.heading, unrotated)
            w, vx, vy = link.twist
            steady = se2.times(inertia, (jnp.zeros(()), w * vy, -w * vx))
            needed = se2.add(steady, se2.gyroscopic(link.twist, se2.times(inertia, link.twist)))
            inertias.append(inertia)
            bias_wrenches.append(se2.add(needed, se2.scale(-jnp.ones(()), wrench)))
        return inertias, bias_wrenches, tuple(rates)

    def _joint_forces(self, t: Array, x: State, u: Array | None) -> Float[Array, "n"]:
        """Forces of springs, dampers, joint limits and drives along the unknown coordinates."""
        out = jnp.zeros(x.v.shape) if u is None else u
        for attached in self.robot.loads:
            free = self._free(attached.part)
            if len(free) and isinstance(attached.load, JointLoad):
                out = out.at[free.start : free.stop].add(
                    attached.load.force(x.q[free.start : free.stop], x.v[free.start : free.stop])
                )
        for k, part in enumerate(self.robot.tree.parts):
            free = self._free(k)
            if part.drive is not None:
                out = out.at[free.start : free.stop].add(part.drive(t)[0])
        return out


def acting_on(robot: Robot, part: int) -> dict[int, Load]:
    """Loads on the stations of a part, by index, without added mass, which is in the inertias."""
    own = {i: a.load for i, a in enumerate(robot.loads) if a.part == part}
    return {i: load for i, load in own.items() if isinstance(load, Load) and not load.inertial}
