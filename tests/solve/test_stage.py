"""Solutions of a stage close to its own, with many load states that depend on each other or not."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import Mechanical, State
from nectosome.solve.stage import ImplicitStage, solved_beside

N, STATES = 2, 7


class Lagged(Mechanical):
    """M(q) a = -q - |v| v - K w, and w' = (1 + v . v) (L v - w) + C w."""

    K: Any
    L: Any
    C: Any

    def residual(self, t, x, a, u=None):
        M = jnp.eye(N) + 0.2 * jnp.sin(x.q[0]) * jnp.ones((N, N))
        return M @ a + x.q + jnp.abs(x.v) * x.v + self.K @ x.z[0]

    def state_rates(self, t, x, u=None):
        return ((1 + x.v @ x.v) * (self.L @ x.v - x.z[0]) + self.C @ x.z[0],)

    def advance(self, q, v, step):
        return q + step * v

    def initial(self):
        return State(jnp.zeros(N), jnp.zeros(N), (jnp.zeros(STATES),))

    def rates(self, t, x, u=None):
        raise NotImplementedError


@pytest.mark.parametrize("coupled", [0.0, 3.0])
def test_solutions_close_by_are_those_of_newtons_method_from_there(coupled):
    """Residuals of Newton's method below 1e-13; at 1e-5 apart second orders are of 1e-5 of the difference."""
    rng = np.random.default_rng(3)
    K, L, C = (jnp.asarray(rng.normal(size=size)) for size in ((N, STATES), (STATES, N), (STATES, STATES)))
    system, y = Lagged(K, L, coupled * C), rng.normal(size=2 * N + STATES)

    def stage_from(y):
        return ImplicitStage(system, jnp.zeros(()), State(y[:N], y[N : 2 * N], (y[2 * N :],)), jnp.asarray(0.05))

    @jax.jit
    @jax.vmap
    def exact(y):
        r, w = stage_from(y).residual, jnp.zeros(N + STATES)
        for _ in range(6):
            w -= jnp.linalg.solve(jax.jacfwd(r)(w), r(w))
        return w, r(w)

    ys = jnp.asarray(y + 1e-5 * np.eye(y.size + 1, y.size, -1))
    ws, left = exact(ys)
    assert np.max(np.abs(left)) < 1e-13
    bases = jax.vmap(lambda y: stage_from(y).base)(ys[1:])
    found = jax.jit(solved_beside)(stage_from(ys[0]), ws[0], bases, None, jnp.full(N + STATES, 1e-3))
    expected = ws[1:] - ws[0]
    assert np.allclose(found - ws[0], expected, rtol=0, atol=3e-5 * np.max(np.abs(expected)))
