"""Numbers of thin foils against exact and printed ones."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import hankel2

from nectosome.loads import foil_theory as theory


def theodorsen(k: float) -> complex:
    """Theodorsen (1935), C(k) = H1/(H1 + i H0) with Hankel functions of the second kind."""
    h0, h1 = hankel2(0, k), hankel2(1, k)
    return h1 / (h1 + 1j * h0)


def test_the_lift_slope_has_the_limits_of_long_and_of_slender_wings():
    assert float(theory.lift_share(jnp.asarray(1e6))) == pytest.approx(1, abs=3e-6)
    slender = 1e-3  # C_L = pi A/2 alpha (R. T. Jones 1946)
    assert float(2 * np.pi * theory.lift_share(jnp.asarray(slender))) == pytest.approx(np.pi * slender / 2, rel=1e-3)


def test_the_lift_slope_of_a_circular_wing():
    """Exact is 1.7900 (Jordan 1971)."""
    assert float(2 * np.pi * theory.lift_share(jnp.asarray(4 / np.pi))) == pytest.approx(1.7900, rel=0.025)


def after_a_step(way: float, aspect_ratio: float) -> float:
    """Circulatory lift over its final value."""
    shares, rates = theory.lag_numbers(jnp.asarray(aspect_ratio))
    return float(1 - jnp.sum(shares * jnp.exp(-rates * way)))


@pytest.mark.parametrize("way", [0.0, 0.5, 1.0, 3.0, 10.0, 30.0])
def test_the_lag_of_an_infinite_span_is_wagners(way: float):
    """Exact by $\\frac2\\pi \\int_0^\\infty F(k) \\sin(k s)/k\\,dk$ with F = Re C, whose part at small k is known."""
    if way == 0:
        exact = 0.5
    else:  # 1/2 is the share of F(infinity)
        head = quad(lambda k: (theodorsen(k).real - 0.5) * np.sin(k * way) / k, 1e-9, 200, limit=4000)[0]
        exact = 0.5 + 2 / np.pi * head
    assert after_a_step(way, 1e9) == pytest.approx(exact, abs=0.012)


@pytest.mark.parametrize("way", [0.0, 0.5, 1.0, 2.0, 4.0, 8.0])
@pytest.mark.parametrize(
    ("aspect_ratio", "printed"), [(3.0, (0.600, 0.170, 0.540)), (6.0, (0.740, 0.267, 0.381))], ids=["A=3", "A=6"]
)
def test_the_lag_of_finite_spans_is_jones(aspect_ratio: float, printed: tuple[float, float, float], way: float):
    """R. T. Jones (1940), over the final lift."""
    final, share, rate = printed
    expected = 1 - share / final * np.exp(-rate * way)
    assert after_a_step(way, aspect_ratio) == pytest.approx(expected, abs=0.025)


@pytest.mark.parametrize(
    ("ratio", "printed"), [(1.0, 0.579), (1.59, 0.704), (2.0, 0.757), (3.17, 0.840), (5.0, 0.897), (10.0, 0.947)]
)
def test_the_added_mass_of_a_rectangular_plate(ratio: float, printed: float):
    """DNV-RP-H103 (2011), table A-2."""
    assert float(theory.plate_added_mass_share(jnp.asarray(ratio))) == pytest.approx(printed, rel=0.045)


def test_a_plate_across_the_flow():
    """1.11 of a short plate, 2.01 of a long one."""
    found = [float(theory.broadside_drag(jnp.asarray(ratio))) for ratio in (0.0, 50.0, 1e9)]
    assert found == pytest.approx([1.11, 2.01, 2.01])
