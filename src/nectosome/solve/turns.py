r"""Turns of a hinge whose motor finds its own speed: its period is not known before.

Such a robot has no clock: its equations do not depend on time, and its motion is periodic where a crank has turned once
and all else is as before. The period T is one more unknown of the cycle. The angle of the crank at the start is given
instead, since a motion that begins later is the same motion.
"""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from nectosome.core import State, Status
from nectosome.core.programs.remember import remembered
from nectosome.core.rows import all_on_device
from nectosome.mechanism import Robot, reduced

from .integrate import Settings, begin, integrate, interpolate
from .symmetry import Model, Symmetry

_LONGEST = 1e4  # [s] of a turn
_STEPS = 20_000  # most of a turn: a hinge that swings to and fro does not turn
_FIRST_STEP = 1e-4  # [s]
_RTOL, _ATOL = 1e-4, 1e-6  # of a simulation that only tells what turns


def free_hinges(robot: Robot, symmetry: Symmetry) -> tuple[int, ...]:
    """Places among the velocities of hinges that motors may turn on and on at speeds of their own.

    None where the equations depend on time, as with loops that are updated at a rate, or are the same at all angles, as
    those of a propeller that does not push aside: then the motion is steady.
    """
    if not symmetry.steady or not robot.powered.groups or robot.update_rates is not None:
        return ()
    moved = np.asarray(robot.tree.coordinate_names)[robot.powered.places(robot.tree, "v")]
    return tuple(k for k in symmetry.turns if robot.coordinate_names[k] in moved)


def with_crank(robot: Robot, symmetry: Symmetry, x: State) -> Symmetry:
    """Symmetry with the first of the `free_hinges` that makes a whole turn from x on; unchanged where none does."""
    free = free_hinges(robot, symmetry)
    if not free:
        return symmetry
    settings = Settings("implicit", *all_on_device(_RTOL, _ATOL, _STEPS))
    end, _, status = remembered(turn, reduced(robot), np.isin(np.arange(x.v.size), free), x, settings)
    if int(status) != Status.SOLVED:
        return symmetry
    turned = np.abs(np.asarray(robot.displacements(end.q) - robot.displacements(x.q)))
    return replace(symmetry, crank=max(free, key=lambda k: turned[k]))


def turn(
    robot: Model, hinges: Bool[Array, "nv"] | np.ndarray, x: State, settings: Settings
) -> tuple[State, Float[Array, ""], Array]:
    """State when the first of some hinges has turned once, the time [s] that it took, and the status.

    The status is SOLVED, or NO_TURN where none has within 10 000 s or 20 000 steps: a motor that stalls, or swings.
    """
    start = robot.displacements(x.q)

    def left(_: Array, x: State) -> Array:
        return jnp.max(jnp.where(hinges, jnp.abs(robot.displacements(x.q) - start), 0.0)) - 2 * jnp.pi

    unbounded = eqx.tree_at(lambda s: (s.longest, s.max_steps), settings, (np.inf, jnp.asarray(_STEPS)))
    m = begin(jnp.zeros(()), x, unbounded, jnp.asarray(_FIRST_STEP))
    m, _ = integrate(robot, m, jnp.array([_LONGEST]), unbounded, guard=left)
    turned = m.status == int(Status.EVENT)
    endless = (m.status == int(Status.SOLVED)) | (m.status == int(Status.STEP_LIMIT))
    status = jnp.where(turned, int(Status.SOLVED), jnp.where(endless, int(Status.NO_TURN), m.status))
    return interpolate(m, jnp.where(turned, m.end, m.t)), m.end, status
