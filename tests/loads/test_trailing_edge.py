"""A trailing edge with the depth of its fin against wing theory: lift slope, induced drag, Wagner's lag, Lighthill.

Its thrust in a swimming body is in tests/robots/test_reactive_force.py.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import Strips, Water
from nectosome.loads import LaggedTrailingEdge, TrailingEdge

HEIGHT, SPEED, RHO = 0.1, 0.5, 1000.0
WATER = Water(jnp.array(RHO), jnp.array(0.0))


def tip(across: float) -> Strips:
    """A tip of a thin fin that moves along -x through the water at `SPEED`, and along y at `across`."""
    one, none = jnp.ones(1), jnp.zeros((1, 3))
    return Strips(
        x=one,
        half_length=one,
        weight=0 * one,
        half_width=jnp.array([[1e-6, HEIGHT / 2]]),
        round_axes=one,
        volume=one,
        inertia=jnp.zeros((1, 6, 6)),
        rotation=jnp.eye(3)[None],
        position=none,
        angular_velocity=none,
        velocity=none.at[0].set(jnp.array([-SPEED, across, 0.0])),
    )


def edge(chord: float) -> LaggedTrailingEdge:
    return LaggedTrailingEdge(jnp.array(1.0), jnp.array(1e-4), None, None, jnp.array(chord))


def settled(load: LaggedTrailingEdge, across: float) -> np.ndarray:
    """Force after the wake has gone."""
    z = jnp.zeros((2, 2)).at[0].set(across)
    return np.asarray(load.force(jnp.zeros(()), tip(across), z, WATER)[0][0, 3:])


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0, 6.0])
def test_a_steady_fin_has_the_lift_slope_and_the_induced_drag_of_a_wing(ratio):
    """Helmbold's slope; C_L^2/(pi A) after the lift has tilted back: both to 1e-3, the squared angle."""
    angle, area = 0.02, HEIGHT**2 / ratio
    ahead, side = settled(edge(HEIGHT / ratio), SPEED * angle)[:2] / (0.5 * RHO * SPEED**2 * area)
    lift = 2 * np.pi * ratio / (2 + np.sqrt(ratio**2 + 4)) * angle
    assert -side == pytest.approx(lift, rel=1e-3)
    # the fin moves along -x: a force along -x is thrust
    drag = ahead + lift * angle
    assert drag == pytest.approx(lift**2 / (np.pi * ratio), rel=1e-3)


def test_after_a_step_the_lift_grows_as_of_a_foil_of_its_aspect_ratio():
    """R. T. Jones' function for A = 3, whose lags are (0.0455, 0.3) + 1.2/A per half chord, to 1e-5."""
    ratio = 3.0
    chord, across = HEIGHT / ratio, 1e-3
    load = edge(chord)
    kappa = ratio / (2 + np.sqrt(ratio**2 + 4))
    shares, rates = kappa * np.array([0.165, 0.335]), np.array([0.0455, 0.3]) + 1.2 / ratio
    dt = 0.002 * chord / SPEED

    @jax.jit
    def side(z):
        rate = lambda y: load.force(jnp.zeros(()), tip(across), y, WATER)[1]  # noqa: E731

        def step(y, _):
            middle = y + 0.5 * dt * rate(y)
            return y + dt * rate(middle), load.force(jnp.zeros(()), tip(across), y, WATER)[0][0, 4]

        return jax.lax.scan(step, z, length=2000)[1]

    way = np.arange(2000) * dt * SPEED / (chord / 2)
    expected = 1 - shares @ np.exp(-np.outer(rates, way))
    found = np.asarray(side(load.initial())) / settled(load, across)[1]
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_a_slender_fin_sheds_at_once():
    """Lighthill's force, but for the aspect ratio: to 1e-3 at A = 0.002, whatever the wake's state."""
    instant = TrailingEdge(jnp.array(1.0), jnp.array(1e-4), None, None)
    lighthill = np.asarray(instant.force(jnp.zeros(()), tip(0.1), (), WATER)[0][0, 3:])
    np.testing.assert_allclose(settled(edge(50.0), 0.1), lighthill, rtol=1.1e-3)


@pytest.mark.parametrize(("degrees", "stalled"), [(29.0, 0.0), (31.0, 1.0), (-31.0, 1.0)])
def test_the_flow_leaves_a_tail_beyond_30_degrees_to_its_path(degrees: float, stalled: float):
    """And where it goes the wrong way round; not by what it does along its height."""
    across = SPEED * np.tan(np.radians(degrees))
    assert float(edge(0.1).flow(tip(across)).stalled[0]) == stalled
    along = eqx.tree_at(lambda s: s.velocity, tip(0.0), jnp.array([[-SPEED, 0.0, 2 * SPEED]]))
    assert float(edge(0.1).flow(along).stalled[0]) == 0.0
    assert float(edge(0.1).flow(eqx.tree_at(lambda s: s.velocity, tip(0.1), jnp.array([[SPEED, 0.1, 0.0]]))).stalled[0])
