"""The tapered cantilever of the benchmarks under its own weight, in air, against independent codes."""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from benchmarks.peers import LENGTH, G, our_rod, pyelastica_rod, soromox_rod

from .case import robot, solve, tip

pytestmark = pytest.mark.slow


@cache
def ours(order: int = 6, points: int = 20, strains: tuple[str, ...] = ("bending_y",)) -> np.ndarray:
    """Tip position [m]: level, and height."""
    held = robot(our_rod(order, points, strains), gravity=G, density=1e-9)
    return tip(held, solve(held))[0][[0, 2]]


def test_ours_has_converged():
    assert ours(4, 12) == pytest.approx(ours(), abs=2e-6)


def soromox(order: int) -> np.ndarray:
    """SoRoMoX: geometric variable strain as well, but other code, basis and quadrature."""
    rod = soromox_rod(order, 20, ("kappa_y",), "monomial")
    slope = jax.jit(jax.grad(rod.potential_energy))
    curvature = jax.jit(jax.jacfwd(jax.grad(rod.potential_energy)))
    q = jnp.zeros(rod.K.shape[0])
    for _ in range(10):
        q = q - jnp.linalg.solve(curvature(q), slope(q))
    assert np.max(np.abs(slope(q))) < 1e-10
    place = np.asarray(rod.forward_kinematics(q, jnp.asarray(LENGTH)))
    return place[[0, 2], 3]


def test_soromox_hangs_as_ours_at_the_same_order():
    assert soromox(4) == pytest.approx(ours(4), abs=1e-7)


def elastica(elements: int) -> np.ndarray:
    """PyElastica: a discrete Cosserat rod, damped until it hangs still."""
    import elastica as ea

    step = 3e-5 * 20 / elements
    simulator, rod = pyelastica_rod(elements, damping=20.0, step=step)
    stepper, time = ea.PositionVerlet(), 0.0
    for _ in range(round(1.5 / step)):
        time = stepper.step(simulator, time, step)
    assert np.max(np.abs(rod.velocity_collection)) < 1e-6
    return rod.position_collection[[0, 2], -1]


def test_pyelastica_approaches_ours_as_it_is_refined():
    """To second order. Its shear factor is 27/28, ours 0.90: 1e-5 m of the tip's 24 mm."""
    shearable = ours(6, 20, ("bending_y", "extension", "shear_z"))
    coarse, middle, fine = (elastica(n) for n in (10, 20, 40))
    order = np.log2(np.linalg.norm(middle - coarse) / np.linalg.norm(fine - middle))
    assert order == pytest.approx(2, abs=0.3)
    limit = fine + (fine - middle) / 3
    assert limit == pytest.approx(shearable, abs=1e-5)
