"""Inertia of rigid links against numerical quadrature over their volume."""

import numpy as np
import pytest

DENSITY, L = 1100.0, 0.2
RIGID = f"""
name: link
water: {{gravity: 0 m/s2}}
body:
  kind: rigid
  density: {DENSITY} kg/m3
  length: {L} m
"""
_x, _w = np.polynomial.legendre.leggauss(24)
S, WS = 0.5 * (_x + 1), 0.5 * _w
ANGLE = np.arange(32) * np.pi / 16


def discs(radius):
    """Points [n, 3] and volumes of a body of revolution along x, its centre at 0; `radius` of fractions."""
    s, r, a = np.meshgrid(S, S, ANGLE, indexing="ij")
    R = radius(s)
    points = np.stack([L * (s - 0.5), R * r * np.cos(a), R * r * np.sin(a)], axis=-1)
    volume = L * WS[:, None, None] * (WS * S)[None, :, None] * R**2 * (np.pi / 16)
    return points.reshape(-1, 3), volume.ravel()


def inertia(points, mass):
    """Spatial inertia [6, 6] about the origin."""
    c = np.cross(np.eye(3)[None], points[:, None, :])
    first, second = np.einsum("n,nij->ij", mass, c), -np.einsum("n,nij,njk->ik", mass, c, c)
    return np.block([[second, first], [-first, mass.sum() * np.eye(3)]])


def test_cylinder(described):
    robot = described(RIGID + "  shape: cylinder\n  radius: 30 mm")
    points, volume = discs(lambda s: 0.03 + 0 * s)
    np.testing.assert_allclose(robot.inertia[0], inertia(points, DENSITY * volume), atol=1e-15, rtol=1e-12)
    assert float(robot.weight()[0]) == pytest.approx(DENSITY * np.pi * 0.03**2 * L, rel=1e-14)


def test_spheroid(described):
    robot = described(RIGID + "  shape: spheroid\n  radius: 30 mm")
    points, volume = discs(lambda s: 0.03 * np.sqrt(4 * s * (1 - s)))
    np.testing.assert_allclose(robot.inertia[0], inertia(points, DENSITY * volume), atol=1e-15, rtol=1e-12)
    assert float(robot.tree.stations.volume[0]) == pytest.approx(volume.sum(), rel=1e-12)


def test_box_with_its_centre_of_mass_elsewhere(described):
    robot = described(RIGID + "  shape: box\n  width: 0.1 m\n  height: 50 mm\n  centre_of_mass: [10 mm, -20 mm, 5 mm]")
    x, y, z = np.meshgrid(L * (S - 0.5), 0.1 * (S - 0.5), 0.05 * (S - 0.5), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=-1) + np.array([0.01, -0.02, 0.005])
    volume = L * 0.1 * 0.05 * np.einsum("i,j,k->ijk", WS, WS, WS).ravel()
    np.testing.assert_allclose(robot.inertia[0], inertia(points, DENSITY * volume), atol=1e-15, rtol=1e-12)


@pytest.mark.parametrize("bend", [42.3, 200.0])
def test_bent_cylinder_of_thin_discs(described, bend):
    """Discs of equal mass set along an arc about y: about the pose of the arc's middle, where station 0 sits."""
    robot = described(RIGID + f"  shape: cylinder\n  radius: 30 mm\n  bend: {bend} deg")
    b = np.deg2rad(bend)
    straight, volume = discs(lambda s: 0.03 + 0 * s)
    s = straight[:, 0] / L + 0.5
    normal = np.stack([np.sin(b * s), 0 * s, np.cos(b * s)], axis=-1)
    place = L / b * np.stack([np.sin(b * s), 0 * s, np.cos(b * s) - 1], axis=-1)
    points = place + straight[:, 1:2] * [0, 1, 0] + straight[:, 2:] * normal
    c = np.array([np.cos(b / 2), np.sin(b / 2)])
    middle = np.array([[c[0], 0, c[1]], [0, 1, 0], [-c[1], 0, c[0]]])
    points = (points - L / b * np.array([c[1], 0, c[0] - 1])) @ middle
    np.testing.assert_allclose(robot.inertia[0], inertia(points, DENSITY * volume), atol=1e-14, rtol=1e-9)
    body = robot.tree.parts[0].body
    np.testing.assert_allclose(body.tip_position, L / b * np.array([np.sin(b), 0, np.cos(b) - 1]), atol=1e-15)
    np.testing.assert_allclose(body.tip_rotation[:, 0], [np.cos(b), 0, -np.sin(b)], atol=1e-14)


def test_what_is_given_comes_before_the_shape(described):
    given = (
        "  shape: cylinder\n  radius: 30 mm\n  inertia: [1 g m2, 2 g m2, 2.5 g m2]\n  centre_of_mass: [50 mm, 0 m, 0 m]"
    )
    robot = described(RIGID.replace(f"density: {DENSITY} kg/m3", "mass: 2 kg") + given)
    steiner = 2 * 0.05**2 * np.diag([0, 1, 1])
    np.testing.assert_allclose(robot.inertia[0, :3, :3], np.diag([1e-3, 2e-3, 2.5e-3]) + steiner, atol=1e-15)
    assert float(robot.weight()[0]) == 2


def test_strips_share_the_length_and_the_volume(described):
    strips = "  shape: spheroid\n  radius: 30 mm\n  strips: 7\n"
    load = "  loads: {f: {kind: distributed_force, force: [0 N/m, 0 N/m, 1 N/m]}}"
    part = described(RIGID + strips + load).tree.one(0)
    body, link = part.stations, part.body
    assert float(body.weight.sum()) == pytest.approx(L, rel=1e-14)
    assert float(body.volume.sum()) == pytest.approx(4 / 3 * np.pi * 0.5 * L * 0.03**2, rel=1e-14)
    assert float(body.weight[0]) == float(body.volume[0]) == 0
    np.testing.assert_allclose(link.position[:, 0], body.x, atol=1e-16)
