"""A clamped beam that is let go: its modulus, its viscosity and how it was held, from noisy readings of its tip."""

import numpy as np
import pytest

from nectosome.core import State
from nectosome.description import parse_robot, with_values
from nectosome.description.variables import read_variable
from nectosome.identification import identify
from nectosome.identification.recordings import recordings_of
from nectosome.identification.robot.misfit import RobotMisfit
from nectosome.identification.robot.trials import read_compared, robot_trials
from nectosome.model import build
from nectosome.solve import reading, simulate, static
from nectosome.units import InputError

BEAM = """
name: beam
water: {density: 1.2 kg/m3}
body:
  kind: rod
  section: rectangle
  length: 120 mm
  width: 20 mm
  height: 6 mm
  young: 0.6 MPa
  damping: 600 Pa s
  density: 1080 kg/m3
  strains: {bending_y: 1}
  points: 4
  loads:
    hand: {kind: force, force: [0 N, 0 N, 0 N]}
aliases: {E: body.young, eta: body.damping, hand: body.loads.hand.force.2}
"""
E, ETA, HAND, NOISE = 0.6e6, 600.0, 0.06, 3e-4  # Pa, Pa s, N, m
TIME = np.linspace(0.0, 0.6, 61)
TIP = "body.tip.position.z"
NAMED = {"vary": {"E": "0.3..1.2MPa log", "eta": "100..2000Pa s log"}, "compare": {"tip": TIP}, "starts": 1}
HELD = {"before.hand": "0..0.2 N"}
STRAINS = {"body.start.bending_y": "-20..20 rad/m", "body.start.rate.bending_y.0": "-50..50 rad/m/s"}
STEPS = 8  # in which a slow hand lets go


@pytest.fixture(scope="module")
def beam():
    return parse_robot(BEAM)


def held(beam, force):
    return with_values(beam, {"body.loads.hand.force.2": force})


def run(robot, time, begins):
    found = simulate(build(robot), float(time[-1]), samples=time.tolist(), initial=begins, rtol=1e-8, atol=1e-10)
    end = found.value.state
    return reading(found, TIP), State(end.q[-1], end.v[-1], begins.z)


@pytest.fixture(scope="module")
def swinging(beam):
    """Height of the tip after a hand that held it lets go at once, and after one that lets go in 40 ms."""
    shape = static(build(held(beam, HAND))).value.state
    begins = State(shape.q[-1], shape.v[-1], build(beam).initial().z)
    found = [run(beam, TIME, begins)[0]]
    for k in range(STEPS):
        _, begins = run(held(beam, HAND * (1 - (k + 0.5) / STEPS)), np.linspace(0.0, 0.04 / STEPS, 3), begins)
    return [*found, run(beam, TIME[:-4], begins)[0]]


def noisy(values, seed):
    return values + NOISE * np.random.default_rng(seed).normal(size=values.shape)


def ends(found):
    return dict(zip(found.to_dataset()["parameter"].values, found.identifiability.intervals(), strict=True))


@pytest.mark.parametrize(
    ("start", "more"),
    [
        pytest.param(HELD, (HAND,), id="held by a force", marks=pytest.mark.slow),
        pytest.param(STRAINS, (3.0, -2.0, 5.0), id="strains and a rate"),
    ],
)
def test_derivatives_by_starts_are_finite_differences(beam, start, more):
    """To 5e-3 of the largest: steps are wide enough that other time steps of the integration do not count."""
    compared = [read_compared("tip", TIP, build(beam))]
    recording = {"time": TIME[:31], "tip": np.sin(TIME[:31])}
    trials = robot_trials(recordings_of([recording], {"tip": "m"}), beam, compared, {}, start=start)
    variables = [read_variable(name, span, beam) for name, span in NAMED["vary"].items()]
    misfit = RobotMisfit(trials, variables, compared).misfit(np.ones(1))
    theta = np.array([E, ETA, *more])
    J = misfit.jacobian(theta)
    for k, x in enumerate(theta):
        h = (1e-3 if k == 0 else 0.05) * abs(x) * np.eye(theta.size)[k]
        apart = np.diff(misfit.residuals(np.array([theta - h, theta + h])), axis=0)[0] / (2 * h[k])
        np.testing.assert_allclose(J[:, k], apart, atol=5e-3 * np.abs(apart).max())


@pytest.mark.slow
def test_a_beam_that_was_held_by_an_unknown_force_tells_modulus_and_viscosity(beam, swinging):
    found = identify(beam, [{"time": TIME, "tip": noisy(swinging[0], 0)}], **NAMED, start=HELD)
    assert [*ends(found)] == ["E", "eta", "before.hand of recording 1"]
    for one, true in zip(ends(found).values(), (E, ETA, HAND), strict=True):
        assert abs(true - 0.5 * (one.low + one.high)) < 0.75 * (one.high - one.low)  # three standard errors: 99.7 %
    assert found.theta[0] == pytest.approx(E, rel=5e-3)
    assert found.warnings == ()


@pytest.mark.slow
def test_each_coefficient_of_a_strain_is_an_unknown_and_those_that_the_readings_do_not_tell_are_named(beam, swinging):
    start = {"body.start.bending_y": "-20..20 rad/m", "body.start.rate.bending_y": "-50..50 rad/m/s"}
    found = identify(beam, [{"time": TIME, "tip": noisy(swinging[0], 0)}], **NAMED, start=start)
    names = [f"body.start.{rate}bending_y.{k} of recording 1" for rate in ("", "rate.") for k in range(2)]
    assert [*ends(found)] == ["E", "eta", *names]
    shape = static(build(held(beam, HAND))).value.state.q[-1] / 0.12
    for one, x in zip(ends(found).values(), (E, ETA, *shape, 0.0, 0.0), strict=True):
        assert one.low - 0.3 * (one.high - one.low) < x < one.high + 0.3 * (one.high - one.low)
    words = found.identifiability.words()
    assert any("rate.bending_y.1" in one and "identifiable, " in one and "hardly" in one for one in words)


@pytest.mark.slow
def test_a_slow_hand_is_no_damping_where_the_start_after_it_is_unknown(beam, swinging):
    """The hand lets go in 40 ms; the recording begins when it is off, with a shape and a rate of no static load."""
    late = {"time": TIME[:-4], "tip": noisy(swinging[1], 1)}
    free = identify(beam, [late], **NAMED, start=STRAINS)
    assert ends(free)["eta"].low < ETA < ends(free)["eta"].high
    assert free.theta[1] == pytest.approx(ETA, rel=0.06)


@pytest.mark.parametrize(
    ("start", "said"),
    [
        ({"body.start.bending_z": "-1..1 rad/m"}, "the rod's strains do not name bending_z"),
        ({"body.start.bending_y.2": "-1..1 rad/m"}, 'there is no quantity called "body.start.bending_y.2"'),
        ({"body.start.bending_y": "-1..1 m"}, "Curvature expected"),
        ({"body.start.bending_y.0": "reading"}, "no first reading tells it"),
        ({"body.start.bending_y.0": "1 rad/m", "before.hand": "1 N"}, "its equilibrium says where it starts"),
    ],
)
def test_starts_that_cannot_be_are_told(beam, start, said):
    with pytest.raises(InputError) as told:
        identify(beam, [{"time": TIME, "tip": np.sin(TIME)}], **NAMED, start=start)
    assert said in str(told.value)
