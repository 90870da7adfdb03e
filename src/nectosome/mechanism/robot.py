r"""Robot: a tree of parts, loads on parts and between them, and water; its equations of motion.

With the body twists $V = J v$ of all stations, the equations are

$$ \sum J^T \left( \mathcal M (J \dot v + \dot J v) - ad^T_V \mathcal M V - w \right) + K q + D v - \tau = 0 $$

where $\mathcal M$ is the body's own inertia and the added mass (the latter with the velocity relative to the water) and
w the wrenches of the loads (Boyer et al. 2021, eq. 44; Armanini et al. 2022), and of added mass that changes
(`carried`).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Drive, DriveOutput, Gaps, Mechanical, State, Strips, Water
from nectosome.core.linear_algebra import inverse
from nectosome.core.programs.remember import remembered
from nectosome.core.rows import Spread, part_of, rows, stacked
from nectosome.core.se3 import coadjoint, cross, dot_t
from nectosome.core.tracers import Untraced, traced
from nectosome.description import DIRECTIONS, RobotDescription
from nectosome.units import InputError

from .carried import carried_water, counted, emerges, times
from .extent import length_ahead
from .forces import Forces
from .load_groups import AnyLoad, Attached, Loads, Paired, names_of, strips_of
from .parts import TreePart
from .powered import PoweredDrives
from .tendons import JointTendon, TendonOutput, outputs
from .tree import PartShape, Tree


class Robot(Mechanical):
    """A tree of parts in water. `make_robot` computes the data that depend on the design only."""

    tree: Tree
    load_groups: Loads  # kind by kind
    powered: PoweredDrives  # motors along joints
    water: Water
    added: Float[Array, "n 6 6"]  # constant added mass, all of it under water (what is there: see `carried`)
    rotors: Float[Array, "nv"] | None  # inertia of the rotors along all velocities [kg m2, kg]; None without motors
    start: State
    body_length: Float[Array, ""]  # the given one, else along the forward axis of the first part (`length_ahead`) [m]
    made_from: Untraced = Untraced()
    example: Untraced = Untraced()  # a robot of this structure whose numbers are known, of one that `bind` traces
    forward: str = eqx.field(static=True, default="x")  # axis of the first part that points ahead: x, -x, ... -z
    length: Float[Array, ""] | None = None  # given, of its body [m]
    tail: int | None = eqx.field(static=True, default=None)  # part whose end beats; None: the rearmost end
    share: Float[Array, "n"] | None = None  # of the mass of stations and of forces on them that counts; None: all

    def with_load(self, part: str | tuple[str, str], load: AnyLoad, name: str | None = None) -> "Robot":
        """The robot with one more load; all else stays, but for the description, which says nothing of it.

        A `Load` acts on the stations of the part, a `JointLoad` along its joint, a `RodLoad` inside it, a `PairLoad`
        between two parts. Results have its row by its name, else by its class: `linear_drag` of a `LinearDrag`. Raises
        InputError for what is no load, for a part that there is not or that it cannot act on, and for a name in use.
        """
        return _complete(replace(self, load_groups=self.load_groups.with_one(self.tree, part, load, name)))

    def with_drive(self, part: str, drive: Drive, battery: str | None = None, supply: float | None = None) -> "Robot":
        """The robot with one more drive, along the free hinge or slide of a part; all else stays, as in `with_load`.

        `battery` is one of the robot's, else its `supply` has a constant voltage [V], or no end. Raises InputError for
        what is no drive, for a joint that it cannot move, and for an unknown battery.
        """
        powered = self.powered.with_one(self.tree, part, drive, battery, supply)
        return _complete(replace(self, powered=powered))

    def __repr__(self) -> str:
        parts = ", ".join(self.tree.names)
        return (
            f"<Robot: parts {parts}; {len(self.tree.free_v)} degrees of freedom, {len(self.tree.prescribed_v)} driven>"
        )

    @property
    def description(self) -> RobotDescription | None:
        """What the robot was built from; None where it is traced, put together otherwise, or changed since."""
        return None if self.example.value else self.made_from.value

    def described(self, description: RobotDescription | None) -> "Robot":
        """The same robot with the description that its results carry."""
        return replace(self, made_from=Untraced(description))

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """Names of the unknown velocities."""
        names = self.tree.coordinate_names
        return tuple(names[i] for i in self.tree.free_v)

    @property
    def prescribed_names(self) -> tuple[str, ...]:
        """Names of the prescribed velocities."""
        names = self.tree.coordinate_names
        return tuple(names[i] for i in self.tree.prescribed_v)

    @property
    def inertia(self) -> Float[Array, "n 6 6"]:
        """Inertia of the body's own matter, at each station."""
        return self.tree.stations.inertia

    @property
    def ahead(self) -> Float[np.ndarray, "3"]:
        """Unit vector ahead, in the frame of the first part."""
        return np.array(DIRECTIONS[self.forward])

    @property
    def loads(self) -> tuple[Attached, ...]:
        """The loads one by one."""
        return self.load_groups.one_by_one()

    @property
    def mild(self) -> bool:
        """Whether nothing in it can be stiff: no rods, springs or contacts, and loads that follow the motion evenly."""
        loads = self.load_groups
        springs = self.tree.rods or loads.along_joints or loads.in_rods or loads.pairs or self.powered.groups
        return not springs and all(g.load.mild for g in loads.on_bodies)

    def states_by_load(self, q: Array, v: Array, z: tuple[Any, ...]) -> dict[int, Any]:
        """States that the loads on bodies see, by their places among `loads`, at all q and v with load states z."""
        groups = zip(self.load_groups.on_bodies, self.load_groups.seen(self.tree, q, v, z), strict=True)
        return {i: part_of(own, k) for g, own in groups for k, i in enumerate(g.members)}

    def states_by_group(self, states: dict[int, Any]) -> tuple[Any, ...]:
        """What the loads on bodies have, such as the rates that they return, group by group."""
        return tuple(stacked([states[i] for i in g.members]) for g in self.load_groups.on_bodies)

    def initial(self) -> State:
        """Joints at their start values, rods unstressed and at rest."""
        return self.start

    def advance(self, q: Array, v: Array, step: Array) -> Array:
        """Solve q1 = q + step N(q1) v."""
        return self.tree.advance(q, v, step)

    def displacements(self, q: Float[Array, "nq"]) -> Float[Array, "nv"]:
        """Displacements of the unknown coordinates q, one per velocity; rotations as rotation vectors [rad]."""
        return self.tree.displacements(q)

    def coordinates(self, displacements: Float[Array, "nv"]) -> Float[Array, "nq"]:
        """Unknown coordinates q of `displacements`."""
        return self.tree.coordinates(displacements)

    def strips(self, t: Array, shape: PartShape, twist: Array) -> Strips:
        """All stations for loads, with velocities relative to the water."""
        strips = self.in_world(shape, twist)
        if self.water.current is None:
            return strips
        c = dot_t(strips.rotation, self.water.flow(t, strips.position)[0])
        return eqx.tree_at(lambda s: s.velocity, strips, strips.velocity - c)

    def in_world(self, shape: PartShape, twist: Array) -> Strips:
        """All stations for pair loads, with velocities in the world."""
        return strips_of(self.tree, shape, twist)

    def gaps(self, t: Array, x: State) -> Gaps | None:
        """Gaps of all loads that act on one side only; None without."""
        return self.load_groups.gaps(self.tree, t, x, self.water)

    def forces(self, t: Array, x: State, a: Float[Array, "nv"], u: Array | None = None) -> Forces:
        """All forces at time t with accelerations a of the unknown coordinates.

        u [n] adds to the generalised forces of all unknown coordinates.
        """
        tree, indices, loads = self.tree, self.tree.indices, self.load_groups
        q, v, full_a = tree.complete(t, x.q, x.v, a)
        shape = tree.shape(q)
        rod_q, split_v = tree.split(q, "q")[1], tree.split(v, "v")

        def moved(joints: tuple[Array, ...], rods: tuple[Array, ...]) -> tuple[Array, Array]:
            added = tree.added(shape, (joints, rods))
            return tree.body_twists(shape, added), added

        twist, transposed, added_twist = jax.vjp(moved, *split_v, has_aux=True)

        def pull(wrench: Array) -> Float[Array, "nv"]:
            joints, rods = transposed(wrench)
            return indices.to_v([x.ravel() for x in (*joints, *rods)])

        rate = tree.rates_of(shape, added_twist, split_v, tree.split(full_a, "v"))

        momentum = times(self.inertia, twist)
        inertia = times(self.inertia, rate) + coadjoint(twist, momentum)
        strips = self.strips(t, shape, twist)
        relative, relative_rate = self.relative(t, shape, twist, rate)
        z = loads.seen(tree, q, v, x.z)
        water = carried_water(self.added, loads, tree, self.water, t, strips, twist, z)
        added, reshaping = water.added, water.reshaping(relative)
        fluid = -times(added, relative_rate) - coadjoint(relative, times(added, relative))
        slamming = None if water.surface is None else water.surface.slam(relative)

        wrench = fluid - inertia if reshaping is None else fluid + reshaping - inertia
        if slamming is not None:
            wrench = wrench + slamming
        on_bodies = self._on_bodies(t, strips, z)
        wrenches = tuple(w for w, _ in on_bodies if w is not None)
        on_cranks = loads.torques([rate for _, rate in on_bodies])
        if wrenches:
            wrench = wrench + self.on_stations(wrenches)
        within = tuple(force for force, _ in loads.inside(tree, t, q, v, x.z))
        on_joints, in_rods = within[: len(loads.along_joints)], within[len(loads.along_joints) :]
        inside = Spread(v.shape[0], *(g.coordinates(tree, "v") for g in loads.in_rods))
        active = inside([f.ravel() for f in in_rods])
        world = self.in_world(shape, twist)
        pair_wrenches = tuple(w for g in loads.pairs for w in g.force(tree, world))
        between = Spread(twist.shape[0], *(g.stations(tree, side) for g in loads.pairs for side in (0, 1)))
        paired = pull(between(pair_wrenches)) if loads.pairs else jnp.zeros(v.shape)

        along = [[g.things.stiffness, g.things.damping] for g in tree.rods]
        elastic, viscous = (
            indices.rods_to_v([times(own[k], x).ravel() for own, x in zip(along, moving, strict=True)])
            for k, moving in enumerate((rod_q, split_v[1]))
        )
        joint, drive = self.along_joints(on_joints), self.driving_forces(t, q, v, x.z, u)
        crank = loads.on_cranks(tree, on_cranks)
        residual = elastic + viscous - joint - crank - active - paired - drive - pull(counted(self.share, wrench))
        if self.rotors is not None:
            residual = residual + self.rotors * full_a
        return Forces(
            shape=shape,
            twist=twist,
            wrenches=wrenches,
            on_joints=on_joints,
            on_cranks=on_cranks,
            in_rods=in_rods,
            pair_wrenches=pair_wrenches,
            joint=joint,
            crank=crank,
            active=active,
            paired=paired,
            added=added,
            fluid=fluid,
            reshaping=reshaping,
            surface=water.surface,
            slamming=slamming,
            inertia=inertia,
            elastic=elastic,
            viscous=viscous,
            drive=drive,
            residual=residual,
        )

    def _on_bodies(self, t: Array, strips: Strips, z: tuple[Any, ...]) -> list[tuple[Array | None, Any]]:
        """Wrenches on stations of each group of loads on bodies, which see the states z, and the rates of these."""
        return [
            (None, own) if g.load.inertial else g.force(self.tree, t, strips, own, self.water)
            for g, own in zip(self.load_groups.on_bodies, z, strict=True)
        ]

    def on_stations(self, wrenches: Sequence[Array]) -> Float[Array, "n 6"]:
        """Sum of `Forces.wrenches` on all stations."""
        places = [g.stations(self.tree) for g in self.load_groups.acting]
        return Spread(self.tree.layout[-1].stations.stop, *places)(wrenches, (6,))

    def along_joints(self, forces: Sequence[Array]) -> Float[Array, "nv"]:
        """Sum along all velocities of the forces of each group of loads on joints and of tendons."""
        places = [g.coordinates(self.tree, "v") for g in self.load_groups.along_joints]
        return Spread(self.tree.layout[-1].v.stop, *places)([f.ravel() for f in forces])

    @property
    def tendon_names(self) -> tuple[str, ...]:
        """Names of the tendons over joints."""
        return tuple(names_of(self.load_groups.tendons))

    def tendons(self, q: Array, v: Array, z: tuple[Any, ...]) -> TendonOutput:
        """Outputs of the tendons over joints at all q and v with load states z."""
        loads = self.load_groups
        within = loads.states(z)[1]
        return outputs(loads.tendons, self.tree, q, v, within[len(loads.on_joints) : len(loads.along_joints)])

    def motors(self, t: Array, q: Array, v: Array, z: tuple[Any, ...]) -> tuple[DriveOutput, tuple[Any, ...], Array]:
        """Outputs of motors at all q and v with load states z, rates of their states, and voltages of batteries."""
        return self.powered.output(self.tree, t, q, v, self.load_groups.states(z)[2])

    def driving_forces(self, t: Array, q: Array, v: Array, z: Any, u: Array | None) -> Float[Array, "nv"]:
        """Generalised forces of driven joints, of motors at all q and v, and u of the unknown coordinates."""
        tree = self.tree
        places = [tree.joint_velocities(g.members) for g in tree.drives]
        forces = [g.map(lambda signal: signal(t)[0]).ravel() for g in tree.drives]
        if self.powered.groups:
            places.append(self.powered.places(tree, "v"))
            forces.append(self.motors(t, q, v, z)[0].torque)
        if u is not None:
            places.append(tree.free_v)
            forces.append(u)
        return Spread(tree.layout[-1].v.stop, *places)(forces)

    def carried(
        self, t: Array, shape: PartShape, twist: Array, q: Array, v: Array, z: tuple[Any, ...]
    ) -> Float[Array, "n 6 6"]:
        """Added mass of all stations at all q and v with load states z."""
        tree, loads, strips = self.tree, self.load_groups, self.strips(t, shape, twist)
        return carried_water(self.added, loads, tree, self.water, t, strips, twist, loads.seen(tree, q, v, z)).added

    @property
    def emerges(self) -> bool:
        """Whether its added mass may come out of the water."""
        return emerges(self.load_groups, self.water)

    def relative(self, t: Array, shape: PartShape, twist: Array, rate: Array) -> tuple[Array, Array]:
        """Twist relative to the water and its rate (with Dc/Dt, after Morison), station frame."""
        if self.water.current is None:
            return twist, rate
        c, dc = self.water.flow(t, shape.position)
        c, dc = dot_t(shape.rotation, c), dot_t(shape.rotation, dc)
        zero = jnp.zeros_like(c)
        turning = cross(twist[:, :3], c)
        return (
            twist - jnp.concatenate([zero, c], axis=-1),
            rate - jnp.concatenate([zero, dc - turning], axis=-1),
        )

    def residual(self, t: Array, x: State, a: Float[Array, "nv"], u: Array | None = None) -> Float[Array, "nv"]:
        """M a + h [N or N m] of the unknown coordinates."""
        return rows(self.forces(t, x, a, u).residual, self.tree.free_v)

    def mass_bias(self, t: Array, x: State, u: Array | None = None) -> tuple[Array, Array]:
        """Mass matrix (added mass included) and bias of the unknown coordinates."""
        acting = self.forces(t, x, jnp.zeros_like(x.v), u)
        return self.mass(acting.shape, acting.added), rows(acting.residual, self.tree.free_v)

    def solved(self, t: Array, x: State, a: Float[Array, "nv"] | None = None) -> tuple[Float[Array, "nv"], Forces]:
        """Accelerations of the unknown coordinates by the equations of motion, or a, and all forces with them."""
        still = self.forces(t, x, jnp.zeros_like(x.v))
        every = self.tree.jacobian(still.shape, jnp.eye(self.tree.layout[-1].v.stop))
        J, inertia = rows(every, self.tree.free_v), counted(self.share, self.inertia + still.added)
        if a is None:
            a = -inverse(self._with_rotors(_mass(J, inertia))) @ rows(still.residual, self.tree.free_v)
        rate = jnp.einsum("vni,v->ni", J, a)
        pushed = jnp.einsum("vni,ni->v", every, times(inertia, rate))
        if self.rotors is not None:
            pushed = pushed + self.rotors * Spread(pushed.shape[0], self.tree.free_v)([a])
        moved = still._replace(
            fluid=still.fluid - times(still.added, rate),
            inertia=still.inertia + times(self.inertia, rate),
            residual=still.residual + pushed,
        )
        return a, moved

    def mass(self, shape: PartShape, added: Float[Array, "n 6 6"]) -> Float[Array, "nv nv"]:
        """Mass matrix, with this added mass, of the unknown coordinates."""
        return self._with_rotors(_mass(self.columns(shape), counted(self.share, self.inertia + added)))

    def _with_rotors(self, M: Float[Array, "nv nv"]) -> Float[Array, "nv nv"]:
        return M if self.rotors is None else M + jnp.diag(rows(self.rotors, self.tree.free_v))

    def columns(self, shape: PartShape) -> Float[Array, "nv n 6"]:
        """Body twists of all stations for unit velocities of the unknown coordinates."""
        return self.tree.jacobian(shape, rows(jnp.eye(self.tree.layout[-1].v.stop), self.tree.free_v))

    def state_rates(self, t: Array, x: State, u: Any = None) -> Any:
        """Rates of the load states."""
        if not jax.tree.leaves(x.z):
            return x.z
        q, v, _ = self.tree.complete(t, x.q, x.v)
        shape = self.tree.shape(q)
        strips = self.strips(t, shape, self.tree.twists(shape, v))
        loads = self.load_groups
        seen = loads.seen(self.tree, q, v, x.z)
        rates = [
            g.force(self.tree, t, strips, z, self.water)[1] if jax.tree.leaves(own) else z
            for g, z, own in zip(loads.on_bodies, seen, loads.states(x.z)[0], strict=True)
        ]
        return (*loads.rates(rates), *loads.inside_rates(self.tree, t, q, v, x.z), *self.motors(t, q, v, x.z)[1])

    @property
    def update_rates(self) -> Float[Array, "k"] | None:
        """Rates of the sampled loops of its servos [Hz]; None without any."""
        return self.powered.update_rates

    def updated(self, t: Array, x: State) -> State:
        """State after the updates of the loops that are due at t."""
        (q, v, _), (outside, inside, own) = self.tree.complete(t, x.q, x.v), self.load_groups.states(x.z)
        return State(x.q, x.v, (*outside, *inside, *self.powered.updated(self.tree, t, q, v, own)))

    def rates(self, t: Array, x: State, u: Array | None = None) -> State:
        """Time derivative of the state (explicit integration)."""
        M, h = self.mass_bias(t, x, u)
        _, dq = jax.jvp(lambda s: self.advance(x.q, x.v, s), (jnp.zeros(()),), (jnp.ones(()),))
        return State(dq, -inverse(M) @ h, self.state_rates(t, x, u))

    def weight(self) -> Float[Array, "parts"]:
        """Mass of each part [kg]."""
        return Spread(len(self.tree.structure), self.tree.indices.part_of_station)([self.inertia[:, 3, 3]])


def _mass(J: Float[Array, "nv n 6"], inertia: Float[Array, "n 6 6"]) -> Float[Array, "nv nv"]:
    """Mass matrix by the twists of all stations for unit velocities."""
    return jnp.einsum("vni,wni->vw", J, times(inertia, J))


def start_shape(robot: Robot) -> PartShape:
    """Poses of all stations at t = 0."""
    q, *_ = robot.tree.complete(jnp.zeros(()), robot.start.q, robot.start.v)
    return robot.tree.shape(q)


def start_poses(robot: Robot) -> tuple[Float[Array, "n 3 3"], Float[Array, "n 3"]]:
    """Rotations and positions [m] of all stations at t = 0, station frame to world frame."""
    return (shape := start_shape(robot)).rotation, shape.position


def make_robot(
    parts: Sequence[TreePart],
    loads: Sequence[Attached],
    water: Water,
    pairs: Sequence[Paired] = (),
    powered: PoweredDrives | None = None,
    tendons: Sequence[JointTendon] = (),
    forward: str = "x",
) -> Robot:
    """Robot with the added mass of its bodies at its stations, its length, and its start.

    Raises InputError for parts of a robot with pairs, motors, tendons or a forward axis that are not given.
    """
    tree, none = Tree.of(parts), jnp.zeros(())
    groups, powered = Loads.of(loads, pairs, tendons, tree), powered or PoweredDrives.of([], {})
    begin, still = State(*tree.start()), tree.stations.inertia
    made = _complete(Robot(tree, groups, powered, water, still, None, begin, none, forward=forward))
    if lost := [what for what in tree.beside if what not in made.tree.beside]:
        words = "Add a load by robot.with_load(part, load), or give pairs, powered, tendons and forward, too."
        raise InputError(f"what else the robot of these parts has would be lost: {', '.join(lost)}. {words}")
    return made


def _complete(robot: Robot) -> Robot:
    """The robot with what follows from its tree, loads and drives; without description and states of loads before."""
    groups, powered, tree, water, none = robot.load_groups, robot.powered, robot.tree, robot.water, jnp.zeros(())
    turned = [] if robot.forward == "x" else [f"forward axis {robot.forward}"]
    tree = replace(tree, beside=(*groups.beside, *powered.beside(tree), *turned))
    inertia, z = tree.stations.inertia, (*groups.initial(tree), *powered.initial())
    begin, rotors = State(robot.start.q, robot.start.v, z), powered.inertia(tree) if powered.groups else None
    own = {"forward": robot.forward, "length": robot.length, "tail": robot.tail}
    bare = Robot(tree, groups, powered, water, jnp.zeros_like(inertia), rotors, begin, none, **own)
    return replace(bare, **(_at_start(bare) if traced(bare) else remembered(_at_start, bare)))


def _at_start(robot: Robot) -> dict[str, Array]:
    """Added mass of all stations where a robot starts, and its length ahead."""
    shape, tree = start_shape(robot), robot.tree
    strips = robot.strips(jnp.zeros(()), shape, jnp.zeros_like(tree.stations.inertia[:, 0]))
    ahead = length_ahead(tree, robot.start, shape, robot.ahead) if robot.length is None else robot.length
    return {"added": robot.load_groups.added(tree, strips, robot.water), "body_length": ahead}
