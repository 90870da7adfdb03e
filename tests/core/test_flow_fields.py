"""Flows of the water: linear waves obey the equations of the water, currents are those described."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from nectosome.core import Stations, Strips, Water, current_of, wetting
from nectosome.core.se3 import exp_so3
from nectosome.description.flow_fields import wave_number
from nectosome.description.water import WaterDescription
from nectosome.units import InputError

G, DEPTH, U = 9.80665, 0.8, (0.15, 0.1, 0.0)
HEADING = 0.4
ALONG = U[0] * np.cos(HEADING) + U[1] * np.sin(HEADING)
SWELL = {"kind": "regular_waves", "height": 0.04, "period": 1.3, "heading": HEADING, "phase": 0.7}
SEA = {"kind": "irregular_waves", "significant_height": 0.05, "peak_period": 1.5}


def described(*flows: dict[str, Any], **water: Any) -> WaterDescription:
    named = {f"flow{k}": flow for k, flow in enumerate(flows)}
    return WaterDescription.model_validate({"surface": 0.2, "flows": named, **water})


def field(*flows: dict[str, Any], **water: Any):
    found = current_of(described(*flows, **water))
    assert found is not None
    return found


def waves(**more: Any):
    """Waves in water of finite depth with a current, without that."""
    return field(SWELL | more, floor=0.2 - DEPTH, current=U).others[0]


@pytest.mark.parametrize("depth", [None, 5.0, 0.8, 0.02])
@pytest.mark.parametrize("along", [0.0, 0.4, -0.3])
def test_wave_numbers_obey_the_dispersion_relation(depth, along):
    omega = 2 * np.pi / np.array([1.0, 1.3, 4.0, 20.0])
    if depth == 0.02 and along < 0:
        omega = omega[2:]  # shorter ones are stopped
        along = -0.2
    k = wave_number(omega, G, depth, along, np)
    level = 1.0 if depth is None else np.tanh(k * depth)
    np.testing.assert_allclose(k * along + np.sqrt(G * k * level), omega, rtol=1e-12)
    assert np.all(np.diff(k) < 0) and np.all(k > 0)


def test_waves_have_neither_sources_nor_vorticity_and_obey_bed_and_surface():
    """Below the surface at rest, where linear theory holds; seen from the current, dc_s/dt = -g d eta/ds there."""
    found, along = waves(), np.array([np.cos(HEADING), np.sin(HEADING)])
    for point in np.random.default_rng(1).uniform([-1, -1, -0.6], [1, 1, 0.2], (4, 3)):
        slope = jax.jacfwd(found, argnums=1)(jnp.asarray(0.3), jnp.asarray(point))
        assert float(jnp.trace(slope)) == pytest.approx(0, abs=1e-14)
        np.testing.assert_allclose(slope, slope.T, atol=1e-14)
    t, at = jnp.asarray(0.31), jnp.array([0.4, -0.3, 0.2 - 1e-12])
    bed = found(t, at.at[2].set(0.2 - DEPTH))
    assert float(bed[2]) == pytest.approx(0, abs=1e-15)
    goes = (jnp.ones(()), jnp.asarray(ALONG * along))  # with the current
    rise = jax.jvp(found.elevation, (t, at[:2]), goes)[1]
    assert float(found(t, at)[2]) == pytest.approx(float(rise), rel=1e-9)
    rate = jax.jvp(found, (t, at), (goes[0], jnp.append(goes[1], 0.0)))[1]
    slope = jax.grad(found.elevation, argnums=1)(t, at[:2])
    np.testing.assert_allclose(rate[:2], -G * slope, rtol=1e-9)


def test_heights_periods_and_phases_are_those_described():
    found, t = waves(), np.linspace(0, 1.3, 1301)
    eta = jax.vmap(lambda t: found.elevation(t, jnp.zeros(2)))(jnp.asarray(t))
    np.testing.assert_allclose(eta, 0.02 * np.cos(2 * np.pi * t / 1.3 + 0.7), atol=1e-15)


def test_above_the_surface_at_rest_velocities_go_on_by_straight_lines():
    for found in (waves(), field(SWELL).others[0]):
        by_height = jax.jit(jax.vmap(lambda z, f=found: f(jnp.asarray(0.2), jnp.stack([0.0, 0.0, z]))))
        z = 0.2 + np.array([-1e-6, 0.0, 0.01, 0.02])
        c = np.asarray(by_height(jnp.asarray(z)))
        np.testing.assert_allclose(c[3] - c[1], 2 * (c[2] - c[1]), rtol=1e-9)
        np.testing.assert_allclose((c[2] - c[1]) / 0.01, (c[1] - c[0]) / 1e-6, rtol=1e-4)


@pytest.mark.parametrize("peakedness", [1.0, 3.3])
def test_irregular_waves_have_their_significant_height_and_the_mean_period_of_the_spectrum(peakedness):
    """T1 = m0/m1 of the spectrum between half and three times the peak's frequency; of six draws of 200 sines."""

    def spectrum(r: float) -> float:
        s = 0.07 if r < 1 else 0.09
        return r**-5 * np.exp(-1.25 * r**-4) * peakedness ** np.exp(-0.5 * ((r - 1) / s) ** 2)

    m0, m1 = (quad(lambda r, n=n: r**n * spectrum(r), 0.5, 3, points=[1.0], limit=200)[0] for n in (0, 1))
    means = []
    for seed in range(6):
        sea = field(SEA | {"peakedness": peakedness, "seed": seed, "count": 200}).others[0]
        energy, frequency = np.asarray(sea.amplitude) ** 2 / 2, np.asarray(sea.frequency) / (2 * np.pi)
        assert 4 * np.sqrt(energy.sum()) == pytest.approx(0.05, rel=1e-12)
        means.append(energy.sum() / (energy * frequency).sum())
    assert np.mean(means) == pytest.approx(1.5 * m0 / m1, rel=2e-3)


def test_sines_of_one_seed_are_the_same_and_those_of_another_are_not():
    one, same, other = (field(SEA | {"seed": seed}).others[0].phase for seed in (3, 3, 4))
    assert np.array_equal(one, same) and not np.array_equal(one, other)


def test_a_particle_of_the_water_drifts_as_stokes_says():
    """a^2 omega k cosh 2k(z + h) / 2 sinh^2 kh, by steps of its own (Heun's); it begins at the middle height."""
    a, omega = 1e-3, 2 * np.pi / 1.3
    found = field(SWELL | {"height": 2 * a, "heading": 0.0, "phase": np.pi / 2}, floor=0.2 - DEPTH).others[0]
    k, h = wave_number(omega, G, DEPTH, 0.0, np), 1.3 / 400

    def step(x, t):
        c = found(t, x)
        return x + 0.5 * h * (c + found(t + h, x + h * c)), None

    times = h * jnp.arange(4000)  # ten periods
    end = jax.jit(lambda x: jax.lax.scan(step, x, times)[0])(jnp.array([0.0, 0.0, 0.1]))
    expected = a**2 * omega * k * np.cosh(2 * k * (DEPTH - 0.1)) / (2 * np.sinh(k * DEPTH) ** 2)
    assert float(end[0]) / 13.0 == pytest.approx(expected, rel=1e-3)


def test_currents_change_over_time_and_height():
    gust = {"kind": "changing_current", "direction": "y", "speed": {"kind": "sine", "amplitude": 0.2, "frequency": 0.5}}
    shear = {"kind": "sheared_current", "heights": [-1.0, 0.0, 0.2], "speed": [0.0, 0.1, 0.4]}
    water = Water(jnp.asarray(1e3), jnp.asarray(G), current=field(gust, shear, current=(0.0, 0.0, 0.01)))
    c, rate = water.flow(jnp.asarray(0.3), jnp.array([[5.0, 1.0, -0.25], [0.0, 0.0, -3.0], [0.0, 0.0, 2.0]]))
    swing = 0.2 * np.sin(0.3 * np.pi)
    np.testing.assert_allclose(c, [[0.075, swing, 0.01], [0.0, swing, 0.01], [0.4, swing, 0.01]], atol=1e-15)
    grows = 0.2 * np.pi * np.cos(0.3 * np.pi)
    np.testing.assert_allclose(rate, [[1e-3, grows, 0.0], [0, grows, 0], [0, grows, 0]], atol=1e-15)


def test_shares_under_waves_change_as_differences_say():
    """Of a box that turns and rises, by its own motion and the waves'."""
    water = Water(jnp.asarray(1e3), jnp.asarray(G), jnp.asarray(0.2), waves_of(0.1))
    own = Stations.along(jnp.zeros(1), jnp.ones(1), jnp.array([[0.05, 0.06]]), jnp.ones(1), jnp.eye(6)[None], 0.0)
    twist = jnp.array([[0.4, -0.3, 0.8, 0.1, 0.2, -0.5]])

    def moved(h):
        R = exp_so3(jnp.array([0.2, 0.3, 0.1])) @ exp_so3(h * twist[0, :3])
        place = jnp.array([0.1, 0.2, 0.21]) + h * R @ twist[0, 3:]
        still = jnp.zeros((1, 3))
        s = Strips(**vars(own), rotation=R[None], position=place[None], angular_velocity=still, velocity=still)
        return wetting(0.4 + h, s, twist, water)

    share, rate = jax.jit(moved)(jnp.zeros(()))
    later, before = (jax.jit(moved)(jnp.asarray(h))[0] for h in (1e-5, -1e-5))
    assert 0.1 < float(share[0]) < 0.9
    assert float(rate[0]) == pytest.approx(float((later - before)[0]) / 2e-5, rel=1e-6)


def waves_of(height: float):
    return field(SWELL | {"height": height})


@pytest.mark.parametrize(
    ("flow", "water", "message"),
    [
        (SWELL, {"surface": None}, "waves run on a surface, and the water has none"),
        (SWELL, {"gravity": 0.0}, "waves need gravity"),
        (SWELL | {"height": 0.5}, {}, "are 2.64 m long here and break above 0.375 m, so that 0.5 m is too high"),
        (SWELL, {"current": (-2.0, 0.0, 0.0)}, "a current of 1.84 m/s against the waves stops those of 1.3 s"),
        (SEA | {"peakedness": 0.5}, {}, "peakedness"),
        (SEA | {"count": 5}, {}, "count"),
        ({"kind": "sheared_current", "heights": [0.0, 0.0], "speed": [0.1, 0.2]}, {}, "heights must increase"),
        ({"kind": "sheared_current", "heights": [0.0, 1.0], "speed": [0.1]}, {}, "speed"),
        ({"kind": "tide"}, {}, "tide"),
    ],
)
def test_what_is_no_flow_is_refused(flow, water, message):
    with pytest.raises((InputError, ValueError)) as caught:
        described(flow, **water)
    assert message in str(caught.value)
