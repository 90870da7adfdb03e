"""Cycles and multipliers of linear systems, whose multipliers are chosen, and whose cycle is at rest."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import block_diag, logm

from nectosome.core import State, Status
from nectosome.core.programs.remember import remembered
from nectosome.mechanism import InPlane
from nectosome.solve.multipliers import cycle_multipliers, multipliers_of
from nectosome.solve.orbit import cycle_settings, orbit
from nectosome.solve.symmetry import Symmetry

N = 12  # velocities, more than those whose multipliers are computed at the last tolerance at once


class Decaying(InPlane):
    """v' = A v, wherever it is; it is no robot."""

    A: Any = None
    robot: Any = None
    bodies: tuple[Any, ...] = ()
    wetted: tuple[Any, ...] = ()
    members: Any = eqx.field(static=True, default=())

    @property
    def update_rates(self):
        return None

    def gaps(self, t, x):
        return None

    def residual(self, t, x, a, u=None):
        return a - self.A @ x.v

    def state_rates(self, t, x, u=None):
        return ()

    def advance(self, q, v, step):
        return q + step * v

    def displacements(self, q):
        return q

    def initial(self):
        return State(jnp.zeros(N), jnp.zeros(N), ())

    def rates(self, t, x, u=None):
        return State(x.v, self.A @ x.v, ())


def turning(size, angle):
    return size * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def solved(M, start, multipliers=True):
    """Cycle of a system whose state is multiplied by M in a second."""
    A, symmetry = np.real(logm(M)), Symmetry(tuple(range(N)), False, False)
    settings = cycle_settings("implicit", 1.0, 1e-6, 1e-8)
    x = State(jnp.zeros(N), jnp.asarray(start), ())
    return symmetry, remembered(
        orbit, Decaying(A=jnp.asarray(A)), symmetry, x, np.linspace(0.0, 1.0, 17), settings, multipliers
    )


def mixed(*blocks, seed=0):
    """Blocks on the diagonal, the rest filled with fast decay, in a basis that is not orthogonal."""
    rng, n = np.random.default_rng(seed), sum(len(b) for b in map(np.atleast_2d, blocks))
    D = block_diag(*map(np.atleast_2d, blocks), np.diag(np.geomspace(0.3, 0.02, N - n)))
    S = np.eye(N) + 0.3 * rng.normal(size=(N, N)) / np.sqrt(N)
    return S @ D @ np.linalg.inv(S)


@pytest.mark.parametrize(
    "blocks",
    [
        (0.95,),
        (0.95, 0.951, 0.6),
        (turning(0.93, 0.7), 0.91),
        (1.05, turning(1.02, 2.9), 0.97),
        (turning(0.999, 1e-3), 0.92),
        (np.array([[0.96, 0.1], [0.0, 0.96]]), 0.905),  # one direction only
    ],
)
@pytest.mark.parametrize("exact", [True, False])
def test_planted_multipliers_come_back(blocks, exact):
    M = mixed(*blocks)
    symmetry, found = solved(M, 0.01 * np.ones(N), exact)
    assert int(found.status) == Status.SOLVED
    values, errors = multipliers_of(symmetry, *map(np.asarray, found.value[1:3]))
    planted = np.linalg.eigvals(M)
    large = planted[np.abs(planted) > 0.9]
    assert values.size == N
    assert np.sum(np.abs(values) > 0.9) == large.size
    nearest = [int(np.argmin(np.abs(values - one))) for one in large]
    assert np.all(np.abs(values[nearest] - large) <= errors[nearest])
    # a double one of one direction moves with the root of an error
    most = 5e-3 if np.shape(blocks[0]) and blocks[0][1, 0] == 0 else 5e-6
    assert max(errors[nearest]) < (most if exact else 0.02)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    "blocks", [(1.05, 0.95, 0.951), (turning(0.97, 2.0),), (np.array([[0.96, 0.1], [0.0, 0.96]]),)]
)
def test_the_errors_of_multipliers_hold_what_errors_of_the_monodromy_change(blocks, seed):
    """Also of a double one, which an error of 1e-7 moves by 1e-4; and they are no larger than ten times that."""
    M, rng = mixed(*blocks, seed=seed), np.random.default_rng(seed)
    sizes = 1e-7 * rng.uniform(0.3, 3.0, M.shape)
    values, errors = multipliers_of(Symmetry((), False, False), M + sizes * rng.uniform(-1, 1, M.shape), sizes)
    planted = np.linalg.eigvals(M)
    apart = np.array([np.min(np.abs(values - one)) for one in planted])
    near = np.array([np.argmin(np.abs(values - one)) for one in planted])
    assert np.all(apart <= errors[near])
    assert np.max(errors) < (2e-3 if np.shape(blocks[0]) and blocks[0][1, 0] == 0 else 1e-5)


def test_a_multiplier_of_1_within_its_error_is_undecided():
    symmetry, errors = Symmetry((), False, False), np.full((2, 2), 1e-7)
    largest = {size: multipliers_of(symmetry, np.diag([size, 0.3]), errors) for size in (1 - 1e-6, 1.0, 1 + 1e-6)}
    assert [found.undecided for found in largest.values()] == [False, True, False]
    assert [found.grow for found in largest.values()] == [False, False, True]


def test_multipliers_without_a_known_error_are_those_of_an_exact_orbit():
    M = mixed(0.95)
    symmetry, found = solved(M, 0.01 * np.ones(N), False)
    times, settings = np.linspace(0.0, 1.0, 17), cycle_settings("implicit", 1.0, 1e-6, 1e-8)
    unknown = found.value._replace(errors=jnp.full_like(found.value.errors, jnp.inf))
    assert multipliers_of(symmetry, np.asarray(unknown.monodromy), np.asarray(unknown.errors)).undecided
    system = Decaying(A=jnp.asarray(np.real(logm(M))))
    values, errors = cycle_multipliers(system, symmetry, unknown, times, settings, exact=False)
    assert abs(values[0] - 0.95) <= errors[0] < 5e-6


def test_a_small_gap_of_a_slow_decay_is_corrected():
    """At 1e-3 from the cycle a disturbance that shrinks by 1e-4 a period leaves a gap of a tenth of the tolerance."""
    M = mixed(0.9999)
    values, vectors = np.linalg.eig(M)
    start = 1e-3 * np.real(vectors[:, np.argmax(np.abs(values))])
    _, found = solved(M, start, False)
    assert int(found.status) == Status.SOLVED
    assert np.max(np.abs(found.value.states.v)) < 3e-8
    assert float(found.residual) <= 1.0


class Rough(Decaying):
    """v' = A (v - 1) + push + rough sin(k), k = q in 1e-7, rounded: a cycle at v = 1, but for errors as at contacts."""

    push: Any = None
    rough: Any = None

    def rates(self, t, x, u=None):
        return State(x.v, self.A @ (x.v - 1.0) + self.push + self.rough * jnp.sin(jnp.round(1e7 * x.q)), ())

    def residual(self, t, x, a, u=None):
        return a - self.rates(t, x).v


def rough_cycle(slowest, push, rough, rtol, steps):
    A = np.log(np.diag([slowest, *np.full(N - 1, 0.2)]), where=np.eye(N, dtype=bool), out=np.zeros((N, N)))
    system = Rough(A=jnp.asarray(A), push=jnp.asarray(push), rough=jnp.asarray(rough))
    x = State(jnp.zeros(N), jnp.ones(N) + 0.01, ())
    settings = cycle_settings("implicit", 100 / steps, rtol, 1e-2 * rtol)
    return remembered(
        orbit, system, Symmetry(tuple(range(N)), False, False), x, np.linspace(0.0, 1.0, 17), settings, False
    )


def test_noise_of_steps_is_accepted_with_its_size():
    """Errors of tens of tolerances that differ each time; which size they have is chance."""
    each = [rough_cycle(slowest, np.zeros(N), 2.5e-5, 1e-9, 1000) for slowest in (0.27, 0.297, 0.303, 0.317)]
    solved = [found for found in each if int(found.status) in (Status.SOLVED, Status.SETTLED)]
    assert max(float(found.residual) for found in solved) > 20.0
    for found in solved:
        assert float(found.residual) <= float(found.stats["residual_limit"]) == 100.0
        assert np.max(np.abs(found.value.states.v - 1.0)) < 1e-6


def test_a_drift_of_a_few_tolerances_is_no_noise():
    """What nothing holds goes on by 35 tolerances a period, 7 in the mean of all, and never comes back."""
    found = rough_cycle(1.0, np.where(np.arange(N) == 0, 3.5e-5, 0.0), 0.0, 1e-6, 100)
    assert int(found.status) == Status.NO_PERIOD
    assert float(found.residual) == pytest.approx(7.0, abs=0.1)
