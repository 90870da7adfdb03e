"""What every block promises; a new block without an example here fails."""

import importlib
import inspect
import pkgutil

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import nectosome.drives as ac
from nectosome.core import Block, Line, RateIndependent


def of(*numbers):
    return [jnp.asarray(x, dtype=float) for x in numbers]


PLAYS = ac.evenly(np.array([0.6, -0.3, 0.2]), 1.0, 1.0)
LAG = ac.second_order(*of(2.0, 30.0, 0.7))
EXAMPLES = {
    "PrandtlIshlinskii": PLAYS,
    "NumericInverse": ac.NumericInverse(PLAYS, *of(-5, 5)),
    "TransferFunction": LAG,
    "Saturation": ac.Saturation(*of(-0.5, 0.7)),
    "SlewLimit": ac.SlewLimit(*of(3.0)),
    "Stiction": ac.Stiction(*of(0.3, 0.12)),
    "DeadTime": ac.DeadTime(*of(0.023), 5),
    "Integrated": ac.Integrated(ac.Tank(*of(1e-3, 2e-9, 0.3, 3e5, -8e4, 1e3, 293.0))),
    "Dahl": ac.Dahl(*of(2.0, 5.0)),
    "Curve": ac.Curve(ac.Polynomial(*of([0.0, 1.0, 0.3]))),
    "Sensor": ac.Sensor(*of(0.01, -3, 3)),
    "Gain": ac.Gain(*of(2.5)),
    "Chain": ac.Chain((PLAYS, LAG)),
    "Parallel": ac.Chain((ac.Gain(*of([1.0, 2.0])), ac.Parallel((PLAYS, LAG)))),
}


@pytest.fixture(scope="module", params=EXAMPLES)
def block(request):
    return EXAMPLES[request.param]


def test_each_block_has_an_example():
    for module in pkgutil.iter_modules(ac.__path__):
        importlib.import_module(f"nectosome.drives.{module.name}")
    blocks, found = [Block], set()
    while blocks:
        kinds = [kind for kind in blocks.pop().__subclasses__() if kind.__module__.startswith("nectosome.")]
        blocks += kinds
        found |= {kind.__name__ for kind in kinds if not inspect.isabstract(kind)}
    assert found == set(EXAMPLES)


def inputs(n=60):
    return np.random.default_rng(5).uniform(-1, 1, size=n)


def test_no_output_depends_on_later_inputs(block):
    u = inputs()
    other = np.concatenate([u[:30], -u[30:]])
    np.testing.assert_array_equal(respond(block, u)[:30], respond(block, other)[:30])


def respond(block, u, hold="zero"):
    return np.asarray(ac.respond(block, u, 0.01, hold))


def test_it_may_stop_and_go_on(block):
    """Stepped one sample at a time, as a controller does, it gives what it gives at once."""
    u, stepper = inputs(20), block.sampled(0.01)
    step, state, found = jax.jit(lambda state, u: stepper.step(state, u)), stepper.initial(), []
    for x in u:
        state, line = step(state, Line(jnp.asarray(x), jnp.asarray(x)))
        found.append(float(line.begin))
    np.testing.assert_allclose(found, respond(block, u), rtol=1e-12, atol=1e-12)


def test_at_rest_nothing_comes_of_nothing(block):
    if isinstance(block, ac.Sensor):
        block = ac.Sensor(*of(0, -3, 3))
    np.testing.assert_allclose(respond(block, np.zeros(10)), 0, atol=1e-9)


def test_what_is_rate_independent_is_so(block):
    if not isinstance(block, RateIndependent):
        assert block.sampled(0.01) is not block
        return
    u = inputs()
    slowly = ac.respond(block, u, 7.0, "zero")
    np.testing.assert_array_equal(slowly, respond(block, u))


def test_many_go_side_by_side(block):
    """Under vmap over inputs, each lane is what it is alone."""
    u = np.stack([inputs(), 0.3 * inputs()])
    both = jax.vmap(lambda one: ac.respond(block, one, 0.01))(u)
    for found, alone in zip(both, u, strict=True):
        np.testing.assert_allclose(found, respond(block, alone, "first"), rtol=1e-12, atol=1e-12)


def test_slopes_by_the_input_are_those_of_differences(block):
    """Along a random direction, where nothing switches in between."""
    u, way = inputs(), np.random.default_rng(6).normal(size=60)
    scale = 1e5 if isinstance(block, ac.Integrated) else 1.0
    slope = jax.jvp(lambda x: ac.respond(block, x, 0.01), (scale * jnp.asarray(u),), (scale * jnp.asarray(way),))[1]
    h = 1e-6
    ends = [respond(block, scale * (u + s * h * way), "first") for s in (1, -1)]
    np.testing.assert_allclose(slope, (ends[0] - ends[1]) / (2 * h), atol=1e-5 * scale * np.abs(way).max())


def test_opposite_chambers_push_the_same_way():
    """Of equal chambers the pair gives twice what one does; with independent pressures, their difference."""
    u = inputs()
    one = respond(PLAYS, u)
    np.testing.assert_allclose(respond(ac.antagonistic(PLAYS, PLAYS), u), 2 * one, atol=1e-12)
    pair = respond(ac.antagonistic(PLAYS, LAG, opposite=False), np.stack([u, inputs()[::-1]], axis=1))
    np.testing.assert_allclose(pair, one - respond(LAG, inputs()[::-1]), atol=1e-12)
