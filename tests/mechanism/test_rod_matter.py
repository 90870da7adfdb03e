"""Rods that change along their length, hollow and filled ones, ribs: stiffness, mass, frequencies, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import eigh

from nectosome.description import parse_robot
from nectosome.model import bind, build
from nectosome.solve import modes

L, R, E, RHO = 0.3, 3e-3, 1e6, 1100.0
ROD = """
name: beam
water: {gravity: 0 m/s2}
body:
  kind: rod
  section: circle
  radius: 3 mm
  length: 300 mm
  young: 1 MPa
  density: 1100 kg/m3
  damping: 30 Pa s
  strains: {STRAINS}
  joint: {kind: fixed}
"""
I = np.pi / 4 * R**4


def rod_of(more: str, strains: str = "bending_y: 7"):
    """A rod alone, and the stations of its robot."""
    robot = build(parse_robot(ROD.replace("STRAINS", strains) + more))
    return jax.tree.map(lambda x: x[0], robot.tree.rods[0].things), robot.tree.stations


def deflection(n: int, s) -> np.ndarray:
    """Of a clamped beam, whose curvature times length is each of n Legendre polynomials: integrated twice [m]."""
    twice = [np.polynomial.legendre.legint(row, m=2, lbnd=-1, scl=0.5) for row in np.eye(n)]
    return L * np.stack([np.polynomial.legendre.legval(2 * np.asarray(s) - 1, row) for row in twice], axis=-1)


def compliance(soft) -> float:
    """Deflection of the tip of a straight cantilever per force there [m/N]."""
    tip = deflection(soft.nq, 1.0)
    return float(tip @ np.linalg.solve(soft.stiffness, tip))


def test_a_cantilever_whose_modulus_falls_to_half_bends_as_in_closed_form():
    """int (L - x)^2 / (E I) dx with E (1 - s/2): L^3 / (E I) (2 ln 2 - 1)."""
    assert compliance(rod_of("  tip_young: 500 kPa\n")[0]) == pytest.approx(
        L**3 / (E * I) * (2 * np.log(2) - 1), rel=1e-6
    )


def test_a_cantilever_with_a_kink_in_its_modulus_bends_as_in_closed_form():
    """E falls evenly to half at 0.4 and stays: int (1 - s)^2 / e ds by a fine sum; stress follows the modulus there."""
    soft, _ = rod_of("  between: [{at: 0.4, young: 500 kPa}]\n  tip_young: 500 kPa\n", "bending_y: 14")
    s = (np.arange(20000) + 0.5) / 20000
    e = np.interp(s, [0, 0.4, 1], [1, 0.5, 0.5])
    assert compliance(soft) == pytest.approx(L**3 / (E * I) * np.mean((1 - s) ** 2 / e), rel=1e-4)
    np.testing.assert_allclose(soft.young, E * np.interp(soft.nodes, [0, 0.4, 1], [1, 0.5, 0.5]), rtol=1e-12)


def frequency(soft, stations) -> float:
    """First angular frequency of small bending, of the rod's own stiffness and the mass of its points."""
    place = deflection(soft.nq, soft.nodes)
    M = place.T @ (np.asarray(stations.inertia[:, 3, 3])[:, None] * place)
    return float(np.sqrt(eigh(np.asarray(soft.stiffness), M, eigvals_only=True)[0]))


def frequency_of_elements(young, density) -> float:
    """The same of 100 cubic beam elements, of modulus and density at fractions of the length."""
    n = 100
    h, A, K, M = L / n, np.pi * R**2, np.zeros((2 * n + 2,) * 2), np.zeros((2 * n + 2,) * 2)
    k = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h]])
    k = np.vstack([k, -k[0], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]) / h**3
    m = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h]])
    m = np.vstack([m, [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]) * h / 420
    for i in range(n):
        at, s = slice(2 * i, 2 * i + 4), (i + 0.5) / n
        K[at, at] += young(s) * I * k
        M[at, at] += density(s) * A * m
    return float(np.sqrt(eigh(K[2:, 2:], M[2:, 2:], eigvals_only=True, subset_by_index=[0, 0])[0]))


PIECES = """
  between: [{at: FROM, young: 1 MPa, density: 1100 kg/m3}, {at: TO, young: 250 kPa, density: 3000 kg/m3}]
  tip_young: 250 kPa
  tip_density: 3000 kg/m3
"""


@pytest.mark.parametrize(("places", "off"), [((0.2, 0.5), 3e-3), ((0.3499, 0.3501), 4e-2)])
def test_a_rod_of_two_pieces_has_the_frequency_of_beam_elements(places, off):
    """From above, as Rayleigh and Ritz say; a jump in the modulus is one in the curvature, which polynomials smear."""
    ends = [0, *places, 1]
    w = frequency_of_elements(
        lambda s: np.interp(s, ends, [1e6, 1e6, 250e3, 250e3]), lambda s: np.interp(s, ends, [1100, 1100, 3000, 3000])
    )
    soft, stations = rod_of(PIECES.replace("FROM", str(places[0])).replace("TO", str(places[1])), "bending_y: 6")
    assert w < frequency(soft, stations) < w * (1 + off)
    mass = 1100 * np.mean(places) + 3000 * (1 - np.mean(places))
    assert float(jnp.sum(stations.inertia[:, 3, 3])) == pytest.approx(np.pi * R**2 * L * mass, rel=3e-3)


TWO = """
name: two
water: {gravity: 0 m/s2}
limbs:
  first: {on: world, kind: rod, section: circle, radius: 3 mm, length: 105 mm, young: 1 MPa, density: 1100 kg/m3,
    strains: {bending_y: 3}}
  second: {on: first, kind: rod, section: circle, radius: 3 mm, length: 195 mm, young: 250 kPa, density: 3000 kg/m3,
    strains: {bending_y: 3}}
"""


@pytest.mark.slow
def test_two_rods_of_a_jump_have_the_frequency_of_beam_elements():
    w = frequency_of_elements(lambda s: 1e6 if s < 0.35 else 250e3, lambda s: 1100 if s < 0.35 else 3000)
    assert np.abs(modes(parse_robot(TWO)).eigenvalue[0]) == pytest.approx(w, rel=3e-4)


def test_points_lie_on_either_side_of_a_step_so_that_mass_and_centre_of_mass_are_exact():
    """1100 kg/m3 up to 0.35, 3000 kg/m3 beyond."""
    soft, stations = rod_of(PIECES.replace("FROM", "0.3499").replace("TO", "0.3501"))
    m, x = np.asarray(stations.inertia[:, 3, 3]), np.asarray(soft.nodes)
    first, second = 1100 * 0.35, 3000 * 0.65
    assert m.sum() == pytest.approx(np.pi * R**2 * L * (first + second), rel=1e-12)
    assert m @ x / m.sum() == pytest.approx((0.175 * first + 0.675 * second) / (first + second), rel=1e-12)
    assert len(soft.nodes) <= 10 + 2 + 1


def test_a_filled_tube_has_mass_inertia_volume_and_stiffness_of_both():
    """Wall of 1 mm around water of 1 kPa, as a gel: rings and discs; the water outside sees the whole tube."""
    tube, stations = rod_of(
        "  wall: 1 mm\n  filling: {density: 998 kg/m3, young: 1 kPa, damping: 2 Pa s}\n",
        "bending_y: 0, torsion: 0, extension: 0",
    )
    r, ring = R - 1e-3, np.pi * (R**2 - (R - 1e-3) ** 2)
    mass, about_x = (float(jnp.sum(stations.inertia[:, k, k])) for k in (3, 0))
    assert mass == pytest.approx(L * (RHO * ring + 998 * np.pi * r**2), rel=1e-12)
    assert about_x == pytest.approx(L * np.pi / 2 * (RHO * (R**4 - r**4) + 998 * r**4), rel=1e-12)
    assert float(jnp.sum(stations.volume)) == pytest.approx(L * np.pi * R**2, rel=1e-12)
    EI = np.pi / 4 * (E * (R**4 - r**4) + 1e3 * r**4)
    torsion, bend, axial = np.diag(np.asarray(tube.stiffness))
    assert bend == pytest.approx(EI / L, rel=1e-12)
    assert torsion == pytest.approx(2 * EI / 3 / L, rel=1e-12)  # G = E/3
    assert axial == pytest.approx((E * ring + 1e3 * np.pi * r**2) * L, rel=1e-12)
    lost = 3 * np.pi / 4 * (30 * (R**4 - r**4) + 2 * r**4)
    assert float(tube.damping[1, 1]) == pytest.approx(lost / L, rel=1e-12)


def test_a_thin_tube_shears_by_cowpers_factor():
    """2 (1 + nu) / (4 + 3 nu) of a thin round tube (Cowper 1966), 0.5455 of rubber; a solid one has 0.9."""
    tube, _ = rod_of("  wall: 3 um\n", "shear_y: 0")
    area = np.pi * (R**2 - (R - 3e-6) ** 2)
    assert float(tube.stiffness[0, 0]) == pytest.approx(3 / 5.5 * E / 3 * area * L, rel=1e-3)


def test_ribs_add_mass_and_stiffen_by_their_share_of_the_length():
    """Ten ribs of 3 mm on 300 mm: a tenth hardly bends, 1/(E I) = 0.9/(E I_0) + 0.1/(E I_r). Rings add mass."""
    plain, before = rod_of("", "bending_y: 0")
    ribbed, stations = rod_of(
        "  ribs: {count: 10, thickness: 3 mm, radius: 9 mm, density: 2000 kg/m3}\n", "bending_y: 0"
    )
    around = np.pi * (9e-3**2 - R**2)
    assert float(ribbed.stiffness[0, 0] / plain.stiffness[0, 0]) == pytest.approx(1 / (0.9 + 0.1 / 81), rel=1e-12)
    more = float(jnp.sum(stations.inertia[:, 3, 3] - before.inertia[:, 3, 3]))
    assert more == pytest.approx(10 * 3e-3 * around * 2000, rel=1e-12)
    assert float(jnp.sum(stations.volume - before.volume)) == pytest.approx(10 * 3e-3 * around, rel=1e-12)
    # one material: its loss by its stiffness stays the same, whatever bends
    np.testing.assert_allclose(ribbed.damping / ribbed.stiffness, plain.damping / plain.stiffness, rtol=1e-12)
    hard, _ = rod_of("  ribs: {count: 10, thickness: 3 mm, radius: 9 mm, young: 1000 GPa}\n", "bending_y: 0")
    np.testing.assert_allclose(hard.stiffness / plain.stiffness, 1 / 0.9, rtol=1e-6)
    np.testing.assert_allclose(hard.damping / plain.damping, 1 / 0.9, rtol=1e-6)  # a tenth moves as one piece


def test_viscosity_by_a_loss_factor_follows_the_modulus():
    """Loss factor 0.2 at 2 Hz everywhere: the damping is the stiffness times 0.2 / (2 pi 2 Hz)."""
    text = ROD.replace("STRAINS", "bending_y: 3").replace("30 Pa s", "{loss_factor: 0.2, frequency: 2 Hz}")
    more = "  between: [{at: 0.3, young: 3 MPa}]\n  tip_young: 500 kPa\n"
    assert len(parse_robot(text + more).body.shear_viscosities) == 3
    robot = build(parse_robot(text + more + "  tip_damping: {loss_factor: 0.2, frequency: 2 Hz}\n"))
    soft = robot.tree.rods[0].things
    np.testing.assert_allclose(soft.damping, soft.stiffness * 0.2 / (4 * np.pi), rtol=1e-12, atol=1e-15)


EVEN = """
  tip_young: 1 MPa
  tip_density: 1100 kg/m3
  tip_damping: 30 Pa s
  between: [{at: 0.3, young: 1 MPa, damping: 30 Pa s}, {at: 0.7, density: 1100 kg/m3, radius: 3 mm}]
"""


def test_even_tables_are_the_rod_without_them_and_such_a_rod_has_single_numbers():
    plain, before = rod_of("")
    even, stations = rod_of(EVEN)
    for name in ("stiffness", "damping"):
        a, b = (np.asarray(getattr(one, name)) for one in (even, plain))
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-13 * np.abs(b).max())
    np.testing.assert_allclose(stations.inertia, before.inertia, rtol=1e-14)
    assert plain.young.shape == ()
    assert even.young.shape == (len(plain.nodes),)


PATHS = ("body.between.0.young", "body.between.0.density", "body.wall", "body.filling.density", "body.ribs.thickness")


def test_derivatives_by_numbers_of_a_section_are_those_of_finite_differences():
    """Of the compliance of the tip, the mass and the damping, in a random direction of all of them."""
    text = ROD.replace("STRAINS", "bending_y: 3") + (
        "  between: [{at: 0.4, young: 600 kPa, density: 1500 kg/m3}]\n  wall: 1 mm\n"
        "  filling: {density: 998 kg/m3}\n  ribs: {count: 5, thickness: 2 mm, radius: 6 mm}\n"
    )
    theta, of = bind(parse_robot(text), PATHS)

    @jax.jit
    def f(x):
        robot = of(x)
        soft = jax.tree.map(lambda y: y[0], robot.tree.rods[0].things)
        tip = jnp.ones(4)
        bent = tip @ jnp.linalg.solve(soft.stiffness, tip)
        return jnp.stack([bent, jnp.sum(robot.tree.stations.inertia[:, 3, 3]), soft.damping[0, 0]])

    way = theta * np.array([0.3, -0.5, 0.2, 0.7, 0.4])
    _, exact = jax.jvp(f, (theta,), (way,))
    h = 1e-5
    np.testing.assert_allclose(exact, (f(theta + h * way) - f(theta - h * way)) / (2 * h), rtol=1e-7)
    assert np.all(np.abs(exact) > 0)
