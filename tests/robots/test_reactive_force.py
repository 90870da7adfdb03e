"""Strips of added mass with a trailing edge are elongated-body theory: Lighthill's mean thrust of a towed swimmer."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome import model
from nectosome.core import State
from nectosome.description import parse_robot
from nectosome.mechanism import diagnose, load_names
from nectosome.mechanism.diagnose import ADDED_MASS

SPEED, FREQUENCY, WAVELENGTH, LENGTH, RADIUS = 0.5, 2.0, 0.35, 0.4, 0.02
TOWED = f"""
name: towed
water: {{density: 1000 kg/m3, gravity: 0 m/s2}}
body:
  kind: rod
  section: ellipse
  length: {LENGTH} m
  width: 8 mm
  height: {2 * RADIUS} m
  young: 0.1 MPa
  density: 1000 kg/m3
  strains: {{bending_z: 12}}
  points: 20
  joint: {{kind: prismatic, axis: x, motion: {{kind: rate, rate: -{SPEED} m/s}}}}
  motion:
    bending_z: {{kind: wave, amplitude: AMPLITUDE rad/m, frequency: {FREQUENCY} Hz, wavelength: {WAVELENGTH} m}}
  loads:
    water: {{kind: added_mass, normal: 1}}
    wake: {{kind: trailing_edge, softness: 1 mm/s}}
"""


def mean_force(amplitude: float) -> np.ndarray:
    """Mean force of the water [N] along x over a cycle: of the added mass, and of the wake."""
    robot = model.build(parse_robot(TOWED.replace("AMPLITUDE", str(amplitude))))
    assert robot.tree.free_v.size == 0

    @jax.jit
    def force(t: jax.Array) -> jax.Array:
        d = diagnose(robot, t, State(jnp.zeros(0), jnp.zeros(0), robot.initial().z), jnp.zeros(0))
        return jnp.stack([jnp.sum(d.load_force[load_names(robot).index(name), :, 0]) for name in (ADDED_MASS, "wake")])

    times = np.arange(64) / 64 / FREQUENCY
    return np.mean([force(jnp.asarray(t)) for t in times], axis=0)


def lighthill(amplitude: float) -> float:
    """m/2 mean(h_t^2 - U^2 h_x^2) at the tail, for h with h_xx = amplitude sin(2 pi (f t - x/wavelength))."""
    w, k = 2 * np.pi * FREQUENCY, 2 * np.pi / WAVELENGTH
    x = LENGTH
    # h = Im exp(i w t) g(x), g'' = amplitude exp(-i k x), g(0) = g'(0) = 0
    slope = amplitude * (1 - np.exp(-1j * k * x)) / (1j * k)
    place = amplitude * (x / (1j * k) + (np.exp(-1j * k * x) - 1) / (1j * k) ** 2)
    m = 1000 * np.pi * RADIUS**2
    return m / 4 * (abs(w * place) ** 2 - SPEED**2 * abs(slope) ** 2)


def test_a_towed_swimmer_has_lighthills_mean_thrust():
    """To the order of the squared amplitude; the inner water gives none of it on the mean."""
    amplitude = 0.02
    water, wake = mean_force(amplitude)
    assert -wake == pytest.approx(lighthill(amplitude), rel=2e-3)
    assert abs(water) < 1e-6 * abs(wake)


def test_thrust_grows_with_the_squared_amplitude():
    assert mean_force(0.04)[1] / mean_force(0.02)[1] == pytest.approx(4, rel=1e-3)
