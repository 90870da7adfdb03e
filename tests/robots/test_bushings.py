"""Robots with bushings and contacts: loops of bodies, grips, and the account of what acts in them."""

import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import Status
from nectosome.core.programs.remember import remembered
from nectosome.description import apply_settings, parse_robot
from nectosome.mechanism import diagnose, load_names
from nectosome.model import build
from nectosome.solve import load_stepping, simulate

# ground 0.3 m, crank 0.1 m, coupler 0.25 m, rocker 0.2 m; the crank is held at 1.1 rad, the rocker is pulled
A, B, C, D, CRANK = 0.1, 0.25, 0.2, 0.3, 1.1
FOUR_BAR = f"""
name: four-bar linkage
water: {{gravity: 0 m/s2, density: 1e-6 kg/m3}}
body: {{kind: rigid, shape: point, mass: 1 kg, volume: 0 m3}}
limbs:
  crank:
    on: body
    kind: rigid
    shape: cylinder
    length: {A} m
    radius: 5 mm
    mass: 0.1 kg
    joint: {{kind: revolute, axis: [0, 0, 1], motion: {{kind: constant, value: {CRANK} rad}}}}
  coupler:
    on: crank
    kind: rigid
    shape: cylinder
    length: {B} m
    radius: 5 mm
    mass: 0.1 kg
    joint: {{kind: revolute, axis: [0, 0, 1], position: -0.6 rad, damping: 0.01 N m s/rad}}
  rocker:
    on: body
    offset: [{D} m, 0 m, 0 m]
    kind: rigid
    shape: cylinder
    length: {C} m
    radius: 5 mm
    mass: 0.1 kg
    joint: {{kind: revolute, axis: [0, 0, 1], position: 1.9 rad}}
    loads: {{pull: {{kind: force, force: [20 N, 0 N, 0 N], at: tip}}}}
pairs:
  pin: {{kind: bushing, between: [coupler, rocker], stiffness: 1e5 N/m, damping: 10 N s/m}}
"""


def closed(crank: float) -> float:
    """Angle of the rocker of an open four-bar linkage (Freudenstein 1954)."""
    k1, k2, k3 = D / A, D / C, (A**2 - B**2 + C**2 + D**2) / (2 * A * C)
    a = np.cos(crank) - k1 - k2 * np.cos(crank) + k3
    b, c = -2 * np.sin(crank), k1 - (k2 + 1) * np.cos(crank) + k3
    return float(2 * np.arctan2(-b - np.sqrt(b * b - 4 * a * c), 2 * a)) % (2 * np.pi)


def test_a_tie_closes_a_four_bar_linkage():
    """The rocker is where closed form says but for the bushing's stretch, which falls as one over its stiffness."""
    robot = parse_robot(FOUR_BAR)
    off = {}
    for stiffness in (1e4, 1e5, 1e6):
        stiff = build(apply_settings(robot, [f"pairs.pin.stiffness={stiffness} N/m"]))
        found = load_stepping(stiff)
        assert int(found.status) == Status.SOLVED
        d = remembered(diagnose, stiff, jnp.zeros(()), found.value)
        force = np.asarray(d.load_force[load_names(stiff).index("pin"), 3])
        off[stiffness] = found.value.q[1] - closed(CRANK)
        # the bushing carries the coupler's end: a force along the coupler, since nothing else acts on it
        ends = A * np.array([np.cos(CRANK), np.sin(CRANK)]), D * np.array([1, 0])
        angle = float(found.value.q[1])
        coupler = ends[1] + C * np.array([np.cos(angle), np.sin(angle)]) - ends[0]
        assert np.linalg.norm(force) > 1
        assert abs(np.cross(np.append(coupler, 0), force)[2]) < 2e-3 * np.linalg.norm(force) * B
    assert abs(off[1e4]) < 0.1
    assert off[1e5] / off[1e4] == pytest.approx(0.1, rel=0.05)
    assert off[1e6] / off[1e5] == pytest.approx(0.1, rel=0.005)


def test_a_linkage_with_a_driven_crank_goes_as_closed_form_says():
    turning = FOUR_BAR.replace(f"kind: constant, value: {CRANK} rad", "kind: rate, rate: 2 rad/s, start: 1.1 rad")
    robot = parse_robot(turning.replace("20 N, 0 N", "0 N, 0 N").replace("1e5", "1e6").replace("10 N s", "100 N s"))
    run = simulate(build(robot), 1.5, samples=31, rtol=1e-6)
    assert int(run.status) == Status.SOLVED
    data = run.to_dataset()
    rocker = data["q"].sel(coordinate="rocker.angle").values
    late = data["time"].values > 0.3
    expected = np.unwrap([closed(1.1 + 2 * t) for t in data["time"].values])
    np.testing.assert_allclose(rocker[late], expected[late], atol=2e-3)
    assert float(data["power_balance"].max()) < 1e-9
    assert "pin" in data["load"]
    np.testing.assert_allclose(data["load_force"].sel(load="pin").sum("part"), 0, atol=1e-9)


ROD = """
    on: body
    kind: rod
    section: circle
    length: 200 mm
    radius: 4 mm
    young: 1 MPa
    density: 1000 kg/m3
    strains: {bending_y: 2, bending_z: 2}
    points: 6
"""
CANTILEVERS = f"""
name: two cantilevers
water: {{gravity: 0 m/s2}}
body: {{kind: rigid, shape: point, mass: 1 kg}}
limbs:
  one: {ROD}
    loads: {{pull: {{kind: force, force: [0 N, 0.2 mN, 0 N]}}}}
  two: {ROD}
pairs:
  bond: {{kind: bushing, between: [one, two], stiffness: 1e3 N/m}}
"""


def test_two_cantilevers_whose_tips_are_tied_share_the_load():
    """Each bends by (F/2) L^3 / 3 E I: small, and the stretch of the bushing is smaller."""
    robot = build(parse_robot(CANTILEVERS))
    found = load_stepping(robot)
    assert int(found.status) == Status.SOLVED
    d = remembered(diagnose, robot, jnp.zeros(()), found.value)
    alone = 0.2e-3 * 0.2**3 / (3 * 1e6 * np.pi * 0.004**4 / 4)
    tips = [np.asarray(d.position[robot.tree.layout[i].stations][-1])[1] for i in (1, 2)]
    assert tips == pytest.approx([alone / 2] * 2, rel=1e-3)
    held = np.asarray(d.load_force[load_names(robot).index("bond")])
    assert held[2, 1] == pytest.approx(0.1e-3, rel=1e-3)
    np.testing.assert_allclose(held[1], -held[2], atol=1e-15)
