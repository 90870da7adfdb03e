"""Free swimming of bodies that are made to bend by a wave: one rod, in a plane, of which nothing is fitted.

What a beat does follows from the forces of the water: the speed, and the recoil of head and tail.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import State, Wave
from nectosome.description import RobotDescription
from nectosome.description.loads import DragLoad
from nectosome.mechanism import Robot, SoftRod, Tree
from nectosome.solve import fixed_step

STEPS = 32  # of a beat; four times as many change no speed by more than 1e-4
_BEATS = 30
_START = 0.5  # body lengths a beat


class Swims(NamedTuple):
    """What several swims do in a beat, in body lengths L."""

    speed: Float[np.ndarray, "n"]  # between the ends of the last beat [L/s]
    head: Float[np.ndarray, "n"]  # excursion across the path, from side to side [L]
    tail: Float[np.ndarray, "n"]  # [L]
    change: Float[np.ndarray, "n"]  # of the speed from the last beat but one, relative to it


def with_plate_friction(description: RobotDescription, reynolds: float) -> RobotDescription:
    r"""The same body with the skin friction of a laminar plate that does not undulate, $C_f = 1.328/\sqrt{Re}$.

    `StripDrag` has 2 C_f along the body: rho pi/2 r C_t u^2 per length is 1/2 rho C_f u^2 over the perimeter 2 pi r.
    """
    friction = DragLoad(kind="drag", normal=0.0, tangential=2 * 1.328 / np.sqrt(reynolds))
    return description.with_part("body", loads={**description.parts["body"].loads, "friction": friction})


def swims(robot: Robot, waves: Sequence[Wave], viscosity: Float[np.ndarray, "n"]) -> Swims:
    """Swims of one body by several waves, in water of a viscosity [Pa s]; all start at half a length a beat.

    The body is the robot's only part, a rod from head to tail on a planar joint.
    """
    n, together = viscosity.size, jax.tree.map(lambda *x: jnp.stack(x), *waves)
    frequency = np.asarray(together.frequency)
    body = robot.tree.parts[0].body
    assert isinstance(body, SoftRod)
    length = float(body.length)
    rest = robot.initial()
    v = jnp.zeros((n, 3)).at[:, 0].set(-_START * frequency * length)
    places = _swim(robot, together, jnp.asarray(viscosity), State(jnp.broadcast_to(rest.q, (n, 3)), v, rest.z))
    return _last_beat(np.asarray(places) / length, frequency)


@eqx.filter_jit
def _swim(robot: Robot, waves: Wave, viscosity: Float[Array, "n"], start: State) -> Float[Array, "n steps stations 2"]:
    """Where all stations are in the last two beats, both ends included [m]."""

    def one(wave: Wave, viscosity: Array, x: State) -> Array:
        part = eqx.tree_at(lambda part: part.strain_signals[0], robot.tree.one(0), wave)
        swimmer = replace(robot, tree=Tree.of([part]), water=replace(robot.water, viscosity=viscosity))
        tree, step = swimmer.tree, 1 / wave.frequency / STEPS

        def place(t: Array, x: State) -> Float[Array, "stations 2"]:
            return tree.shape(tree.complete(t, x.q, x.v)[0]).position[:, :2]

        x, _ = fixed_step(swimmer, jnp.zeros(()), x, step, STEPS * (_BEATS - 2))
        _, kept = fixed_step(swimmer, jnp.zeros(()), x, step, 2 * STEPS, lambda x: x)
        all_of = jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), x, kept)
        return jax.vmap(place)(step * jnp.arange(2 * STEPS + 1), all_of)

    return jax.vmap(one)(waves, viscosity, start)


def _last_beat(places: Float[np.ndarray, "n steps stations 2"], frequency: Float[np.ndarray, "n"]) -> Swims:
    """Swims in the last of two beats, by the places [L] of all stations."""
    path = np.diff(places[:, ::STEPS, 0], axis=1)  # of the head, in each beat
    before, last = np.linalg.norm(path, axis=-1).T
    along = path[:, 1] / last[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    lateral = np.einsum("ntsk,nk->nts", places[:, STEPS:][:, :, [0, -1]], across)
    # a heading that still drifts is no beat: what is between the ends is taken out evenly
    drift = (lateral[:, -1] - lateral[:, 0])[:, None] * np.linspace(0, 1, STEPS + 1)[:, None]
    head, tail = np.ptp(lateral - drift, axis=1).T
    return Swims(last * frequency, head, tail, last / before - 1)
