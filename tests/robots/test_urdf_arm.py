"""An arm from a URDF file against its own Lagrange equations, from a reader that shares nothing with the importer.

Slanted axes, turned frames, products of inertia, a slide, and a fixed link between. All derivatives are complex steps.
"""

from pathlib import Path
from xml.etree import ElementTree

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import State
from nectosome.description import import_urdf, parse_robot
from nectosome.mechanism.diagnose import energies
from nectosome.model import build

ARM = Path(__file__).with_name("arm.urdf")
GRAVITY, WATER = 9.80665, 1000.0
VOLUMES = {  # of the shapes that count: the collision shapes, or the visual ones of a link without
    "Base-Link": [0.3 * 0.2 * 0.1],
    "upper": [np.pi * 0.03**2 * 0.2, 4 / 3 * np.pi * 0.04**3],
    "hand": [0.1 * 0.04 * 0.02],
}
POSES = [(0.0, 0.0, 0.0), (0.7, 0.05, -1.1), (-2.3, -0.2, 2.9)]
RATES = [(0.0, 0.0, 0.0), (1.3, -0.4, 2.1), (-0.6, 0.9, -3.2)]


class Reference:
    """M(q) and V(q) of the arm, analytic in q, so that q may be complex."""

    def __init__(self, path):
        root = ElementTree.parse(path).getroot()
        self.links = {link.get("name"): link for link in root.findall("link")}
        self.joints = {joint.find("child").get("link"): joint for joint in root.findall("joint")}
        self.moving = [j for j in self.joints.values() if j.get("type") != "fixed"]
        dynamics = [{} if (own := j.find("dynamics")) is None else own.attrib for j in self.moving]
        self.damping = np.diag([float(own.get("damping", 0)) for own in dynamics])
        self.friction = np.array([float(own.get("friction", 0)) for own in dynamics])  # of hinges

    def pose(self, link, q):
        """Rotation and place of a link in the world, and (axis, place, kind) of the joints above it."""
        if link not in self.joints:
            return np.eye(3), np.zeros(3), {}
        joint = self.joints[link]
        R, p, above = self.pose(joint.find("parent").get("link"), q)
        R0, p0 = origin(joint)
        R, p = R @ R0, p + R @ p0
        if joint.get("type") == "fixed":
            return R, p, above
        axis = np.array([1.0, 0.0, 0.0]) if joint.find("axis") is None else row(joint.find("axis").get("xyz"))
        axis = axis / np.linalg.norm(axis)
        k = self.moving.index(joint)
        above = {**above, k: (R @ axis, p, joint.get("type"))}
        if joint.get("type") == "prismatic":
            return R, p + R @ axis * q[k], above
        K = np.cross(np.eye(3), axis)  # K v = axis x v
        return R @ (np.eye(3) + np.sin(q[k]) * K + (1 - np.cos(q[k])) * K @ K), p, above

    def mass(self, q):
        M = np.zeros((len(q), len(q)), dtype=np.asarray(q).dtype)
        for name, link in self.links.items():
            if link.find("inertial") is None:
                continue
            m, centre, inertia = inertial(link)
            R, p, above = self.pose(name, q)
            c = p + R @ centre
            Jv, Jw = np.zeros((2, 3, len(q)), dtype=M.dtype)
            for k, (axis, place, kind) in above.items():
                Jv[:, k] = axis if kind == "prismatic" else np.cross(axis, c - place)
                Jw[:, k] = 0 if kind == "prismatic" else axis
            M += m * Jv.T @ Jv + Jw.T @ R @ inertia @ R.T @ Jw
        return M

    def potential(self, q):
        """Weight, and the water that the shapes displace."""
        V = 0.0
        for name, link in self.links.items():
            R, p, _ = self.pose(name, q)
            if link.find("inertial") is not None:
                m, centre, _ = inertial(link)
                V = V + m * GRAVITY * (p + R @ centre)[2]
            shapes = link.findall("collision") or link.findall("visual")
            for shape, volume in zip(shapes, VOLUMES.get(name, []), strict=True):
                V = V - WATER * volume * GRAVITY * (p + R @ origin(shape)[1])[2]
        return V

    def slope(self, f, q):
        """df/dq, the direction first."""
        return np.array([np.imag(f(q + 1e-30j * e)) / 1e-30 for e in np.eye(len(q))])

    def acceleration(self, q, v):
        dM = self.slope(self.mass, q)
        bias = np.einsum("kij,k,j->i", dM, v, v) - 0.5 * np.einsum("kij,i,j->k", dM, v, v)
        y = 0.01 * v / np.radians(0.1)  # dry friction that nothing has loaded yet: half of it damps
        dry = 0.5 * self.friction * y / np.sqrt(1 + y**2)
        return np.linalg.solve(self.mass(q), -bias - self.slope(self.potential, q) - self.damping @ v - dry)


def row(text):
    return np.array(text.split(), dtype=float)


def origin(element):
    """Rotation about the fixed axes x, y, z in turn, and place."""
    found = element.find("origin")
    if found is None:
        return np.eye(3), np.zeros(3)
    r, p, y = row(found.get("rpy", "0 0 0"))
    X = np.array([[1, 0, 0], [0, np.cos(r), -np.sin(r)], [0, np.sin(r), np.cos(r)]])
    Y = np.array([[np.cos(p), 0, np.sin(p)], [0, 1, 0], [-np.sin(p), 0, np.cos(p)]])
    Z = np.array([[np.cos(y), -np.sin(y), 0], [np.sin(y), np.cos(y), 0], [0, 0, 1]])
    return Z @ Y @ X, row(found.get("xyz", "0 0 0"))


def inertial(link):
    element = link.find("inertial")
    R, centre = origin(element)
    i = {key: float(value) for key, value in element.find("inertia").attrib.items()}
    own = [[i["ixx"], i["ixy"], i["ixz"]], [i["ixy"], i["iyy"], i["iyz"]], [i["ixz"], i["iyz"], i["izz"]]]
    return float(element.find("mass").get("value")), centre, R @ np.array(own) @ R.T


@pytest.fixture(scope="module")
def reference():
    return Reference(ARM)


@pytest.fixture(scope="module")
def imported():
    """Mass matrix, bias, accelerations and kinetic energy of the robot in the text that is written."""
    robot = build(parse_robot(import_urdf(ARM).text))

    @eqx.filter_jit
    def at(q, v):
        x = State(q, v, robot.initial().z)
        M, h = robot.mass_bias(jnp.zeros(()), x)
        return M, h, robot.rates(jnp.zeros(()), x).v, energies(robot, jnp.zeros(()), x)[:, 0].sum()

    return lambda q, v: [np.asarray(value) for value in at(jnp.asarray(q), jnp.asarray(v))]


@pytest.mark.parametrize("q", POSES)
def test_mass_matrix_and_gravity_torques(imported, reference, q):
    M, h, _, _ = imported(q, (0.0, 0.0, 0.0))
    np.testing.assert_allclose(M, reference.mass(np.array(q)), rtol=0, atol=1e-12)
    np.testing.assert_allclose(h, reference.slope(reference.potential, np.array(q)), rtol=0, atol=1e-10)


@pytest.mark.parametrize(("q", "v"), [*zip(POSES, RATES, strict=True)])
def test_kinetic_energy_and_accelerations(imported, reference, q, v):
    _, _, a, kinetic = imported(q, v)
    q, v = np.array(q), np.array(v)
    assert kinetic == pytest.approx(0.5 * v @ reference.mass(q) @ v, rel=1e-10, abs=1e-14)
    np.testing.assert_allclose(a, reference.acceleration(q, v), rtol=1e-9, atol=1e-9)


def test_products_of_inertia_matter_here(reference, imported):
    """A reader that dropped them would be off by far more than the tolerances above."""
    robot = import_urdf(ARM).description
    bare = {name: limb.model_copy(update={"products": None}) for name, limb in robot.limbs.items()}
    without = build(robot.model_copy(update={"limbs": bare}))
    x = without.initial()
    M, _ = eqx.filter_jit(without.mass_bias)(jnp.zeros(()), x)
    assert np.max(np.abs(np.asarray(M) - reference.mass(np.zeros(3)))) > 1e-4
