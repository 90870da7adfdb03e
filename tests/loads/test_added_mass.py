"""Added mass against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import jv, kv, kvp, roots_legendre

from nectosome.description import dump_robot, parse_robot
from nectosome.loads import LaggedTrailingEdge, lamb_coefficients
from nectosome.loads.added_mass import wave_share
from nectosome.model import build

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


RHO = 1000.0


def _carried(shape: str, load: str) -> np.ndarray:
    """Added mass of a body 0.3 m long about the middle of its axis, all stations together [6, 6]."""
    text = "name: body\nwater: {density: 1000 kg/m3}\nbody: {kind: rigid, length: 0.3 m, volume: 1e-3 m3, mass: 1 kg, "
    robot = build(parse_robot(f"{text}{shape}, loads: {{water: {load}}}}}\n"))
    return np.sum(np.asarray(robot.added), axis=0)


def test_a_flat_body_carries_the_water_of_an_elliptic_cylinder():
    """Per length rho pi b^2 along y and rho pi a^2 along z, of half axes a along y and b along z (Lamb, art. 71)."""
    found = _carried("shape: box, width: 40 mm, height: 100 mm", "{kind: added_mass, normal: 1, tangential: 0.2}")
    expected = RHO * np.pi * 0.3 * np.array([0.2 * 0.02 * 0.05, 0.05**2, 0.02**2])
    np.testing.assert_allclose(np.diag(found)[3:], expected, rtol=1e-12)


def test_a_turning_cylinder_carries_what_its_strips_do():
    """m' L^3/12 about an axis across it, m' the added mass per length."""
    found = np.diag(_carried("shape: cylinder, radius: 20 mm", "{kind: cylinder_added_mass, coefficient: 0.9}"))
    line = 0.9 * RHO * np.pi * 0.02**2
    np.testing.assert_allclose(found, [0, *[line * 0.3**3 / 12] * 2, 0, *[line * 0.3] * 2], rtol=1e-12)


def test_a_spheroid_carries_lambs_shares_of_the_water_that_it_displaces():
    """k1 and k2 of its mass, k' of its moment of inertia (Lamb 1932, art. 115)."""
    found = np.diag(_carried("shape: spheroid, radius: 75 mm", "{kind: spheroid_added_mass}"))
    mass = RHO * 4 / 3 * np.pi * 0.15 * 0.075**2
    along, across, turning = LAMB[2.0]
    moment = turning * mass / 5 * (0.15**2 + 0.075**2)
    np.testing.assert_allclose(found, [0, moment, moment, along * mass, across * mass, across * mass], rtol=3e-4)


# --- sections whose motion is a wave along the body ------------------------------------------------------------------


def plate_wave_share(kappa: float) -> float:
    """Of a plate of half height 1: Galerkin's method with Chebyshev polynomials of the second kind.

    The jump of the potential has the Fourier transform mu, its normal derivative $\\tfrac12 \\sqrt{l^2 + k^2}\\,\\mu$.
    """
    l, weight = roots_legendre(800)
    l, weight = 40 * (l + 1), 40 * weight
    order = 2 * np.arange(4) + 1
    mu = np.pi * order[:, None] * np.cos(np.pi * np.arange(4))[:, None] * jv(order[:, None], l) / l
    more = np.einsum("x,mx,nx->mn", weight * (np.sqrt(l**2 + kappa**2) - l), mu, mu) / (2 * np.pi)
    A = more + np.diag(np.pi * order / 4)
    b = np.array([np.pi / 2, 0, 0, 0])
    return float(b @ np.linalg.solve(A, b)) / np.pi


@pytest.mark.parametrize("kappa", [0.05, 0.2, 0.5, 1.0, 2.0, 4.0])
def test_the_added_mass_of_waves_on_plates_and_cylinders(kappa: float):
    plate, circle = (float(wave_share(jnp.array([kappa]), jnp.array([t]))[0]) for t in (0.0, kappa))
    assert plate == pytest.approx(plate_wave_share(kappa), abs=0.015)
    assert circle == pytest.approx(-kv(1, kappa) / (kappa * kvp(1, kappa)), abs=0.015)


def test_short_waves_carry_little_water():
    """4/(pi k a) of a plate, 1/(k a) of a cylinder."""
    plate, circle = (float(wave_share(jnp.array([200.0]), jnp.array([t]))[0]) for t in (0.0, 200.0))
    assert plate == pytest.approx(4 / np.pi / 200, rel=1e-3)
    assert circle == pytest.approx(1 / 200, rel=1e-3)


FISH = """
name: fish
body: {kind: rigid, shape: cylinder, length: 0.2 m, radius: 15 mm, mass: 0.1 kg, joint: {kind: free}}
limbs:
  fin:
    {kind: rigid, shape: box, length: 40 mm, width: 2 mm, height: HEIGHT mm, mass: 5 g,
    loads: {water: {kind: added_mass, normal: 1 FIN}, wake: {kind: trailing_edge}}}
"""


@pytest.mark.parametrize(
    ("height", "fin", "is_one"),
    [(200, "", True), (200, ", fin: false", False), (70, "", False), (70, ", fin: true", True)],
)
def test_a_fin_higher_than_deep_carries_the_water_of_a_plate(height: int, fin: str, is_one: bool):
    """Chosen by its height over its depth where the file does not say, kept in a copy, and so with its wake."""
    robot = parse_robot(FISH.replace("HEIGHT", str(height)).replace("FIN", fin))
    ratio = height / 40
    plate = (1 - 0.425 * ratio / (1 + ratio**2)) / np.sqrt(1 + ratio**2)
    for one in (robot, parse_robot(dump_robot(robot))):
        built = build(one)
        carried = float(jnp.sum(built.added[:, 4, 4]))
        strips = 1000 * np.pi / 4 * (1e-3 * height) ** 2 * 0.04
        assert carried == pytest.approx(strips * (plate if is_one else 1), rel=1e-12)
    if not fin:
        lags = any(isinstance(group.load, LaggedTrailingEdge) for group in built.load_groups.on_bodies)
        assert lags == is_one


def test_a_body_on_its_own_may_be_a_fin():
    text = "body: {kind: rigid, shape: box, length: 40 mm, height: 90 mm, width: 2 mm, mass: 9 g, loads: {water: LOAD}}"
    robot = parse_robot("name: fin\n" + text.replace("LOAD", "{kind: added_mass, normal: 1}"))
    assert getattr(robot.parts["body"].loads["water"], "fin", None) is True


@pytest.mark.parametrize(("length", "height", "printed"), [(1.0, 1.0, 0.579), (5.0, 1.0, 0.897), (0.2, 1.0, 0.897)])
def test_a_plate_that_ends_carries_less_than_its_strips(length: float, height: float, printed: float):
    """DNV-RP-H103 (2011), table A-2: a share of rho pi/4 a^2 b with the shorter side a, whichever way strips run."""
    text = f"""
name: plate
water: {{density: 1000 kg/m3}}
body:
  {{kind: rigid, shape: box, length: {length} m, width: 1 mm, height: {height} m, mass: 1 kg,
  loads: {{water: {{kind: added_mass, normal: 1, length: {length} m}}}}}}
"""
    carried = float(jnp.sum(build(parse_robot(text)).added[:, 4, 4]))
    short, long = sorted((length, height))
    assert carried == pytest.approx(printed * 1000 * np.pi / 4 * short**2 * long, rel=0.045)
