"""A model as a rig: it answers as the model does, when it should, in either time."""

import math
import time

import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import Memoryless
from nectosome.drives import Chain, DeadTime, Sensor, respond
from nectosome.rigs import RigError, SimulatedRig

from .faulty import FREQUENCY, GAIN, plant, sensor, simulated


def critically_damped(t: float) -> float:
    """1 - (1 + w t) exp(-w t), of a step at 0."""
    x = FREQUENCY * max(t, 0.0)
    return 1 - (1 + x) * math.exp(-x)


@pytest.mark.parametrize("delay", [0.0, 0.01])
def test_a_held_command_is_answered_after_the_delay_by_the_step_response(delay):
    """Exactly: 20 kPa lead to 4 mm at last, by (1 - (1 + w t) exp(-w t))."""
    rig = SimulatedRig(plant(), dt=2e-3, delay=delay)
    rig.open()
    rig.write([2e4])
    for k in range(1, 40):
        rig.wait(k * 0.01)
        assert rig.now() == pytest.approx(k * 0.01, rel=1e-12)
        assert rig.measure() == pytest.approx((2e4 * GAIN * critically_damped(rig.now() - delay),), abs=1e-12)


def test_it_answers_any_commands_as_the_block_does():
    """Written every 10 ms and held, as `respond` holds samples of 2 ms; a dead time in front of it is its delay."""
    commands = np.random.default_rng(0).uniform(-6e4, 6e4, 50)
    rig = SimulatedRig(plant(), dt=2e-3, delay=0.01)
    rig.open()
    for k, command in enumerate(commands):
        rig.wait(k * 0.01)
        rig.measure()
        rig.write([command])
    late = np.concatenate([[0.0], commands])[:50]
    expected = respond(plant(), np.repeat(late, 5), 2e-3, hold="zero")[::5]
    assert np.allclose(rig.outputs, expected, rtol=0, atol=1e-12)
    behind = Chain((DeadTime(jnp.asarray(0.01)), plant()))
    assert np.allclose(rig.outputs, respond(behind, np.repeat(commands, 5), 2e-3, hold="zero")[::5], rtol=0, atol=1e-12)


def test_waiting_at_once_or_in_pieces_is_the_same():
    ends = []
    for pieces in (1, 7, 50):
        rig = SimulatedRig(plant(), dt=2e-3, delay=0.006)
        rig.open()
        rig.write([3e4])
        for k in range(pieces):
            rig.wait((k + 1) * 0.1 / pieces)
        ends.append(rig.true)
    assert ends[0] == ends[2]
    assert ends[0] == ends[1]


def test_noise_is_the_sensor_s_and_the_truth_is_kept_beside_it():
    """0.02 mm of noise at rest; the truth is what was there at each reading."""
    rig = simulated()
    rig.open()
    readings = np.concatenate([rig.measure() for _ in range(1000)])
    assert readings.std() == pytest.approx(2e-5, rel=0.08)
    assert abs(readings.mean()) < 3e-6
    assert rig.outputs == [0.0] * 1000


def test_a_sensor_ends_at_its_range_and_the_truth_does_not():
    near = Sensor(jnp.asarray(0.0), jnp.asarray(-1e-3), jnp.asarray(1e-3))
    rig = SimulatedRig(plant(), near, dt=2e-3)
    rig.open()
    rig.write([5e4])
    rig.wait(1.0)
    assert rig.measure() == (1e-3,)
    assert rig.true == pytest.approx(0.01, rel=1e-6)


def test_a_vent_acts_at_once_whatever_is_on_its_way():
    rig = SimulatedRig(plant(), dt=2e-3, delay=0.02)
    rig.open()
    rig.write([6e4])
    rig.vent()
    rig.wait(1.0)
    assert rig.measure() == (0.0,)


def test_opened_again_it_is_at_rest_and_its_clock_goes_on():
    rig = SimulatedRig(plant(), sensor(), dt=2e-3)
    for _ in range(2):
        before = rig.now()
        rig.open()
        assert rig.true == 0.0
        rig.write([6e4])
        rig.wait(rig.now() + 0.1)
        assert rig.true > 1e-3
        assert rig.now() > before
        rig.close()
    with pytest.raises(RigError, match="before it was opened"):
        rig.measure()


def test_names_and_units_are_given_or_those_of_an_actuator():
    assert (simulated().commands, simulated().measurements) == ({"pressure": "Pa"}, {"displacement": "m"})
    rig = SimulatedRig(plant(), command=("torque", "N m"), measurement=("angle", "rad"))
    rig.open()
    with pytest.raises(RigError, match="nan N m"):
        rig.write([math.nan])
    assert (rig.commands, rig.measurements) == ({"torque": "N m"}, {"angle": "rad"})


def test_connected_it_is_measured_at_rest_and_takes_no_command():
    rig = SimulatedRig(plant(), dt=2e-3)
    rig.connect()
    with pytest.raises(RigError, match="before it was opened"):
        rig.write([2e4])
    rig.wait(0.1)
    assert rig.measure() == (0.0,)
    rig.vent()
    rig.close()
    with pytest.raises(RigError, match="before it was opened"):
        rig.measure()


@pytest.mark.parametrize("command", [math.nan, math.inf])
def test_a_command_that_is_none_is_refused(command):
    rig = simulated()
    with pytest.raises(RigError, match="before it was opened"):
        rig.write([0.0])
    rig.open()
    with pytest.raises(RigError, match=f"{command:g} Pa"):
        rig.write([command])
    rig.wait(0.1)
    assert rig.true == 0.0


def test_in_real_time_it_answers_as_in_virtual_time_and_takes_that_time():
    """0.2 s of a step: a sample read at another time gives the answer of that time."""
    rig = SimulatedRig(plant(), dt=1e-3, pace="real")
    rig.open()
    start = rig.now()
    rig.write([2e4])
    for k in range(1, 21):
        rig.wait(start + k * 0.01)
        before, (y,), after = rig.now() - start, rig.measure(), rig.now() - start
        assert k * 0.01 <= before
        low, high = (2e4 * GAIN * critically_damped(t) for t in (before - 2e-3, after + 2e-3))
        assert low <= y <= high
    assert time.perf_counter() - start >= 0.2


class Traced(Memoryless):
    """A gain that counts how often it is traced."""

    count = 0
    gain: jnp.ndarray

    def value(self, u):
        type(self).count += 1
        return self.gain * u


def test_one_program_serves_all_rigs_of_a_structure_and_all_waits():
    Traced.count = 0
    rigs = [SimulatedRig(Traced(jnp.asarray(gain)), dt=1e-3) for gain in (1e-7, 2e-7)]
    rigs[0].open()
    before = Traced.count
    rigs[1].open()
    for n, rig in enumerate(rigs):
        rig.write([1e4])
        for k in (1, 5, 6, 50):
            rig.wait(k * 1e-3)
        assert rig.measure() == pytest.approx(((n + 1) * 1e-3,))
    assert Traced.count == before
