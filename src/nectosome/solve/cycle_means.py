"""Cycle averages and peaks of a periodic motion: speed, forces, power, efficiency, cost of transport."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import State, UniformCurrent, safe_norm
from nectosome.core.programs.remember import prepare
from nectosome.core.se3 import dot_t, matmul3
from nectosome.loads import Leg, LineForce, PointForce, PulsedThrust, Spring
from nectosome.mechanism import SLIDES, Diagnosis, Robot, load_names
from nectosome.mechanism.diagnose import ADDED_MASS, DRIVE, SHAPE_CHANGE, VISCOUS, driving

from .flow_numbers import flow_numbers, has_flow_numbers
from .motor_results import MOTOR_VARIABLES, of_motors
from .results import TENDON_VARIABLES, VARIABLES, Data, Names, blank, diagnose_all, labels
from .stream import water_velocity
from .stroke import hull_drag, stroke
from .transport import KINDS, battery_endurance, costs, direction, least_known, ratio

_STAYS = 1e-9  # [largest speed of a part]: a slower body does not travel


class CyclePath(NamedTuple):
    """Circle or helix along which successive cycles move a body."""

    radius: float  # [m]
    rate: float  # mean angular speed [rad/s], less than half a turn per cycle
    axis: Float[np.ndarray, "3"]  # of rotation; without rotation, the direction of travel
    pitch: float  # displacement along the axis per turn [m]


class CycleMeans(NamedTuple):
    """Means over a cycle and largest magnitudes in it; SI units, world frame."""

    velocity: Float[Array, "parts 3"]  # of each part's first station [m/s]
    load_force: Float[Array, "loads parts 3"]  # [N]
    load_power: Float[Array, "loads parts"]  # [W], positive into the robot
    force: Float[Array, "3"]  # of all loads on all parts [N]
    force_peak: Float[Array, "3"]  # largest magnitude of each component [N]
    reaction: Float[Array, "prescribed"]  # of prescribed joints [N m, N]
    reaction_power: Float[Array, "prescribed"]  # [W]
    energy: Float[Array, "3"]  # kinetic, of the added mass, elastic [J]
    part_energy: Float[Array, "parts 3"]
    velocity_peak: Float[Array, "parts 3"]  # largest magnitude of each component
    load_power_peak: Float[Array, "loads"]  # of each load on all parts
    reaction_peak: Float[Array, "prescribed"]
    reaction_power_peak: Float[Array, "prescribed"]
    drive_velocity_peak: Float[Array, "prescribed"]  # [rad/s, m/s]
    hinge_strain_peak: Float[Array, "parts"]  # NaN for a part without a flexible layer
    hinge_stress_peak: Float[Array, "parts"]  # [Pa]
    bending_strain_peak: Float[Array, "parts"]  # along the part, at the ends of the half axes; NaN for a rigid part
    bending_stress_peak: Float[Array, "parts"]  # [Pa]
    power: Float[Array, ""]  # of all drives [W]
    power_positive: Float[Array, ""]  # of all drives, each while it gives power [W]
    water_velocity: Float[Array, "3"]  # of what speeds are relative to [m/s]
    speed: Float[Array, ""]  # through the water [m/s]
    forward_speed: Float[Array, ""]  # along the robot's own forward axis, signed [m/s]
    speed_over_ground: Float[Array, ""]  # [m/s]
    forward_speed_over_ground: Float[Array, ""]
    turn_rate: Float[Array, ""]  # [rad/s]
    efficiency: Float[Array, ""]
    energy_per_metre: Float[Array, ""]  # [J/m], of all drives
    energy_per_metre_positive: Float[Array, ""]  # of drives that cannot take power back
    energy_per_metre_electrical: Float[Array, ""]  # of motors
    energy_per_metre_battery: Float[Array, ""]
    cost_of_transport: Float[Array, ""]
    cost_of_transport_positive: Float[Array, ""]
    cost_of_transport_electrical: Float[Array, ""]
    cost_of_transport_battery: Float[Array, ""]
    froude_efficiency: Float[Array, ""]  # NaN where thrust cannot be told from drag
    body_length: Float[Array, ""]  # of the robot [m]
    body_lengths_per_second: Float[Array, ""]  # [1/s], signed
    stride_length: Float[Array, ""]  # [body lengths a cycle], signed
    tail_amplitude: Float[Array, ""]  # [m]
    strouhal: Float[Array, ""]
    slip: Float[Array, ""]  # NaN where no wave runs along the robot
    endurance: Float[Array, ""]  # least of the batteries [s]
    range: Float[Array, ""]  # [m]
    tracking_error_peak: Float[Array, "motor"]  # of servos [rad, m]; NaN without a position loop
    speed_error_peak: Float[Array, "motor"]  # of servos [rad/s, m/s]; NaN without a velocity loop
    voltage_demand_peak: Float[Array, "motor"]  # of servos, share of the supply's voltage; NaN of motors
    motor_rate_peak: Float[Array, "motor"]  # [rad/s, m/s]
    motor_torque_peak: Float[Array, "motor"]  # [N m, N]
    current_peak: Float[Array, "motor"]  # [A]
    electrical_power: Float[Array, "motor"]  # from the supply [W]
    motor_heat: Float[Array, "motor"]  # [W]
    battery_power: Float[Array, "battery"]  # with the electronics [W]
    tension: Float[Array, "tendon"]  # of tendons over joints [N]
    tension_peak: Float[Array, "tendon"]  # [N]
    tendon_heat: Float[Array, "tendon"]  # [W]
    battery_endurance: Float[Array, "battery"]  # [s]
    flow_number: Float[Array, "numbers loads parts"]  # see `flow_numbers`


def cycle_means(robot: Robot, times: Float[Array, "n"], states: State) -> CycleMeans:
    r"""Averages of a cycle with known states at equally spaced times from 0 to the period T, both ends included.

    A mean is that of the first n - 1 samples, the trapezoidal rule of a periodic function. With the position x and the
    rotation R of the root body's first station, the mean powers $\bar P_l$ of loads, $\bar P_r$ of reactions and
    $\bar P_d$ of driving forces, and the mass m of the robot:

    - force: of a robot on a support, minus the mean support reaction, since the rate of momentum has mean 0. It
      converges faster with samples than the mean of the reactions, which contain impacts on joint limits. Its peak
      corresponds to a load cell with a low-pass that removes such impacts.
    - power $P = \sum \bar P_r + \sum \bar P_d$, including muscles, tendons and chambers; negative power of a drive in a
      part of the cycle is subtracted. Given forces on a root that slides freely push against the water: their power is
      that through it. power_positive is without that: the mean of $\sum \max(P_r, 0) + \sum \max(P_d,
      0)$, of drives that cannot take power back.
    - water_velocity c: mean velocity of the water at x; 0 where legs on the floor carry the robot over the ground.
    - speed $U = |u|$ through the water, $u = (x(T) - x(0))/T - c$; speed_over_ground $|x(T) - x(0)|/T$. In all that
      follows a speed is one through the water.
    - forward_speed $u \cdot f$ with the mean direction f of the robot's forward axis, the unit vector
      along the mean of $R e$: negative where it goes backwards (tail first), whatever its heading. NaN where the axis
      points nowhere on the mean. forward_speed_over_ground is that of x.
    - turn_rate $\mathrm{atan2}(Q_{yx} - Q_{xy}, Q_{xx} + Q_{yy})/T$, $Q = R(T) R(0)^T$: the change of heading, less
      than half a turn per cycle.
    - efficiency $-\sum \bar P_l / P$ of the loads on the root body, except its added mass: the power to tow that body
      along its motion through the water over the power of the drives. Close to the quasi-propulsive efficiency
      (Maertens et al. 2015), which tows at the mean speed. NaN if the body does not travel, if the drives give no
      power, and for a rod as root body, whose bending and towing are not separable.
    - energy_per_metre $P/U$ and cost_of_transport $P/(m g U)$, each of four powers: see `transport`. NaN if the body
      does not travel, and if it is held or towed in a stream, by drives whose power is over ground. They and the
      efficiency are NaN with a load whose power source is not among the drives: a given force or thrust, a change of
      shape, a jet or leg whose crank no joint turns. The efficiency is NaN with every jet, whose power is not that of
      towing.
    - froude_efficiency, body_lengths_per_second, stride_length, tail_amplitude, strouhal, slip: see `stroke`. Of
      fewer than three times, which see no beat, those of a beat are NaN.
    - flow_number: see `flow_numbers`.
    - endurance, the least of those of the batteries that say their charge or energy, and range, U times that; NaN
      without one. See `battery_endurance`.

    Works under jit, vmap and derivatives.
    """
    return means_of(robot, times, diagnose_all(robot, times, states))


def means_of(robot: Robot, times: Float[Array, "n"], d: Diagnosis) -> CycleMeans:
    """`cycle_means` of a diagnosed cycle, leaves [n, ...]."""
    once = jax.tree.map(lambda x: x[:-1], d)  # the last sample repeats the first
    mean = jax.tree.map(lambda x: jnp.mean(x, axis=0), once)
    streamed = by_stream(robot, times[:-1], once.rotation[:, 0])
    drives = once.load_power.at[:, load_names(robot).index(DRIVE), 0].add(-streamed)
    drives = drives[:, driving(robot)]
    power = jnp.sum(mean.reaction_power) + jnp.sum(jnp.mean(drives, axis=0))
    over_ground = (d.position[-1, 0] - d.position[0, 0]) / times[-1]
    stream = water_velocity(robot, times[:-1], once.position[:, 0])
    flow = jnp.mean(stream, axis=0)
    drift = over_ground - flow
    speed, ground_speed = safe_norm(drift), safe_norm(over_ground)
    weights = jnp.full(times.shape[0] - 1, 1 / (times.shape[0] - 1))
    ahead, points = direction(robot.ahead, once.rotation[:, 0], weights)
    forward = jnp.sum(drift * ahead)
    Q = matmul3(d.rotation[-1, 0], d.rotation[0, 0].T)  # from start to end
    fastest = jnp.max(safe_norm(jax.lax.stop_gradient(once.velocity - stream[:, None])))
    root = robot.tree.structure[0]
    # the power source of a given force, or of a crank at a given speed, is not among the drives
    hull = root.strains is None
    sourceless = PointForce | LineForce | PulsedThrust | Leg
    given = any(isinstance(g.load, sourceless) and not g.cranks for g in robot.load_groups.acting)
    reshaping = robot.load_groups.reshaping.values()
    # a spring holds it: its mean speed is rounding
    anchored = not root.prescribed and any(
        isinstance(g.load, Spring) and 0 in g.parts for g in robot.load_groups.on_joints
    )
    goes = (speed > _STAYS * fastest) & (not anchored)
    swims = bool({*root.joint.names} & SLIDES) and not root.prescribed
    # else it is held or towed, in a stream by powers over ground, which do not go with a speed through the water
    moves = goes & (swims | ((ground_speed > _STAYS * fastest) & jnp.all(flow == 0)))
    travels = moves & all(g.cranks or g.load.driven for g in reshaping) & (not given)
    motors = of_motors(once)
    power_positive = _given(once.reaction_power) + _given(drives)
    mechanical, electrical = jnp.stack([power, power_positive]), (mean.powered.electrical, mean.battery_power)
    lasting = battery_endurance(*robot.powered.stored, once.battery_voltage, once.battery_power, weights)
    endurance = least_known(lasting)
    lasts = ~jnp.isnan(endurance)
    largest = ("tracking_error", "speed_error", "voltage_demand", "motor_rate", "motor_torque", "current")
    return CycleMeans(
        **{name: value for name, value in mean._asdict().items() if name in CycleMeans._fields},
        **{f"{name}_peak": _largest(motors[name]) for name in largest},
        electrical_power=mean.powered.electrical,
        motor_heat=mean.powered.heat,
        tension=mean.tendons.tension,
        tension_peak=_largest(once.tendons.tension),
        tendon_heat=mean.tendons.heat,
        force=jnp.sum(mean.load_force, axis=(0, 1)),
        force_peak=_largest(jnp.sum(once.load_force, axis=(1, 2))),
        velocity_peak=_largest(once.velocity),
        load_power_peak=_largest(jnp.sum(once.load_power, axis=2)),
        reaction_peak=_largest(once.reaction),
        reaction_power_peak=_largest(once.reaction_power),
        drive_velocity_peak=_largest(once.drive_velocity),
        hinge_strain_peak=_largest(once.bending.hinge_strain),
        hinge_stress_peak=_largest(once.bending.hinge_stress),
        bending_strain_peak=_by_part(robot, once.bending.strain),
        bending_stress_peak=_by_part(robot, once.bending.stress),
        power=power,
        power_positive=power_positive,
        water_velocity=flow,
        speed=speed,
        forward_speed=jnp.where(points, forward, jnp.nan),
        speed_over_ground=ground_speed,
        forward_speed_over_ground=jnp.where(points, jnp.sum(over_ground * ahead), jnp.nan),
        turn_rate=jnp.arctan2(Q[1, 0] - Q[0, 1], Q[0, 0] + Q[1, 1]) / times[-1],
        body_length=robot.body_length,
        froude_efficiency=_froude(robot, mean, ahead, forward, power, travels & points),
        **{
            name: ratio(points & defined, a, b)
            for name, (defined, a, b) in stroke(robot, times, once, over_ground, drift, ahead, goes).items()
        },
        efficiency=ratio(travels & (power > 0) & hull & (not reshaping), _towing(robot, once, stream), power),
        **dict(costs(robot, speed, travels, mechanical, *electrical)),
        endurance=endurance,
        range=jnp.where(lasts & moves, jnp.where(lasts, endurance, 0.0) * speed, jnp.nan),
        battery_endurance=lasting,
        flow_number=jnp.asarray(
            flow_numbers(robot, times[:-1], once.flows, weights, times[-1] if times.shape[0] > 2 else None)
        ),
    )


def by_stream(robot: Robot, times: Any, rotation: Any) -> Float[Array, "n"]:
    """Power [W] of a uniform current on given forces of a root that slides freely: theirs less it is that in water.

    With n `rotation` [n, 3, 3] of the root's first station.
    """
    root, current = robot.tree.one(0), robot.water.current
    held = any(0 in g.parts for g in (*robot.load_groups.on_joints, *robot.powered.groups))
    push = root.drive
    if not isinstance(current, UniformCurrent) or push is None or held:
        return jnp.zeros(times.shape)
    slides = root.joint.motion(root.joint.start()[0]).subspace[:, 3:]  # in the part's own frame, wherever it is
    along = jax.vmap(lambda R: slides @ dot_t(R, current.velocity))(rotation)
    return jnp.sum(jax.vmap(lambda t: push(t)[0])(times).reshape(along.shape) * along, axis=-1)


def _froude(robot: Robot, mean: Diagnosis, ahead: Array, forward: Array, power: Array, travels: Array) -> Array:
    drag = hull_drag(robot, mean.load_force)
    if drag is None:
        return jnp.asarray(jnp.nan)
    return ratio(travels & (power > 0) & (forward > 0), -jnp.sum(drag * ahead) * forward, power)


def _given(power: Float[Array, "n k"]) -> Float[Array, ""]:
    """Mean of positive powers, summed [W]."""
    return jnp.sum(jnp.mean(jnp.maximum(power, 0.0), axis=0))


def _towing(robot: Robot, once: Diagnosis, stream: Float[Array, "n 3"]) -> Float[Array, ""]:
    """Mean power [W] that the loads on the root body dissipate, seen from the water, which has velocities `stream`."""
    own = np.array([name not in (ADDED_MASS, SHAPE_CHANGE, VISCOUS, DRIVE) for name in load_names(robot)])
    power = once.load_power[:, :, 0] - jnp.sum(once.load_force[:, :, 0] * stream[:, None], axis=-1)
    return -jnp.sum(jnp.mean(power, axis=0)[own & ~driving(robot)[:, 0]])


def _largest(x: Float[Array, "n *rest"]) -> Float[Array, "*rest"]:
    """Largest magnitude along the first axis; NaN if one is NaN, without NaN in other derivatives."""
    none = jnp.isnan(x)
    size = jnp.max(jnp.abs(jnp.where(none, 0.0, x)), axis=0)
    return jnp.where(jnp.any(none, axis=0), jnp.nan, size)


def _by_part(robot: Robot, x: Float[Array, "n stations 2"]) -> Float[Array, "parts"]:
    """Largest magnitude at any station of each part."""
    return jnp.stack([_largest(x[:, place.stations].reshape(-1)) for place in robot.tree.layout])


def prepare_means(robot: Robot, samples: int) -> None:
    """Compile `cycle_means` for cycles of that many samples in the background."""
    prepare(cycle_means, robot, *blank(robot, samples))


OF_A_CYCLE: dict[str, tuple[tuple[str, ...], str]] = {
    "load_power_peak": (("load",), "W"),
    "bending_strain_peak": (("part",), "1"),
    "bending_stress_peak": (("part",), "Pa"),
    "force": (("axis",), "N"),
    "force_peak": (("axis",), "N"),
    "power": ((), "W"),
    "power_positive": ((), "W"),
    "water_velocity": (("axis",), "m/s"),
    "speed": ((), "m/s"),
    "forward_speed": ((), "m/s"),
    "speed_over_ground": ((), "m/s"),
    "forward_speed_over_ground": ((), "m/s"),
    "turn_rate": ((), "rad/s"),
    "efficiency": ((), "1"),
    **{f"energy_per_metre{kind}": ((), "J/m") for kind in KINDS},
    **{f"cost_of_transport{kind}": ((), "1") for kind in KINDS},
    "froude_efficiency": ((), "1"),
    "body_length": ((), "m"),
    "body_lengths_per_second": ((), "1/s"),
    "stride_length": ((), "1"),
    "tail_amplitude": ((), "m"),
    "strouhal": ((), "1"),
    "slip": ((), "1"),
    "endurance": ((), "s"),
    "range": ((), "m"),
    "battery_endurance": (("battery",), "s"),
    "flow_number": (("number", "load", "part"), "1"),
}


def mean_data(robot: Robot, means: CycleMeans, dims: tuple[str, ...] = ()) -> tuple[Data, Names]:
    """The means with the dimensions and units of `Results.data`, and the names along them, as in `Results.names`.

    `dims` name the leading dimensions of the arrays, those of a sweep. A mean has the name of its quantity; names of
    largest magnitudes end in `_peak`.
    """
    data = {}
    kinds = OF_A_CYCLE | VARIABLES | MOTOR_VARIABLES | TENDON_VARIABLES
    absent = set() if robot.powered.groups else {"motor", "battery"}
    absent |= set() if robot.load_groups.tendons else {"tendon"}
    absent |= set() if has_flow_numbers(robot) else {"number"}
    for name, values in means._asdict().items():
        own, unit = kinds.get(name) or kinds[name.removesuffix("_peak")]
        if absent & {*own}:
            continue
        data[name] = ((*dims, *own), np.asarray(values), unit)
    used = {dim for own, _, _ in data.values() for dim in own}
    return data, {name: label for name, label in labels(robot).items() if name in used}
