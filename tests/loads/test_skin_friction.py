"""Friction along bodies against the plate of Blasius and the yawed cylinder of Taylor."""

import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import Strips, Water
from nectosome.loads import SkinFriction
from nectosome.loads.drag import friction_coefficient

RHO, NU, LENGTH, RADIUS = 1000.0, 1.0016e-6, 0.6, 0.03
WATER = Water(jnp.asarray(RHO), jnp.asarray(0.0))


def force(velocity: list[float], half_width: tuple[float, float] = (RADIUS, RADIUS), box: bool = False) -> np.ndarray:
    """Force per length [N/m]."""
    one, none = jnp.ones(1), jnp.zeros((1, 3))
    here = Strips(
        x=one,
        half_length=one,
        weight=one,
        half_width=jnp.array([half_width]),
        round_axes=0 * one if box else 2 * one,
        volume=one,
        inertia=jnp.zeros((1, 6, 6)),
        rotation=jnp.eye(3)[None],
        position=none,
        angular_velocity=none,
        velocity=jnp.array([velocity]),
    )
    return np.asarray(SkinFriction(jnp.asarray(LENGTH)).force(jnp.zeros(()), here, (), WATER)[0])[0]


def test_a_body_that_goes_straight_ahead_has_the_friction_of_a_plate():
    """Blasius: 1/2 rho 1.328 Re^-1/2 U^2 per wetted area, against the motion; no moment."""
    speed = 0.3
    expected = -0.5 * RHO * 1.328 * np.sqrt(NU / (speed * LENGTH)) * speed**2 * 2 * np.pi * RADIUS
    assert force([speed, 0.0, 0.0]) == pytest.approx([0, 0, 0, expected, 0, 0], rel=1e-12)
    assert force([-speed, 0.0, 0.0])[3] == pytest.approx(-expected, rel=1e-12)


def test_a_body_that_moves_across_has_taylors_friction():
    """Taylor (1952): 1/2 rho d U^2 5.4 (U d/nu)^-1/2 cos(a) sin(a)^1/2 of a cylinder at the angle a, not small."""
    speed, a, d = 0.3, np.deg2rad(60), 2 * RADIUS
    expected = -0.5 * RHO * d * speed**2 * 5.4 * np.sqrt(NU / (speed * d)) * np.cos(a) * np.sqrt(np.sin(a))
    u, w = speed * np.cos(a), speed * np.sin(a)
    plate = force([u, 0.0, 0.0])[3]
    assert force([u, w, 0.0])[3] == pytest.approx(-np.hypot(expected, plate), rel=1e-12)
    assert abs(plate / expected) < 0.25


def test_the_water_is_felt_along_the_whole_edge_of_a_section():
    """Ahead in proportion to the perimeter, of a box of its four sides, of a thin ellipse of its two faces."""
    plain = force([0.3, 0.0, 0.0])[3] / (2 * np.pi * RADIUS)
    assert force([0.3, 0.0, 0.0], (0.01, 0.04), box=True)[3] == pytest.approx(plain * 0.2, rel=1e-12)
    assert force([0.3, 0.0, 0.0], (1e-6, 0.04))[3] == pytest.approx(plain * 0.16, rel=0.005)


def test_friction_is_blasius_then_schlichtings():
    assert float(friction_coefficient(jnp.asarray(1e5))) == pytest.approx(1.328 / np.sqrt(1e5), rel=1e-12)
    # Schlichting's turbulent 0.455/log10(Re)^2.58 at 1e7 is 0.0030; less by transition at 5e5: 1700/1e7
    assert float(friction_coefficient(jnp.asarray(1e7))) == pytest.approx(0.00300 - 0.00017, abs=1e-5)
