"""Transfer functions: exact for held and joined samples, of any order, as SciPy and as closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import lsim

from nectosome.drives import Chain, TransferFunction, respond, second_order

CASES = {
    "first": ([2.0], [0.5, 1.0]),
    "second": ([205.21], [0.59, 22.18, 205.21]),
    "with a zero": ([1.0, 3.0], [1.0, 2.0, 5.0]),
    "direct": ([2.0, 1.0, 3.0], [1.0, 2.0, 5.0]),
    "fifth, far apart": ([1e9], np.poly([-1.0, -10.0, -100.0, -30 + 40j, -30 - 40j]).real),
    "integrator": ([1.0], [1.0, 1.0, 0.0]),
    "double integrator": ([1.0], [1.0, 0.0, 0.0]),
    "unstable": ([1.0], [1.0, -2.0]),
}


@pytest.fixture(scope="module", params=CASES.values(), ids=CASES)
def ratio(request):
    return tuple(np.array(x) for x in request.param)


def test_lines_and_steps_are_answered_exactly(ratio):
    """As SciPy's lsim of the state space, for coarse samples."""
    dt, u = 0.05, np.random.default_rng(1).normal(size=60)
    found = TransferFunction(*map(jnp.asarray, ratio))
    times = dt * np.arange(60)
    wanted = lsim(ratio, u, times)[1]
    np.testing.assert_allclose(respond(found, u, dt), wanted, atol=1e-9 * np.abs(wanted).max())
    held = lsim(ratio, u, times, interp=False)[1]
    if len(ratio[0]) == len(ratio[1]):  # lsim tells the sample's own input too
        held = np.append(held[:-1], held[-1])
    np.testing.assert_allclose(respond(found, u, dt, "zero"), held, atol=1e-9 * np.abs(held).max())


def test_it_does_not_matter_how_finely_a_line_is_sampled(ratio):
    found = TransferFunction(*map(jnp.asarray, ratio))
    u = np.interp(np.arange(401) / 20, np.arange(21), np.random.default_rng(2).normal(size=21))
    fine, coarse = respond(found, u, 0.01), respond(found, u[::20], 0.2)
    np.testing.assert_allclose(fine[::20], coarse, atol=1e-9 * np.abs(coarse).max())


def test_a_step_is_answered_as_in_the_textbook():
    """1 - e^{-z w t} (cos w_d t + z/sqrt(1 - z^2) sin w_d t), times the gain."""
    K, w, z, dt = 3.0, 18.65, 0.4, 0.01
    t = dt * np.arange(100)
    wd = w * np.sqrt(1 - z**2)
    wanted = K * (1 - np.exp(-z * w * t) * (np.cos(wd * t) + z * w / wd * np.sin(wd * t)))
    found = respond(second_order(*map(jnp.asarray, (K, w, z))), np.ones(100), dt, "zero")
    np.testing.assert_allclose(found, wanted, atol=1e-12)


def test_numbers_are_differentiable():
    """Slopes by gain, frequency and damping against central differences."""
    u = np.sin(np.arange(200) / 9)

    def last(theta):
        return respond(second_order(*theta), u, 0.01)[-1]

    theta = jnp.array([3.0, 18.65, 1.0])
    slopes = jax.jit(jax.jacfwd(last))(theta)
    for k in range(3):
        h = jnp.zeros(3).at[k].set(1e-5 * theta[k])
        difference = (last(theta + h) - last(theta - h)) / (2e-5 * theta[k])
        assert float(slopes[k]) == pytest.approx(float(difference), rel=1e-6)


def test_a_chain_of_two_first_orders_is_the_second_order_where_lines_are_short():
    """The output of the first is straightened within samples: an error of second order in their length."""
    one, two = (TransferFunction(jnp.array([1.0]), jnp.array([tau, 1.0])) for tau in (0.1, 0.3))
    both = TransferFunction(jnp.array([1.0]), jnp.array([0.03, 0.4, 1.0]))
    errors = []
    for n in (100, 200, 400):
        u = np.sin(np.linspace(0, 6, n + 1))
        errors.append(np.abs(respond(Chain((one, two)), u, 6 / n) - respond(both, u, 6 / n)).max())
    np.testing.assert_allclose(np.log2(errors[:-1]) - np.log2(errors[1:]), 2, atol=0.1)


@pytest.mark.parametrize(("above", "below"), [([1.0, 2.0, 3.0], [1.0, 2.0]), ([], [1.0, 2.0]), ([1.0], [2.0])])
def test_what_is_no_transfer_function_is_refused(above, below):
    with pytest.raises(ValueError, match="coefficients: the denominator"):
        TransferFunction(jnp.array(above), jnp.array(below))
