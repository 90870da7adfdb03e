"""The periods of a grid are those of its points, one by one, and few of them are asked for."""

from itertools import product

import numpy as np
import pytest
from tests.small_robots import DRIVEN, SERVO

from nectosome.description import (
    check_updates,
    drive_period,
    parse_robot,
    samples_at_updates,
    update_rates,
    with_values,
)
from nectosome.designs import batches
from nectosome.designs.axes import axis_of
from nectosome.designs.batches import batches_of
from nectosome.units import InputError

PART = "kind: rigid, shape: point, mass: 1 kg, inertia: [1 kg m2, 1 kg m2, 1 kg m2]"
HINGE = "joint: {kind: revolute, axis: z, "
THREE = f"""
name: three
water: {{gravity: 0 m/s2}}
body: {{{PART}, joint: {{kind: fixed}}}}
limbs:
  a: {{{PART}, {HINGE}motion: {{kind: sine, amplitude: 1 rad, frequency: 2 Hz}}}}}}
  b: {{{PART}, {HINGE}motion: {{kind: stroke, amplitude: 1 rad, frequency: 3 Hz, forward_share: 0.4}}}}}}
  c: {{{PART}, {HINGE}torque: {{kind: cycle, values: [0 N m, 1 N m, 2 N m, 0 N m], frequency: 2 Hz}}}}}}
  d: {{{PART}, {HINGE}motion: {{kind: rate, rate: 2 rpm, ramp: 1 s}}}}}}
aliases:
  f: [limbs.a.joint.motion.frequency, limbs.c.joint.torque.frequency]
  all: [limbs.a.joint.motion.frequency, limbs.b.joint.motion.frequency, limbs.c.joint.torque.frequency]
  A: [limbs.a.joint.motion.amplitude]
  B: [limbs.b.joint.motion.amplitude]
  AB: [limbs.c.joint.torque.values.1, limbs.c.joint.torque.values.2]
  turn: [limbs.d.joint.motion.rate]
  mass: [limbs.a.mass]
  share: [limbs.b.joint.motion.forward_share]
"""
THREE_OF_SINE = with_values(parse_robot(THREE), {"turn": 0.0})
PLAIN = parse_robot(DRIVEN)
UPDATED = parse_robot(SERVO.replace("inertia: 20 g m2", "inertia: 20 g m2, update_rate: 50 Hz"))
RATE, BEAT, STROKE = "body.joint.servo.update_rate", "body.joint.motion.frequency", "body.joint.motion.amplitude"
MASS, PHASE = "body.mass", "body.joint.motion.phase"


def one_by_one(robot, axes, samples):
    """Periods of all points, and samples of a cycle; what is refused is raised."""
    points = [dict(zip([a.name for a in axes], x, strict=True)) for x in product(*(a.values for a in axes))]
    robots = [with_values(robot, point) for point in points]
    periods = [drive_period(one) for one in robots]
    for one, period in zip(robots, periods, strict=True):
        check_updates(update_rates(one), period)
    counts = {rate * t for one, t in zip(robots, periods, strict=True) for rate in update_rates(one)}
    return np.array(periods), samples_at_updates(counts, 1.0, samples)


def outcome(make):
    try:
        periods, samples = make()
    except InputError as error:
        return str(error)
    return periods.tobytes(), samples


@pytest.mark.parametrize(
    ("robot", "over", "asked"),
    [
        (PLAIN, {"M": [0.1, 0.2, 0.3], "f": [0.7, 1.0, 1.3], "c": [0.1, 0.2]}, 3),
        (PLAIN, {"f": [1.3, 0.7], "M": [0.1, -0.2]}, 2),
        (PLAIN, {"M": [0.1, 0.0, 0.3], "f": [1.0, 2.0]}, None),  # nothing moves at some points: refused
        (THREE_OF_SINE, {"f": [2.0, 4.0, 6.0], "mass": [1.0, 2.0], "share": [0.3, 0.4]}, 3),
        (THREE_OF_SINE, {"all": [1.0, 1.1, 0.9], "A": [1.0, 0.5]}, 3),
        (THREE_OF_SINE, {"A": [1.0, 0.0, 0.5, 0.2], "B": [0.0, 1.0, 2.0], "AB": [0.5, 1.0]}, 8),
        (THREE_OF_SINE, {"mass": [1.0, 2.0], "f": [2.0, 3.1, 2.7182818]}, None),  # no common period
        (THREE_OF_SINE, {"turn": [0.0, 4 * np.pi, -2 * np.pi], "A": [1.0, 2.0]}, 3),
        (UPDATED, {MASS: [1.0, 2.0], RATE: [20.0, 50.0], BEAT: [1.0, 2.0, 5.0], PHASE: [0.0, 1.0]}, 6),
        (UPDATED, {STROKE: [0.5, 0.6], BEAT: [1.0, 1.2, 1.7], RATE: [50.0, 20.0]}, None),  # updates do not fit
    ],
)
def test_the_periods_of_a_grid_are_those_of_its_points(robot, over, asked, monkeypatch):
    axes = tuple(axis_of(name, values, robot) for name, values in over.items())
    theirs = outcome(lambda: one_by_one(robot, axes, 33))
    calls = []
    monkeypatch.setattr(batches, "drive_period", lambda one: (calls.append(one), drive_period(one))[1])

    def grid():
        batch = batches_of(robot, axes, 33, 1e-4)
        return batch.periods, batch.samples

    assert outcome(grid) == theirs
    assert isinstance(theirs, str) == (asked is None)
    assert asked is None or len(calls) == asked


def test_steady_motions_have_no_period(monkeypatch):
    still = with_values(PLAIN, {"M": 0.0})
    monkeypatch.setattr(batches, "drive_period", None)  # is not asked
    assert not batches_of(still, (axis_of("c", [0.1, 0.2], still),), 33, 1e-4).periods.any()
