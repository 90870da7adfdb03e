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
from nectosome.solve import simulate

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


def mean_force(amplitude: float, text: str = TOWED) -> np.ndarray:
    """Mean force of the water [N] along x over a cycle: of the added mass, and of the wake."""
    return np.mean(forces(text.replace("AMPLITUDE", str(amplitude))), axis=0)[:, 0]


def forces(text: str) -> np.ndarray:
    """Force of the water [N] at 64 times of a cycle: of the added mass, and of the wake."""
    robot = model.build(parse_robot(text))
    assert robot.tree.free_v.size == 0

    @jax.jit
    def force(t: jax.Array) -> jax.Array:
        d = diagnose(robot, t, State(jnp.zeros(0), jnp.zeros(0), robot.initial().z), jnp.zeros(0))
        return jnp.stack(
            [jnp.sum(d.load_force[load_names(robot).index(name)], axis=0) for name in (ADDED_MASS, "wake")]
        )

    times = np.arange(64) / 64 / FREQUENCY
    return np.stack([force(jnp.asarray(t)) for t in times])


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


def test_a_tail_fin_of_a_given_depth_thrusts_by_its_lagged_wake():
    """f m mean((1 - f/2) w_e^2 - U w_e h_x) with w_e = C w, of a fin of A = 2, after the wake has settled."""
    amplitude, chord = 0.02, RADIUS
    text = TOWED.replace("AMPLITUDE", str(amplitude)).replace("softness", f"chord: {chord} m, softness")
    robot = model.build(parse_robot(text))
    times = np.append(0.0, 6 + np.arange(32) / 32) / FREQUENCY
    run = simulate(robot, times[-1], samples=list(times), rtol=1e-8, atol=1e-12)
    tow = np.asarray(run.results().data["reaction"][1])[1:, 0].mean()  # of the drive that holds the speed

    w, k, x = 2 * np.pi * FREQUENCY, 2 * np.pi / WAVELENGTH, LENGTH
    slope = amplitude * (1 - np.exp(-1j * k * x)) / (1j * k)
    place = amplitude * (x / (1j * k) + (np.exp(-1j * k * x) - 1) / (1j * k) ** 2)
    ratio, across = 2 * RADIUS / chord, 1j * w * place + SPEED * slope
    kappa = ratio / (2 + np.sqrt(ratio**2 + 4))
    b, f = (np.array([0.0455, 0.3]) + 1.2 / ratio) * 2 * SPEED / chord, 4 * kappa / ratio
    lagged = across * (1 - np.sum(kappa * np.array([0.165, 0.335]) * 1j * w / (1j * w + b)))
    m = 1000 * np.pi * RADIUS**2
    expected = 0.5 * f * m * ((1 - f / 2) * abs(lagged) ** 2 - SPEED * (lagged * slope.conjugate()).real)
    assert tow == pytest.approx(expected, rel=2e-4)


def test_thrust_grows_with_the_squared_amplitude():
    assert mean_force(0.04)[1] / mean_force(0.02)[1] == pytest.approx(4, rel=1e-3)


POINT = f"""
name: behind a towed point
water: {{density: 1000 kg/m3, gravity: 0 m/s2}}
body:
  kind: rigid
  shape: point
  mass: 1 kg
  joint: {{kind: prismatic, axis: x, motion: {{kind: rate, rate: -{SPEED} m/s}}}}
limbs:
"""
LINKS, LINK, LAG = 4, 0.1, 1.1  # links, their length [m], and by how much each lags the one before [rad]


def chain() -> str:
    """A towed chain of rigid plates on hinges."""
    text = POINT
    for k in range(LINKS):
        wake = ", wake: {kind: trailing_edge, softness: 1 mm/s}" if k == LINKS - 1 else ""
        text += f"""
  link{k}:
    kind: rigid
    on: {f"link{k - 1}" if k else "body"}
    shape: box
    length: {LINK} m
    width: 8 mm
    height: {2 * RADIUS} m
    density: 1000 kg/m3
    joint:
      kind: revolute
      axis: z
      motion: {{kind: sine, amplitude: AMPLITUDE rad, frequency: {FREQUENCY} Hz, phase: {-k * LAG} rad}}
    loads: {{water: {{kind: added_mass, normal: 1}}{wake}}}
"""
    return text


def test_a_towed_chain_of_rigid_links_has_lighthills_mean_thrust():
    """m/2 mean(h_t^2 - U^2 h_x^2) at the tip of the last link, to the order of the squared amplitude."""
    amplitude = 0.02
    water, wake = mean_force(amplitude, chain())
    angles = amplitude * np.exp(-1j * LAG * np.arange(LINKS))
    slopes = np.cumsum(angles)  # of the links, complex amplitudes
    across, slope = LINK * slopes.sum(), slopes[-1]
    m = 1000 * np.pi * RADIUS**2
    expected = m / 4 * (abs(2 * np.pi * FREQUENCY * across) ** 2 - SPEED**2 * abs(slope) ** 2)
    assert -wake == pytest.approx(expected, rel=2e-3)
    assert abs(water) < 1e-6 * abs(wake)


TAIL = f"""{POINT}
  fin:
    length: 0.1 m
    width: 4 mm
    height: 60 mm
    density: 1000 kg/m3
    joint: {{kind: revolute, axis: z, motion: {{kind: sine, amplitude: 0.6 rad, frequency: {FREQUENCY} Hz}}}}
    loads: {{water: {{kind: added_mass, normal: 1}}, wake: {{kind: trailing_edge}}}}
"""
PLATE = "    kind: rigid\n    shape: box\n"
STIFF = """    kind: rod
    section: rectangle
    young: 1 MPa
    strains: {bending_z: 0}
    motion: {bending_z: {kind: wave, amplitude: 0 rad/m, frequency: 1 Hz}}
"""


def test_a_rigid_plate_sheds_what_a_rod_that_does_not_bend_sheds():
    """At large angles; added mass too, of which both have strips."""
    plate, rod = (forces(TAIL + kind) for kind in (PLATE, STIFF))
    np.testing.assert_allclose(plate, rod, rtol=1e-9, atol=1e-9 * abs(rod).max())
    assert abs(plate[:, 1]).max() > 0.1


def test_the_edge_of_a_bent_cylinder_stands_as_its_tip_does():
    """Towed tail first along the tip's own axis it sheds nothing; along that of its root it does."""
    bent = """
name: bent
water: {density: 1000 kg/m3, gravity: 0 m/s2}
body:
  kind: rigid
  shape: cylinder
  length: 0.1 m
  radius: 10 mm
  bend: 40 deg
  density: 1000 kg/m3
  rotation: [0 deg, TURN deg, 0 deg]
  joint: {kind: prismatic, axis: AXIS, motion: {kind: rate, rate: -0.5 m/s}}
  loads: {water: {kind: added_mass, normal: 1}, wake: {kind: trailing_edge}}
"""
    ahead = [np.cos(np.deg2rad(40)), 0, -np.sin(np.deg2rad(40))]  # of the tip, in the frame of the root
    along_tip, along_root = (
        forces(bent.replace("TURN", "0").replace("AXIS", axis))[0, 1] for axis in (str([*map(float, ahead)]), "x")
    )
    V = -0.5 * np.array([np.cos(np.deg2rad(40)), 0, np.sin(np.deg2rad(40))])  # in the frame of the tip
    p = 1000 * np.pi * 0.01**2 * np.array([0, 0, V[2]])
    expected = V[0] * p + [-0.5 * p @ V, 0, 0]
    back = np.array([[ahead[0], 0, -ahead[2]], [0, 1, 0], [ahead[2], 0, ahead[0]]])
    np.testing.assert_allclose(along_root, back @ expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(along_tip, 0, atol=1e-12)
