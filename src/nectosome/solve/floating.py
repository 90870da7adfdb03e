r"""How a robot lies in the water: draught, trim and heel at rest, metacentric heights, righting arms.

Its joints and rods are held, and weight and buoyancy alone act, by the same loads as in its motion. They have a
potential $\Pi$ in the pose of the whole, its rise h and the turns $\theta$ about the two level axes, whose first
derivatives are the vertical force Z and the moments about the centre of mass, and whose second ones

$$ K = -\frac{\partial (Z, M)}{\partial (h, \theta)}, \quad
   K' = K_{\theta\theta} - K_{\theta h} K_{hh}^{-1} K_{h\theta}, \quad GM = \frac{K'}{m g} $$

are exact, too: the robot's stiffness at rest, that against turning while it rises and sinks freely, and the metacentric
heights. At the surface Newton's method finds where $\Pi$ is least. A robot that is all under water has no stiffness
against sinking: it turns until its centre of buoyancy B is above its centre of mass G, with $K' = \rho g V\, BG$.
"""

from dataclasses import replace
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from nectosome.core import State, Strips
from nectosome.core.immersion import reach_up
from nectosome.core.linear_algebra import generalised_inverse
from nectosome.core.programs.remember import remembered
from nectosome.core.rows import Spread, on_device
from nectosome.core.se3 import (
    cross,
    dot,
    dot_t,
    exp_so3,
    matmul3,
    quaternion_of,
    rotation_about,
    rotation_from_quaternion,
    skew,
)
from nectosome.core.tracers import traced
from nectosome.loads import Buoyancy, MeshBuoyancy, Weight
from nectosome.mechanism import Free, Robot
from nectosome.mechanism.robot import start_poses

_MOST_STEPS, _MOST_HALVINGS = 200, 12
_BALANCED = 1e-11  # forces over the weight, and moments over weight and size
_LEVEL = 1e-14  # force over the weight, and rise over the size
_NEUTRAL = 1e-9  # stiffness over weight and size, or distance over the size, below which it is rounding
SINKS = 1e-9  # share of the weight that buoyancy must exceed it by
_LONGEST, _KICK = 0.2, 0.05  # step: tilt [rad], rise over the size
_UP = np.array([0.0, 0.0, 1.0])


class Pose(NamedTuple):
    """Stations of a robot in the world."""

    rotation: Float[Array, "n 3 3"]
    position: Float[Array, "n 3"]  # [m]


class Centres(NamedTuple):
    """Masses [kg] and centres [m, world frame] of a robot in its initial pose, as if all of it were under water."""

    mass: Float[Array, ""]
    displaced: Float[Array, ""]
    centre_of_mass: Float[Array, "3"]
    centre_of_buoyancy: Float[Array, "3"]


class Floating(NamedTuple):
    """A robot as weight and buoyancy alone leave it, its joints held as at the start; x ahead, y to port, z up.

    All under water, where that is so, it is as if its depth were held.
    """

    centres: Centres  # in the initial pose
    weight: Float[Array, ""]  # [N]
    net_weight: Float[Array, ""]  # less the buoyancy of all of it [N]
    afloat: Bool[Array, ""]  # at the surface; else it is all under water
    solved: Bool[Array, ""]
    rotation: Float[Array, "3 3"]  # from the initial pose, about the centre of mass
    rise: Float[Array, ""]  # of the centre of mass since then [m]
    draught: Float[Array, ""]  # depth of the lowest point [m]; NaN if not afloat
    trim: Float[Array, ""]  # bow up [rad]
    heel: Float[Array, ""]  # to starboard, port side up [rad]
    metacentric_heights: Float[Array, "2"]  # against heel and against trim [m]: stable where both are above 0
    waterplane: Float[Array, ""]  # area [m2]


def centres(robot: Robot) -> Centres:
    """Masses and centres of a robot at the start."""
    rotation, position = start_poses(robot)
    mass = robot.inertia[:, 3, 3]
    first = robot.inertia[:, :3, 3:]  # m [c]: the first moment of mass in each station's frame
    moment = jnp.stack([first[:, 2, 1], first[:, 0, 2], first[:, 1, 0]], axis=-1)
    moment = mass[:, None] * position + dot(rotation, moment)
    displaced = robot.water.density * robot.tree.stations.volume
    none = np.finfo(float).tiny
    return Centres(
        jnp.sum(mass),
        jnp.sum(displaced),
        jnp.sum(moment, axis=0) / jnp.maximum(jnp.sum(mass), none),
        jnp.sum(displaced[:, None] * position, axis=0) / jnp.maximum(jnp.sum(displaced), none),
    )


def floating(robot: Robot) -> Floating:
    """How a robot floats or hangs in the water. It is the stable position near the attitude at the start."""
    return remembered(float_freely, robot)


def righting_curve(robot: Robot, found: Floating, heels: Float[np.ndarray, "k"]) -> Float[np.ndarray, "k"]:
    """Righting arm GZ [m] at each heel [rad]: moment about the axis ahead over the weight.

    Heels are to starboard, below 0 to port. GZ above 0 turns to port, below 0 to starboard: the robot turns back where
    it has the sign of the heel. The trim of `found` is held; afloat the robot sinks or rises until it displaces its
    mass.
    """
    return np.asarray(remembered(_arms, robot, found, jnp.asarray(heels, dtype=float)))


def is_adrift(robot: Robot) -> bool:
    """Whether nothing but its joints holds a robot together: its first part is free, and has weight or buoyancy."""
    roots = [part for part in robot.tree.structure if part.parent < 0]
    weighs = any(isinstance(g.load, Weight) for g in robot.load_groups.on_bodies)
    return weighs and len(roots) == 1 and issubclass(roots[0].joint, Free) and not roots[0].prescribed


def is_neutral(found: Floating) -> bool:
    """Whether weight and buoyancy of all of it are the same, but for rounding."""
    return abs(float(found.net_weight)) <= SINKS * float(found.weight)


def placed(robot: Robot, found: Floating) -> Robot:
    """The robot, adrift, that starts where it floats; one that is neutral at the depth where it is, if under water."""
    if traced((robot, found)):
        return _placed(robot, found)

    from scipy.spatial.transform import Rotation  # which takes a tenth of a second to import

    rise = float(found.rise) if bool(found.afloat) else min(float(found.rise), 0.0)
    R, c = np.asarray(found.rotation), np.asarray(found.centres.centre_of_mass)
    mount = np.asarray(robot.tree.mounts[0])
    turn, away = mount[:, :3], mount[:, 3]
    x = np.array(robot.start.q)
    before = Rotation.from_quat(x[3:7], scalar_first=True)
    place = c + [0.0, 0.0, rise] + R @ (turn @ x[:3] + away - c)
    after = Rotation.from_matrix(turn.T @ R @ turn) * before
    x[:7] = [*(turn.T @ (place - away)), *after.as_quat(scalar_first=True)]
    return replace(robot, start=State(on_device(x), robot.start.v, robot.start.z)).described(robot.description)


def _placed(robot: Robot, found: Floating) -> Robot:
    """The same, traced."""
    rise = jnp.where(found.afloat, found.rise, jnp.minimum(found.rise, 0.0))
    turn, away = robot.tree.mounts[0, :, :3], robot.tree.mounts[0, :, 3]
    c, q = found.centres.centre_of_mass, robot.start.q
    place = c + rise * _UP + dot(found.rotation, dot(turn, q[:3]) + away - c)
    after = matmul3(matmul3(turn.T, found.rotation), matmul3(turn, rotation_from_quaternion(q[3:7])))
    q = q.at[:7].set(jnp.concatenate([dot_t(turn, place - away), quaternion_of(after)]))
    return replace(robot, start=State(q, robot.start.v, robot.start.z))


def held_adrift(robot: Robot, q: Float[Array, "nq"], afloat: Bool[Array, ""]) -> Float[Array, "nv 4"]:
    """Velocities of a robot adrift against which the water has no stiffness: along x and y, about z, and, deep, z."""
    R = matmul3(robot.tree.mounts[0, :, :3], rotation_from_quaternion(q[3:7]))
    none = jnp.zeros(3)
    twists = [(none, R[0]), (none, R[1]), (R[2], none), (none, jnp.where(afloat, 0.0, 1.0) * R[2])]
    columns = jnp.stack([jnp.concatenate(twist) for twist in twists], axis=-1)
    return jnp.zeros((robot.tree.free_v.size, 4)).at[:6].set(columns)


class _Body(NamedTuple):
    """A robot as a rigid body in the water."""

    robot: Robot
    start: Pose
    centre: Float[Array, "3"]  # of mass, at the start
    weight: Float[Array, ""]
    size: Float[Array, ""]  # largest distance of a point from the centre of mass [m]

    @classmethod
    def of(cls, robot: Robot, found: Centres) -> "_Body":
        start = Pose(*start_poses(robot))
        s = _strips(robot, start)
        away = jnp.linalg.norm(s.position - found.centre_of_mass, axis=1)
        half = jnp.sqrt(s.half_length**2 + jnp.sum(s.half_width**2, axis=1))
        reach = [jnp.max(away + half)]
        reach += [jnp.max(away[at] + jnp.max(jnp.linalg.norm(x, axis=-1))) for at, x in _meshes(robot)]
        return cls(robot, start, found.centre_of_mass, found.mass * robot.water.gravity, jnp.max(jnp.stack(reach)))

    def pose(self, R: Array, rise: Array) -> Pose:
        """Stations after a turn about the centre of mass and a rise of it."""
        away = self.start.position - self.centre
        return Pose(matmul3(R, self.start.rotation), self.centre + rise * _UP + dot(R, away))

    def forces(self, R: Array, rise: Array) -> Float[Array, "3"]:
        """Vertical force [N], and the moments about level axes x and y through the centre of mass [N m]."""
        pose, robot = self.pose(R, rise), self.robot
        strips, tree = _strips(robot, pose), robot.tree
        groups = [g for g in robot.load_groups.on_bodies if isinstance(g.load, Weight | Buoyancy)]
        found = [g.force(tree, jnp.zeros(()), strips, g.initial(), robot.water)[0] for g in groups]
        wrenches = [wrench for wrench in found if wrench is not None]  # of both kinds there is one
        on_stations = Spread(strips.position.shape[0], *(g.stations(tree) for g in groups))(wrenches, (6,))
        force = dot(pose.rotation, on_stations[:, 3:])
        moment = dot(pose.rotation, on_stations[:, :3])
        moment = moment + cross(pose.position - (self.centre + rise * _UP), force)
        return jnp.stack([jnp.sum(force[:, 2]), jnp.sum(moment[:, 0]), jnp.sum(moment[:, 1])])

    def stiffness(self, R: Array, rise: Array) -> tuple[Float[Array, "3"], Float[Array, "3 3"]]:
        """Those forces, and K."""

        def at(w: Array) -> tuple[Array, Array]:
            turn = skew(jnp.stack([w[1], w[2], jnp.zeros(())]))
            found = self.forces(R + matmul3(turn, R), rise + w[0])
            return found, found

        slope, value = jax.jacfwd(at, has_aux=True)(jnp.zeros(3))
        return value, -slope

    @property
    def sunk(self) -> Float[Array, ""]:
        """Rise at which all of it is under water, whatever its attitude."""
        surface = self.robot.water.surface
        return jnp.zeros(()) if surface is None else surface - self.centre[2] - 1.01 * self.size

    def level(self, R: Array) -> Float[Array, ""]:
        """Rise at which it displaces its mass in an attitude, by Newton's method between bounds."""

        def going(it):
            low, high, _, force, k = it
            return (jnp.abs(force) > _LEVEL) & (high - low > _LEVEL) & (k < _MOST_STEPS)

        def once(it):
            low, high, rise, _, k = it
            force, slope = jax.jvp(lambda h: self.forces(R, h)[0], (rise * self.size,), (self.size,))
            low, high = jnp.where(force > 0, rise, low), jnp.where(force > 0, high, rise)
            new = rise - force / jnp.where(slope < 0, slope, -1.0)
            new = jnp.where((slope < 0) & (new > low) & (new < high), new, 0.5 * (low + high))
            force = force / self.weight
            return low, high, jnp.where(jnp.abs(force) > _LEVEL, new, rise), force, k + 1

        low = self.sunk / self.size
        start = low, low + 2.02, low + 1.01, jnp.asarray(jnp.inf), jnp.zeros((), int)
        return jax.lax.while_loop(going, once, start)[2] * self.size

    def downward(self) -> tuple[Float[Array, "3 3"], Float[Array, ""], Bool[Array, ""]]:
        """Turn and rise to where the potential is least at the surface, and whether it was found."""
        scale = jnp.stack([self.size, jnp.ones(()), jnp.ones(())])

        def at(R: Array, rise: Array) -> tuple[Array, Array]:
            force, K = self.stiffness(R, rise)
            energy = self.weight * self.size
            K = K * scale[:, None] * scale / energy
            return force * scale / energy, 0.5 * (K + K.T)

        def turned(R: Array, rise: Array, step: Array) -> tuple[Array, Array]:
            turn = exp_so3(jnp.stack([step[1], step[2], jnp.zeros(())]))
            return matmul3(turn, R), rise + step[0] * self.size

        def over(force: Array, K: Array) -> tuple[Array, Array]:
            """Whether forces balance, and whether it is stable there."""
            return jnp.max(jnp.abs(force)) < _BALANCED, jnp.linalg.eigvalsh(_tilting(K))[0] >= -_NEUTRAL

        def onward(force: Array, K: Array) -> tuple[Array, Array]:
            """The next step, and whether it leaves a balance: from the top of a hill down its steeper side."""
            values, vectors = jnp.linalg.eigh(K)
            size = jnp.abs(values)
            step = vectors @ ((vectors.T @ force) / jnp.maximum(size, 1e-6 * jnp.max(size)))
            step = step * jnp.minimum(1.0, _LONGEST / jnp.maximum(jnp.max(jnp.abs(step)), 1e-300))
            balanced, _ = over(force, K)
            tilt = jnp.linalg.eigh(_tilting(K))[1][:, 0]
            return jnp.where(balanced, jnp.concatenate([jnp.zeros(1), _KICK * tilt]), step), balanced

        def going(it):
            (_, _, force, K), _, k = it
            balanced, stable = over(force, K)
            return ~(balanced & stable) & (k < _MOST_STEPS)

        def once(it):
            """Take the step, or halve it where that goes too far: forces are traced here and nowhere else."""
            (R, rise, force, K), (step, share, leaving), k = it
            new = turned(R, rise, share * step)
            new_force, new_K = at(*new)
            too_far = new_force @ step < -0.5 * (force @ step) - _BALANCED
            too_far = too_far & (share > 0.5**_MOST_HALVINGS) & ~leaving
            next_step, balanced = onward(new_force, new_K)
            halved = (R, rise, force, K), (step, 0.5 * share, leaving), k
            taken = (*new, new_force, new_K), (next_step, jnp.ones(()), balanced), k + 1
            return jax.tree.map(lambda a, b: jnp.where(too_far, a, b), halved, taken)

        R = jnp.eye(3)
        before = R, self.level(R), jnp.zeros(3), -jnp.eye(3)  # the first step is none
        start = before, (jnp.zeros(3), jnp.ones(()), jnp.zeros((), bool)), jnp.full((), -1)
        (R, rise, force, K), _, _ = jax.lax.while_loop(going, once, start)
        balanced, stable = over(force, K)
        return R, rise, balanced & stable

    def angles(self, R: Array) -> tuple[Float[Array, "3"], Float[Array, ""], Float[Array, ""]]:
        """Unit vector ahead in the world, trim and heel [rad]."""
        ahead = self.robot.ahead if not self.robot.ahead[2] else np.array([1.0, 0.0, 0.0])
        up = matmul3(R, self.start.rotation[0])[2]
        port = np.cross(_UP, ahead)
        trim = jnp.arcsin(jnp.clip(jnp.sum(up * ahead), -1.0, 1.0))
        return dot(matmul3(R, self.start.rotation[0]), jnp.asarray(ahead)), trim, jnp.arctan2(up @ port, up[2])


def float_freely(robot: Robot) -> Floating:
    """`floating`, traced: with derivatives by the robot's numbers, also of what Newton's method finds."""
    found = centres(robot)
    body = _Body.of(robot, found)
    net = (found.mass - found.displaced) * robot.water.gravity
    R, rise = _upright(found.centre_of_buoyancy - found.centre_of_mass, body.size), body.sunk
    afloat = solved = jnp.zeros((), bool)
    if robot.water.surface is not None:
        afloat = net < -SINKS * body.weight
        fixed = jax.tree.map(lambda x: jax.lax.stop_gradient(x) if eqx.is_array(x) else x, body)
        # what sinks has no place at the surface: the search would not end
        new_R, new_rise, solved = jax.lax.cond(afloat, fixed.downward, lambda: (R * 1.0, rise * 1.0, afloat))
        force, K = body.stiffness(new_R, new_rise)
        left = jax.lax.stop_gradient(generalised_inverse(K)) @ force  # none, but for its derivative
        new_R = new_R + matmul3(skew(jnp.stack([left[1], left[2], jnp.zeros(())])), new_R)
        R, rise = jnp.where(afloat, new_R, R), jnp.where(afloat, new_rise + left[0], rise)
    solved = solved | ~afloat
    _, K = body.stiffness(R, rise)
    ahead, trim, heel = body.angles(R)
    level = ahead[:2] / jnp.maximum(jnp.linalg.norm(ahead[:2]), 1e-12)
    axes = jnp.stack([level, jnp.stack([-level[1], level[0]])])
    heights = jnp.diagonal(axes @ _tilting(K) @ axes.T) / body.weight
    draught = jnp.asarray(jnp.nan) if robot.water.surface is None else robot.water.surface - _lowest(body, R, rise)
    return Floating(
        centres=found,
        weight=body.weight,
        net_weight=net,
        afloat=afloat,
        solved=solved,
        rotation=R,
        rise=rise,
        draught=jnp.where(afloat, draught, jnp.nan),
        trim=trim,
        heel=heel,
        metacentric_heights=heights,
        waterplane=K[0, 0] / (robot.water.density * robot.water.gravity),
    )


def arm(robot: Robot, found: Floating, heel: Float[Array, ""]) -> Float[Array, ""]:
    """Righting arm GZ [m] at a heel [rad], traced; see `righting_curve`."""
    body = _Body.of(robot, found.centres)
    ahead, _, now = body.angles(found.rotation)
    R = matmul3(rotation_about(ahead, heel - now), found.rotation)
    rise = body.sunk
    if robot.water.surface is not None:
        fixed = jax.tree.map(lambda x: jax.lax.stop_gradient(x) if eqx.is_array(x) else x, body)
        rise = jax.lax.cond(found.afloat, lambda: fixed.level(jax.lax.stop_gradient(R)), lambda: rise * 1.0)
        force, K = body.stiffness(R, rise)
        stiff = jax.lax.stop_gradient(jnp.where(K[0, 0] > 0, K[0, 0], 1.0))
        rise = rise + jnp.where(found.afloat, force[0] / stiff, 0.0)  # none, but for its derivative
    moments = body.forces(R, rise)[1:]
    return -moments @ ahead[:2] / jnp.maximum(jnp.linalg.norm(ahead[:2]), 1e-12) / body.weight


def smaller_arm(robot: Robot, found: Floating, heel: float) -> Float[Array, ""]:
    """The smaller of the righting arms [m] at a heel [rad] to starboard and to port, traced."""
    return jnp.min(jax.lax.map(lambda side: side * arm(robot, found, side * heel), jnp.array([1.0, -1.0])))


def _arms(robot: Robot, found: Floating, heels: Float[Array, "k"]) -> Float[Array, "k"]:
    return jax.lax.map(lambda heel: arm(robot, found, heel), heels)


def _tilting(K: Float[Array, "3 3"]) -> Float[Array, "2 2"]:
    """Stiffness against tilts of a body that rises and sinks freely."""
    area = jnp.where(K[0, 0] > 0, K[0, 0], 1.0)
    return K[1:, 1:] - jnp.where(K[0, 0] > 0, jnp.outer(K[1:, 0], K[0, 1:]) / area, 0.0)


def _upright(away: Float[Array, "3"], size: Array) -> Float[Array, "3 3"]:
    """Least turn after which the centre of buoyancy, `away` from that of mass, is above it."""
    far = jnp.sum(away * away) > (_NEUTRAL * size) ** 2
    d = jnp.where(far, away, _UP)
    d = d / jnp.linalg.norm(d)
    below = d[2] < -1 + 1e-12
    turn = skew(cross(d, jnp.asarray(_UP)))
    R = jnp.eye(3) + turn + matmul3(turn, turn) / jnp.where(below, 1.0, 1 + d[2])
    return jnp.where(below, jnp.diag(jnp.array([1.0, -1.0, -1.0])), R)


def _strips(robot: Robot, pose: Pose) -> Strips:
    """All stations, at rest."""
    none = jnp.zeros_like(pose.position)
    moving = dict(zip(("rotation", "position", "angular_velocity", "velocity"), (*pose, none, none), strict=True))
    return Strips(**vars(robot.tree.stations), **moving)


def _meshes(robot: Robot) -> list[tuple[int, Float[Array, "m 3 3"]]]:
    """First station and corners of each part that is a mesh under a surface."""
    return [
        (int(at), corners)
        for g in robot.load_groups.on_bodies
        if isinstance(g.load, MeshBuoyancy)
        for at, corners in zip(g.stations(robot.tree), g.load.corners, strict=True)
    ]


def _lowest(body: _Body, R: Array, rise: Array) -> Float[Array, ""]:
    """Height of the lowest point [m]: of the shapes of stations, or of the triangles of meshes."""
    pose, robot = body.pose(R, rise), body.robot
    strips = _strips(robot, pose)
    low = strips.position[:, 2] - reach_up(strips)
    of_part, meshes = robot.tree.indices.part_of_station, _meshes(robot)
    plain = ~np.isin(of_part, [of_part[at] for at, _ in meshes])
    lows = [jnp.min(low[plain])] if plain.any() else []
    lows += [pose.position[at, 2] + jnp.min(dot(pose.rotation[at], x)[..., 2]) for at, x in meshes]
    return jnp.min(jnp.stack(lows))
