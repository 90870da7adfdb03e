r"""What a tail does: its amplitude, Strouhal number, stride and slip; thrust and Froude efficiency.

With the period T, the speed U through the water, the forward speed $U_f$ and the body length L (`Robot.body_length`):

- stride length $U_f T/L$ (body lengths a cycle; Videler 1993), and body lengths per second $U_f/L$,
- tail amplitude a: half of the largest distance, across the forward direction, between two places of the robot's
  rearmost end in the frame that goes along with the mean velocity; half the peak-to-peak excursion of a tail that beats
  in a plane. The rearmost end is the station, or the end of a rigid part, that is furthest behind on the mean: of the
  part that is the reference's `tail`, where there is one,
- Strouhal number $2a/(T U)$ (Triantafyllou et al. 1993),
- slip $U_f/V$ with the speed V of a wave of bending that runs along the robot (Lighthill 1960): see `wave`,
- Froude efficiency $F U_f/P$ (Lighthill 1970) with the power P of all drives and the thrust F, where it can be told
  from drag: of a rigid first part on which nothing acts but drag, weight, buoyancy and added mass, the mean drag of
  that part against the forward direction, which the other parts overcome. NaN where a mount takes the difference.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from nectosome.core import safe_norm
from nectosome.loads import Buoyancy, Weight
from nectosome.mechanism import Diagnosis, Robot, load_names
from nectosome.mechanism.extent import points, points_of

from .wave import wave_speed

_POINT = 1e-8  # m: shorter bodies are points


def tail_amplitude(
    robot: Robot, once: Diagnosis, travelled: Float[Array, "n 3"], ahead: Float[Array, "3"]
) -> Float[Array, ""]:
    """Half of the largest distance across `ahead` between two places of the rearmost end, less the way `travelled`."""
    places = points(robot.tree, once.rotation, once.position)
    if robot.tail is not None:
        places = places[:, points_of(robot.tree, robot.tail)]
    tail = places[:, jnp.argmin(jnp.mean(places, axis=0) @ ahead)] - travelled
    across = tail - (tail @ ahead)[:, None] * ahead
    most = jnp.max(jnp.sum((across[:, None] - across) ** 2, axis=-1))
    return 0.5 * jnp.where(most > 0, jnp.sqrt(jnp.where(most > 0, most, 1.0)), 0.0)


def stroke(
    robot: Robot,
    times: Float[Array, "n"],
    once: Diagnosis,
    over_ground: Float[Array, "3"],
    drift: Float[Array, "3"],
    ahead: Float[Array, "3"],
    goes: Bool[Array, ""],
) -> dict[str, tuple[bool | Bool[Array, ""], Float[Array, ""], Float[Array, ""]]]:
    """Body lengths per second, stride length, tail amplitude, Strouhal number and slip of a cycle.

    `over_ground` and `drift` are the mean velocities over ground and through the water [m/s], `ahead` a unit vector,
    and `goes` says whether the body goes through the water. Each number is (whether it is defined, numerator,
    denominator).
    """
    seen = times.shape[0] > 2
    length, period, forward = robot.body_length, times[-1], jnp.sum(drift * ahead)
    runs, wave = wave_speed(robot, period, once, ahead)
    tail = tail_amplitude(robot, once, times[:-1, None] * over_ground, ahead)
    extended = length > _POINT
    return {
        "body_lengths_per_second": (extended, forward, length),
        "stride_length": (seen & extended, forward * period, length),
        "tail_amplitude": (seen, tail, jnp.ones(())),
        "strouhal": (goes & seen, 2 * tail, period * safe_norm(drift)),
        "slip": (runs & seen, forward, wave),
    }


def hull_drag(robot: Robot, mean_force: Float[Array, "loads parts 3"]) -> Float[Array, "3"] | None:
    """Mean force of drag on the first part [N]; None where thrust acts on it too, or cannot be told from drag."""
    names, drag = load_names(robot), np.zeros(len(load_names(robot)))
    on_rail = any(0 in g.parts for g in robot.load_groups.on_joints)
    if robot.tree.structure[0].strains is not None or on_rail:
        return None
    for g in robot.load_groups.acting:
        for name, part in zip(g.names, g.parts, strict=True):
            if part == 0 and not isinstance(g.load, Weight | Buoyancy):
                if not g.load.dissipative:
                    return None
                drag[names.index(name)] = 1.0
    return jnp.asarray(drag) @ mean_force[:, 0]
