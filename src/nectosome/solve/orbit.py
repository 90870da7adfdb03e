r"""Periodic orbits by shooting, modulo what the equations do not depend on.

A state x at the start of a cycle is looked for from which the robot comes back to itself after a period T, but for the
symmetry: a swimmer's place and heading may drift. With the flow $\Phi_T$ and displacements y of the state,

$$ F(y) = \Phi_T(x \oplus y) \ominus (x \oplus y) = 0, \quad y = -(D\Phi_T - 1)^{-1} F $$

by Newton's method; the derivative goes through the adaptive time steps. It costs many times what the cycle itself does,
so it is kept while corrections by it bring the ends together quickly, and taken afresh where they have met. Where a
correction does not bring them closer the robot is left to itself for a cycle instead, as it is for the first cycles.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from nectosome.core import Solution, State, Status
from nectosome.core.linear import generalised_inverse
from nectosome.mechanism import Robot

from .march import Settings, begin, march
from .symmetry import Symmetry

_WAIT, _CYCLES = 2, 60  # cycles before Newton's method, and in all
_CORRECTIONS = 12
_QUICK = 0.1  # of the gap that a correction leaves: the derivative is kept
_CLOSED = 1.0  # of the error allowed in a step: ends as close have met
_FIRST_STEP = 1e-4  # s
_NOTHING = 1e-9  # of what a cycle does to a disturbance


class Orbit(NamedTuple):
    """A motion that repeats itself."""

    state: State  # at the start of the cycle, t = 0
    monodromy: Float[Array, "m m"]  # derivative of the state after a cycle by that before, in displacements


_Gap = tuple[Array, State, Array]  # between the ends of a cycle; its last state; status of the time integration


class _Search(NamedTuple):
    x: State
    monodromy: Array
    inverse: Array  # of the derivative of the gap, where it was last taken
    derive: Array  # take it in the next cycle
    size: Array  # of the gap between the ends of the last cycle, in allowed errors
    best: Array  # size that a correction must halve; inf after a wait, when any gap may be corrected again
    corrections: Array
    cycles: Array
    waited: Array  # the last move was to wait
    status: Array  # of the time integration
    done: Array


def near(robot: Robot, x: State, y: Float[Array, "m"]) -> State:
    """State displaced by y: coordinates along the velocities, velocities, load states."""
    n = x.v.shape[0]
    z, unravel = ravel_pytree(x.z)
    return State(robot.advance(x.q, y[:n], jnp.ones(())), x.v + y[n : 2 * n], unravel(z + y[2 * n :]))


def between(robot: Robot, symmetry: Symmetry, a: State, b: State) -> Float[Array, "m"]:
    """Displacement from a to b as far as the equations can tell: 0 along the symmetry."""
    moved = robot.displacements(b.q) - robot.displacements(a.q)
    moved = jnp.where(symmetry.rates(moved.shape[0]), 0.0, moved)
    if symmetry.spin:
        moved = moved.at[:3].set(symmetry.tilt(robot, a.q, b.q))
    return jnp.concatenate([moved, b.v - a.v, ravel_pytree(b.z)[0] - ravel_pytree(a.z)[0]])


def states_at(robot: Robot, x: State, times: Float[Array, "n"], settings: Settings) -> tuple[State, Array]:
    """States at increasing times from x at time 0 on, and the status of the integration."""
    m, states = march(robot, begin(jnp.zeros(()), x, settings, jnp.asarray(_FIRST_STEP)), times, settings)
    return states, m.status


def after(robot: Robot, x: State, time: Float[Array, ""], settings: Settings) -> tuple[State, Array]:
    """State after some time, and the status of the integration."""
    states, status = states_at(robot, x, time[None], settings)
    return jax.tree.map(lambda x: x[0], states), status


def _solved(J: Float[Array, "m m"]) -> Float[Array, "m m"]:
    """Generalised inverse of DPhi - 1, whose rounding errors are no numbers."""
    return generalised_inverse(jnp.where(jnp.abs(J) > _NOTHING, J, 0.0))


def orbit(robot: Robot, symmetry: Symmetry, guess: State, period: Float[Array, ""], settings: Settings) -> Solution:
    """Periodic orbit from a state nearby, with status SOLVED, SETTLED (Newton's method did not get there) or NO_PERIOD.

    The residual is the root mean square of the gap between the ends of the cycle, in errors allowed by the settings.
    Works under jit and vmap.
    """
    m = ravel_pytree((guess.v, guess.v, guess.z))[0].shape[0]

    def gap(x: State, y: Array) -> tuple[Array, _Gap]:
        x = near(robot, x, y)
        end, status = after(robot, x, period, settings)
        r = between(robot, symmetry, x, end)
        return r, (r, end, status)

    def size_of(r: Array, x: State) -> Array:
        numbers = ravel_pytree((robot.displacements(x.q), x.v, x.z))[0]
        scaled = r / (settings.atol + settings.rtol * jnp.abs(numbers))
        return jnp.sqrt(jnp.mean(scaled**2))

    def derived(s: _Search) -> tuple[Array, Array, _Gap]:
        J, out = jax.jacfwd(lambda y: gap(s.x, y), has_aux=True)(jnp.zeros(m))
        return J + jnp.eye(m), _solved(J), out

    def kept(s: _Search) -> tuple[Array, Array, _Gap]:
        return s.monodromy, s.inverse, gap(s.x, jnp.zeros(m))[1]

    def look(s: _Search) -> _Search:
        monodromy, inverse, (r, end, status) = jax.lax.cond(s.derive, derived, kept, s)
        size = size_of(r, s.x)
        closed = size <= _CLOSED
        first = s.cycles < _WAIT
        closer = (size < 0.5 * s.best) & (s.corrections < _CORRECTIONS) & ~first
        corrected = near(robot, s.x, -inverse @ r)
        fine = jnp.all(jnp.isfinite(ravel_pytree(corrected)[0]))
        newton = closer & fine
        x = jax.tree.map(lambda a, b, c: jnp.where(closed, a, jnp.where(newton, b, c)), s.x, corrected, end)
        bad = status != int(Status.SOLVED)
        cycles = s.cycles + 1
        slow = ~newton | (jnp.isfinite(s.best) & (size > _QUICK * s.best))
        return _Search(
            x=x,
            monodromy=monodromy,
            inverse=inverse,
            derive=closed | ((cycles >= _WAIT) & slow),
            size=size,
            best=jnp.where(newton, size, jnp.inf),
            corrections=s.corrections + newton,
            cycles=cycles,
            waited=jnp.where(closed, s.waited, ~newton & ~first),
            status=status,
            done=(closed & s.derive) | bad | (~closed & (cycles >= _CYCLES)),
        )

    none, infinite, no = jnp.zeros((), int), jnp.asarray(jnp.inf), jnp.asarray(False)
    solved, eye = jnp.asarray(int(Status.SOLVED)), jnp.eye(m)
    start = _Search(guess, eye, 0 * eye, no, infinite, infinite, none, none, no, solved, no)
    s = jax.lax.while_loop(lambda s: ~s.done, look, start)
    found = jnp.where(s.waited, int(Status.SETTLED), int(Status.SOLVED))
    status = jnp.where(s.size <= _CLOSED, found, int(Status.NO_PERIOD))
    status = jnp.where(s.status == int(Status.SOLVED), status, s.status)
    stats = {"cycles": s.cycles, "corrections": s.corrections}
    return Solution(Orbit(s.x, s.monodromy), status, stats, s.size)
