"""Gains that are found against those of a grid, and the slopes that lead there."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.controllers import ActuatorLimits, BlockLoop, pid_of, run_batch, tune, wave
from nectosome.drives import DeadTime
from nectosome.units import InputError
from nectosome.units.ranges import Ranges

from .simple_loops import DT, UNLIMITED, actuator, around, lag, late, of, quiet

STEP = np.where(np.arange(200) < 5, 0.0, 1.0)
WAVE = wave("varying", None, DT, amplitude=(1.0, 0.5), frequency=(0.5, 0.6))
RANGE = Ranges(["integral"], [0.1], [50.0], log=["integral"])


def integral(theta):
    return pid_of(jnp.stack([jnp.zeros(()), theta[0], jnp.zeros(())]), 0.02, UNLIMITED)


def together(*blocks):
    """One loop with a lane for each block."""
    plant = jax.tree.map(lambda *x: jnp.stack(x), *blocks)
    return BlockLoop(plant, jax.tree.map(lambda x: jnp.broadcast_to(x, (len(blocks), *x.shape)), quiet()), DT, 1)


def delayed(delay):
    return DeadTime(jnp.asarray(delay), 30)


@eqx.filter_jit
def cost(lanes, theta, references):
    """Rms of the errors by the range of each reference."""
    means = []
    for reference in references:
        track = run_batch(lanes, integral(theta).planned(reference, DT), reference)
        means.append(jnp.mean((track.output - reference) ** 2) / jnp.ptp(reference) ** 2)
    return jnp.sqrt(jnp.mean(jnp.stack(means)))


def best(lanes, references, low, high):
    """Of a grid, of 1 % from one to the next."""
    grid = np.geomspace(low, high, int(np.log(high / low) / 0.01))
    costs = jax.lax.map(lambda g: cost(lanes, g[None], references), jnp.asarray(grid))
    k = int(np.argmin(costs))
    assert 0 < k < len(grid) - 1
    return grid[k], float(costs[k])


LOOPS = {
    "a pure delay": together(delayed(0.1)),
    "a delay, and a lag": together(late(lag(2.0, 0.15), 0.05, 30)),
    "two delays": together(delayed(0.05), delayed(0.2)),
}


@pytest.mark.parametrize(("name", "start"), [("a pure delay", 0.3), ("a delay, and a lag", 6.0), ("two delays", 0.3)])
def test_it_finds_the_best_of_a_grid(name, start):
    """An integral alone, along two references, from far below and from near; what gains less than 1/1000 ends it."""
    lanes, references = LOOPS[name], [STEP, WAVE]
    found = tune(integral, RANGE, np.array([start]), lanes, references)
    gain, least = best(lanes, references, 0.5, 10.0)
    assert found.values[0] == pytest.approx(gain, rel=0.05)
    assert least * (1 - 1e-4) <= found.error_after <= least * (1 + 1e-3)
    assert found.error_before == pytest.approx(float(cost(lanes, jnp.array([start]), references)), rel=1e-9)


def test_what_suits_two_lies_between_what_suits_each():
    gains = [
        tune(integral, RANGE, np.array([2.0]), one, [STEP]).values[0]
        for one in (
            together(delayed(0.05)),
            LOOPS["two delays"],
            together(delayed(0.2)),
        )
    ]
    assert gains[0] > gains[1] > gains[2]


def test_the_integral_for_a_pure_delay():
    """Least squares of the errors after a step: K T = 0.74 (the minimum of (1/2K) cos(KT)/(1 - sin(KT)), and T)."""
    x = np.linspace(0.1, 1.5, 10_000)
    wanted = x[np.argmin(np.cos(x) / (2 * x * (1 - np.sin(x))))]
    found = tune(integral, RANGE, np.array([2.0]), together(delayed(0.195)), [np.where(np.arange(600) < 5, 0.0, 1.0)])
    assert found.values[0] * 0.2 == pytest.approx(wanted, rel=0.03)


def test_slopes_through_loops_are_those_of_differences():
    """By three gains and the filter of a loop with hysteresis, limits and noise."""
    loop = around(actuator(), substeps=1)
    reach = ActuatorLimits(*of(-0.9, 0.9, 20.0))

    @jax.jit
    def errors(theta):
        return loop.run(pid_of(theta[:3], theta[3], reach), WAVE).output - WAVE

    theta = np.array([0.4, 6.0, 0.01, 0.03])
    slopes = np.asarray(jax.jacfwd(errors)(jnp.asarray(theta)))
    assert np.isfinite(slopes).all()
    for k in range(4):
        h = np.zeros(4)
        h[k] = 1e-6 * theta[k]
        differences = (np.asarray(errors(theta + h)) - np.asarray(errors(theta - h))) / (2 * h[k])
        np.testing.assert_allclose(slopes[:, k], differences, atol=1e-5 * np.abs(differences).max())


@pytest.mark.parametrize("start", [0.05, 51.0])
def test_a_start_outside_of_the_ranges_is_refused(start):
    with pytest.raises(InputError, match=r"is not between 0\.1 and 50"):
        tune(integral, RANGE, np.array([start]), LOOPS["a pure delay"], [STEP])


def test_a_loop_without_a_finite_error_is_refused():
    """Dead time beyond what the block can keep is NaN."""
    with pytest.raises(InputError, match="NaN or infinite"):
        tune(integral, RANGE, np.array([2.0]), together(delayed(0.5)), [STEP])


def test_a_reference_that_stands_still_is_refused():
    """Errors are relative to its range, which is none."""
    with pytest.raises(InputError):
        tune(integral, RANGE, np.array([2.0]), LOOPS["a pure delay"], [np.ones(50)])


def test_a_reference_that_stays_where_it_is_is_refused():
    with pytest.raises(InputError, match="relative to its range"):
        tune(lambda x: None, Ranges(("k",), 0.1, 1.0), np.array([0.5]), None, [np.full(5, 2.0)])  # type: ignore[arg-type]
