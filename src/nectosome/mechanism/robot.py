r"""Robot: a tree of parts, loads on parts and between them, and water; its equations of motion.

With the body twists $V = J v$ of all stations, the equations are

$$ \sum J^T \left( \mathcal M (J \dot v + \dot J v) - ad^T_V \mathcal M V - w \right) + K q + D v - \tau = 0 $$

where $\mathcal M$ is the body's own inertia and the added mass (the latter with the velocity relative to the water) and
w the wrenches of the loads (Boyer et al. 2021, eq. 44; Armanini et al. 2022). If a load changes the shape of a body,
the momentum A V of the water also changes with its added mass A, which gives the wrench $-\dot A V$.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import JointLoad, Load, Mechanical, PairLoad, ReshapingLoad, RodLoad, State, Strips, Water
from nectosome.core.linear_algebra import inverse
from nectosome.core.se3 import coadjoint, cross, dot_t
from nectosome.description import RobotDescription

from .rods import SoftRod
from .tree import PartShape, Tree


@jax.tree_util.register_pytree_node_class
class Untraced:
    """A value in a field of a pytree that is neither a leaf nor a part of its structure.

    Two trees that differ in it alone are the same to `jax.jit`: nothing is compiled anew. Whatever takes a tree apart
    and puts it together again (`jit`, `vmap`, `tree.map`, `eqx.tree_at`) leaves None in its place: a value never
    stays with a tree that has changed.
    """

    __slots__ = ("value",)

    def __init__(self, value: Any = None):
        self.value = value

    def __repr__(self) -> str:
        return f"Untraced({self.value!r})"

    def tree_flatten(self) -> tuple[tuple[()], None]:
        """No leaves, no structure."""
        return (), None

    @classmethod
    def tree_unflatten(cls, structure: None, leaves: tuple[()]) -> "Untraced":
        """Without the value."""
        return cls()


class Attached(eqx.Module):
    """A load and the part on whose stations or joint it acts."""

    name: str = eqx.field(static=True)
    part: int = eqx.field(static=True)
    load: Load | JointLoad | RodLoad


class Paired(eqx.Module):
    """A load between two parts."""

    name: str = eqx.field(static=True)
    parts: tuple[int, int] = eqx.field(static=True)
    load: PairLoad


class Forces(NamedTuple):
    """All forces at one time; their sum is the residual."""

    shape: PartShape
    twist: Float[Array, "n 6"]  # of the stations, body frame
    wrenches: tuple[Array | None, ...]  # of each load on its part's stations, station frame
    inner_forces: tuple[Array | None, ...]  # of each load along the velocities of its part's joint or strains
    pair_wrenches: tuple[tuple[Array, Array], ...]  # of each pair on the stations of its two parts, station frame
    joint: Float[Array, "nv"]  # sum of those on joints
    active: Float[Array, "nv"]  # sum of those inside rods
    paired: Float[Array, "nv"]  # sum of those of pairs
    added: Float[Array, "n 6 6"]  # current added mass
    fluid: Float[Array, "n 6"]  # inertia force of the added mass, station frame
    reshaping: Float[Array, "n 6"] | None  # wrench of the changing added mass; None if it is constant
    inertia: Float[Array, "n 6"]  # rate of momentum of the body's own matter
    elastic: Float[Array, "nv"]  # K q of the rods
    viscous: Float[Array, "nv"]  # D v of the rods
    drive: Float[Array, "nv"]  # of driven joints
    residual: Float[Array, "nv"]  # zero at free coordinates, the reaction at prescribed ones


class Robot(Mechanical):
    """A tree of parts in water. `make_robot` computes the data that depend on the design only."""

    tree: Tree
    loads: tuple[Attached, ...]
    water: Water
    inertia: Float[Array, "n 6 6"]  # of the body's own matter, at each station
    added: Float[Array, "n 6 6"]  # constant added mass (variable part: see `carried`)
    pairs: tuple[Paired, ...] = ()
    made_from: Untraced = Untraced()

    def __repr__(self) -> str:
        parts = ", ".join(part.name for part in self.tree.parts)
        return (
            f"<Robot: parts {parts}; {len(self.tree.free_v)} degrees of freedom, {len(self.tree.prescribed_v)} driven>"
        )

    @property
    def description(self) -> RobotDescription | None:
        """What the robot was built from; None where it is traced, put together otherwise, or changed since."""
        return self.made_from.value

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

    def initial(self) -> State:
        """Joints at their start values, rods unstressed and at rest."""
        q, v = self.tree.start()
        return State(q, v, tuple(a.load.initial() if isinstance(a.load, Load) else () for a in self.loads))

    def advance(self, q: Array, v: Array, step: Array) -> Array:
        """Solve q1 = q + step N(q1) v."""
        return self.tree.advance(q, v, step)

    def displacements(self, q: Float[Array, "nq"]) -> Float[Array, "nv"]:
        """Displacements of the unknown coordinates q, one per velocity; rotations as rotation vectors [rad]."""
        return self._converted(q, "nq", "displacement")

    def coordinates(self, displacements: Float[Array, "nv"]) -> Float[Array, "nq"]:
        """Unknown coordinates q of `displacements`."""
        return self._converted(displacements, "nv", "coordinates")

    def _converted(self, x: Array, size: str, method: str) -> Array:
        """Numbers of all unknown joints, `size` of each, converted by a method of the joint; strains stay."""
        out, i = [jnp.zeros(0)], 0
        for part in self.tree.parts:
            if part.prescribed is None and part.joint.nv:
                n = getattr(part.joint, size)
                out.append(getattr(part.joint, method)(x[i : i + n]))
                i += n
            n = part.free_strains.size
            out.append(x[i : i + n])
            i += n
        return jnp.concatenate(out)

    def strips(self, part: int, t: Array, shape: PartShape, twist: Array) -> Strips:
        """Stations of one part for a load, with velocities relative to the water."""
        strips = self.in_world(part, shape, twist)
        if self.water.current is None:
            return strips
        c = dot_t(strips.rotation, self.water.flow(t, strips.position)[0])
        return eqx.tree_at(lambda s: s.velocity, strips, strips.velocity - c)

    def in_world(self, part: int, shape: PartShape, twist: Array) -> Strips:
        """Stations of one part for a pair load, with velocities in the world."""
        here, body = self.tree.layout[part].stations, self.tree.parts[part].body
        return Strips(
            rotation=shape.rotation[here],
            position=shape.position[here],
            angular_velocity=twist[here, :3],
            velocity=twist[here, 3:],
            x=body.x,
            weight=body.weight,
            half_width=body.half_width,
            volume=body.volume,
            inertia=self.inertia[here],
        )

    def forces(self, t: Array, x: State, a: Float[Array, "nv"], u: Array | None = None) -> Forces:
        """All forces at time t with accelerations a of the unknown coordinates.

        u [n] adds to the generalised forces of all unknown coordinates.
        """
        tree = self.tree
        q, v, prescribed = tree.complete(t, x.q, x.v)
        full_a = prescribed.at[tree.free_v].add(a)
        shape = tree.shape(q)
        twist, pull = jax.vjp(lambda v: tree.twists(shape, v), v)
        rate = tree.twist_rates(shape, q, v, full_a)

        momentum = times(self.inertia, twist)
        inertia = times(self.inertia, rate) + coadjoint(twist, momentum)
        relative, relative_rate = self.relative(t, shape, twist, rate)
        added, growth = self.carried(t, shape, twist, x.z)
        momentum = times(added, relative)
        fluid = -times(added, relative_rate) - coadjoint(relative, momentum)
        reshaping = None if growth is None else -times(growth, relative)

        wrench = fluid - inertia if reshaping is None else fluid + reshaping - inertia
        joint, active = jnp.zeros(v.shape), jnp.zeros(v.shape)
        wrenches, inner_forces = [], []
        for attached, z in zip(self.loads, x.z, strict=True):
            place = tree.layout[attached.part]
            if isinstance(attached.load, Load):
                w, _ = attached.load.force(t, self.strips(attached.part, t, shape, twist), z, self.water)
                wrench = wrench if w is None else wrench.at[place.stations].add(w)
                wrenches.append(w)
                inner_forces.append(None)
            else:
                kind = tree.parts[attached.part].joint
                if isinstance(attached.load, RodLoad):
                    f = attached.load.force(t, q[place.q][kind.nq :], v[place.v][kind.nv :])
                    f = jnp.concatenate([jnp.zeros(kind.nv), f])
                    active = active.at[place.v].add(f)
                else:
                    f = attached.load.force(kind.displacement(q[place.q][: kind.nq]), v[place.v][: kind.nv])
                    f = jnp.concatenate([f, jnp.zeros(place.v.stop - place.v.start - kind.nv)])
                    joint = joint.at[place.v].add(f)
                wrenches.append(None)
                inner_forces.append(f)

        between = jnp.zeros_like(wrench)
        pair_wrenches = []
        for pair in self.pairs:
            both = pair.load.force(*(self.in_world(part, shape, twist) for part in pair.parts))
            for part, w in zip(pair.parts, both, strict=True):
                between = between.at[tree.layout[part].stations].add(w)
            pair_wrenches.append(both)
        paired = pull(between)[0] if self.pairs else jnp.zeros(v.shape)

        elastic, viscous, drive = (jnp.zeros(v.shape) for _ in range(3))
        for part, place in zip(tree.parts, tree.layout, strict=True):
            start = place.v.start + part.joint.nv
            if isinstance(part.body, SoftRod):
                elastic = elastic.at[start : place.v.stop].set(part.body.stiffness @ q[place.q][part.joint.nq :])
                viscous = viscous.at[start : place.v.stop].set(part.body.damping @ v[start : place.v.stop])
            if part.drive is not None:
                drive = drive.at[place.v.start : start].set(part.drive(t)[0])
        if u is not None:
            drive = drive.at[tree.free_v].add(u)
        residual = elastic + viscous - joint - active - paired - drive - pull(wrench)[0]
        return Forces(
            shape=shape,
            twist=twist,
            wrenches=tuple(wrenches),
            inner_forces=tuple(inner_forces),
            pair_wrenches=tuple(pair_wrenches),
            joint=joint,
            active=active,
            paired=paired,
            added=added,
            fluid=fluid,
            reshaping=reshaping,
            inertia=inertia,
            elastic=elastic,
            viscous=viscous,
            drive=drive,
            residual=residual,
        )

    def carried(
        self, t: Array, shape: PartShape, twist: Array, z: Any
    ) -> tuple[Float[Array, "n 6 6"], Float[Array, "n 6 6"] | None]:
        """Added mass of all stations with load states z, and its rate; None if it is constant."""
        added, growth = self.added, None
        for attached, own in zip(self.loads, z, strict=True):
            if isinstance(attached.load, ReshapingLoad):
                strips = self.strips(attached.part, t, shape, twist)
                now, rate = attached.load.carried(t, strips, own, self.water)
                first = self.tree.layout[attached.part].stations.start
                growth = (jnp.zeros_like(added) if growth is None else growth).at[first].add(rate)
                added = added.at[first].add(now)
        return added, growth

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
        return self.forces(t, x, a, u).residual[self.tree.free_v]

    def mass_bias(self, t: Array, x: State, u: Array | None = None) -> tuple[Array, Array]:
        """Mass matrix (added mass included) and bias of the unknown coordinates."""
        acting = self.forces(t, x, jnp.zeros_like(x.v), u)
        return self.mass(acting.shape, acting.added), acting.residual[self.tree.free_v]

    def mass(self, shape: PartShape, added: Float[Array, "n 6 6"]) -> Float[Array, "nv nv"]:
        """Mass matrix, with this added mass, of the unknown coordinates."""
        J = self.columns(shape)
        return jnp.einsum("vni,wni->vw", J, times(self.inertia + added, J))

    def columns(self, shape: PartShape) -> Float[Array, "nv n 6"]:
        """Body twists of all stations for unit velocities of the unknown coordinates."""
        return self.tree.jacobian(shape, jnp.eye(self.tree.layout[-1].v.stop)[self.tree.free_v])

    def state_rates(self, t: Array, x: State, u: Any = None) -> Any:
        """Rates of the load states."""
        if not jax.tree.leaves(x.z):
            return x.z
        q, v, _ = self.tree.complete(t, x.q, x.v)
        shape = self.tree.shape(q)
        twist = self.tree.twists(shape, v)
        rates = []
        for attached, z in zip(self.loads, x.z, strict=True):
            if isinstance(attached.load, Load):
                z = attached.load.force(t, self.strips(attached.part, t, shape, twist), z, self.water)[1]
            rates.append(z)
        return tuple(rates)

    def rates(self, t: Array, x: State, u: Array | None = None) -> State:
        """Time derivative of the state (explicit integration)."""
        M, h = self.mass_bias(t, x, u)
        a = -inverse(M) @ h
        _, dq = jax.jvp(lambda s: self.advance(x.q, x.v, s), (jnp.zeros(()),), (jnp.ones(()),))
        return State(dq, a, self.state_rates(t, x, u))

    def weight(self) -> Float[Array, "parts"]:
        """Mass of each part [kg]."""
        return jnp.stack([jnp.sum(self.inertia[place.stations, 3, 3]) for place in self.tree.layout])


def times(matrix: Array, x: Array) -> Array:
    """Matrix-vector product of small matrices as a broadcast sum."""
    return jnp.sum(matrix * x[..., None, :], axis=-1)


def start_shape(robot: Robot) -> PartShape:
    """Poses of all stations at t = 0."""
    x = robot.initial()
    q, *_ = robot.tree.complete(jnp.zeros(()), x.q, x.v)
    return robot.tree.shape(q)


def start_poses(robot: Robot) -> tuple[Float[Array, "n 3 3"], Float[Array, "n 3"]]:
    """Rotations and positions [m] of all stations at t = 0, station frame to world frame."""
    shape = start_shape(robot)
    return shape.rotation, shape.position


def make_robot(tree: Tree, loads: tuple[Attached, ...], water: Water, pairs: tuple[Paired, ...] = ()) -> Robot:
    """Robot with the inertia and the added mass of its bodies at its stations."""
    inertia = jnp.concatenate([part.body.inertia for part in tree.parts])
    bare = Robot(tree, loads, water, inertia, jnp.zeros_like(inertia))
    shape = start_shape(bare)
    rest = jnp.zeros_like(inertia[:, 0])
    added = jnp.zeros_like(inertia)
    for attached in loads:
        if isinstance(attached.load, Load):
            mass = attached.load.inertia(bare.strips(attached.part, jnp.zeros(()), shape, rest), water)
            if mass is not None:
                added = added.at[tree.layout[attached.part].stations].add(mass)
    return Robot(tree, loads, water, inertia, added, pairs)
