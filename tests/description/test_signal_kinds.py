"""Every kind of signal drives what it fits: files, paths, periods, copies that run ahead, the other sign."""

import pickle

import numpy as np
import pytest

from nectosome.core import sampled
from nectosome.description import dump_robot, get_value, parse_robot, with_values
from nectosome.description.copies import _ahead
from nectosome.description.mirror import opposite
from nectosome.description.period import drive_period
from nectosome.description.plausible import implausible
from nectosome.description.signal_contract import signal_kinds
from nectosome.units import InputError

HINGE = """
name: a
body:
  kind: rigid
  shape: point
  mass: 1 kg
  inertia: [1 kg m2, 1 kg m2, 1 kg m2]
  joint: {kind: revolute, axis: z, DRIVE}
"""
SIGNALS = {
    "constant": "value: 1 U",
    "rate": "rate: 1 U/s",
    "sine": "amplitude: 1 U, frequency: 1 Hz",
    "triangle": "amplitude: 1 U, frequency: 1 Hz",
    "stroke": "amplitude: 1 U, frequency: 1 Hz, forward_share: 0.3",
    "ray": "amplitude: 1 U, frequency: 1 Hz, waves: 1.5, place: 0.25, envelope: [0.5, 1, 2]",
    "cycle": "values: [0 U, 1 U, 0 U, -1 U], frequency: 1 Hz",
    "step": "height: 1 U, at: 0.5 s",
    "chirp": "amplitude: 1 U, frequency: 1 Hz, to: 2 Hz, time: 3 s",
    "multisine": "amplitude: 1 U, frequency: 1 Hz, to: 4 Hz",
    "varying": "amplitude: [1 U, 2 U], frequency: [1 Hz, 2 Hz]",
    "recording": "times: [0 s, 1 s, 2 s, 3 s], values: [0 U, 1 U, 0 U, 1 U]",
    "sum": "terms: [{kind: sine, amplitude: 1 U, frequency: 1 Hz}, {kind: constant, value: 2 U}]",
}


def driven(kind, what="torque", unit="N m"):
    fields = SIGNALS[kind].replace(" U/s", f" {unit}/s").replace(" U", f" {unit}")
    return parse_robot(HINGE.replace("DRIVE", f"{what}: {{kind: {kind}, {fields}}}"))


@pytest.mark.parametrize("kind", SIGNALS)
def test_a_file_has_it_back_and_its_values_are_between_those_that_it_names(kind):
    robot = driven(kind)
    assert parse_robot(dump_robot(robot)) == robot == pickle.loads(pickle.dumps(robot))
    torque = robot.body.joint.torque
    values = sampled(torque, np.linspace(0.0, 3.0, 100))
    low, high = torque.least(), -opposite(torque).least()
    assert (low - 1e-9 <= values.min() and values.max() <= high + 1e-9) or kind in ("cycle", "rate")
    np.testing.assert_allclose(sampled(opposite(torque), np.linspace(0.0, 3.0, 100)), -values, atol=1e-12)


def test_all_kinds_are_here_and_a_motion_takes_those_whose_rate_is_continuous():
    assert {*SIGNALS} == {*signal_kinds()}
    for kind in SIGNALS:
        if kind in signal_kinds(motion=True):
            assert driven(kind, "motion", "rad").body.joint.motion.dimension == "angle"
        else:
            with pytest.raises(InputError, match=f'there is no kind "{kind}" here'):
                driven(kind, "motion", "rad")
    assert {*SIGNALS} - {*signal_kinds(motion=True)} == {"triangle", "step", "varying"}


def test_terms_of_a_sum_have_paths():
    changed = with_values(driven("sum"), {"body.joint.torque.terms.0.amplitude": 3.0})
    assert get_value(changed, "body.joint.torque.terms.0.amplitude") == 3.0
    assert sampled(changed.body.joint.torque, np.array([0.25]))[0] == pytest.approx(5.0)


def test_terms_of_a_sum_run_ahead_together():
    ahead = _ahead(driven("sum").body.joint, np.pi / 2).torque
    assert sampled(ahead, np.array([0.0]))[0] == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("kind", "period"),
    [("sine", 1), ("triangle", 1), ("stroke", 1), ("ray", 1), ("cycle", 1), ("multisine", 1), ("sum", 1),
     ("chirp", "torque.to: a chirp does not repeat itself"), ("step", "torque.at: a step comes once"),
     ("varying", "torque.frequency: each of these sines comes once"), ("rate", "torque.rate"),
     ("recording", "torque.values: a recording does not repeat itself"), ("constant", "nothing of this robot")],
)  # fmt: skip
def test_periods_are_those_of_the_signals(kind, period):
    if isinstance(period, int):
        assert drive_period(driven(kind)) == period
    else:
        with pytest.raises(InputError, match=period):
            drive_period(driven(kind))


def test_a_rate_of_torque_has_a_unit_of_its_own():
    assert driven("rate").body.joint.torque.rate == 1.0
    with pytest.raises(InputError, match="Torque rate expected"):
        parse_robot(HINGE.replace("DRIVE", "torque: {kind: rate, rate: 1 N m}"))


def test_a_voltage_that_grows_without_end_is_above_its_supply():
    motor = "motor: {model: XW540-T140-R, inertia: 1e-3 kg m2, supply: 12 V, voltage: {kind: rate, rate: 1 V/s}}"
    said = dict(implausible(parse_robot(HINGE.replace("DRIVE", motor))))
    assert "it goes up to any voltage, and its supply gives 12 V" in said["body.joint.motor.voltage"]
