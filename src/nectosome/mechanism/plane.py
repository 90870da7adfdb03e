r"""Planar dynamics of robots of rigid links whose joints rotate about the plane's normal or slide in the plane.

The equations are the robot's, with three components per twist instead of six. For a link with angular velocity w and
velocity v of its root, inertia M (3 x 3, with added mass) about its root and momentum $(m, f) = M (w, v)$, in the
fixed axes of the plane,

$$ M \begin{bmatrix} \dot w \\ \dot v - w \times v \end{bmatrix}
   + \begin{bmatrix} v \times f \\ w \times f \end{bmatrix} = F $$

Accelerations follow from articulated-body inertias, without a mass matrix (Featherstone 2008, ch. 7).
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Gaps, Load, Mechanical, ReshapingLoad, SectionedLoad, State, Stations, Strips, Water, se2
from nectosome.core.linear_algebra import computed_once
from nectosome.core.rows import rows

from .carried import AtSurface
from .robot import Robot


class PlaneBody(eqx.Module):
    """A link with all parts fixed to it, at zero joint coordinates, in the axes of the plane."""

    part: int = eqx.field(static=True)  # of the robot
    parent: int = eqx.field(static=True)  # body, or -1
    offset: se2.Vector  # of its joint from the parent's root [m]
    slides: tuple[se2.Vector, ...]  # sliding axes of its joint
    turn: tuple[Array, ...]  # sense of its joint's rotation about z; () without rotation
    inertia: se2.Inertia  # about its root, with added mass unless that may come out of the water


class MovingLink(NamedTuple):
    """Motion of a link."""

    heading: se2.Vector  # cosine and sine of its rotation
    place: se2.Vector  # of its root [m]
    step: se2.Vector  # from its parent's root [m]
    twist: se2.Twist
    bias: se2.Twist  # acceleration due to velocities and prescribed joints
    motions: tuple[se2.Twist, ...]  # of its joint, one per coordinate


class LinkBatch(eqx.Module):
    """Links of one structure and their loads, stacked along the first axis for one vectorised call."""

    stations: Stations
    loads: tuple[Load, ...]
    added: Float[Array, "*m n 6 6"] | None  # added mass that may come out of the water; None without
    plane: Float[Array, "*m 3 3"]  # axes of the plane in the world, as columns
    rotation: Float[Array, "*m n 3 3"]  # of the stations, to the axes of the plane
    position: Float[Array, "*m n 3"]

    def link_forces(
        self, t: Array, links: list[MovingLink], states: list[tuple[Any, ...]], water: Water
    ) -> list["LinkForces"]:
        """Forces of the loads on each link."""
        moves = jnp.stack([jnp.stack([*link.heading, *link.place, *link.twist]) for link in links])
        if len(links) == 1:
            return [forces_on_link(jax.tree.map(lambda x: x[0], self), t, moves[0], states[0], water)]
        z = jax.tree.map(lambda *x: jnp.stack(x), *states)
        forces = jax.vmap(lambda one, move, z: forces_on_link(one, t, move, z, water))(self, moves, z)
        return [jax.tree.map(lambda x, k=k: x[k], forces) for k in range(len(links))]


class LinkForces(NamedTuple):
    """Forces of loads on one link, about its root."""

    wrench: se2.Wrench  # in the axes of the plane
    carried: se2.Inertia | None  # variable added mass, at zero joint coordinates; None without any
    rates: tuple[Any, ...]  # of the loads' states


def ground() -> MovingLink:
    """Fixed base of the first link."""
    zero = jnp.zeros(())
    still, origin = (zero, zero, zero), (zero, zero)
    return MovingLink((jnp.ones(()), zero), origin, origin, still, still, ())


def link_motion(
    body: PlaneBody, before: MovingLink, turn: se2.Vector | None, q: Array, v: Array, a: Array | None
) -> MovingLink:
    """Motion of a link by its joint: coordinates q, heading change `turn`, velocities v; a of a prescribed joint."""
    zero = jnp.zeros(())
    w = before.twist[0]
    x, y = se2.rotate(before.heading, body.offset)
    for i, axis in enumerate(body.slides):
        ex, ey = se2.rotate(before.heading, axis)
        x, y = x + q[i] * ex, y + q[i] * ey
    step, heading, spin = (x, y), before.heading, zero
    if turn is not None:
        (sense,) = body.turn
        heading = se2.rotate(heading, turn)
        spin = sense * v[-1]
    # velocities are in axes that rotate with the link
    motions: list[se2.Twist] = [(zero, *se2.rotate(heading, axis)) for axis in body.slides]
    gone = spin, zero, zero
    for i, S in enumerate(motions):
        gone = se2.add(gone, se2.scale(v[i], S))
    twist = se2.add(se2.shift_twist(before.twist, step), gone)
    bias = zero, -w * w * x - (2 * w + spin) * gone[2], -w * w * y + (2 * w + spin) * gone[1]
    motions += [(sense, zero, zero) for sense in body.turn]
    if a is not None:
        for i, S in enumerate(motions):
            bias = se2.add(bias, se2.scale(a[i], S))
    place = before.place[0] + x, before.place[1] + y
    return MovingLink(heading, place, step, twist, bias, tuple(motions))


def forces_on_link(
    alike: LinkBatch, t: Array, moves: Float[Array, "7"], z: tuple[Any, ...], water: Water
) -> LinkForces:
    """Forces of all loads with states z on one link with the motion (heading, position, twist)."""
    R, at = alike.rotation, alike.position
    c, s, X, Y, w, x, y = moves
    # in axes that rotate with the link
    own = w, c * x + s * y, c * y - s * x
    x, y = own[1] - w * at[:, 1], own[2] + w * at[:, 0]
    Rx, Ry, Rz = R[:, 0], R[:, 1], R[:, 2]
    place = [X + c * at[:, 0] - s * at[:, 1], Y + s * at[:, 0] + c * at[:, 1], at[:, 2]]
    turned = [c * Rx - s * Ry, s * Rx + c * Ry, Rz]
    strips = Strips(
        **vars(alike.stations),
        rotation=jnp.stack([_combined(row, turned) for row in alike.plane], axis=1),
        position=jnp.stack([_combined(row, place) for row in alike.plane], axis=1),
        angular_velocity=Rz * w,
        velocity=Rx * x[:, None] + Ry * y[:, None],
    )
    acting = [load.force(t, strips, state, water) for load, state in zip(alike.loads, z, strict=True)]
    wrenches = [wrench for wrench, _ in acting if wrench is not None]
    reshaped = [
        load.carried(t, strips, state, water)
        for load, state in zip(alike.loads, z, strict=True)
        if isinstance(load, ReshapingLoad)
    ]
    carried, growths = [about_root(now[None], R[:1], at[:1]) for now, _ in reshaped], [growth for _, growth in reshaped]
    if alike.added is not None:
        added = alike.added
        for now, _ in reshaped:
            added = added.at[0].add(now)
        there, share = AtSurface.of(added, t, strips, water)
        for load in alike.loads:
            if isinstance(load, SectionedLoad):
                more = AtSurface.of_sections(load, t, strips, water)
                there = AtSurface(*(x.at[0].add(y) for x, y in zip(there, more, strict=True)))
        wrenches.append(there.slam(jnp.concatenate([strips.angular_velocity, strips.velocity], axis=1)))
        carried, growths = [about_root(there.under, R, at)], [share[0] * growth for growth in growths]
    # by component, so that XLA skips those that are always 0
    total = [sum((wrench[:, i] for wrench in wrenches), jnp.zeros(at.shape[0])) for i in range(6)]
    fx, fy = (_combined(axis.T, total[3:]) for axis in (Rx, Ry))
    m = _combined(Rz.T, total[:3]) + at[:, 0] * fy - at[:, 1] * fx
    m, fx, fy = jnp.sum(m), jnp.sum(fx), jnp.sum(fy)
    for growth in growths:
        lost = se2.times(tuple(about_root(growth[None], R[:1], at[:1])), own)
        m, fx, fy = m - lost[0], fx - lost[1], fy - lost[2]
    inertia = tuple(sum(carried[1:], carried[0])) if carried else None
    return LinkForces((m, *se2.rotate((c, s), (fx, fy))), inertia, tuple(rate for _, rate in acting))


def _combined(row: Float[Array, "3 *n"], x: list[Array]) -> Array:
    """Linear combination of three arrays."""
    return row[0] * x[0] + row[1] * x[1] + row[2] * x[2]


def about_root(
    inertia: Float[Array, "n 6 6"], rotation: Float[Array, "n 3 3"], position: Float[Array, "n 3"]
) -> Float[Array, "6"]:
    """Inertia of all stations for motions (w, x, y) of the root: an `se2.Inertia`."""
    Rx, Ry, Rz = rotation[:, 0], rotation[:, 1], rotation[:, 2]
    none = jnp.zeros_like(Rx)
    spin = jnp.concatenate([Rz, position[:, :1] * Ry - position[:, 1:2] * Rx], axis=1)
    B = jnp.stack([spin, jnp.concatenate([none, Rx], axis=1), jnp.concatenate([none, Ry], axis=1)], axis=2)
    M = jnp.einsum("nia,nij,njb->ab", B, inertia, B)
    return jnp.stack([M[0, 0], M[0, 1], M[0, 2], M[1, 1], M[1, 2], M[2, 2]])


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

    @property
    def update_rates(self) -> Float[Array, "k"] | None:
        """Those of the robot."""
        return self.robot.update_rates

    def updated(self, t: Array, x: State) -> State:
        """Update the loops as the robot."""
        return self.robot.updated(t, x)

    def gaps(self, t: Array, x: State) -> Gaps | None:
        """Those of the robot."""
        return self.robot.gaps(t, x)

    def state_rates(self, t: Array, x: State, u: Any = None) -> Any:
        """Rates of the load states."""
        every = self._coordinates(t, x)
        rates = self._inertias(t, every, x, self._moving(every, self._turns(every[0])))[2]
        return self._with_motors(t, every, x, rates)

    def _with_motors(self, t: Array, every: tuple[Array, Array, Array], x: State, of_loads: tuple[Any, ...]) -> Any:
        """Rates of all states, those of loads first, of what the latter return."""
        (q, v, _), robot, loads = every, self.robot, self.robot.load_groups
        inside = loads.inside_rates(robot.tree, t, q, v, x.z)
        return (*loads.rates(of_loads), *inside, *robot.motors(t, q, v, x.z)[1])

    def residual(self, t: Array, x: State, a: Float[Array, "n"], u: Array | None = None) -> Float[Array, "n"]:
        """Unbalanced forces [N m, N] at accelerations a, by recursive Newton-Euler."""
        every = self._coordinates(t, x)
        links, rotors = self._moving(every, self._turns(every[0])), self._rotors()
        inertias, bias_wrenches, of_loads = self._inertias(t, every, x, links)
        missing = -self._joint_forces(t, every, x.z, u, of_loads)
        if rotors is not None:
            missing = missing + rotors * a
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
        every = self._coordinates(t, x)
        turns = self._turns(every[0])
        links, rotors = self._moving(every, turns), self._rotors()
        inertias, wrenches, of_loads = self._inertias(t, every, x, links)
        force = self._joint_forces(t, every, x.z, u, of_loads)
        eliminated: list[list[tuple]] = [[] for _ in links]
        for k, link in reversed([*enumerate(links)]):
            inertia, wrench = inertias[k], wrenches[k]
            for S, i in reversed([*zip(link.motions, self._free(self.bodies[k].part), strict=False)]):
                U = se2.times(inertia, S)
                D = se2.dot(S, U) if rotors is None else se2.dot(S, U) + rotors[i]
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
        return State(self._drift(x, turns), jnp.stack([*out]) if out else x.v, self._with_motors(t, every, x, of_loads))

    def _free(self, part: int) -> range:
        """Indices of the unknown coordinates of a part's joint."""
        parts = self.robot.tree.structure
        first = sum(before.joint.nv for before in parts[:part] if not before.prescribed)
        return range(first, first + (0 if parts[part].prescribed else parts[part].joint.nv))

    def _of_parent(self, k: int, of_links: list[se2.Twist], link: MovingLink) -> se2.Twist:
        """Twist or acceleration of the parent at a link's root."""
        parent = self.bodies[k].parent
        return se2.shift_twist(of_links[parent], link.step) if parent >= 0 else ground().twist

    def _coordinates(self, t: Array, x: State) -> tuple[Array, Array, Array]:
        """Coordinates, velocities and prescribed accelerations of all joints."""
        every = self.robot.tree.complete(t, x.q, x.v)
        if not self.robot.tree.motions:
            return every
        q, v, a = computed_once(jnp.stack(every))
        return q, v, a

    def _turns(self, q: Array) -> dict[int, se2.Vector]:
        """Cosine and sine of the angle of each rotating joint."""
        layout = self.robot.tree.layout
        turning = {k: layout[body.part].q.stop - 1 for k, body in enumerate(self.bodies) if body.turn}
        if not turning:
            return {}
        angles = jnp.stack([self.bodies[k].turn[0] * q[i] for k, i in turning.items()])
        cosines, sines = computed_once(jnp.stack([jnp.cos(angles), jnp.sin(angles)]))
        return {k: (cosines[i], sines[i]) for i, k in enumerate(turning)}

    def _moving(self, every: tuple[Array, Array, Array], turns: dict[int, se2.Vector]) -> list[MovingLink]:
        links: list[MovingLink] = []
        tree = self.robot.tree
        for k, body in enumerate(self.bodies):
            before, here = links[body.parent] if body.parent >= 0 else ground(), tree.layout[body.part].v
            q, v, a = (x[here] for x in every)
            links.append(
                link_motion(body, before, turns.get(k), q, v, a if tree.structure[body.part].prescribed else None)
            )
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

    def _inertias(
        self, t: Array, every: tuple[Array, Array, Array], x: State, links: list[MovingLink]
    ) -> tuple[list[se2.Inertia], list[se2.Wrench], tuple[Any, ...]]:
        """Inertias of the links, their wrenches at zero acceleration, and what loads return beside these."""
        at_zero, states = [body.inertia for body in self.bodies], self.robot.states_by_load(*every[:2], x.z)
        rates, on_parts = {**states}, acting(self.robot)
        load_wrenches = [ground().twist for _ in links]
        for batch, members in zip(self.wetted, self.members, strict=True):
            indices = [on_parts.get(part, []) for part, _ in members]
            own = [tuple(states[i] for i in each) for each in indices]
            forces = batch.link_forces(t, [links[k] for _, k in members], own, self.robot.water)
            for (_, k), each, found in zip(members, indices, forces, strict=True):
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
        return inertias, bias_wrenches, self.robot.states_by_group(rates)

    def _joint_forces(
        self, t: Array, every: tuple[Array, Array, Array], z: Any, u: Array | None, of_loads: tuple[Any, ...]
    ) -> Float[Array, "n"]:
        """Forces of springs, dampers, joint limits, drives and loads on cranks along the unknown coordinates."""
        (q, v, _), robot, loads = every, self.robot, self.robot.load_groups
        along = robot.along_joints([force for force, _ in loads.inside(robot.tree, t, q, v, z)])  # there are no rods
        on_joints = along + robot.driving_forces(t, q, v, z, u)
        return rows(on_joints + loads.on_cranks(robot.tree, loads.torques(of_loads)), robot.tree.free_v)

    def _rotors(self) -> Float[Array, "n"] | None:
        """Inertia of the rotors of motors along the unknown coordinates."""
        rotors = self.robot.rotors
        return None if rotors is None else rows(rotors, self.robot.tree.free_v)


def acting(robot: Robot) -> dict[int, list[int]]:
    """Indices of the loads on the stations of each part, without added mass, which is in the inertias."""
    out: dict[int, list[int]] = {}
    for g in robot.load_groups.acting:
        for i, part in zip(g.members, g.parts, strict=True):
            out.setdefault(part, []).append(i)
    return {part: sorted(indices) for part, indices in out.items()}
