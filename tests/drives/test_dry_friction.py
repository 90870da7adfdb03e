"""Dry friction of motors: it holds, slips by Coulomb's law, and has one rest."""

import numpy as np
import pytest

from nectosome.core import Status
from nectosome.description import parse_robot, with_values
from nectosome.description.drives import MotorDrive
from nectosome.drives.motor import GearedMotor
from nectosome.model import build
from nectosome.solve import simulate, static

OFF = "model: HS-5646WP, duty_cycle: {kind: constant, value: 0}, supply: 6 V, inertia: 1e-3 kg m2"
ARM = f"""
name: arm on a servo that is off
water: {{density: 1000 kg/m3, gravity: 0 m/s2}}
body:
  kind: rigid
  shape: point
  mass: 0.1 kg
  volume: 0 m3
  inertia: [1e-3 kg m2, 1e-3 kg m2, 1e-3 kg m2]
  joint: {{kind: revolute, axis: z, motor: {{{OFF}}}}}
  loads: {{dead: {{kind: force, force: [0 N, 0 N, 0 N], moment: [0 N m, 0 N m, 0.1 N m]}}}}
aliases: {{moment: body.loads.dead.moment.2}}
"""
MOTOR = GearedMotor.of(MotorDrive(model="HS-5646WP", duty_cycle={"kind": "constant", "value": 0}, supply=6.0))
assert MOTOR.friction is not None
FRICTION = float(MOTOR.friction.limit)  # 0.207 N m


def turned(share: float, time: float) -> np.ndarray:
    """Angles at 31 times under this share of its own friction [rad]."""
    robot = build(with_values(parse_robot(ARM), {"moment": share * FRICTION}))
    return np.asarray(simulate(robot, time, samples=31).to_dataset()["q"])[:, 0]


@pytest.mark.parametrize("share", [0.3, 0.5, 0.8])
def test_a_servo_that_is_off_holds_what_is_below_its_friction(share: float):
    """For 30 s, within what its presliding gives way; a load put on at once overshoots."""
    angle = turned(share, 30.0)
    slip = np.deg2rad(0.1)
    assert share * slip * 0.999 < angle[-1] < np.deg2rad(0.15)
    assert np.ptp(angle[10:]) < 0.01 * slip


def test_above_its_friction_it_slips_as_coulombs_law_says():
    """At rest of the forces: 4 T_f = T_f + (2 - eta) K^2 v/R."""
    angle = turned(4.0, 3.0)
    speed = (angle[-1] - angle[-2]) / 0.1
    drag = float((2 - MOTOR.efficiency) * MOTOR.constant**2 / MOTOR.resistance)
    assert speed == pytest.approx(3 * FRICTION / drag, rel=1e-3)


def test_at_rest_it_holds_nothing():
    """One equilibrium is the one without friction, M/k, though friction would hold the arm anywhere about it."""
    text = ARM.replace("axis: z, motor", "axis: z, stiffness: 2 N m/rad, motor")
    found = static(build(parse_robot(text)))
    assert float(np.squeeze(found.to_dataset()["q"].values)) == pytest.approx(0.05, rel=1e-9)


def test_a_load_that_nothing_else_holds_has_no_rest():
    """`static` does not say that it is solved where friction alone may hold, or not."""
    found = static(build(parse_robot(ARM)))
    assert int(found.status) == Status.NO_EQUILIBRIUM
    assert "dry friction may hold it" in found.why
