"""The common period of drives, and what has none."""

import numpy as np
import pytest

from nectosome.description import drive_period, parse_robot
from nectosome.units import InputError

PART = "kind: rigid, shape: point, mass: 1 kg, inertia: [1 kg m2, 1 kg m2, 1 kg m2]"


def robot(*joints: str):
    """A body that is held, and limbs on these joints."""
    limbs = [f"  limb{i}: {{{PART}, joint: {{{joint}}}}}" for i, joint in enumerate(joints)]
    return parse_robot("\n".join(["name: test", f"body: {{{PART}, joint: {{kind: fixed}}}}", "limbs:", *limbs]))


def hinge(signal: str, name: str = "motion") -> str:
    return f"kind: revolute, axis: z, {name}: {{{signal}}}"


def sine(frequency: str) -> str:
    return hinge(f"kind: sine, amplitude: 1 rad, frequency: {frequency}")


STROKE = "kind: stroke, amplitude: 20 deg, frequency: 0.5 Hz"
WAVE, TURN = "kind: sine, amplitude: 1 m", "{kind: rate, rate: 2 rpm}"
SLIDE = "kind: prismatic, axis: x"
SHOT = "{kind: recording, times: [0 s, 1 s], values: [0 N, 1 N]}"
HELD = hinge("kind: constant, value: 1 rad")


@pytest.mark.parametrize(
    ("joints", "period"),
    [
        ([sine("0.9 Hz")], 1 / 0.9),
        ([hinge(STROKE + ", forward_share: 0.3")], 2.0),
        ([hinge("kind: rate, rate: -4 rad/s")], np.pi / 2),
        ([hinge("kind: sine, amplitude: 1 N m, frequency: 3 Hz", "torque")], 1 / 3),
        ([f"{SLIDE}, force: {{kind: sine, amplitude: 1 N, frequency: 3 Hz}}", HELD], 1 / 3),
        ([f"{SLIDE}, motion: {{kind: sine, amplitude: 1 mm, frequency: 0.1 Hz}}"], 10.0),
        ([sine("0.9 Hz"), sine("1.1 Hz"), sine("0.9 Hz")], 10.0),
        ([sine("2 Hz"), sine("0.5 Hz"), sine("3 Hz")], 2.0),
        ([hinge("kind: rate, rate: 14.4 rad/s"), hinge("kind: rate, rate: 21.6 rad/s")], 2 * np.pi / 7.2),
        ([sine("50 Hz"), sine("1 Hz")], 1.0),
        ([sine("2 Hz"), hinge("kind: sine, amplitude: 0 rad, frequency: 3 Hz"), sine("0 Hz")], 0.5),
        ([f"kind: planar, axis: z, motion: {{x: {{{WAVE}, frequency: 0.5 Hz}}, angle: {TURN}}}"], 30.0),
        (["kind: spherical, drive: {y: {kind: sine, amplitude: 1 N m, frequency: 5 Hz}}"], 0.2),
        ([f"{SLIDE}, force: {{kind: cycle, values: [0 N, 1 N, 2 N, 0 N], frequency: 4 Hz}}", sine("2 Hz")], 0.5),
        ([f"{SLIDE}, force: {{kind: cycle, values: [1 N, 1 N, 1 N, 1 N], frequency: 3 Hz}}", sine("2 Hz")], 0.5),
        (["kind: free, motion: {yaw: {kind: sine, amplitude: 1 rad, frequency: 2 Hz}}"], 0.5),
    ],
)  # fmt: skip
def test_the_period_is_the_shortest_that_all_share(joints, period):
    assert drive_period(robot(*joints)) == pytest.approx(period, rel=1e-14)


@pytest.mark.parametrize(
    ("joints", "field", "why"),
    [
        ([HELD], "period", "nothing of this robot is driven"),
        ([hinge("kind: rate, rate: 0 rad/s"), sine("0 Hz")], "period", "nothing of this robot is driven"),
        ([HELD, f"{SLIDE}, motion: {{kind: rate, rate: 1 m/s}}"], "limbs.limb1.joint.motion.rate", "never comes back"),
        (["kind: free, motion: {x: {kind: rate, rate: 1 m/s}}"], "limbs.limb0.joint.motion.x.rate", "never comes back"),
        ([f"{SLIDE}, force: {SHOT}"], "limbs.limb0.joint.force.values", "Cut one period out"),
        ([sine("1.4142136 Hz"), sine("1 Hz")], "limbs.limb1.joint.motion.frequency", "no common period"),
        ([sine("1 Hz"), sine("51 Hz")], "limbs.limb0.joint.motion.frequency", "within 50 cycles"),
        ([sine("1 Hz"), hinge("kind: rate, rate: 1 rad/s")], "limbs.limb1.joint.motion.rate", "no common period"),
    ],
)  # fmt: skip
def test_what_has_no_period_is_told_with_its_place(joints, field, why):
    with pytest.raises(InputError, match=why) as raised:
        drive_period(robot(*joints))
    assert raised.value.field == field
