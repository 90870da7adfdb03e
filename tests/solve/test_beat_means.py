"""What simulations come to by the steps of the solver: closed forms, the cycle itself, and whatever the samples."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tests.small_robots import PENDULUM
from tests.solve.test_stroke import FIN, LENGTH, A, F, V, towed

from nectosome.core import State
from nectosome.description import parse_robot
from nectosome.model import build
from nectosome.solve import cycle_means, periodic, simulate
from nectosome.solve.integrate import AcceptedSteps
from nectosome.solve.run_means import run_means

# beats on its way to a speed, lighter, so that it comes to a cycle
SWIMMER = FIN.replace("mass: 2 kg", "mass: 0.5 kg")
# a motor that saturates: its current is cut off at a limit in a part of each beat
SATURATED = SWIMMER.replace(
    "motion: {kind: sine, amplitude: 0.4 rad, frequency: 1.25 Hz}}",
    "motion: {kind: sine, amplitude: 1.4 rad, frequency: 1.25 Hz}, "
    "servo: {model: XC330-M288-T, supply: 5 V, full_voltage_at: 2 deg}}",
)


@pytest.fixture(scope="module")
def fin():
    return build(parse_robot(FIN))


def over(robot, beats: float, samples: int, text: str = FIN):
    """Means of beats of a run that is towed for so many of them, between steps as many as its samples."""
    times, states = towed(robot, 0.7, n=samples)
    times = np.asarray(times * beats)
    place = states.q.at[:, :2].set(states.q[:1, :2] + times[:, None] * states.v[:1, :2])
    states = type(states)(place, states.v, states.z)
    rates = type(states)(states.v, jnp.zeros_like(states.v), states.z)
    first, later = (
        jax.tree.map(lambda x, s=s: np.asarray(x)[s], (times, states, rates)) for s in (slice(-1), slice(1, None))
    )
    return run_means(robot, AcceptedSteps(*first, *later), times, {"robot": text})


def test_the_last_beats_tell_a_stroke_wherever_samples_fall(fin):
    """Of 23.3 beats the last 2, at 128 times each: 1 - cos(pi/128) of an amplitude at most."""
    found = {name: values for name, (_, values, _) in over(fin, 23.3, 1409).items()}
    assert float(found["tail_amplitude"]) == pytest.approx(LENGTH * np.sin(A), rel=3e-4)
    assert float(found["strouhal"]) == pytest.approx(2 * F * LENGTH * np.sin(A) / V, rel=3e-4)
    assert float(found["body_lengths_per_second"]) == pytest.approx(V / 0.5, rel=1e-9)
    assert float(found["stride_length"]) == pytest.approx(V / (0.5 * F), rel=1e-9)  # of one beat, not of two
    cycle = jax.jit(cycle_means)(fin, *towed(fin, 0.7))
    for name in ("power", "power_positive", "froude_efficiency", "cost_of_transport", "energy_per_metre_positive"):
        assert float(found[name]) == pytest.approx(float(getattr(cycle, name)), rel=1e-4), name
    assert np.isnan(found["endurance"]) and np.isnan(found["cost_of_transport_battery"])
    np.testing.assert_allclose(found["beat_power"], float(cycle.power), rtol=1e-4)


@pytest.mark.parametrize(("beats", "ramp"), [(2.9, "0 s"), (23.3, "16.4 s")])  # 23.3 beats are 18.64 s
def test_too_few_beats_have_no_stroke(fin, beats, ramp):
    assert "strouhal" not in over(fin, beats, 1409, FIN.replace("frequency:", f"ramp: {ramp}, frequency:"))


def test_after_a_ramp_come_beats_that_tell(fin):
    assert "strouhal" in over(fin, 23.3, 1409, FIN.replace("frequency:", "ramp: 16.2 s, frequency:"))


def test_a_run_from_the_cycle_has_the_numbers_of_the_cycle_whatever_its_samples():
    robot = build(parse_robot(SWIMMER))
    cycle = periodic(robot)
    wanted = cycle.means()
    run = simulate(robot, 3 / F, samples=31, rtol=1e-6, atol=1e-8, initial=cycle.state)
    found = run.results().data
    for name in ("speed", "stride_length", "tail_amplitude", "strouhal", "power", "cost_of_transport", "efficiency"):
        assert float(found[name][1]) == pytest.approx(float(getattr(wanted, name)), rel=1e-4), name
    assert float(found["power_closure"][1]) < 1e-4


def test_powers_of_a_robot_that_has_come_to_rest_close():
    robot = build(parse_robot(PENDULUM.replace("axis: y}", "axis: y, damping: 1 N m s/rad}")))
    run = simulate(robot, 60.0, samples=21)
    assert float(run.results().data["power_closure"][1]) < 1e-6
    assert "their sum misses" not in " ".join(run.summary().notes)


def test_means_of_a_servo_that_saturates_do_not_depend_on_the_samples():
    """0.505217 W over the last beat, of steps at tolerances of 1e-8; at the usual ones it is 0.2 % less."""
    robot = build(parse_robot(SATURATED))
    few, many = (simulate(robot, 3.2, samples=n).results() for n in (21, 401))
    kept = {name for name in few.data if name.endswith(("_mean", "_peak")) or name.startswith("beat_")}
    assert {"electrical_power_mean", "load_power_peak", "power_into_robot_peak", "beat_power"} <= kept
    for name in kept | {"flow_number"}:
        size = np.max(np.abs(np.nan_to_num(many.data[name][1])), initial=0.0)
        np.testing.assert_allclose(few.data[name][1], many.data[name][1], atol=1e-9 * size, rtol=0, err_msg=name)
    assert float(few.data["voltage_demand_peak"][1][0]) > 1
    off = float(few.data["power_closure"][1])
    assert off < 1e-4 or "their sum misses" in " ".join(few.summary().notes)
    assert float(few.arrays["electrical_power_mean"][0]) == pytest.approx(0.505217, rel=3e-3)
    fine = simulate(robot, 3.2, samples=21, rtol=1e-6, atol=1e-8).results()
    assert float(fine.arrays["electrical_power_mean"][0]) == pytest.approx(0.505217, rel=1e-4)
    settled = [[note for note in run.summary().notes if "settled" in note] for run in (few, many)]
    assert settled[0] == settled[1] != []


def test_a_run_whose_powers_do_not_close_says_so():
    robot = build(parse_robot(SWIMMER))
    notes = " ".join(simulate(robot, 2.4, rtol=2e-2, atol=1e-3).summary().notes)
    assert "their sum misses the change of energy" in notes


def test_a_free_body_in_ideal_water_has_a_power_balance_of_rounding():
    """It coasts: all powers are 0, and the balance is relative to its energy over the time of the run."""
    ball = """
name: ball
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: spheroid
  length: 0.2 m
  radius: 0.05 m
  density: 1000 kg/m3
  joint: {kind: free, start: {velocity: [0.3 m/s, 0.1 m/s, 0 m/s], angular_velocity: [0 rad/s, 1 rad/s, 0 rad/s]}}
  loads: {added_mass: {kind: spheroid_added_mass}}
"""
    run = simulate(build(parse_robot(ball)), 1.0)
    assert float(np.max(run.results().arrays["power_balance"])) < 1e-12


PUSHED = """
name: pushed
water: {{gravity: 0 m/s2, current: [{stream} m/s, 0 m/s, 0 m/s]}}
body:
  kind: rigid
  shape: point
  mass: 1 kg
  joint: {{kind: prismatic, axis: x, {motion}}}
  loads: {{drag: {{kind: lumped_drag, drag_area: [1e-3 m2, 4e-3 m2, 4e-3 m2]}}}}
"""


def test_a_stream_changes_no_power_of_a_push_and_what_is_over_ground_says_so():
    """F (v + c) is given over ground, F v through the water: of all numbers of drives the latter."""
    push = "force: {kind: sine, offset: 0.3 N, amplitude: 0.2 N, frequency: 1 Hz}"
    streams = {c: build(parse_robot(PUSHED.format(stream=c, motion=push))) for c in (0.0, 0.3)}
    begins = {c: robot.initial() for c, robot in streams.items()}
    begins = {c: State(x.q, x.v + c, x.z) for c, x in begins.items()}
    a, b = (simulate(robot, 4.0, samples=9, initial=begins[c]).results() for c, robot in streams.items())
    for name in ("power", "power_positive", "beat_power", "cost_of_transport", "flow_number"):
        np.testing.assert_allclose(b.arrays[name], a.arrays[name], rtol=1e-4, err_msg=name)  # of the steps
    for one in (a, b):
        assert float(one.arrays["beat_power"][0]) == pytest.approx(float(one.arrays["power"]), rel=1e-9)
    drive = a.names["load"][1].tolist().index("drive")
    over_ground = float(b.arrays["load_power_mean"][drive].sum() - a.arrays["load_power_mean"][drive].sum())
    assert over_ground == pytest.approx(0.3 * 0.3, rel=1e-5)
    texts = [str(one.summary()) for one in (a, b)]
    assert ["over ground" in text for text in texts] == [False, True]
    assert "power into the robot, over ground " in texts[1] and "energy, over ground " in texts[1]


class Jet(eqx.Module):
    """A current that grows with the square of x."""

    growth: jax.Array  # [1/(m s)]

    def __call__(self, t, x):
        return self.growth * x[0] ** 2 * jnp.array([1.0, 0.0, 0.0])


def test_the_mean_velocity_through_water_that_is_not_the_same_everywhere_is_by_the_steps():
    """To and fro by a through c = g x^2: the water goes by g a^2/2 on the mean, 25 mm/s."""
    motion = "motion: {kind: sine, amplitude: 0.1 m, frequency: 1 Hz}"
    robot = build(parse_robot(PUSHED.format(stream=0.0, motion=motion)))
    robot = replace(robot, water=replace(robot.water, current=Jet(jnp.asarray(5.0))))
    for samples in (5, 8):
        run = simulate(robot, 3.0, samples=samples)
        row = run.summary().to_json()["tables"]["body"]["velocity_mean_through_water"]
        assert row["x"]["value"] == pytest.approx(-0.025, rel=1e-6)
        assert float(run.results().arrays["beat_water_velocity"][1][0]) == pytest.approx(0.025, rel=1e-6)
