"""Diagnosis of a robot at one time, load by load: forces, powers, energies, reactions, bending strain and stress."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from nectosome.core import JointLoad, Load, ReshapingLoad, RodLoad, State
from nectosome.core.se3 import cross, dot, dot_t

from .robot import Robot, times
from .rods import SoftRod, bending

ADDED_MASS, SHAPE_CHANGE, VISCOUS, DRIVE = "added_mass", "shape_change", "viscous", "drive"


class Bending(NamedTuple):
    """Bending strain and stress at the edges of sections; NaN for rigid parts."""

    strain: Float[Array, "n 2"]  # of each station of a rod, at +r_y and at +r_z of its section
    stress: Float[Array, "n 2"]  # [Pa]
    hinge_strain: Float[Array, "parts"]  # at the face of the flexible layer of the part's hinge
    hinge_stress: Float[Array, "parts"]  # [Pa]


class Diagnosis(NamedTuple):
    """Forces and powers at one time; loads with one name on one part are summed."""

    displacement: Float[Array, "nv"]  # of the unknown coordinates, rotations as rotation vectors [rad, m]
    a: Float[Array, "nv"]
    position: Float[Array, "n 3"]  # stations, world frame [m]
    rotation: Float[Array, "n 3 3"]
    velocity: Float[Array, "parts 3"]  # of each part's first station, world frame [m/s]
    load_force: Float[Array, "loads parts 3"]  # world frame [N]
    load_power: Float[Array, "loads parts"]  # [W], positive into the robot
    line_force: Float[Array, "loads n 3"]  # station frame [N/m], NaN where a station is no strip
    missing: Float[Array, "nv"]  # force along the unknown coordinates that balances the rest [N m, N]; 0 in free motion
    reaction: Float[Array, "prescribed"]  # what the drives of prescribed joints give [N m, N]
    reaction_power: Float[Array, "prescribed"]  # [W]
    drive_velocity: Float[Array, "prescribed"]  # of prescribed joints [rad/s, m/s]
    momentum: Float[Array, "3"]  # of the body's own matter, world frame [kg m/s]
    angular_momentum: Float[Array, "3"]  # the same about the world's origin [kg m2/s]
    energy: Float[Array, "3"]  # kinetic of the body, kinetic of the added mass, elastic [J]
    part_energy: Float[Array, "parts 3"]  # the same of each part
    energy_rate: Float[Array, ""]  # d/dt of their sum [W]
    bending: Bending


def load_names(robot: Robot) -> tuple[str, ...]:
    """Names of all loads and pairs, in order, then of the forces of the mechanism itself."""
    own = dict.fromkeys(a.name for a in robot.loads if not (isinstance(a.load, Load) and a.load.inertial))
    own |= dict.fromkeys(pair.name for pair in robot.pairs)
    reshaped = any(isinstance(a.load, ReshapingLoad) for a in robot.loads)
    return (*own, ADDED_MASS, *([SHAPE_CHANGE] if reshaped else []), VISCOUS, DRIVE)


def driving(robot: Robot) -> Bool[np.ndarray, "loads parts"]:
    """Mask of the load powers of drives: driven joints, and actuators inside rods."""
    names = load_names(robot)
    out = np.zeros((len(names), len(robot.tree.parts)), bool)
    out[names.index(DRIVE)] = True
    for attached in robot.loads:
        if isinstance(attached.load, RodLoad):
            out[names.index(attached.name), attached.part] = True
    return out


def energies(robot: Robot, t: Array, x: State) -> Float[Array, "parts 3"]:
    """Kinetic energy of each part, of its added mass (relative to the current), elastic energy of rods [J]."""
    tree = robot.tree
    q, v, _ = tree.complete(t, x.q, x.v)
    shape = tree.shape(q)
    twist = tree.twists(shape, v)
    relative, _ = robot.relative(t, shape, twist, twist)
    own = 0.5 * jnp.sum(twist * times(robot.inertia, twist), axis=1)  # of each station
    carried = 0.5 * jnp.sum(relative * times(robot.carried(t, shape, twist, x.z)[0], relative), axis=1)
    found = []
    for part, place in zip(tree.parts, tree.layout, strict=True):
        elastic = jnp.zeros(())
        if isinstance(part.body, SoftRod):
            bent = q[place.q][part.joint.nq :]
            elastic = 0.5 * bent @ part.body.stiffness @ bent
        found.append(jnp.stack([jnp.sum(own[place.stations]), jnp.sum(carried[place.stations]), elastic]))
    return jnp.stack(found)


def bending_of(robot: Robot, q: Float[Array, "nq"]) -> Bending:
    r"""Bending at all coordinates q, prescribed ones included.

    Rods: $\epsilon = -\kappa_z r_y$ and $\kappa_y r_z$ with the curvatures relative to the rest shape, $\sigma = E
    \epsilon$. Hinges: the moment $k\theta$ of a layer of thickness h and second moment I gives $\sigma = k \theta h /
    2I$.
    """
    tree = robot.tree
    strains, stresses = [], []
    for part, place in zip(tree.parts, tree.layout, strict=True):
        if isinstance(part.body, SoftRod):
            strain = bending(part.body, q[place.q][part.joint.nq :])
            strains.append(strain)
            stresses.append(part.body.young * strain)
        else:
            strains.append(jnp.full(part.body.half_width.shape, jnp.nan))
            stresses.append(strains[-1])
    hinges = jnp.full((2, len(tree.parts)), jnp.nan)
    for attached in robot.loads:
        if isinstance(attached.load, JointLoad):
            place, joint = tree.layout[attached.part], tree.parts[attached.part].joint
            bent = attached.load.bending(joint.displacement(q[place.q][: joint.nq]))
            hinges = hinges if bent is None else hinges.at[:, attached.part].set(bent)
    return Bending(jnp.concatenate(strains), jnp.concatenate(stresses), *hinges)


def diagnose(robot: Robot, t: Float[Array, ""], x: State, a: Float[Array, "nv"] | None = None) -> Diagnosis:
    """Forces, powers and energies of the motion through x at time t.

    Accelerations of the unknown coordinates are those of the equations of motion, or a; `missing` is then what must act
    along the coordinates besides.
    """
    tree, names = robot.tree, load_names(robot)
    rate = robot.rates(t, x)
    rate = rate if a is None else State(rate.q, a, rate.z)
    acting = robot.forces(t, x, rate.v)
    shape, twist = acting.shape, acting.twist
    n, parts = shape.position.shape[0], len(tree.parts)
    q, v, _ = tree.complete(t, x.q, x.v)
    weight = jnp.concatenate([part.body.weight for part in tree.parts])
    belongs = jnp.concatenate([jnp.full(part.body.weight.shape[0], i) for i, part in enumerate(tree.parts)])

    wrench = jnp.zeros((len(names), n, 6)).at[names.index(ADDED_MASS)].set(acting.fluid)
    joint_power = jnp.zeros((len(names), parts))
    for attached, w, f in zip(robot.loads, acting.wrenches, acting.inner_forces, strict=True):
        place = tree.layout[attached.part]
        if w is not None:
            wrench = wrench.at[names.index(attached.name), place.stations].add(w)
        if f is not None:
            watts = f @ v[place.v]
            joint_power = joint_power.at[names.index(attached.name), attached.part].add(watts)
    for pair, both in zip(robot.pairs, acting.pair_wrenches, strict=True):
        for part, w in zip(pair.parts, both, strict=True):
            wrench = wrench.at[names.index(pair.name), tree.layout[part].stations].add(w)
    for i, place in enumerate(tree.layout):
        joint_power = joint_power.at[names.index(VISCOUS), i].set(-acting.viscous[place.v] @ v[place.v])
        joint_power = joint_power.at[names.index(DRIVE), i].set(acting.drive[place.v] @ v[place.v])

    def by_part(x: Array) -> Array:
        return jax.vmap(lambda y: jax.ops.segment_sum(y, belongs, parts))(x)

    power = jnp.sum(wrench * twist, axis=-1)
    # the kinetic energy of the added mass is part of the energy; only a current gives power through it
    c = dot_t(shape.rotation, robot.water.flow(t, shape.position)[0])
    power = power.at[names.index(ADDED_MASS)].set(jnp.sum(acting.fluid[:, 3:] * c, axis=-1))
    if acting.reshaping is not None:
        # half of the power of -dA/dt V goes into the added mass' energy V A V / 2, half comes from the shape change
        relative, _ = robot.relative(t, shape, twist, twist)
        given = jnp.sum(acting.reshaping[:, 3:] * c, axis=-1) + 0.5 * jnp.sum(acting.reshaping * relative, axis=-1)
        wrench = wrench.at[names.index(SHAPE_CHANGE)].set(acting.reshaping)
        power = power.at[names.index(SHAPE_CHANGE)].set(given)
    power = by_part(power) + joint_power

    world = dot(shape.rotation, wrench[:, :, 3:])
    strip = (weight > 0)[:, None]
    line = jnp.where(strip, wrench[:, :, 3:] / jnp.where(strip, weight[:, None], 1.0), jnp.nan)
    first = jnp.array([place.stations.start for place in tree.layout])
    reaction = acting.residual[tree.prescribed_v]
    local = times(robot.inertia, twist)
    linear = dot(shape.rotation, local[:, 3:])
    angular = dot(shape.rotation, local[:, :3]) + cross(shape.position, linear)
    energy, energy_rate = jax.jvp(lambda t, x: energies(robot, t, x), (t, x), (jnp.ones(()), rate))
    return Diagnosis(
        displacement=robot.displacements(x.q),
        a=rate.v,
        position=shape.position,
        rotation=shape.rotation,
        velocity=dot(shape.rotation[first], twist[first, 3:]),
        load_force=by_part(world),
        load_power=power,
        line_force=line,
        missing=acting.residual[tree.free_v],
        reaction=reaction,
        reaction_power=reaction * v[tree.prescribed_v],
        drive_velocity=v[tree.prescribed_v],
        momentum=jnp.sum(linear, axis=0),
        angular_momentum=jnp.sum(angular, axis=0),
        energy=jnp.sum(energy, axis=0),
        part_energy=energy,
        energy_rate=jnp.sum(energy_rate),
        bending=bending_of(robot, q),
    )


def support_force(robot: Robot, t: Float[Array, ""], x: State) -> Float[Array, "3"]:
    """Force on the support of the robot, world frame [N]: the sum of all loads minus the rate of its momentum."""

    def momentum(t: Array, x: State) -> Array:
        q, v, _ = robot.tree.complete(t, x.q, x.v)
        shape = robot.tree.shape(q)
        return jnp.sum(dot(shape.rotation, times(robot.inertia, robot.tree.twists(shape, v))[:, 3:]), axis=0)

    rate = jax.jvp(momentum, (t, x), (jnp.ones(()), robot.rates(t, x)))[1]
    return jnp.sum(diagnose(robot, t, x).load_force, axis=(0, 1)) - rate
