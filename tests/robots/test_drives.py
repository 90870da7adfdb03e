"""Joints of several coordinates from a description: made to move, or driven."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from nectosome.description import get_value, parse_robot, with_values
from nectosome.model import build
from nectosome.solve import simulate
from nectosome.units import InputError

BALL = """
name: ball
water: {{gravity: 0 m/s2}}
body:
  kind: rigid
  shape: spheroid
  length: 0.2 m
  radius: 0.1 m
  mass: 2 kg
  joint: {joint}
"""


JET = """
name: jet
water: {{gravity: 0 m/s2, density: 1000 kg/m3}}
body:
  kind: rigid
  shape: point
  mass: 0.755 kg
  inertia: [1e-3 kg m2, 1e-3 kg m2, 1e-3 kg m2]
  joint: {{kind: prismatic, axis: x, force: {{kind: cycle, values: [{values}], frequency: 1.8 Hz}}}}
  loads:
    drag: {{kind: lumped_drag, drag_area: [0.01 m2, 0 m2, 0 m2]}}
    water: {{kind: given_added_mass, mass: [2.745 kg, 0 kg, 0 kg]}}
"""


def ball(joint: str):
    return build(parse_robot(BALL.format(joint=joint)))


def test_a_thruster_accelerates_a_free_body_along_its_own_axis():
    """x = F t^2 / 2m along the axis that the body is turned to; torque free."""
    robot = ball(
        "{kind: free, start: {orientation: [0 deg, 0 deg, 90 deg]}, drive: {force_x: {kind: constant, value: 3 N}}}"
    )
    run = simulate(robot, 2.0, samples=2, rtol=1e-8, atol=1e-10)
    assert np.asarray(run.value.state.q[-1, :3]) == pytest.approx([0.0, 3.0, 0.0], abs=1e-7)


def test_a_base_that_is_made_to_move_tells_the_force_that_takes():
    """Reaction of a free joint on x = A sin wt: -m A w^2 sin wt along x, nothing else."""
    robot = ball("{kind: free, motion: {x: {kind: sine, amplitude: 0.1 m, frequency: 2 Hz}}}")
    reaction = simulate(robot, 0.1, samples=11).to_dataset()["reaction"]
    expected = -2 * 0.1 * (4 * np.pi) ** 2 * np.sin(4 * np.pi * reaction["time"].values)
    assert reaction.sel(prescribed="body.vx").values == pytest.approx(expected, abs=1e-9)
    assert np.abs(reaction.drop_sel(prescribed="body.vx").values).max() < 1e-12


def test_a_planar_body_is_driven_about_its_axis():
    """angle = T t^2 / 2 I, I = 2/5 m r^2, about the centre, 0.1 m ahead of the joint."""
    robot = ball("{kind: planar, axis: z, drive: {angle: {kind: constant, value: 0.016 N m}}}")
    run = simulate(robot, 1.0, samples=2, rtol=1e-8, atol=1e-10)
    assert np.asarray(run.value.state.q[-1]) == pytest.approx([0.1 * (1 - np.cos(1)), -0.1 * np.sin(1), 1.0], abs=1e-7)


def test_a_spherical_joint_follows_its_angles():
    robot = ball("{kind: spherical, motion: {yaw: {kind: rate, rate: 90 deg/s}}}")
    rotation = simulate(robot, 1.0, samples=2).to_dataset()["rotation"].values[-1, 0]
    assert rotation == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]), abs=1e-12)


def test_pulses_drive_a_body_along_a_line_through_water():
    """(M + m_a) v' = tau(t) - rho/2 Cd A v|v| with a thrust tau of eight values a cycle, by SciPy."""
    values, f = np.array([0.0, -0.1, -0.2, -0.1, 0.0, 0.4, 0.9, 0.4]), 1.8
    robot = build(parse_robot(JET.format(values=", ".join(f"{x} N" for x in values))))
    run = simulate(robot, 2.0, samples=21, method="implicit", rtol=1e-7, atol=1e-9).value
    thrust = CubicSpline(np.arange(9) / 8 / f, [*values, values[0]], bc_type="periodic")
    own = solve_ivp(
        lambda t, x: [x[1], (thrust(t) - 5.0 * x[1] * abs(x[1])) / 3.5],
        (0.0, 2.0),
        [0.0, 0.0],
        t_eval=np.linspace(0, 2, 21),
        rtol=1e-10,
        atol=1e-12,
        max_step=0.01,
    )
    np.testing.assert_allclose(run.state.v[:, 0], own.y[1], atol=1e-7)
    np.testing.assert_allclose(run.state.q[:, 0], own.y[0], atol=1e-7)
    assert own.y[1, -1] > 0.05


RECORDED = "kind: recording, times: [{times}], values: [{values}]"


def recorded(times: str, values: str):
    cycle = "kind: cycle, values: [{values}], frequency: 1.8 Hz"
    return parse_robot(JET.replace(cycle, RECORDED).format(times=times, values=values))


def test_a_recorded_thrust_drives_a_body_as_straight_lines_do():
    """Without drag: impulse over (M + m_a) of trapezoids, from a start before the recording to a hold after it."""
    robot = build(recorded("0.1 s, 0.3 s, 0.4 s", "0.5 N, 1.5 N, -0.2 N"))
    robot = eqx.tree_at(lambda r: r.load_groups.on_bodies[0].load.drag_area, robot, jnp.zeros((1, 3)))
    samples = [0.0, 0.1, 0.3, 0.4, 1.0]
    run = simulate(robot, 1.0, samples=samples, rtol=1e-9, atol=1e-11).value
    impulse = np.cumsum([0.0, 0.5 * 0.1, 1.0 * 0.2, 0.65 * 0.1, -0.2 * 0.6])
    np.testing.assert_allclose(run.state.v[:, 0] * 3.5, impulse, atol=1e-7)


@pytest.mark.parametrize(
    ("times", "values", "why"),
    [
        ("0 s, 1 s", "1 N, 2 N, 3 N", "3 values at 2 times"),
        ("0 s, 2 s, 2 s", "1 N, 2 N, 3 N", "2 s, number 3, comes after 2 s"),
        ("0 s", "1 N", "at least 2"),
    ],
)
def test_a_recording_that_is_none_is_refused(times, values, why):
    with pytest.raises(InputError, match=why):
        recorded(times, values)


def test_values_of_a_cycle_are_numbers_of_the_robot():
    description = parse_robot(JET.format(values="0 N, 1 N, 0 N, 0.5 N"))
    assert get_value(with_values(description, {"body.joint.force.values.1": 2.0}), "body.joint.force.values.1") == 2.0
    with pytest.raises(InputError, match="at least 4"):
        parse_robot(JET.format(values="0 N, 1 N"))


def test_a_joint_is_not_moved_and_driven_at_once():
    with pytest.raises(InputError, match="cannot have a drive as well"):
        parse_robot(BALL.format(joint="{kind: free, motion: {}, drive: {}}"))


MATRIX = np.diag([0.01, 0.02, 0.02, 0.3, 0.9, 0.9]) + 0.001 * np.ones((6, 6))


def added(matrix) -> str:
    rows = ", ".join(f"[{', '.join(map(repr, map(float, row)))}]" for row in matrix)
    return BALL.format(joint="{kind: free}") + f"  loads:\n    water: {{kind: given_added_mass, matrix: [{rows}]}}\n"


def test_a_given_matrix_is_the_added_mass():
    robot = build(parse_robot(added(MATRIX)))
    np.testing.assert_allclose(robot.added[0], MATRIX, atol=1e-15)


@pytest.mark.parametrize(("wrong", "why"), [(np.triu(MATRIX), "symmetric"), (MATRIX - np.eye(6), "energy")])
def test_a_matrix_that_is_no_added_mass_is_refused(wrong, why):
    with pytest.raises(InputError, match=why):
        parse_robot(added(wrong))
