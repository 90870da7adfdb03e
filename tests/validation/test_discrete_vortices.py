"""The discrete vortices of the benchmarks against closed forms of attached flow, and plates that start across it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from benchmarks.discrete_vortices import Motion, run
from jaxtyping import Array
from scipy.special import hankel2
from tests.loads.test_foil import SPAN, STILL, B, foil, strips

from nectosome.loads import RigidFoil

CHORD, RHO = 1.0, 1000.0


def towed(degrees: float, held: float, step: float, way: float) -> tuple[np.ndarray, np.ndarray]:
    """Way in chords, and coefficients along the plate and normal to it, of one that starts at once."""
    angle = np.radians(degrees)
    found = run(Motion(lambda t: complex(t), lambda t: angle), CHORD / 2, held, step, int(way / step), 1.0)
    return found.time, found.force * np.exp(-1j * angle) / (0.5 * RHO * CHORD)


def test_lift_grows_as_wagner_has_it():
    """Jones' form of his function, itself within 1 %, from a quarter of a half chord to eight."""
    way, force = towed(2.0, np.pi / 2, 0.02, 4.0)
    s = way / 0.5
    wagner = 1 - 0.165 * np.exp(-0.0455 * s) - 0.335 * np.exp(-0.3 * s)
    lift = (force * np.exp(1j * np.radians(2.0))).imag / (2 * np.pi * np.sin(np.radians(2.0)))
    far = s > 0.25
    np.testing.assert_allclose(lift[far], wagner[far], rtol=0.015)


def test_a_plate_that_heaves_a_little_has_garricks_thrust_and_power():
    """T = pi rho b (omega h)^2 |C|^2, P = pi rho b (omega h)^2 F U with Theodorsen's C = F + i G.

    The power to 0.5 %. The thrust is off by the step: two steps, continued to none, have it to 1 %.
    """
    k, heave, thrust = 1.0, 0.01, []
    w = 2 * k
    h0, h1 = hankel2(0, k), hankel2(1, k)
    c, each = h1 / (h1 + 1j * h0), np.pi * RHO * CHORD / 2 * (w * heave) ** 2
    motion = Motion(lambda t: complex(t, heave * np.cos(w * t)), lambda t: 0.0)
    for steps in (50, 100):
        found = run(motion, CHORD / 2, np.pi / 2, 2 * np.pi / w / steps, 3 * steps, 1.0)
        force, power = found.force.real[-steps:].mean(), found.power[-steps:].mean()
        thrust.append(force)
        assert force - power == pytest.approx(each * c.real, rel=0.005)  # without what tows it
    assert 2 * thrust[1] - thrust[0] == pytest.approx(each * abs(c) ** 2, rel=0.01)


def test_a_plate_that_starts_across_the_flow_has_the_drag_of_a_start():
    """That of `plate_drag` for C = 2, whose numbers are Graham's (1980) and not these sheets', from 0.3 to
    1.4 heights within 15 %."""
    way, force = towed(90.0, 0.0, 0.02, 2.0)
    np.testing.assert_allclose(force.real, 0.0, atol=1e-9)
    start = 2 * (1 + np.exp(-np.outer(way, 1 / np.array([0.189, 1.6]))) @ np.array([2.39, 1.07]))
    settled = (way > 0.3) & (way < 1.4)
    np.testing.assert_allclose(force.imag[settled], start[settled], rtol=0.15)


def test_flow_that_leaves_both_edges_pushes_normal_to_the_plate():
    way, force = towed(45.0, 0.0, 0.02, 2.0)
    grown = way > 0.3
    assert abs(force.real[grown].mean()) < 0.01 * force.imag[grown].mean()


@jax.jit
def _starting(load: RigidFoil, u: Array, w: Array) -> Array:
    """Coefficients of the normal force on the way of a chord, from the start."""

    def on(z: Array, _: None) -> tuple[Array, Array]:
        force, rates = load.force(jnp.zeros(()), strips(u, w), z, STILL)
        return z + 2 * B / 500 * rates, -force[0, 4] / (0.5 * RHO * 2 * B * SPAN)

    return jax.lax.scan(on, load.initial(), None, length=500)[1]


@pytest.mark.parametrize(("degrees", "within"), [(20, 0.08), (30, 0.12), (45, 0.1), (60, 0.25), (75, 0.3), (90, 0.1)])
def test_a_foil_that_starts_at_once_has_their_normal_force(degrees: float, within: float):
    """From 0.2 to one chord, an endless foil with the stall that the vortices have; across it less well."""
    way, force = towed(degrees, np.radians(15), 0.02, 1.0)
    load = foil(aspect_ratio=1e6, stall=np.radians(15), broadside=2.01)
    found = _starting(load, jnp.cos(jnp.radians(degrees)), jnp.sin(jnp.radians(degrees)))
    later = way > 0.2
    np.testing.assert_allclose(np.interp(way[later], np.arange(500) / 500, found), force.imag[later], rtol=within)
