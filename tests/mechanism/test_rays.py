"""Fins of rays: thrust and yaw by resistive theory, what drag and added mass cannot give, and waves' added mass."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import jv

from nectosome.core.se3 import dot
from nectosome.description import parse_robot, with_values
from nectosome.loads import SheetAddedMass
from nectosome.mechanism.webs import waves_reach
from nectosome.model import build

# two fins below a hull that is held, one to each side; all made up
FINS = """
name: fins
water: {gravity: 0 m/s2}
body: {kind: rigid, shape: point, mass: 1 kg, joint: {kind: prismatic, axis: x}}
rays:
  FIN
aliases:
  left: rays.left.motion.waves
  right: rays.right.motion.waves
  A: [rays.left.motion.amplitude, rays.right.motion.amplitude]
"""
FIN = """SIDE:
    count: 13
    roots: [[0 mm, Y mm, 0 mm], [-200 mm, Y mm, 0 mm]]
    tips: [[0 mm, Y mm, -40 mm], [-200 mm, Y mm, -40 mm]]
    radius: 0.01 mm
    density: 1000 kg/m3
    motion: {amplitude: 25 deg, frequency: 2 Hz, waves: 1}
    web:
      {thickness: 0.1 mm, young: 1 Pa, density: 1000 kg/m3,
       loads: {drag: {kind: plate_drag, normal: 1.8, start_up: none}, water: {kind: sheet_added_mass}}}
  """
RAYS, LONG, HEIGHT, ARM, F, RHO, C = 13, 0.2, 0.04, 0.1, 2.0, 1000.0, 1.8
EACH = 24  # times in a period


def resistive(amplitude, waves, rays=RAYS):
    """Mean thrust of one fin by the velocity across itself, of straight gaps between rays."""
    x, w = np.polynomial.legendre.leggauss(6)
    r, w = 0.5 * HEIGHT * (x + 1)[:, None, None, None], 0.5 * HEIGHT * w
    omega, step, share = 2 * np.pi * F, LONG / (rays - 1), 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3)
    t, s = np.arange(EACH)[:, None] / EACH / F, np.arange(rays) / (rays - 1)
    angle = amplitude * np.sin(omega * t - 2 * np.pi * waves * s)
    turning = amplitude * omega * np.cos(omega * t - 2 * np.pi * waves * s)
    ray = np.stack([0 * angle, np.sin(angle), -np.cos(angle)], axis=-1)
    moving = turning[..., None] * np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=-1)
    total = 0.0
    for m in share:  # two strips across each gap
        ahead = r * np.diff(ray, axis=1) + np.array([-step, 0, 0])
        along = (1 - m) * ray[:, :-1] + m * ray[:, 1:]
        area = np.cross(ahead, np.broadcast_to(along, ahead.shape))  # per part of the gap and length of the rays
        across = np.sum(r * ((1 - m) * moving[:, :-1] + m * moving[:, 1:]) * area, axis=-1)
        push = -0.5 * RHO * C * np.abs(across) * across * area[..., 0] / np.sum(area**2, axis=-1)
        total += 0.5 * np.sum(w * np.mean(np.sum(push, axis=-1), axis=-1))
    return total


@pytest.fixture(scope="module")
def mean():
    """Mean force and moment about the world's origin of the water on both fins, held, by amplitude and waves."""
    sides = (FIN.replace("SIDE", name).replace("Y", y) for name, y in (("left", "100"), ("right", "-100")))
    described = parse_robot(FINS.replace("FIN", "".join(sides)))

    @eqx.filter_jit
    def averages(robot):
        def at(t):
            forces = robot.forces(t, robot.start, jnp.zeros(1))
            there, turned = (x[robot.tree.solid :] for x in (forces.shape.position, forces.shape.rotation))
            drags = zip(robot.load_groups.acting, forces.wrenches, strict=True)
            (wrench,) = (w for group, w in drags if "drag" in group.names)
            push = dot(turned, wrench[:, 3:])
            return jnp.concatenate([push.sum(axis=0), jnp.cross(there, push).sum(axis=0)])

        return jnp.mean(jax.vmap(at)(jnp.arange(EACH) / EACH / F), axis=0)

    def of(amplitude, left, right):
        return np.asarray(averages(build(with_values(described, {"A": amplitude, "left": left, "right": right}))))

    return of


@pytest.mark.slow
@pytest.mark.parametrize(("degrees", "waves"), [(25.0, 1.0), (25.0, -1.0), (25.0, 2.0), (50.0, 1.0), (10.0, 0.5)])
def test_thrust_is_that_of_resistive_theory_against_the_waves(mean, degrees, waves):
    """Nothing heaves, and nothing goes sideways."""
    amplitude = np.radians(degrees)
    expected = 2 * resistive(amplitude, waves)
    found = mean(amplitude, waves, waves)
    assert np.sign(expected) == np.sign(waves)
    assert found[0] == pytest.approx(expected, rel=1e-2)
    np.testing.assert_allclose(found[[1, 2, 5]], 0, atol=1e-6)


@pytest.mark.slow
def test_waves_that_run_against_each_other_on_two_sides_only_yaw(mean):
    found = mean(0.4, 1.0, -1.0)
    assert found[5] == pytest.approx(-2 * ARM * resistive(0.4, 1.0), rel=1e-2)
    np.testing.assert_allclose(found[:3], 0, atol=1e-6)


@pytest.mark.slow
def test_rays_that_swing_together_give_no_thrust(mean):
    np.testing.assert_allclose(mean(0.4, 1e-9, 1e-9), 0, atol=1e-9)


def test_many_rays_have_the_thrust_of_a_smooth_fin():
    r"""With the angle $\theta(s, t)$ of the ray at s, and r from its root:

    $$ T = \tfrac12 \rho C \iint \frac{r^3 |\dot\theta| \dot\theta\, \theta'}{1 + r^2 \theta'^2}\, dr\, ds $$

    It grows with the third power of small amplitudes.
    """
    phase, (x, w) = 2 * np.pi * (np.arange(400) + 0.5) / 400, np.polynomial.legendre.leggauss(20)
    r, w, omega, k = 0.5 * HEIGHT * (x[:, None] + 1), 0.5 * HEIGHT * w, 2 * np.pi * F, 4 * np.pi / LONG
    turning, slope = 0.6 * omega * np.cos(phase), 0.6 * k * np.cos(phase)
    line = np.mean(r**3 * np.abs(turning) * turning * slope / (1 + (r * slope) ** 2), axis=1)
    assert resistive(0.6, 2.0, 401) == pytest.approx(0.5 * RHO * C * LONG * np.sum(w * line), rel=1e-3)
    assert resistive(0.02, 2.0) / resistive(0.01, 2.0) == pytest.approx(8, rel=1e-2)


def strip_mass(kb):
    """Added mass per length over rho b^2 of a strip of the half width b in waves of wave number k: 8 functions.

    The potential is a sum of sqrt(1 - y^2) U_2n(y), whose transforms are Bessel functions.
    """
    q = np.concatenate([np.linspace(1e-6, 60, 20001), np.linspace(60.01, 1500, 100000)])
    order = np.arange(8)
    phi = np.pi * ((-1.0) ** order * (2 * order + 1))[:, None] * jv(2 * order[:, None] + 1, q) / q
    rest = np.outer(2 * order + 1, 2 * order + 1) / q[-1]  # of the integral, beyond
    stiff = np.trapezoid(phi[:, None] * phi[None] * np.sqrt(q**2 + kb**2), q) / np.pi + rest
    return np.pi * np.linalg.solve(stiff, np.pi / 2 * (order == 0))[0]


@pytest.mark.parametrize("kb", [0.03, 0.3, 1.0, 3.0, 10.0])
def test_waves_along_a_strip_carry_the_water_of_potential_flow(kb):
    """Within 3 % of 2 rho c over the strip, with c the root of the distances to its edges where it moves as one."""
    y = (np.arange(4000) + 0.5) / 4000
    reach = waves_reach(jnp.sqrt(1 - y**2), jnp.asarray(2 * np.pi / kb))
    assert 4 * float(jnp.mean(reach)) == pytest.approx(strip_mass(kb), rel=0.03)
    assert strip_mass(1e-3) == pytest.approx(np.pi, rel=1e-3)  # moves as one


def test_a_web_between_limbs_of_unlike_lengths_carries_water_between_that_of_its_rectangles():
    bar = "{kind: rigid, shape: cylinder, length: LENGTH, radius: 1 mm, density: 1 g/cm3, offset: [0 m, Y, 0 m]}"
    short, long = (bar.replace("Y", y).replace("LENGTH", x) for y, x in (("0 m", "SHORT mm"), ("8 cm", "LONG mm")))
    text = f"""
    name: sheet
    body: {{kind: rigid, shape: point, mass: 1 kg, joint: {{kind: prismatic, axis: z}}}}
    limbs: {{short: {short}, long: {long}}}
    webs:
      sheet:
        {{between: [short, long], thickness: 1 mm, young: 1 MPa, density: 1000 kg/m3,
         loads: {{water: {{kind: sheet_added_mass}}}}}}
    """

    def carried(a, b):
        """Water of all strips [m3]."""
        robot = build(parse_robot(text.replace("SHORT", a).replace("LONG", b)))
        every = jax.tree.leaves(robot, is_leaf=lambda x: isinstance(x, SheetAddedMass))
        return next(float(x.carried.sum()) for x in every if isinstance(x, SheetAddedMass))

    assert carried("60", "60") < carried("60", "140") < carried("140", "140")
