"""Added mass against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.loads import lamb_coefficients

LAMB = {
    2.0: (0.2100, 0.7042, 0.2394),
    5.0: (0.0591, 0.8943, 0.6999),
    1.0: (0.5, 0.5, 0.0),
}


@pytest.mark.parametrize("ratio", LAMB)
def test_lambs_coefficients_of_a_prolate_spheroid(ratio: float):
    """Lamb (1932), art. 115 and 373."""
    assert [float(k) for k in lamb_coefficients(jnp.asarray(ratio))] == pytest.approx(LAMB[ratio], abs=5e-5)


def test_a_flat_disc_carries_the_water_of_a_disc():
    """Broadside 8/3 rho b^3, and 16/45 rho b^5 on turning about a diameter, of a disc of radius b."""
    ratio = 1e-4
    along, across, turning = lamb_coefficients(jnp.asarray(ratio))
    assert float(along * 4 / 3 * np.pi * ratio) == pytest.approx(8 / 3, rel=1e-3)
    assert float(turning * 4 / 3 * np.pi * ratio / 5 * (1 + ratio**2)) == pytest.approx(16 / 45, rel=1e-3)
    assert float(across) == pytest.approx(np.pi / 4 * ratio, rel=1e-3)


def test_a_long_spheroid_tends_to_a_cylinder():
    along, across, turning = lamb_coefficients(jnp.asarray(1e3))
    assert float(along) == pytest.approx(0, abs=1e-5)
    assert float(across) == pytest.approx(1, abs=2e-5)
    assert float(turning) == pytest.approx(1, abs=1e-4)


def test_closed_form_and_series_meet():
    """The series takes over where |1 - 1/ratio^2| falls below 0.04, on both sides of the sphere."""
    for s in (0.04, -0.04):
        ends = jnp.asarray([(1 - s * (1 + side)) ** -0.5 for side in (-1e-9, 1e-9)])
        for k, slope in zip(
            jax.vmap(lamb_coefficients)(ends), jax.vmap(jax.jacfwd(lamb_coefficients))(ends), strict=False
        ):
            assert float(k[0]) == pytest.approx(float(k[1]), rel=1e-8)
            assert np.all(np.isfinite(slope))


def test_slopes_are_smooth_through_the_sphere():
    ratios = jnp.linspace(0.9, 1.1, 201)
    for k in range(3):
        slope = jax.vmap(jax.grad(lambda r, k=k: lamb_coefficients(r)[k]))(ratios)
        assert np.max(np.abs(np.diff(slope))) < 0.02
