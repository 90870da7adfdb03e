r"""Runge-Kutta methods: their coefficients, and one time step of a mechanical system, implicit or explicit.

Implicit: the stiffly accurate, L-stable ESDIRK 4(3) of Kennedy and Carpenter (2003, ARK4(3)6L[2]SA). A stage solves
for the accelerations alone, since velocities and coordinates follow from them,
$v_i = \bar v_i + c\,a_i$, $q_i = \bar q_i + c\,N(q_i) v_i$ with $c = \gamma h$: a system of half the size of the
first-order form. Its exact Jacobian $M + c\,C + c^2 K$ is kept from step to step while Newton's method converges well.

Explicit: the Runge-Kutta 5(4) of Tsitouras (2011).
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int

from nectosome.core import Mechanical, State
from nectosome.core.linear_algebra import inverse
from nectosome.core.rows import all_on_device
from nectosome.core.shared_derivatives import along

from .stage import CHANGE, LEAST_CHANGE, ImplicitStage, Neighbours, as_rows, moved_to, solved_beside


class Tableau(NamedTuple):
    """Butcher tableau whose last stage is the solution; `error` has the stage weights of the embedded error."""

    order: int
    A: np.ndarray  # [s, s]
    c: np.ndarray  # [s]
    error: np.ndarray  # [s]

    @property
    def kink_share(self) -> float:
        """Share s of a step whose stages before s have weights that add up to s, and the one furthest from a stage.

        A step over a jump of the rate at s is right to the second order.
        """
        c, order = np.append(np.sort(self.c), 1.0), np.argsort(self.c, kind="stable")
        s = np.cumsum(self.A[-1][order])
        room = np.minimum(s - c[:-1], c[1:] - s)
        return float(s[np.argmax(room)])


def _matrix(*rows: list[float]) -> np.ndarray:
    return np.array([row + [0.0] * (len(rows) - len(row)) for row in rows])


GAMMA = 0.25
_B = [82889 / 524892, 0.0, 15625 / 83664, 69875 / 102672, -2260 / 8211, GAMMA]
_EMBEDDED = [
    4586570599 / 29645900160,
    0.0,
    178811875 / 945068544,
    814220225 / 1159782912,
    -3700637 / 11593932,
    61727 / 225920,
]

# Kennedy, Carpenter (2003), ARK4(3)6L[2]SA, the implicit part: L-stable, stiffly accurate, first stage explicit.
ESDIRK4 = Tableau(
    order=4,
    A=_matrix(
        [0.0],
        [GAMMA, GAMMA],
        [8611 / 62500, -1743 / 31250, GAMMA],
        [5012029 / 34652500, -654441 / 2922500, 174375 / 388108, GAMMA],
        [15267082809 / 155376265600, -71443401 / 120774400, 730878875 / 902184768, 2285395 / 8070912, GAMMA],
        _B,
    ),
    c=np.array([0.0, 0.5, 83 / 250, 31 / 50, 17 / 20, 1.0]),
    error=np.array(_B) - np.array(_EMBEDDED),
)

_TSIT_B = [0.09646076681806523, 0.01, 0.4798896504144996, 1.379008574103742, -3.290069515436081, 2.324710524099774, 0.0]

# Tsitouras (2011), order 5(4), first same as last.
TSIT5 = Tableau(
    order=5,
    A=_matrix(
        [0.0],
        [0.161],
        [-0.008480655492356989, 0.335480655492357],
        [2.8971530571054935, -6.359448489975075, 4.3622954328695815],
        [5.325864828439257, -11.748883564062828, 7.4955393428898365, -0.09249506636175525],
        [5.86145544294642, -12.92096931784711, 8.159367898576159, -0.071584973281401, -0.028269050394068383],
        _TSIT_B,
    ),
    c=np.array([0.0, 0.161, 0.327, 0.9, 0.9800255409045097, 1.0, 1.0]),
    error=np.array(
        [
            0.0017800110522257773,
            0.0008164344596567463,
            -0.007880878010261994,
            0.1447110071732629,
            -0.5823571654525552,
            0.45808210592918686,
            -0.015151515151515152,
        ]
    ),
)


class Step(NamedTuple):
    """Outcome of an attempted step."""

    x: State
    first: State  # dx/dt at the start
    rate: State  # dx/dt at the end
    error: State  # estimate of the local error
    memory: Any  # data of the method for the next step
    converged: Bool[Array, ""]
    stable: Float[Array, ""] | None = None  # longest stable step [s], of an explicit one
    beside: Neighbours | None = None  # at the end
    beside_first: State | None = None  # their dx/dt at the start
    beside_error: State | None = None


class Newton(NamedTuple):
    """Inverse of the last Jacobian, and whether it is outdated."""

    inverted: Float[Array, "n n"]
    c: Float[Array, ""]
    stale: Bool[Array, ""]
    refreshes: Int[Array, ""]


_MOST_ITERATIONS = 12
_SLOW = 0.3  # contraction of Newton's correction above which the Jacobian is recomputed
_NEWTON_SHARE = 0.002  # remaining error of Newton's method over the tolerance
_STABLE = 3.2  # decay over a step of `TSIT5`, which damps by 0.57 there and grows from 3.5 on
_NOISE = 1e-6  # difference of stages over the tolerance that may be rounding
_ENOUGH = 0.02  # the same, where corrections no longer shrink: rounding errors of tight tolerances


class _Iterate(NamedTuple):
    """Newton's iteration within a stage."""

    w: Array
    inverted: Array
    size: Array  # of the last correction over the tolerance
    rate: Array  # ratio of the last correction to the one before
    remaining: Array  # estimate of the remaining error
    k: Array
    refreshes: Array

    @property
    def slow(self) -> Array:
        """Whether corrections do not shrink as they should."""
        return (self.k > 1) & (self.rate > _SLOW)

    @property
    def solved(self) -> Array:
        """Whether the remaining error is small."""
        return self.remaining <= jnp.where(self.slow, _ENOUGH, _NEWTON_SHARE)


@eqx.filter_custom_jvp
def _newton(
    stage: ImplicitStage, w: Array, inverted: Array, must: Array, needed: Array, tolerance: Array, increment: Array
) -> _Iterate:
    """Solve a stage to a tolerance of w, from w, with a kept inverse Jacobian (`must`: recompute it), if `needed`.

    The Jacobian is that of differences by `increment`, so that the residual, the most of what is to be compiled,
    stands here once. Derivatives are those of the solution, by the implicit function theorem.
    """
    n = w.shape[0]

    def correct(it: _Iterate) -> _Iterate:
        refresh = jnp.where(it.k == 0, must, it.slow)
        moved = it.w + jnp.maximum(increment, CHANGE * jnp.abs(it.w))

        def one(i: Array, found: Array) -> Array:
            return found.at[i].set(stage.residual(jnp.where(jnp.arange(n) == i - 1, moved, it.w)))

        found = jax.lax.fori_loop(0, jnp.where(refresh, n + 1, 1), one, jnp.zeros((n + 1, n)))
        columns = (found[1:] - found[0]) / (moved - it.w)[:, None]
        inverted = jax.lax.cond(refresh, lambda J: inverse(J.T), lambda J: it.inverted, columns)
        dw = -inverted @ found[0]
        size = rms(dw / tolerance)
        rate = jnp.where(it.k == 0, 1.0, size / jnp.maximum(it.size, 1e-300))
        remaining = size * jnp.minimum(rate / jnp.maximum(1 - rate, 1e-3), 1.0)
        return _Iterate(it.w + dw, inverted, size, rate, remaining, it.k + 1, it.refreshes + refresh)

    def going(it: _Iterate) -> Array:
        unsolved = (it.k == 0) | ~it.solved
        return needed & unsolved & (it.k < _MOST_ITERATIONS) & (it.size < 1e12)

    infinite = jnp.asarray(jnp.inf)
    start = _Iterate(w, inverted, jnp.zeros(()), jnp.ones(()), infinite, jnp.zeros((), int), jnp.zeros((), int))
    return jax.lax.while_loop(going, correct, start)


@_newton.def_jvp
def _newton_derivatives(primals: tuple, tangents: tuple) -> tuple[_Iterate, _Iterate]:
    stage, w, _, _, needed, *_ = primals
    it = _newton(*primals)
    before = jnp.zeros_like(w) if tangents[1] is None else tangents[1]
    moved = w.size and jax.tree.leaves(tangents[0])
    dw = along(_solution_changes, (stage, it.w), tangents[0]) if moved else jnp.zeros_like(w)
    unchanged = jax.tree.map(lambda _: None, it)
    return it, unchanged._replace(w=jnp.where(needed, dw, before))


def _solution_changes(here: tuple[ImplicitStage, Array], changes: Any) -> Float[Array, "k n"]:
    """Derivatives of the solution w of a stage along k changes of its numbers.

    The Jacobian's columns and what the changes leave unbalanced are derivatives of one residual, in n + k directions:
    its equations stand here once.
    """
    stage, w = here
    n = w.shape[0]
    k = jax.tree.leaves(changes)[0].shape[0]

    def unbalanced(change: Any, dw: Array) -> Array:
        return eqx.filter_jvp(lambda stage, w: stage.residual(w), (stage, w), (change, dw))[1]

    padded = jax.tree.map(lambda d: jnp.pad(d, [(n, 0), *[(0, 0)] * (d.ndim - 1)]), changes)
    found = jax.vmap(unbalanced)(padded, jnp.eye(n + k, n))
    return -found[n:] @ inverse(found[:n].T).T


def newton_memory(n: int) -> Newton:
    """Memory of the first implicit step."""
    return Newton(*all_on_device(np.eye(n), 0.0, True, 0))


def implicit_step(
    system: Mechanical,
    t: Array,
    h: Array,
    x: State,
    rate: State,
    known: Array,
    memory: Newton,
    allowed: State,
    beside: Neighbours | None = None,
    with_them: Bool[Array, ""] | bool = True,
) -> Step:
    """Attempt a step of size h from x; `rate` is dx/dt at x if it is known, `allowed` the tolerance of each component.

    The first stage computes an unknown rate; its c is 0, so its equations are linear. Solutions `beside` this one make
    the same step, with its Jacobian; they stay, at little cost, where not `with_them`.
    """
    w0, unravel = ravel_pytree((rate.v, rate.z))
    A = jnp.asarray(ESDIRK4.A)
    tolerance = ravel_pytree((allowed.v, allowed.z))[0] / (GAMMA * h)
    moving, _ = ravel_pytree((x.v, x.z))
    increment = jnp.maximum(tolerance, jnp.maximum(LEAST_CHANGE, CHANGE * jnp.abs(moving)) / (GAMMA * h))

    def slope(here: ImplicitStage, w: Array) -> tuple[State, State]:
        """State of a stage, and its rate."""
        a, dz = unravel(w)
        xi = here.reach(w)
        _, dq = jax.jvp(lambda s: here.system.advance(xi.q, xi.v, s), (jnp.zeros(()),), (jnp.ones(()),))  # N(q) v
        return xi, State(dq, a, dz)

    def stage(carry, i: Array):
        K, w, inverted, good, count, near = carry
        needed = (i > 0) | ~known
        c = jnp.where(i > 0, GAMMA * h, 0.0)
        must = (i == 0) | ((i == 1) & outdated)
        ti = t + jnp.asarray(ESDIRK4.c)[i] * h
        row = jnp.where(jnp.arange(6) < i, A[i], 0.0)
        base = jax.tree.map(lambda x, k: x + h * jnp.tensordot(row, k, axes=1), x, K)

        here = ImplicitStage(system, ti, base, c)
        it = _newton(here, w, inverted, must, needed, tolerance, increment)
        if beside is not None:
            near = jax.lax.cond(with_them, lambda: moved(here, it.w, i, row, needed, *near), lambda: near)
        xi, Ki = slope(here, it.w)
        K = jax.tree.map(lambda all_k, k: all_k.at[i].set(k), K, Ki)
        good &= ~needed | it.solved
        return (K, it.w, it.inverted, good, count + it.refreshes, near), xi

    def moved(
        here: ImplicitStage, w: Array, i: Array, row: Array, needed: Array, K: State, known: Array, _: State
    ) -> tuple:
        """Slopes of the solutions beside this one, and their states."""
        assert beside is not None
        bases = jax.tree.map(lambda x, k: x + h * jnp.tensordot(row, k, axes=1), beside.x, K)
        numbers = beside.numbers
        near = jax.lax.cond(needed, lambda: solved_beside(here, w, bases, numbers, increment), lambda: known)
        others = jax.tree.map(lambda x: x[len(w) + 1 :], numbers)
        xi, Ki = jax.vmap(lambda base, w, numbers: slope(moved_to(here, base, numbers), w))(bases, near, others)
        return jax.tree.map(lambda all_k, k: all_k.at[i].set(k), K, Ki), known, xi

    K = jax.tree.map(lambda k: jnp.zeros((6, *k.shape)), State(x.q, rate.v, rate.z))
    c = GAMMA * h
    outdated = memory.stale | ~known | (jnp.abs(c - memory.c) > 0.2 * memory.c)
    near = None
    if beside is not None:
        slopes = jax.tree.map(lambda x: jnp.zeros((6, *x.shape)), beside.x)
        near = slopes, as_rows((beside.rate.v, beside.rate.z)), beside.x
    start = (K, w0, jnp.asarray(memory.inverted), jnp.asarray(True), jnp.zeros((), int), near)
    (K, _, inverted, converged, count, near), stages = jax.lax.scan(stage, start, jnp.arange(6))
    last = jax.tree.map(lambda s: s[-1], stages)
    embedded = lambda k: h * jnp.tensordot(jnp.asarray(ESDIRK4.error), k, axes=1)  # noqa: E731
    error = jax.tree.map(embedded, K)
    memory = Newton(inverted, jnp.where(count > 0, c, memory.c), ~converged, memory.refreshes + count)
    first, end = (jax.tree.map(lambda k, i=i: k[i], K) for i in (0, -1))
    done = Step(last, first, end, error, memory, converged)
    if beside is None:
        return done
    assert near is not None
    rates, ends = (jax.tree.map(lambda k, i=i: k[i], near[0]) for i in (0, -1))
    moved_on = Neighbours(near[2], ends, beside.numbers)
    return done._replace(beside=moved_on, beside_first=rates, beside_error=jax.tree.map(embedded, near[0]))


def explicit_step(
    system: Mechanical, t: Array, h: Array, x: State, rate: State, known: Array, memory: None, allowed: State
) -> Step:
    r"""Attempt a step of size h from x; `rate` is dx/dt at x if it is known.

    Instabilities grow from rounding errors to the tolerance unseen, and derivatives as much. So the quickest decay is
    that of the two stages at the end of the step, $-\delta v \cdot \delta a / |\delta v|^2$ in tolerances (as in
    Hairer, Wanner 1996, sec. IV.2).
    """

    def stage(K: State, i: Array):
        row = jnp.where(jnp.arange(7) < i, jnp.asarray(TSIT5.A)[i], 0.0)
        xi = jax.tree.map(lambda x, k: x + h * jnp.tensordot(row, k, axes=1), x, K)
        ti = t + jnp.asarray(TSIT5.c)[i] * h
        Ki = jax.lax.cond((i > 0) | ~known, lambda: system.rates(ti, xi), lambda: rate)
        return jax.tree.map(lambda all_k, k: all_k.at[i].set(k), K, Ki), xi

    K, stages = jax.lax.scan(stage, jax.tree.map(lambda k: jnp.zeros((7, *k.shape)), rate), jnp.arange(7))
    error = jax.tree.map(lambda k: h * jnp.tensordot(jnp.asarray(TSIT5.error), k, axes=1), K)
    last = jax.tree.map(lambda s: s[-1], stages)
    first, end = (jax.tree.map(lambda k, i=i: k[i], K) for i in (0, -1))

    def differ(x: State) -> Array:
        difference = jax.tree.map(lambda x, scale: (x[6] - x[5]) / scale, (x.v, x.z), (allowed.v, allowed.z))
        return jax.lax.stop_gradient(ravel_pytree(difference)[0])

    dx, dk = differ(stages), differ(K)
    decay = jnp.where(rms(dx) > _NOISE, -jnp.sum(dx * dk), 0.0)
    stable = jnp.where(decay > 0, _STABLE * jnp.sum(dx * dx) / jnp.where(decay > 0, decay, 1.0), jnp.inf)
    return Step(last, first, end, error, None, jnp.asarray(True), stable)


def rms(x: Array) -> Array:
    """Root mean square; 0 for an empty array."""
    return jnp.sqrt(jnp.sum(x * x) / max(x.size, 1))
