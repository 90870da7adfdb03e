r"""The periodic motion that forces give a held robot, by harmonic balance: an estimate before a run.

Torques, muscles, chambers and tendons bend the robot, which is held where it starts. Of each free coordinate

$$ d(t) = c + \sum_k a_k \cos k\omega t + b_k \sin k\omega t $$

over the frequencies k of its drives alone; the same harmonics of all forces on it vanish (Krylov and Bogoliubov 1947).
Elasticity, damping, added mass and drag count, higher harmonics and states of loads, such as wakes, do not. Newton's
method finds it, with steps that shorten the next one (Deuflhard 2011, 3.3).
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import State
from nectosome.core.programs.remember import remembered
from nectosome.mechanism import Robot

_TIMES = 16  # in a period of the fastest drive
_STEPS, _SHORTEST = 20, 2.0**-6  # of Newton's method
_DAMPED = (4.0, 1.0, 0.25, 0.0)  # damping ratios, twice, that are added one after another: at rest drag has none
_CLOSE = (0.2, 0.2, 0.2, 1e-3)  # last step beside the motion, at each of them


def forced_motion(
    robot: Robot, period: float, harmonics: list[int], time: Float[np.ndarray, "t"]
) -> tuple[Float[np.ndarray, "t n"], Float[np.ndarray, "t n"]] | None:
    """Displacements and velocities of the unknown coordinates at times of a period [s]; None where none is found.

    `harmonics` are the frequencies of the drives, times the period.
    """
    held = np.isin(robot.tree.free_v, robot.tree.joint_velocities((0,)))
    if held.all():
        return None
    chosen, few = np.eye(held.size)[:, ~held], np.arange(_TIMES * max(harmonics)) / (_TIMES * max(harmonics)) * period
    x = _balanced(robot, *map(jnp.asarray, (few, _shapes(few, period, harmonics), chosen)))
    if x is None:
        return None
    d, v, _ = _shapes(time, period, harmonics) @ x.T @ chosen.T
    return d + np.asarray(robot.displacements(robot.start.q)), v


def _shapes(time: Float[np.ndarray, "t"], period: float, harmonics: list[int]) -> Float[np.ndarray, "3 t m"]:
    """A constant, and cosine and sine of each harmonic, with their first and second derivatives."""
    rates, one = 2 * np.pi * np.array(harmonics) / period, np.ones((len(time), 1))
    cos, sin = np.cos(time[:, None] * rates), np.sin(time[:, None] * rates)
    rows = [(one, cos, sin), (0 * one, -rates * sin, rates * cos), (0 * one, -(rates**2) * cos, -(rates**2) * sin)]
    return np.stack([np.hstack(row) for row in rows])


def _balanced(robot: Robot, time: Array, shapes: Array, chosen: Array) -> Float[np.ndarray, "k m"] | None:
    """Coefficients of each coordinate at which harmonics of the forces vanish; None where Newton's method fails."""
    x = np.zeros((chosen.shape[1], shapes.shape[2]))
    mass = np.asarray(chosen.T @ remembered(_mass, robot) @ chosen)
    turning = np.linalg.pinv(shapes[0]) @ shapes[1]  # coefficients of velocities
    damping = np.kron(mass, turning * np.abs(turning).max(axis=0))

    def at(x: np.ndarray, more: float) -> tuple[np.ndarray, np.ndarray]:
        left, J = map(np.asarray, remembered(_left, robot, time, shapes, chosen, jnp.asarray(x)))
        return left.ravel() + more * damping @ x.ravel(), J.reshape(x.size, x.size) + more * damping

    def step(J: np.ndarray, left: np.ndarray) -> np.ndarray:
        return -np.linalg.lstsq(J, left, rcond=None)[0]  # what nothing holds keeps its mean

    for more, close in zip(_DAMPED, _CLOSE, strict=True):
        left, J = at(x, more)
        for _ in range(_STEPS):
            if not (np.isfinite(left).all() and np.isfinite(J).all()):
                return None
            ahead, share = step(J, left), 1.0
            size = np.linalg.norm(ahead)
            if size <= close * np.linalg.norm(x):
                break
            while True:
                there = x + share * ahead.reshape(x.shape)
                left, J_there = at(there, more)
                known = np.isfinite(left).all()
                if share <= _SHORTEST or (known and np.linalg.norm(step(J, left)) <= (1 - share / 4) * size):
                    break
                share /= 2
            x, J = there, J_there
        else:
            return None
    return x


def _mass(robot: Robot) -> Array:
    """Mass matrix where it starts, with that of the water."""
    start = State(robot.start.q, 0.0 * robot.start.v, robot.start.z)
    return robot.mass_bias(jnp.zeros(()), start)[0]


def _left(robot: Robot, time: Array, shapes: Array, chosen: Array, x: Array) -> tuple[Array, Array]:
    """Harmonics of the forces that are left, and their derivatives by the coefficients x."""
    start = robot.displacements(robot.start.q)
    back = jnp.linalg.pinv(shapes[0])

    def at(t: Array, d: Array, v: Array, a: Array) -> Array:
        return robot.residual(t, State(robot.coordinates(start + d), v, robot.start.z), a)

    def left(x: Array) -> Any:
        d, v, a = jnp.einsum("sti,ki,nk->stn", shapes, x, chosen)
        return jnp.einsum("it,tn,nk->ki", back, jax.vmap(at)(time, d, v, a), chosen)

    return left(x), jax.jacfwd(left)(x)
