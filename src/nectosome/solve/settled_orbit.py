"""Periodic orbits that free motion leads to, as those of many robots side by side."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Solution, State, Status

from .cycle_attempt import CycleAttempt, along_velocities, before_any, cycle, gap_inverse
from .integrate import Settings
from .orbit import Orbit
from .orbit_search import LOOSE, settings_at
from .runge_kutta import rms
from .symmetry import Model, Symmetry, near

_SETTLE, _POLISH = 8, 4  # most cycles of free motion, and of Newton's method after them


class _Polish(NamedTuple):
    """Newton's method after free motion."""

    x: State
    step: Array  # from x to what it corrects
    found: CycleAttempt  # from x
    left: Array  # the larger of gap and step over the tolerance
    rounds: Array


def settled_orbit(
    robot: Model, symmetry: Symmetry, guess: State, times: Float[Array, "n"], settings: Settings
) -> Solution:
    """Periodic orbit that free motion (transient) leads to, with status SOLVED, or NO_PERIOD after a few cycles.

    If the gap g shrinks by the factor s per cycle, the remaining distance is g/(1 - s): until it is within the
    tolerance, cycles need no derivatives. Newton's method follows, until gap and correction are within the tolerance,
    with one derivative, by a cycle at loose tolerances. Corrections shrink by its error, and the monodromy has it too:
    the largest multipliers of a tuna and a rowing robot, 0.713 and 1.211, are off by 0.002.
    """

    def more(carry: tuple[CycleAttempt, Array, Array]) -> tuple[CycleAttempt, Array, Array]:
        before, _, count = carry
        found = cycle(robot, symmetry, before.end, times, settings)
        shrinks = jnp.isfinite(before.size) & (found.size < before.size)
        share = jnp.where(shrinks, found.size / jnp.where(shrinks, before.size, 1.0), 0.0)
        left = jnp.where(shrinks | (found.size == 0), found.size / (1.0 - share), jnp.inf)
        return found, left, count + 1

    def going(carry: tuple[CycleAttempt, Array, Array]) -> Array:
        found, left, count = carry
        return (left > 1.0) & (found.status == solved) & (count < _SETTLE)

    def gap(y: Array) -> Array:
        return cycle(robot, symmetry, near(robot, x, y), times, loose).gap

    def judged(x: State, found: CycleAttempt, rounds: Array) -> _Polish:
        step = -inverse @ found.gap
        return _Polish(x, step, found, jnp.maximum(found.size, rms(step / found.allowed)), rounds)

    def correct(s: _Polish) -> _Polish:
        x = near(robot, s.x, s.step)
        return judged(x, cycle(robot, symmetry, x, times, settings), s.rounds + 1)

    def correcting(s: _Polish) -> Array:
        return ~(s.left <= 1.0) & jnp.isfinite(rms(s.step)) & (s.found.status == solved) & (s.rounds < _POLISH)

    solved, none, far = int(Status.SOLVED), jnp.zeros((), int), jnp.asarray(jnp.inf)
    waited, _, count = jax.lax.while_loop(going, more, (before_any(guess, times), far, none))
    x = jax.tree.map(lambda x: x[0], waited.states)
    loose = settings_at(settings, LOOSE)
    J = jax.jacfwd(gap)(jnp.zeros(waited.gap.size))
    inverse, monodromy = gap_inverse(J), along_velocities(robot, symmetry, x) @ J + jnp.eye(len(J))
    s = jax.lax.while_loop(correcting, correct, judged(x, waited, none))
    status = jnp.where(s.left <= 1.0, solved, int(Status.NO_PERIOD))
    status = jnp.where(s.found.status == solved, status, s.found.status)
    stats = {"cycles": count + s.rounds, "corrections": s.rounds}
    return Solution(Orbit(s.found.states, monodromy, jnp.full_like(monodromy, jnp.nan)), status, stats, s.left)
