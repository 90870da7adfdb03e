"""Signals that jump: steps end there, and derivatives are those of the motion, by closed forms of a driven mass."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import Chirp, Jump, Mechanical, Signal, State, Stroke, Sum, Triangle, Varying
from nectosome.solve.integrate import Settings, begin, integrate
from nectosome.solve.sensitivity import SensitivityState, SensitivitySystem

TIMES = jnp.asarray([0.0, 0.31, 0.5, 0.97, 1.4, 2.2])


class Pushed(Mechanical):
    """A mass of 1 kg: dv/dt is the signal or one of its derivatives."""

    signal: Signal
    order: int = eqx.field(static=True)

    def initial(self):
        return State(jnp.zeros(1), jnp.zeros(1))

    def rates(self, t, x, u=None):
        return State(x.v, self.signal(t)[self.order][None], ())

    def residual(self, t, x, a, u=None):
        return a - self.signal(t)[self.order]

    def state_rates(self, t, x, u=None):
        return ()

    def advance(self, q, v, step):
        return q + step * v


def n(*values: float) -> dict[str, Any]:
    names = ("amplitude", "frequency", "phase", "offset")
    return dict(zip(names, map(jnp.asarray, values), strict=True))


STROKE = Stroke(**n(0.4, 1.1, 0.3, 0.1), forward_share=jnp.asarray(0.3))
LATER = Stroke(**n(0.3, 0.7, -1.0, 0.0), forward_share=jnp.asarray(0.6))
CASES = {  # a signal and the order of its derivative that pushes
    "stroke": (STROKE, 2),
    "triangle": (Triangle(**n(0.4, 1.1, 0.3, 0.1)), 1),
    "chirp": (Chirp(**n(0.4, 1.1, 0.3, 0.1), to=jnp.asarray(3.0), time=jnp.asarray(0.9)), 2),
    "varying": (Varying(jnp.asarray([0.2, 0.5, 0.3]), jnp.asarray([1.7, 1.0, 2.0]), jnp.asarray(0.0)), 1),
    "jump": (Jump(jnp.asarray(0.7), jnp.asarray(0.8)), 0),
    "sum": (Sum((STROKE, LATER)), 2),
}


def speeds(signal: Signal, order: int, t: Any) -> Any:
    """Closed form of v at t: the derivative of one order less, less what it is at 0."""
    if isinstance(signal, Jump):
        return signal.height * jnp.maximum(t - signal.at, 0.0)
    return signal(t)[order - 1] - signal(jnp.zeros(()))[order - 1]


def settings(method: Any) -> Settings:
    return Settings(method, *map(jnp.asarray, (1e-8, 1e-10, 10_000)))


def along(signal: Signal) -> Signal:
    """Some direction of its numbers."""
    return jax.tree.map(lambda x: 0.3 + 0.2 * x, signal)


def close(found, wanted, share):
    """Times within a step are those of its cubic, which has fewer digits than the step."""
    np.testing.assert_allclose(found, wanted, rtol=0, atol=share * np.abs(wanted).max())


@pytest.mark.parametrize("method", ["explicit", "implicit"])
@pytest.mark.parametrize("case", CASES)
def test_motions_and_their_derivatives_are_exact_across_jumps(case, method):
    """A step over a jump would be off by 1e-4 and more; its derivatives do not know that the jump moves at all."""
    signal, order = CASES[case]

    @jax.jit
    def found(signal):
        system = Pushed(signal, order)
        start = begin(TIMES[0], system.initial(), settings(method), jnp.asarray(1e-3))
        end, states = integrate(system, start, TIMES[1:], settings(method))
        return states.v[:, 0], end.rejected

    def wanted(signal):
        return jax.vmap(lambda t: speeds(signal, order, t))(TIMES[1:])

    (v, rejected), (dv, _) = jax.jvp(found, (signal,), (along(signal),))
    exact, d_exact = jax.jvp(wanted, (signal,), (along(signal),))
    close(v, exact, 1e-6)
    close(dv, d_exact, 3e-5)
    assert rejected <= 16


@pytest.mark.parametrize("case", CASES)
def test_sensitivities_jump_as_the_times_of_the_jumps_move(case):
    """By the signal's numbers, at times that stretch by 0.3 of the parameter: dv + 0.3 t dv/dt."""
    signal, order = CASES[case]
    system, p = Pushed(signal, order), 0.3
    changes = Pushed(jax.tree.map(lambda x: x[None], along(signal)), order)
    rest = system.initial()

    @jax.jit
    def found():
        start = SensitivityState(rest, jax.tree.map(lambda x: jnp.zeros((1, *x.shape)), rest))
        m = begin(TIMES[0], start, settings("implicit"), jnp.asarray(1e-3))
        whole = SensitivitySystem(system, changes, jnp.full(1, p))
        return integrate(whole, m, TIMES[1:], settings("implicit"))[1]

    def wanted(signal, stretch):
        return jax.vmap(lambda t: speeds(signal, order, t * (1 + stretch)))(TIMES[1:])

    states, zero = found(), jnp.zeros(())
    exact, d_exact = jax.jvp(wanted, (signal, zero), (along(signal), zero + p))
    close(states.x.v[:, 0], exact, 1e-6)
    close(states.derivatives.v[:, 0, 0], d_exact, 3e-5)


@pytest.mark.parametrize("case", CASES)
def test_jumps_follow_one_after_the_other(case):
    """Just before and just after each of them the derivatives differ, and between two of them they do not."""
    signal, order = CASES[case]
    system, t, found = Pushed(signal, order), jnp.asarray(-0.05), []
    while (t := system.next_jump(t)) < 2.0:
        found.append(float(t))
    push = jax.vmap(lambda t: signal(t)[order])
    times = np.array(found)
    steps = np.abs(push(times + 1e-10) - push(times - 1e-10))
    assert len(found) and np.all(steps > 0.01)
    grid = np.linspace(0.0, 2.0, 4001)
    clear = grid[np.min(np.abs(grid[:, None] - times), axis=1) > 1e-3]
    assert np.max(np.abs(push(clear + 1e-7) - push(clear - 1e-7))) < 1e-3


def test_a_stroke_of_equal_halves_and_a_step_that_is_over_have_none():
    even = eqx.tree_at(lambda s: s.forward_share, STROKE, jnp.asarray(0.5))
    assert np.isinf(even.next_jump(jnp.asarray(0.2)))
    assert np.isinf(CASES["jump"][0].next_jump(jnp.asarray(0.8)))
    assert Pushed(Sum(()), 2).next_jump(jnp.zeros(())) is None
