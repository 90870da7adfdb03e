"""Steady motions against closed forms, blade-element theory and the dynamics; derivatives; honest ways to fail."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import fsolve

from nectosome.core import Sine, State, Status
from nectosome.description import parse_robot
from nectosome.mechanism import make_robot
from nectosome.model import bind, build
from nectosome.robots import describe
from nectosome.solve import equilibrium, find_symmetry, regime_of, simulate, steady
from nectosome.units import InputError

RHO, G = 1000.0, 9.80665

SINKER = """
name: sinker
body:
  kind: rigid
  shape: cylinder
  length: 60 mm
  radius: 20 mm
  mass: 0.15 kg
  joint: {kind: prismatic, axis: z}
  loads:
    drag: {kind: lumped_drag, drag_area: [0 m2, 0 m2, 1.2e-3 m2]}
    water: {kind: given_added_mass, mass: [0 kg, 0 kg, 0.05 kg]}
"""
FALLER = """
name: faller
body:
  kind: rigid
  shape: cylinder
  length: 200 mm
  radius: 10 mm
  density: 1500 kg/m3
  joint: {kind: free}
  loads: {drag: {kind: drag, normal: 1.1, tangential: 0.01}, water: {kind: added_mass, normal: 1.0}}
"""
TOWED = """
name: towed
body:
  kind: rigid
  shape: box
  length: 50 mm
  width: 50 mm
  height: 50 mm
  mass: 1 kg
  joint: {kind: prismatic, axis: x, motion: {kind: rate, rate: 0.4 m/s}}
limbs:
  rod:
    on: body
    kind: rigid
    shape: cylinder
    length: 0.5 m
    radius: 5 mm
    density: 3000 kg/m3
    strips: 8
    rotation: [0 deg, 90 deg, 0 deg] # hangs down
    joint: {kind: revolute, axis: y}
    loads: {drag: {kind: drag, normal: 1.2, tangential: 0}}
"""
ROTOR = """
name: rotor
body:
  kind: rigid
  shape: cylinder
  length: 20 mm
  radius: 10 mm
  mass: 0.2 kg
  joint: {kind: prismatic, axis: z}
limbs:
  hub:
    on: body
    kind: rigid
    shape: cylinder
    length: 10 mm
    radius: 5 mm
    mass: 0.01 kg
    joint: {kind: revolute, axis: z}
"""
BLADE = """
  NAME:
    on: hub
    at: root
    kind: rod # as good as rigid
    section: rectangle
    length: 200 mm
    width: 40 mm
    height: 1 mm
    young: 1e6 GPa
    density: 1200 kg/m3
    strains: {bending_y: 0}
    points: 12
    rotation: [25 deg, 0 deg, TURN]
    joint: {kind: fixed}
    loads: {drag: {kind: drag, normal: 1.2, tangential: 0}}
"""
ROTOR += "".join(BLADE.replace("NAME", name).replace("TURN", turn) for name, turn in (("a", "0 deg"), ("b", "180 deg")))


@pytest.fixture(scope="module")
def flagellum():
    return build(describe("flagellum"))


@pytest.fixture(scope="module")
def swimming(flagellum):
    return steady(flagellum)


def test_a_sinking_body_reaches_the_speed_where_drag_carries_its_weight():
    """(m - rho V) g = rho A V^2 / 2, and a disturbance decays at rho A V / (m + m_a)."""
    found = steady(build(parse_robot(SINKER)))
    weight = (0.15 - RHO * np.pi * 0.02**2 * 0.06) * G
    speed = np.sqrt(2 * weight / (RHO * 1.2e-3))
    assert int(found.status) == Status.SOLVED
    assert float(found.state.v[0]) == pytest.approx(-speed, rel=1e-12)
    np.testing.assert_allclose(found.eigenvalues, [-RHO * 1.2e-3 * speed / 0.20], rtol=1e-10)


def test_a_free_cylinder_falls_broadside_and_endwise_only_unstably():
    """Broadside (rho_s - rho) g pi r^2 = rho r C_n V^2; both are equilibria, and only the first lasts."""
    robot = build(parse_robot(FALLER))
    found = steady(robot)
    assert int(found.status) == Status.SOLVED
    speed = np.sqrt(500 * G * np.pi * 0.01**2 / (RHO * 0.01 * 1.1))
    np.testing.assert_allclose(np.linalg.norm(found.state.v[3:]), speed, rtol=1e-10)
    np.testing.assert_allclose(found.state.v[:3], 0, atol=1e-10)
    assert np.sum(np.abs(found.eigenvalues) < 1e-6) == 2  # rolling about its own axis, at any angle and any rate

    x = robot.initial()
    turned = jax.jit(type(robot).advance)(robot, x.q, 2.0 * np.eye(6)[1], np.ones(()))  # Cayley: 90 degrees
    down = State(turned, jnp.asarray(3.0 * np.eye(6)[3]), x.z)
    endwise = steady(robot, guess=down)
    assert int(endwise.status) == Status.UNSTABLE
    terminal = np.sqrt(500 * G * np.pi * 0.01**2 / (0.5 * np.pi * RHO * 0.01 * 0.01))
    assert abs(float(endwise.state.v[3])) == pytest.approx(terminal, rel=1e-9)


def test_a_towed_rod_hangs_where_drag_and_weight_balance():
    """Moments about the hinge: tan a = rho r C_n U^2 / ((rho_s - rho) g pi r^2)."""
    found = steady(build(parse_robot(TOWED)))
    angle = np.arctan(RHO * 0.005 * 1.2 * 0.4**2 / (2000 * G * np.pi * 0.005**2))
    assert int(found.status) == Status.SOLVED
    assert abs(float(found.state.q[0])) == pytest.approx(angle, rel=1e-10)
    towing = RHO * 0.005 * 1.2 * 0.4**2 * np.cos(angle) ** 2 * 0.5
    assert float(found.to_dataset()["reaction"][0, 0]) == pytest.approx(towing, rel=1e-10)


def test_an_autorotating_rotor_obeys_blade_element_theory():
    """Falling plates that spin: torque of the drag 0, its lift the weight; by an independent quadrature and root."""
    description = parse_robot(ROTOR)
    found = steady(build(description))
    assert int(found.status) == Status.SOLVED
    s, w = np.polynomial.legendre.leggauss(12)
    r, w = 0.1 * (s + 1), 0.1 * w
    pitch = np.radians(25)
    heavy = 0.2 - RHO * np.pi * 0.01**2 * 0.02 + 0.01 - RHO * np.pi * 0.005**2 * 0.01 + 2 * 200 * 0.2 * 0.04 * 0.001

    def unbalanced(y):
        v, turn = y
        across = np.stack([turn * r * np.cos(pitch) + v * np.sin(pitch), v * np.cos(pitch) - turn * r * np.sin(pitch)])
        half = np.array([0.0005, 0.02])  # what the water meets along the chord and across it
        f = -RHO * 1.2 * np.linalg.norm(across, axis=0) * half[:, None] * across
        tangential = f[0] * np.cos(pitch) - f[1] * np.sin(pitch)
        vertical = f[0] * np.sin(pitch) + f[1] * np.cos(pitch)
        return [2 * np.sum(w * vertical) - heavy * G, 2 * np.sum(w * r * tangential)]

    speed, turn = fsolve(unbalanced, [-0.8, -4.0], xtol=1e-13)
    names = build(description).coordinate_names
    got = dict(zip(names, np.asarray(found.state.v), strict=True))
    assert got["body.position"] == pytest.approx(speed, rel=1e-6)
    assert abs(got["hub.angle"]) == pytest.approx(abs(turn), rel=1e-6)
    assert abs(turn) > 1


def test_the_residual_of_a_steady_swim_is_rounding(swimming):
    assert float(swimming.residual) < 1e-10


@pytest.mark.slow
def test_the_flagellum_swims_as_its_dynamics_from_rest(flagellum, swimming):
    run = simulate(flagellum, 5.0, rtol=1e-7, atol=1e-9)
    assert float(swimming.state.v[0]) == pytest.approx(float(run.value.state.v[-1, 0]), abs=1e-6)
    np.testing.assert_allclose(swimming.state.q[1:], run.value.state.q[-1, 1:], atol=1e-5)
    assert regime_of(run).kind == "steady"


def test_a_disturbance_of_the_flagellum_decays_at_its_slowest_mode(flagellum, swimming):
    x = swimming.state
    run = simulate(flagellum, 3.0, rtol=1e-9, atol=1e-12, initial=eqx.tree_at(lambda x: x.v, x, x.v * 1.01))
    # where all has nearly settled, rounding errors in a step are as large as such tolerances
    assert int(run.stats["rejected"]) < 0.05 * int(run.stats["steps"])
    left = np.abs(np.asarray(run.value.state.v[:, 0]) - float(x.v[0]))
    rate = np.polyfit(np.asarray(run.value.time)[120:], np.log(left[120:]), 1)[0]
    assert rate == pytest.approx(float(swimming.stats["growth"]), rel=0.01)
    assert swimming.eigenvalues[0].imag == 0


def test_a_warm_start_takes_few_corrections_and_ends_at_the_same_root(flagellum, swimming):
    again = steady(flagellum, guess=swimming.state)
    assert int(again.stats["residuals"]) <= 3
    np.testing.assert_allclose(again.state.q, swimming.state.q, atol=1e-13)
    lost = State(swimming.state.q * 3, swimming.state.v * -10, swimming.state.z)
    from_afar = steady(flagellum, guess=lost)
    assert int(from_afar.status) == Status.SOLVED
    np.testing.assert_allclose(from_afar.state.q[1:], swimming.state.q[1:], atol=1e-10)


def test_derivatives_are_those_of_the_closed_form_forward_and_reverse_and_side_by_side():
    """V = -sqrt(2 (m - rho pi r^2 l) g / (rho A)): dV/dm = g / (rho A V), dV/dr = -2 pi r l g / (A V)."""
    description = parse_robot(SINKER)
    found = steady(build(description))
    theta, from_theta = bind(description, ("body.mass", "body.radius"))
    symmetry = find_symmetry(build(description))

    def speed(theta):
        return equilibrium(from_theta(theta), symmetry, found.state, jnp.asarray(True)).value.state.v[0]

    def closed(m, r):
        V = -np.sqrt(2 * (m - RHO * np.pi * r**2 * 0.06) * G / (RHO * 1.2e-3))
        return V, np.array([G / (RHO * 1.2e-3 * V), -2 * np.pi * r * 0.06 * G / (1.2e-3 * V)])

    thetas = jnp.array([[0.15, 0.02], [0.14, 0.021], [0.3, 0.01]])
    together, reverse = jax.jit(jax.vmap(jax.value_and_grad(speed)))(thetas)
    forward = jax.jit(jax.jacfwd(speed))(theta)
    for got, slope, values in zip(together, reverse, thetas, strict=True):
        V, dV = closed(*np.asarray(values))
        assert got == pytest.approx(V, rel=1e-10)
        np.testing.assert_allclose(slope, dV, rtol=1e-9)
    np.testing.assert_allclose(forward, closed(0.15, 0.02)[1], rtol=1e-9)


@pytest.mark.slow
def test_derivatives_against_central_differences_forward_and_reverse(flagellum, swimming):
    description = describe("flagellum")
    theta0, from_theta = bind(description, ("L", "tip_radius", "alpha", "omega", "E"), log=("E",))
    scale = jnp.array([0.4, 49e-3, np.pi / 2, 19.0, np.log(1681e6 / 1379e3)])
    symmetry = find_symmetry(flagellum)

    @jax.jit
    def outputs(u):
        found = equilibrium(from_theta(theta0 + scale * u), symmetry, swimming.state, jnp.asarray(True))
        return jnp.concatenate([found.value.state.v[:1], found.value.reaction])

    o, h = jnp.zeros(5), 2e-4
    forward, reverse = jax.jit(lambda u: (jax.jacfwd(outputs)(u), jax.jacrev(outputs)(u)))(o)
    e = jnp.eye(5) * h
    values = {k: jnp.stack([outputs(k * e[i]) for i in range(5)], axis=1) for k in (-2, -1, 1, 2)}
    wanted = (8 * (values[1] - values[-1]) - (values[2] - values[-2])) / (12 * h)
    for got in (forward, reverse):
        error = np.linalg.norm(got - wanted, axis=1) / np.linalg.norm(wanted, axis=1)
        assert np.all(error < 1e-7), error


@pytest.mark.slow
def test_designs_side_by_side_are_those_one_by_one(flagellum, swimming):
    theta0, from_theta = bind(describe("flagellum"), ("omega", "E"))
    symmetry = find_symmetry(flagellum)

    def speed(theta):
        found = equilibrium(from_theta(theta), symmetry, swimming.state, jnp.asarray(False))
        return found.value.state.v[0], found.status

    thetas = theta0 * jnp.array([[1.0, 1.0], [0.5, 1.0], [1.0, 4.0]])
    together, status = jax.jit(jax.vmap(speed))(thetas)
    one = jax.jit(speed)
    np.testing.assert_allclose(together, [one(theta)[0] for theta in thetas], rtol=1e-9)
    assert not np.any(status)


SYMMETRIES = {
    "flagellum, along its slide": (lambda: describe("flagellum"), (0,), False),
    "free in gravity: translation and the heading": (lambda: parse_robot(FALLER), (3, 4, 5), True),
    "free without gravity: everything": (
        lambda: parse_robot(FALLER.replace("body:", "water: {gravity: 0 m/s2}\nbody:", 1)),
        (0, 1, 2, 3, 4, 5),
        False,
    ),
    "under a surface: no depth": (
        lambda: parse_robot(SINKER.replace("body:", "water: {surface: 0.1 m}\nbody:", 1)),
        (),
        False,
    ),
    "towed: the hinge angle matters": (lambda: parse_robot(TOWED), (), False),
    "rotor: sinking and spinning": (lambda: parse_robot(ROTOR), (0, 1), False),
}


@pytest.mark.parametrize("name", SYMMETRIES)
def test_symmetries_are_found(name):
    make, drift, spin = SYMMETRIES[name]
    symmetry = find_symmetry(build(make()))
    assert (symmetry.drift, symmetry.spin, symmetry.steady) == (drift, spin, True)


def test_drives_that_change_have_no_steady_motion(flagellum):
    shaft = flagellum.tree.part("shaft")
    motion = Sine(*(jnp.full((1,), x) for x in (1.0, 0.5, 0.0, 0.0)))
    parts = [replace(part, prescribed=motion) if k == shaft else part for k, part in enumerate(flagellum.tree.parts)]
    changed = eqx.filter_jit(make_robot)(parts, flagellum.loads, flagellum.water, forward=flagellum.forward)
    found = steady(changed)
    assert int(found.status) == Status.UNSTEADY_DRIVES
    assert "change with time" in Status.UNSTEADY_DRIVES.reason


def test_a_body_that_nothing_holds_has_no_equilibrium_and_says_what_it_does_instead(falling):
    """A mass point that falls without drag: it gets faster for ever."""
    found = steady(falling)
    assert int(found.status) == Status.NO_EQUILIBRIUM
    assert found.instead(2.0).kind == "irregular"


def test_what_a_run_comes_to_is_recognised(swinging):
    robot, at = swinging
    run = simulate(robot, 8.0, samples=1601, initial=at(0.5), rtol=1e-8)
    ends = regime_of(run)
    inertia = (1.0**2 + 0.1**2) / 12 + 0.25
    assert ends.kind == "oscillating"
    assert ends.frequency == pytest.approx(np.sqrt(0.5 * G / inertia) / (2 * np.pi), rel=0.03)  # and 1.6 % slower


def test_nothing_free_to_move_is_refused():
    fixed = parse_robot(SINKER.replace("{kind: prismatic, axis: z}", "{kind: fixed}"))
    with pytest.raises(InputError, match="nothing of this robot is free to move"):
        steady(build(fixed))
