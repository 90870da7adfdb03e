"""Prandtl-Ishlinskii operators: their memory, their loops, their inverses."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nectosome.drives import NumericInverse, Polynomial, PrandtlIshlinskii, Tanh, evenly, inverse, respond
from nectosome.units import InputError

WEIGHTS = np.array([0.6, -0.3, 0.2, 0.1, 0.05])
SOME = evenly(WEIGHTS, 1.0, 1.0)
BENT = PrandtlIshlinskii(
    *(jnp.asarray(x) for x in (0.5, [0.1, 0.3], [0.4, 0.3])),
    rising=Tanh(*jnp.array([1.0, 1.2, 0.1, 0.0])),
    falling=Tanh(*jnp.array([1.1, 1.0, 0.3, 0.1])),
)
turns = st.lists(st.floats(-1, 1), min_size=8, max_size=8).map(np.array)


def printed(u, thresholds, weights):
    """Equations 2 and 3 of the fishtail paper, sample by sample."""
    H, y = np.zeros(len(thresholds)), []
    for p in u:
        H = np.maximum(p - thresholds, np.minimum(p + thresholds, H))
        y.append(weights @ H)
    return np.array(y)


@given(turns)
def test_plays_are_those_of_the_paper(u):
    r = np.arange(6) / 5
    np.testing.assert_allclose(respond(SOME, u, 0.1), printed(u, r, np.append(1.0, WEIGHTS)), atol=1e-14)


@given(turns, st.integers(1, 5))
def test_only_the_turns_count_and_not_the_speed(u, k):
    """Points in between, however many, change nothing at the turns: rate-independence."""
    fine = np.interp(np.arange(7 * k + 1) / k, np.arange(8), u)
    np.testing.assert_allclose(respond(SOME, fine, 0.1)[::k], respond(SOME, u, 0.1), atol=1e-14)
    np.testing.assert_allclose(respond(SOME, u, 0.1, "zero"), respond(SOME, u, 5.0, "first"), atol=1e-14)


@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), turns)
def test_larger_turns_wipe_out_smaller_ones(a, b, after):
    """A loop within the last swing leaves nothing behind once the swing goes beyond it (wiping-out)."""
    begun = np.array([0.0, 0.9, -0.5])
    outer = np.array([0.6])
    with_loop = np.concatenate([begun, [a, b, a], outer, after])
    without = np.concatenate([begun, outer, after])
    np.testing.assert_allclose(respond(SOME, with_loop, 0.1)[-8:], respond(SOME, without, 0.1)[-8:], atol=1e-14)


@given(st.sampled_from([[0.9], [0.9, -0.8], [-0.9], [-0.7, 0.8, -0.6]]))
def test_loops_between_the_same_turns_are_congruent(history):
    """Their outputs differ by a number, whatever came before (congruency)."""
    loop = np.concatenate([np.linspace(0.3, -0.2, 6), np.linspace(-0.2, 0.3, 6)])
    u = np.concatenate([history, loop, loop])
    fresh = np.concatenate([[-1.0, 1.0], loop, loop])
    one, other = respond(SOME, u, 0.1)[-12:], respond(SOME, fresh, 0.1)[-12:]
    np.testing.assert_allclose(one - one[0], other - other[0], atol=1e-14)


def test_the_area_of_a_loop_is_that_of_its_plays():
    """A play of width r that swings by A > r encloses 4 r (A - r); counterclockwise with positive weights."""
    u = np.sin(np.linspace(0, 6 * np.pi, 60001))
    y = np.asarray(respond(SOME, u, 1e-3))
    last = slice(40000, 60001)
    area = -np.trapezoid(y[last], u[last])
    r = np.arange(1, 6) / 5
    assert area == pytest.approx(np.sum(WEIGHTS * 4 * r * (1 - r)), rel=1e-6)


@given(turns)
def test_the_inverse_takes_outputs_back_to_inputs(u):
    """Both ways round, to rounding."""
    back = inverse(SOME)
    np.testing.assert_allclose(respond(back, respond(SOME, u, 0.1), 0.1), u, atol=1e-13)
    np.testing.assert_allclose(respond(SOME, respond(back, u, 0.1), 0.1), u, atol=1e-13)


def test_the_inverse_of_the_inverse_is_the_operator():
    again = inverse(inverse(SOME))
    for name in ("direct", "thresholds", "weights"):
        np.testing.assert_allclose(getattr(again, name), getattr(SOME, name), rtol=1e-13)


@pytest.mark.parametrize(
    ("direct", "weights", "told"),
    [
        (0.0, [1.0, 1.0], "the direct part is 0"),
        (1.0, [0.5, -1.5, 3.0], "the first 2 weights is 0"),
        (1.0, [np.nan], "the first 1 weights is nan"),
    ],
)
def test_what_has_no_inverse_says_why(direct, weights, told):
    with pytest.raises(InputError, match=told):
        inverse(evenly(weights, 1.0, direct))


def test_envelopes_have_no_inverse_in_closed_form():
    with pytest.raises(InputError, match="Take the numeric one"):
        inverse(BENT)


@settings(max_examples=20)
@given(turns)
def test_the_numeric_inverse_agrees_and_takes_envelopes(u):
    y = respond(SOME, u, 0.1)
    numeric = NumericInverse(SOME, jnp.asarray(-2.0), jnp.asarray(2.0))
    np.testing.assert_allclose(respond(numeric, y, 0.1), u, atol=1e-12)
    bent = NumericInverse(BENT, jnp.asarray(-2.0), jnp.asarray(2.0))
    y = respond(BENT, u, 0.1)
    np.testing.assert_allclose(respond(BENT, respond(bent, y, 0.1), 0.1), y, atol=1e-12)


def test_envelopes_bend_loops_and_two_of_them_take_their_symmetry():
    """A symmetric operator answers -u with -y; one with other edges for rising and falling does not."""
    u = np.sin(np.linspace(0, 4 * np.pi, 2001))
    cubic = PrandtlIshlinskii(SOME.direct, SOME.thresholds, SOME.weights, Polynomial(jnp.array([0.0, 1.0, 0.0, 0.2])))
    np.testing.assert_allclose(respond(cubic, -u, 0.1), -respond(cubic, u, 0.1), atol=1e-14)
    np.testing.assert_allclose(respond(cubic, u, 0.1), respond(SOME, u + 0.2 * u**3, 0.1), atol=1e-14)
    assert np.abs(respond(BENT, -u, 0.1) + respond(BENT, u, 0.1)).max() > 0.1


def test_slopes_by_the_input_are_those_of_what_moves():
    """Directly after a turn only the direct part follows; after a long way all plays do."""
    slope = jax.grad(lambda last: respond(SOME, jnp.concatenate([jnp.array([0.0, 1.5]), last[None]]), 0.1)[-1])
    assert float(slope(jnp.asarray(1.49))) == pytest.approx(1.0)
    assert float(slope(jnp.asarray(-1.5))) == pytest.approx(1.0 + WEIGHTS.sum())
    np.testing.assert_allclose(SOME.slopes(), np.cumsum([1.0, *WEIGHTS]))
