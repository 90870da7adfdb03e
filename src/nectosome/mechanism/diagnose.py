"""Diagnosis of a robot at one time, load by load: forces, powers, energies, reactions, bending strain and stress."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from nectosome.core import DriveOutput, Flow, State
from nectosome.core.rows import Spread, rows
from nectosome.core.se3 import cross, dot, dot_t
from nectosome.description.own_rows import ADDED_MASS, DRIVE, SHAPE_CHANGE, SLAMMING, VISCOUS

from .carried import times
from .forces import Forces
from .joints import SLIDES
from .load_groups import names_of
from .robot import Robot
from .tendons import TendonOutput
from .tree import PartShape, Tree


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
    support_force: Float[Array, "3"]  # on what holds the robot, world frame [N]: all loads minus the rate of momentum
    support_moment: Float[Array, "3"]  # the same about the place in the world of the first part's joint [N m]
    drive_velocity: Float[Array, "prescribed"]  # of prescribed joints [rad/s, m/s]
    momentum: Float[Array, "3"]  # of the body's own matter, world frame [kg m/s]
    water_momentum: Float[Array, "3"]  # of the water carried along [kg m/s]
    momentum_rate: Float[Array, "parts 3"]  # rate of momentum of each part's own matter [N]
    momentum_balance: Float[Array, "slides"]  # rate of momentum less all outer forces, along slides of roots [N]
    angular_momentum: Float[Array, "3"]  # the same about the world's origin [kg m2/s]
    energy: Float[Array, "3"]  # kinetic of the body, kinetic of the added mass, elastic [J]
    part_energy: Float[Array, "parts 3"]  # the same of each part
    energy_rate: Float[Array, ""]  # d/dt of their sum [W]
    bending: Bending
    powered: DriveOutput  # what motors do, leaves [m]
    motor_position: Float[Array, "m"]  # coordinates of their joints [rad, m]
    motor_rate: Float[Array, "m"]  # [rad/s, m/s]
    battery_voltage: Float[Array, "b"]  # [V]
    battery_power: Float[Array, "b"]  # [W]
    tendons: TendonOutput  # leaves [m]
    flows: tuple[Flow | None, ...]  # what each group of loads on bodies sees of the water


def load_names(robot: Robot) -> tuple[str, ...]:
    """Names of all loads, pairs and tendons, in order, then of the forces of the mechanism itself."""
    loads = robot.load_groups
    of_parts = names_of([*loads.acting, *loads.on_joints, *loads.in_rods])
    own = dict.fromkeys((*of_parts, *names_of(loads.pairs), *names_of(loads.tendons)))
    of_water = [ADDED_MASS] + [SHAPE_CHANGE] * bool(loads.reshaping) + [SLAMMING] * robot.emerges
    return tuple(dict.fromkeys([*own, *of_water, VISCOUS, DRIVE]))  # a load of added mass may be called like its row


def driving(robot: Robot) -> Bool[np.ndarray, "loads parts"]:
    """Mask of the load powers of drives: driven joints, and actuators inside rods."""
    names = load_names(robot)
    out = np.zeros((len(names), len(robot.tree.structure)), bool)
    out[names.index(DRIVE)] = True
    for g in robot.load_groups.in_rods:
        for name, part in zip(g.names, g.parts, strict=True):
            out[names.index(name), part] |= name != VISCOUS
    return out


def energies(robot: Robot, t: Array, x: State) -> Float[Array, "parts 3"]:
    """Kinetic energy of each part, of its added mass (relative to the current), elastic energy of rods [J]."""
    tree = robot.tree
    q, v, _ = tree.complete(t, x.q, x.v)
    shape = tree.shape(q)
    twist = tree.twists(shape, v)
    relative, _ = robot.relative(t, shape, twist, twist)
    return _energies(robot, q, v, twist, relative, robot.carried(t, shape, twist, q, v, x.z))


def _energies(robot: Robot, q: Array, v: Array, twist: Array, relative: Array, added: Array) -> Float[Array, "parts 3"]:
    tree = robot.tree
    own = 0.5 * jnp.sum(twist * times(robot.inertia, twist), axis=1)  # of each station
    spinning = [] if robot.rotors is None else [0.5 * robot.rotors * v**2]  # relative to the parts before
    carried = 0.5 * jnp.sum(relative * times(added, relative), axis=1)
    bent = tree.split(q, "q")[1]
    energy = [0.5 * jnp.einsum("mi,mij,mj->m", x, g.things.stiffness, x) for g, x in zip(tree.rods, bent, strict=True)]
    parts = len(tree.structure)
    elastic = Spread(parts, *(np.array(g.members) for g in tree.rods))(energy)
    by_part = Spread(parts, tree.indices.part_of_station)
    kinetic = Spread(parts, tree.indices.part_of_station, *([owners(tree)] if spinning else []))([own, *spinning])
    return jnp.stack([kinetic, by_part([carried]), elastic], axis=-1)


def owners(tree: Tree) -> Int[np.ndarray, "nv"]:
    """Part of each velocity."""
    return np.concatenate([np.full(place.v.stop - place.v.start, i) for i, place in enumerate(tree.layout)])


def _added_mass_rate(robot: Robot, t: Array, acting: Forces, relative: Array) -> Float[Array, ""]:
    """Rate of the kinetic energy V A V/2 of the added mass [W], by the forces of the water."""
    rate = -jnp.sum(relative * acting.fluid)
    if acting.reshaping is not None:
        rate -= 0.5 * jnp.sum(relative * acting.reshaping)
    if acting.surface is not None:
        # V A V/2 with the rate of A, which is what is met less what is left
        rate += jnp.sum(relative * times(acting.surface.met, relative)) - jnp.sum(acting.surface.lost(relative))
    return rate + jnp.sum(_from_uneven_flow(robot, t, acting, relative))


def _from_uneven_flow(robot: Robot, t: Array, acting: Forces, relative: Array) -> Float[Array, "n"]:
    """Power [W] that stations get through their added mass as they go across a flow that differs from place to place.

    Forces know Dc/Dt along the path of the water; a body goes through the water by its relative velocity V, where c
    changes by (V . grad) c besides. -V A (V . grad) c comes from the energy of the flow itself.
    """
    current = robot.water.current
    if current is None:
        return jnp.zeros(relative.shape[0])
    R, p = acting.shape.rotation, acting.shape.position
    _, more = jax.jvp(jax.vmap(lambda point: current(t, point)), (p,), (dot(R, relative[:, 3:]),))
    return -jnp.sum(times(acting.added, relative)[:, 3:] * dot_t(R, more), axis=-1)


def bending_of(robot: Robot, q: Float[Array, "nq"]) -> Bending:
    r"""Bending at all coordinates q, prescribed ones included.

    Rods and soft plates: see `SoftBody.bending`. Hinges: the moment $k\theta$ of a layer of thickness h and second
    moment I gives $\sigma = k \theta h / 2I$.
    """
    tree, layout = robot.tree, robot.tree.layout
    strains, stresses, places = [], [], []
    for g, x in zip(tree.rods, tree.split(q, "q")[1], strict=True):
        here = np.array([np.arange(layout[i].stations.start, layout[i].stations.stop) for i in g.members])
        bent = g.map(lambda body, *x: body.bending(*x), rows(tree.stations.half_width, here), x)
        strains.append(bent[:, 0].reshape(-1, 2))
        stresses.append(bent[:, 1].reshape(-1, 2))
        places.append(here.ravel())
    n, parts = layout[-1].stations.stop, len(tree.structure)
    hinges, hinged = [], []
    for g in robot.load_groups.on_joints:
        bent = g.map(lambda load, x: load.bending(x), g.displacements(tree, q))
        if bent is not None:
            hinges.append(bent)
            hinged += g.parts
    of_parts = _known(parts, hinges, np.array(hinged, dtype=int))
    at = np.concatenate([np.zeros(0, int), *places])
    return Bending(_known(n, strains, at), _known(n, stresses, at), of_parts[:, 0], of_parts[:, 1])


def _known(n: int, found: list[Array], at: np.ndarray) -> Float[Array, "n 2"]:
    """Rows at their places among n, NaN elsewhere."""
    missing = ~np.isin(np.arange(n), at)[:, None]
    return jnp.where(missing, jnp.nan, Spread(n, at)(found, (2,)))


def diagnose(robot: Robot, t: Float[Array, ""], x: State, a: Float[Array, "nv"] | None = None) -> Diagnosis:
    """Forces, powers and energies of the motion through x at time t.

    Accelerations of the unknown coordinates are those of the equations of motion, or a; `missing` is then what must act
    along the coordinates besides.
    """
    tree, names = robot.tree, load_names(robot)
    a, acting = robot.solved(t, x, a)
    shape, twist = acting.shape, acting.twist
    n, parts, several = shape.position.shape[0], len(tree.structure), len(names)
    q, v, _ = tree.complete(t, x.q, x.v)
    weight = tree.stations.weight
    by_part = jax.vmap(lambda x: Spread(parts, tree.indices.part_of_station)([x]))
    row = {name: k for k, name in enumerate(names)}

    loads, every = robot.load_groups, [row[ADDED_MASS] * n + np.arange(n)]
    for g in loads.acting:
        counts = [len(here) for here in g.stations_of_each(tree)]
        every.append(np.repeat([row[name] for name in g.names], counts) * n + g.stations(tree))
    for g in loads.pairs:
        of_name = np.array([row[name] for name in g.names])[:, None] * n
        every += [of_name + g.stations(tree, side) for side in (0, 1)]
    to_names = Spread(several * n, *every)
    wrench = to_names([acting.fluid, *acting.wrenches, *acting.pair_wrenches]).reshape(several, n, 6)

    inner, owner = loads.inner, owners(tree)
    along = [g.coordinates(tree, "v") for g in inner]
    watts = [(f * rows(v, here)).ravel() for here, f in zip(along, (*acting.on_joints, *acting.in_rods), strict=True)]
    every = [
        np.array([row[name] for name in g.names])[:, None] * parts + owner[here]
        for g, here in zip(inner, along, strict=True)
    ]
    # what a load takes from its crank
    watts += [f * rows(v, g.hinges(tree, "v")) for g, f in zip(loads.cranked, acting.on_cranks, strict=True)]
    every += [np.array([row[name] for name in g.names]) * parts + g.parts for g in loads.cranked]
    to_parts = Spread(several * parts, *every, row[VISCOUS] * parts + owner, row[DRIVE] * parts + owner)
    joint_power = to_parts([*watts, -acting.viscous * v, acting.drive * v]).reshape(several, parts)

    relative, _ = robot.relative(t, shape, twist, twist)
    through = robot.strips(t, shape, twist)
    power = jnp.sum(wrench * twist, axis=-1)
    # the kinetic energy of the added mass is part of the energy; only a moving water gives power through it
    c = dot_t(shape.rotation, robot.water.flow(t, shape.position)[0])
    of_loads = wrench[names.index(ADDED_MASS)] - acting.fluid
    through_it = jnp.sum(of_loads * twist, axis=-1) + jnp.sum(acting.fluid[:, 3:] * c, axis=-1)
    through_it += _from_uneven_flow(robot, t, acting, relative)
    power = power.at[names.index(ADDED_MASS)].set(through_it)
    if acting.reshaping is not None:
        # half of the power of -dA/dt V goes into the added mass' energy V A V / 2, half comes from the shape change
        given = jnp.sum(acting.reshaping[:, 3:] * c, axis=-1) + 0.5 * jnp.sum(acting.reshaping * relative, axis=-1)
        wrench = wrench.at[names.index(SHAPE_CHANGE)].set(acting.reshaping)
        power = power.at[names.index(SHAPE_CHANGE)].set(given)
    if acting.surface is not None and acting.slamming is not None:
        # the energy of water that the body meets or leaves goes with the spray and the wake
        lost = acting.surface.lost(relative)
        wrench = wrench.at[names.index(SLAMMING)].set(acting.slamming)
        power = power.at[names.index(SLAMMING)].set(jnp.sum(acting.slamming[:, 3:] * c, axis=-1) - lost)
    power = by_part(power) + joint_power

    given = jnp.sum(wrench, axis=0) - acting.inertia
    root, push = tree.mounts[int(tree.indices.in_order[0]), :, 3], dot(shape.rotation, given[:, 3:])
    moment = dot(shape.rotation, given[:, :3]) + cross(shape.position - root, push)
    world = dot(shape.rotation, wrench[:, :, 3:])
    strip = (weight > 0)[:, None]
    line = jnp.where(strip, wrench[:, :, 3:] / jnp.where(strip, weight[:, None], 1.0), jnp.nan)
    first = np.array([place.stations.start for place in tree.layout])
    reaction = acting.residual[tree.prescribed_v]
    local = times(robot.inertia, twist)
    linear = dot(shape.rotation, local[:, 3:])
    pushed = dot(shape.rotation, acting.inertia[:, 3:])
    angular = dot(shape.rotation, local[:, :3]) + cross(shape.position, linear)
    energy = _energies(robot, q, v, twist, relative, acting.added)
    # V I dV/dt of the body, since gyroscopic forces do no work, and q K dq/dt of the rods
    energy_rate = jnp.sum(twist * acting.inertia) + jnp.sum(acting.elastic * v)
    own = acting.joint + acting.drive + acting.residual  # the last is a reaction, or what is missing
    if robot.rotors is not None:
        speeding = robot.rotors * tree.complete(t, x.q, x.v, a)[2]
        energy_rate += jnp.sum(v * speeding)
        own -= speeding
    powered, _, voltages = robot.motors(t, q, v, x.z)
    return Diagnosis(
        displacement=robot.displacements(x.q),
        a=a,
        position=shape.position,
        rotation=shape.rotation,
        velocity=dot(rows(shape.rotation, first), rows(twist, first)[:, 3:]),
        load_force=by_part(world),
        load_power=power,
        line_force=line,
        missing=acting.residual[tree.free_v],
        reaction=reaction,
        reaction_power=reaction * v[tree.prescribed_v],
        support_force=jnp.sum(push, axis=0),
        support_moment=jnp.sum(moment, axis=0),
        drive_velocity=v[tree.prescribed_v],
        momentum=jnp.sum(linear, axis=0),
        water_momentum=jnp.sum(dot(shape.rotation, times(acting.added, relative)[:, 3:]), axis=0),
        momentum_rate=by_part(pushed[None])[0],
        momentum_balance=_momentum_balance(robot, acting.shape, pushed - jnp.sum(world, axis=0), own),
        angular_momentum=jnp.sum(angular, axis=0),
        energy=jnp.sum(energy, axis=0),
        part_energy=energy,
        energy_rate=energy_rate + _added_mass_rate(robot, t, acting, relative),
        bending=bending_of(robot, q),
        powered=powered,
        motor_position=rows(q, robot.powered.places(tree, "q")),
        motor_rate=rows(v, robot.powered.places(tree, "v")),
        battery_voltage=voltages,
        battery_power=robot.powered.battery_powers(powered.electrical),
        tendons=robot.tendons(q, v, x.z),
        flows=tuple(g.flow(tree, through) for g in loads.on_bodies),
    )


def _momentum_balance(
    robot: Robot, shape: PartShape, net: Float[Array, "n 3"], own: Float[Array, "nv"]
) -> Float[Array, "slides"]:
    """Rate of momentum of all that hangs on a root joint, less the forces on it, along each slide of the joint [N].

    `net` is that of each station without the forces of the joints' own loads and drives, world frame, and `own` these,
    less what speeds up rotors. Roots that a web joins are left out.
    """
    tree, indices = robot.tree, robot.tree.indices
    roots: list[int] = []  # of each part
    for part in tree.structure:
        roots.append(len(roots) if part.parent < 0 else roots[part.parent])
    on_root = Spread(len(roots), np.array(roots)[indices.part_of_station])
    sides = np.array(roots)[indices.part_of_station[indices.beside]]  # of webs, whose forces no single root has
    shared = {*sides[sides[:, 0] != sides[:, 1]].ravel().tolist()}
    sums = on_root([net])
    terms = []
    for group, subspaces, places in zip(tree.joints, shape.subspaces, indices.joint_v, strict=True):
        slides = [k for k, name in enumerate(tree.structure[group.members[0]].joint.names) if name in SLIDES]
        some = np.array([k for k, i in enumerate(group.members) if roots[i] == i and i not in shared], dtype=int)
        if slides and some.size:
            members = np.array(group.members)[some]
            turned = rows(shape.frame_rotation, indices.in_order[members])
            along = dot(turned[:, None], rows(subspaces, some)[:, slides, 3:])
            force = jnp.sum(along * rows(sums, members)[:, None], axis=-1)
            terms.append((force - rows(own, places[some][:, slides])).ravel())
    return jnp.concatenate(terms) if terms else jnp.zeros(0)
