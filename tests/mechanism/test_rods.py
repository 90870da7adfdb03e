"""Soft rods: shapes, order of the Magnus expansion, strains at rest, marks, stiffness, size of the graph."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.core.se3 import exp_se3
from nectosome.description import STRAIN_NAMES
from nectosome.mechanism import make_rod
from nectosome.mechanism.rod_matter import Layer, Matter
from nectosome.mechanism.rods import SoftRod
from nectosome.mechanism.sections import ellipse, rectangle

LENGTH = 0.8


def with_stations(orders, points=5, rest=None, marks=(), radius=(0.02, 0.02), density=1000.0, young=1e6, poisson=0.3):
    numbers = [jnp.asarray(x) for x in (LENGTH, young, poisson, density, 100.0, *radius)]
    rest = {name: jnp.asarray(c) for name, c in (rest or {}).items()}

    @jax.jit
    def make(numbers, rest):
        length, *material, root, tip = numbers
        return make_rod(length, solid(ellipse, (root, tip), (root, tip), *material), orders, {}, rest, points, marks)

    return make(numbers, rest)


def solid(shape, y, z, young, poisson, density, viscosity):
    """Of half axes that go over evenly from the root to the tip."""

    def matter(s):
        sections = shape(*(first + (last - first) * jnp.asarray(s) for first, last in (y, z)))
        layer = Layer(sections, young, poisson, density, viscosity, sections.shear_factor(poisson))
        return Matter(sections, (layer,), None)

    return matter


def rod(*args, **kwargs):
    return with_stations(*args, **kwargs)[0]


shape = jax.jit(SoftRod.shape)
WAVY = {"torsion": 2, "bending_y": 2, "bending_z": 1, "extension": 1, "shear_y": 0}
WAVY_Q = jnp.array([1.0, -0.5, 0.8, 2.0, 1.5, -0.7, -1.0, 0.6, 0.1, 0.05, -0.1])


def test_the_pose_converges_with_the_fourth_power_of_the_number_of_intervals():
    ends = [shape(rod(WAVY, points=n), WAVY_Q) for n in (7, 15, 31, 80)]
    tips = [np.concatenate([s.position[-1], s.rotation[-1].ravel()]) for s in ends]
    errors = [np.linalg.norm(tip - tips[-1]) for tip in tips[:-1]]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all(orders > 3.75), (errors, orders)


def test_rotations_stay_orthogonal():
    R = shape(rod(WAVY), WAVY_Q).rotation
    np.testing.assert_allclose(R @ jnp.swapaxes(R, 1, 2), np.broadcast_to(np.eye(3), R.shape), atol=1e-14)


@pytest.mark.parametrize("strain", ["bending_y", "bending_z"])
def test_a_moment_of_2_pi_EI_over_L_closes_the_circle(strain):
    """Constant curvature 2 pi / L: the tip comes back to the root, the far side is a diameter L / pi away."""
    soft = rod({strain: 0}, points=9)
    s = shape(soft, jnp.array([2 * jnp.pi]))
    np.testing.assert_allclose(s.position[-1], np.zeros(3), atol=1e-15)
    np.testing.assert_allclose(s.rotation[-1], np.eye(3), atol=1e-14)
    middle = s.position[soft.nodes.index(0.5)]
    assert float(jnp.linalg.norm(middle)) == pytest.approx(LENGTH / np.pi, rel=1e-14)
    # turning about +y bends the axis towards -z, about +z towards +y
    assert float(middle[2 if strain == "bending_y" else 1]) * (-1 if strain == "bending_y" else 1) > 0
    EI = 1e6 * np.pi / 4 * 0.02**4
    assert float(soft.stiffness[0, 0] * 2 * jnp.pi) == pytest.approx(2 * np.pi * EI / LENGTH, rel=1e-13)


@given(st.lists(st.floats(-4, 4), min_size=6, max_size=6).map(np.array))
def test_constant_strains_give_a_screw(q):
    """All six strains constant: g(X) = exp(X xi), whatever the number of points."""
    s = shape(ALL_CONSTANT, q * np.array([1, 1, 1, 0.2, 0.2, 0.2]))
    xi = np.array([*q[:3], LENGTH * (1 + 0.2 * q[3]), *(LENGTH * 0.2 * q[4:])])
    for node, R, p in zip(ALL_CONSTANT.nodes, s.rotation, s.position, strict=True):
        wanted = exp(node * xi)
        np.testing.assert_allclose(R, wanted[0], atol=1e-13)
        np.testing.assert_allclose(p, wanted[1], atol=1e-13)


ALL_CONSTANT = rod(dict.fromkeys(STRAIN_NAMES, 0), points=3)
exp = jax.jit(exp_se3)


@pytest.mark.parametrize("strain", STRAIN_NAMES)
@pytest.mark.parametrize("order", [0, 2])
def test_every_strain_has_its_coordinates_and_stiffness(strain, order):
    """Legendre polynomials are orthogonal: int Phi^T E J Phi dX = E J / L / (2 i + 1), and E A L / (2 i + 1)."""
    r, nu, E = 0.02, 0.3, 1e6
    soft = rod({strain: order})
    assert soft.names == tuple(f"{strain}.{i}" for i in range(order + 1))
    G, k = E / (2 * (1 + nu)), 6 * (1 + nu) / (7 + 6 * nu)
    J, A = np.pi / 4 * r**4, np.pi * r**2
    material = dict(zip(STRAIN_NAMES, [(G, 2 * J), (E, J), (E, J), (E, A), (k * G, A), (k * G, A)], strict=True))
    modulus, geometry = material[strain]
    scale = 1 / LENGTH if strain in STRAIN_NAMES[:3] else LENGTH
    share = np.diag(1 / (2 * np.arange(order + 1) + 1.0)) * geometry * scale
    np.testing.assert_allclose(soft.stiffness, modulus * share, rtol=1e-12, atol=1e-12)
    viscosity = {"torsion": 100.0, "shear_y": k * 100, "shear_z": k * 100}.get(strain, 300.0)
    np.testing.assert_allclose(soft.damping, viscosity * share, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("bends", "shears", "axis"), [("bending_y", "shear_z", 2), ("bending_z", "shear_y", 1)])
@pytest.mark.parametrize("section", ["circle", "ellipse", "rectangle"])
def test_a_short_cantilever_bends_and_shears_as_timoshenkos(section, bends, shears, axis):
    """Tip compliance L^3/(3 E I) + L/(k G A) in both planes, with Cowper's k of circles and of rectangles."""
    E, nu, L, (a, b) = 1e6, 0.3, 0.05, (0.02, 0.02) if section == "circle" else (0.02, 0.012)
    of, orders = rectangle if section == "rectangle" else ellipse, {bends: 1, shears: 0}
    matter = solid(of, (a, a), (b, b), *map(jnp.asarray, (E, nu, 1e3, 0.0)))
    soft = make_rod(jnp.asarray(L), matter, orders, {}, {}, 5, ())[0]
    tip = jax.jacfwd(lambda q: shape(soft, q).position[-1, axis])(jnp.zeros(3))
    compliance = float(tip @ jnp.linalg.solve(soft.stiffness, tip))
    across, along = (a, b) if axis == 2 else (b, a)
    if section == "rectangle":
        A, I, k = 4 * a * b, 4 / 3 * across * along**3, 10 * (1 + nu) / (12 + 11 * nu)
    else:
        A, I, k = np.pi * a * b, np.pi / 4 * across * along**3, 6 * (1 + nu) / (7 + 6 * nu)
    shear = L * 2 * (1 + nu) / (k * E * A)
    assert compliance == pytest.approx(L**3 / (3 * E * I) + shear, rel=1e-12)
    assert shear > 0.05 * compliance


def test_stiffness_and_mass_of_a_tapered_rod():
    """r = r0 (1 - s/2): int r^4 = r0^4 31/80, int r^2 = r0^2 7/12; exact for few points."""
    soft, stations = with_stations({"bending_y": 0}, points=2, radius=(0.02, 0.01))
    assert float(soft.stiffness[0, 0]) == pytest.approx(1e6 * np.pi / 4 * 0.02**4 * 31 / 80 / LENGTH, rel=1e-13)
    mass, volume = float(jnp.sum(stations.inertia[:, 3, 3])), float(jnp.sum(stations.volume))
    assert mass == pytest.approx(1000 * np.pi * 0.02**2 * LENGTH * 7 / 12, rel=1e-13)
    assert volume == pytest.approx(mass / 1000, rel=1e-13)


def test_a_rod_curved_at_rest_is_a_straight_one_bent_as_much():
    orders = {"torsion": 0, "bending_y": 1, "bending_z": 0}
    coefficients = {"torsion": [0.5], "bending_y": [2.0, -1.5], "bending_z": [1.0]}
    q = LENGTH * jnp.array([0.5, 2.0, -1.5, 1.0])
    curved, straight = shape(rod(orders, rest=coefficients), jnp.zeros(4)), shape(rod(orders), q)
    np.testing.assert_allclose(curved.position, straight.position, atol=1e-15)
    np.testing.assert_allclose(curved.rotation, straight.rotation, atol=1e-15)
    stretched = shape(rod({"bending_y": 0}, rest={"extension": [0.1]}), jnp.zeros(1))
    np.testing.assert_allclose(stretched.position[-1], [1.1 * LENGTH, 0, 0], atol=1e-15)


def test_marks_are_places_without_mass():
    marks = (0.37, 0.6, 0.9)
    (marked, stations), (plain, others) = with_stations({"bending_z": 0}, marks=marks), with_stations({"bending_z": 0})
    s = shape(marked, jnp.array([2.0]))
    for mark in marks:
        i = marked.nodes.index(mark)
        np.testing.assert_allclose(s.position[i], exp(mark * jnp.array([0, 0, 2.0, LENGTH, 0, 0]))[1], atol=1e-15)
        assert float(stations.weight[i]) == 0
        assert float(stations.x[i]) == pytest.approx(mark * LENGTH)
    assert len(marked.nodes) == len(plain.nodes) + len(marks)
    np.testing.assert_allclose(jnp.sum(stations.inertia, axis=0), jnp.sum(others.inertia, axis=0), rtol=1e-14)
    np.testing.assert_allclose(jnp.sum(stations.weight), LENGTH, rtol=1e-14)


@pytest.mark.parametrize("ratio", [1.0, 2.0, 5.0, 20.0])
def test_torsion_constant_of_a_rectangle(ratio):
    """Saint-Venant's series, which Roark's formula fits to 0.2 %."""
    a, b = 0.01 * ratio, 0.01
    n = np.arange(1, 60, 2)
    series = a * b**3 * (16 / 3 - 1024 / np.pi**5 * b / a * np.sum(np.tanh(n * np.pi * a / (2 * b)) / n**5))
    for y, z in ((a, b), (b, a)):
        section = rectangle(jnp.array([y]), jnp.array([z]))
        assert float(section.torsion_constant[0]) == pytest.approx(series, rel=2e-3)


def test_sections_by_integration():
    """Area and second moments of ellipse and rectangle, summed over a fine polar or square grid."""
    a, b = 0.03, 0.01
    x, w = np.polynomial.legendre.leggauss(8)
    y, z, dA = (m.ravel() for m in [*np.meshgrid(a * x, b * x), np.outer(b * w, a * w)])
    check_section(rectangle(jnp.array([a]), jnp.array([b])), y, z, dA)
    r, angle = 0.5 * (x + 1), np.arange(16) * np.pi / 8
    y, z = (a * np.outer(r, np.cos(angle))).ravel(), (b * np.outer(r, np.sin(angle))).ravel()
    dA = np.outer(0.5 * w * r * a * b, np.full(16, np.pi / 8)).ravel()
    section = ellipse(jnp.array([a]), jnp.array([b]))
    check_section(section, y, z, dA)
    assert float(ellipse(jnp.array([a]), jnp.array([a])).torsion_constant[0]) == pytest.approx(np.pi / 2 * a**4)


def check_section(section, y, z, dA):
    assert float(section.area[0]) == pytest.approx(dA.sum(), rel=1e-12)
    assert float(section.second_moment_y[0]) == pytest.approx((z**2 * dA).sum(), rel=1e-12)
    assert float(section.second_moment_z[0]) == pytest.approx((y**2 * dA).sum(), rel=1e-12)
    assert float(section.polar_moment[0]) == pytest.approx(((y**2 + z**2) * dA).sum(), rel=1e-12)
