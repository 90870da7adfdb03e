"""Added mass of limbs behind which the flow across separates: Morison's force, and blades in a stream."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array
from scipy.integrate import solve_bvp

from nectosome.core import Stations, Strips, Water
from nectosome.core.se3 import exp_so3
from nectosome.description import parse_robot, with_values
from nectosome.loads import StripAddedMass
from nectosome.model import build
from nectosome.solve import simulate, static

RHO, G, CD, LENGTH, WIDTH, THICKNESS, SPEED = 1000.0, 9.80665, 1.95, 1.0, 0.05, 0.004, 0.4
BLADE = parse_robot(f"""
name: blade
water: {{density: {RHO} kg/m3, gravity: {G} m/s2, current: [{SPEED} m/s, 0 m/s, 0 m/s]}}
body:
  kind: rod
  section: rectangle
  width: {WIDTH} m
  height: {THICKNESS} m
  length: {LENGTH} m
  density: 900 kg/m3
  young: 1 MPa
  damping: 1 kPa s
  points: 40
  rotation: [0 deg, -90 deg, 0 deg]
  strains: {{bending_y: 8}}
  joint: {{kind: fixed}}
  loads:
    drag: {{kind: plate_drag, normal: {CD}}}
    water: {{kind: added_mass, normal: 1}}
""")


def blade(cauchy: float, buoyancy: float):
    """Ca = rho C_D b U^2 l^3 / 2 E I, B = (rho - rho_s) g b d l^3 / E I."""
    young = 6 * RHO * CD * SPEED**2 * LENGTH**3 / (cauchy * THICKNESS**3)
    lighter = buoyancy * young * THICKNESS**2 / (12 * G * LENGTH**3)
    return with_values(BLADE, {"body.young": young, "body.density": RHO - lighter})


def effective_length(cauchy: float, buoyancy: float) -> float:
    """Drag over that of an upright blade: theta'' = V sin theta - H cos theta, H' = -Ca cos^3 theta,
    V' = Ca cos^2 theta sin theta - B, with theta(0) = theta'(1) = H(1) = V(1) = 0 (Luhar and Nepf 2011, eq. 5)."""
    s, y = np.linspace(0, 1, 400), np.zeros((4, 400))
    for ca in np.geomspace(1, cauchy, 25):

        def slope(s: np.ndarray, y: np.ndarray, ca: float = ca) -> np.ndarray:
            sin, cos = np.sin(y[0]), np.cos(y[0])
            return np.stack([y[1], y[3] * sin - y[2] * cos, -ca * cos**3, ca * cos**2 * sin - buoyancy])

        found = solve_bvp(slope, lambda a, b: np.array([a[0], b[1], b[2], b[3]]), s, y, tol=1e-6, max_nodes=100_000)
        assert found.success
        s, y = found.x, found.y
    return y[2, 0] / cauchy


@pytest.mark.parametrize(
    ("cauchy", "buoyancy"), [(1, 0), (43.7, 172), (1092, 172), (10.9, 0.5), (273, 0.5), (4367, 0.5), (1e4, 172)]
)
def test_a_blade_bends_in_a_stream_as_its_equation_says(cauchy: float, buoyancy: float):
    """With the loads that the theory page advises for it; strips of attached flow miss this by up to 23 %."""
    found = static(blade(cauchy, buoyancy))
    drag = float(found.to_dataset().squeeze()["load_force"].sel(load="drag")[0])
    upright = 0.5 * RHO * CD * WIDTH * LENGTH * SPEED**2
    assert drag / upright == pytest.approx(effective_length(cauchy, buoyancy), rel=5e-4)


def moved(t: Array) -> tuple[Array, Array]:
    """Attitude and place of a strip that turns about changing axes and goes ahead and across."""
    turn = exp_so3(jnp.stack([0.3 * t, jnp.sin(2 * t), 0.5 - t**2]))
    return turn, jnp.stack([1.5 * t, jnp.cos(3 * t), 0.2 * t**3])


@jax.jit
def wrenches(t: Array) -> tuple[Array, Array]:
    """Kirchhoff's wrench of the added mass and that of the load on the strip; -A R^T p''."""
    load = StripAddedMass(jnp.asarray(0.9), jnp.asarray(0.1), separated=True)

    def twist(t: Array) -> tuple[Array, Array]:
        (R, _), (dR, v) = jax.jvp(moved, (t,), (jnp.ones(()),))
        spin = R.T @ dR
        return jnp.stack([spin[2, 1], spin[0, 2], spin[1, 0]]), R.T @ v

    (w, v), (_, dv) = jax.jvp(twist, (t,), (jnp.ones(()),))
    acceleration = moved(t)[0].T @ jax.jacfwd(jax.jacfwd(lambda t: moved(t)[1]))(t)
    one, water = jnp.ones(1), Water(jnp.asarray(RHO), jnp.asarray(0.0))
    own = Stations.along(one, one, jnp.array([[0.02, 0.03]]), one, jnp.zeros((1, 6, 6)))
    strip = Strips(
        **vars(own), rotation=jnp.eye(3)[None], position=jnp.zeros((1, 3)), angular_velocity=w[None], velocity=v[None]
    )
    A = load.inertia(strip, water)[0, 3:, 3:]
    own = load.force(t, strip, (), water)[0][0]
    kirchhoff = -jnp.concatenate([jnp.cross(v, A @ v), A @ dv + jnp.cross(w, A @ v)])
    return jnp.stack([own, kirchhoff]), -A @ acceleration


def test_what_is_carried_resists_accelerations_only():
    each, expected = wrenches(jnp.asarray(0.4))
    assert float(jnp.linalg.norm(each[0])) > 0.1
    np.testing.assert_allclose(each.sum(axis=0)[:3], 0.0, atol=1e-12)
    np.testing.assert_allclose(each.sum(axis=0)[3:], expected, rtol=1e-12)


ARM = f"""
name: arm
water: {{density: {RHO} kg/m3, gravity: 0 m/s2, current: [{SPEED} m/s, 0 m/s, 0 m/s]}}
body:
  kind: rigid
  shape: cylinder
  length: 0.3 m
  radius: 10 mm
  mass: 0.1 kg
  rotation: [0 deg, -90 deg, 0 deg]
  joint: {{kind: revolute, axis: y, stiffness: 0.1 N m/rad}}
  loads:
    drag: {{kind: drag, normal: 1.1}}
    added_mass: {{kind: WATER}}
"""


@pytest.mark.parametrize("kind", ["added_mass, normal: 1", "cylinder_added_mass"])
def test_an_arm_in_a_stream_turns_by_its_drag_alone(kind: str):
    """k theta = 1/4 rho C_D D L^2 U^2 cos theta; let go upright, its account closes on the way there.

    Its row is that of the water that is carried, of which the rest has no power here.
    """
    robot = build(parse_robot(ARM.replace("WATER", kind)))
    theta = 0.0
    for _ in range(100):
        theta = 0.25 * RHO * 1.1 * 0.02 * 0.3**2 * SPEED**2 * np.cos(theta) / 0.1
    assert float(static(robot).state.q[0]) == pytest.approx(theta, rel=1e-9)
    data = simulate(robot, 1.0, samples=21).to_dataset()
    assert float(data["power_balance"].max()) < 1e-9
    assert float(abs(data["load_power"].sel(load="added_mass")).max()) > 1e-3
