"""A rig file says all that is needed of a rig; each mistake in it is told with its place, before anything is opened."""

from pathlib import Path

import numpy as np
import pytest

from nectosome.rigs.dynamixel import Dynamixel, Servo
from nectosome.rigs.files import load_rig
from nectosome.rigs.guards import Limits
from nectosome.rigs.ni import Laser, NationalInstruments, Valve, Watchdog, Wiring
from nectosome.rigs.serial_motor import MotorLink, SerialMotor
from nectosome.rigs.simulated_rig import SimulatedRig
from nectosome.units import InputError

from .tail import save_tail

EXAMPLES = Path(__file__).parents[2] / "examples" / "rigs"
NI = (EXAMPLES / "fishtail_ni.yaml").read_text(encoding="utf-8")
SERVO = (EXAMPLES / "servo_dynamixel.yaml").read_text(encoding="utf-8")
SIMULATED = (EXAMPLES / "fishtail_simulated.yaml").read_text(encoding="utf-8")
LINEAR = "gain: 46 mm/bar\nfrequency: 18.6 rad/s\ndamping: 1.0\nnoise: 0.05 mm\n"
SAVED = SIMULATED.replace(LINEAR, "model: tail.nc\nreal_time: true\n")
MOTOR = (EXAMPLES / "motor_serial.yaml").read_text(encoding="utf-8")


def test_every_example_is_a_rig():
    assert len([load_rig(path) for path in EXAMPLES.glob("*.yaml")]) == 4


def test_a_simulated_rig_is_a_linear_model(tmp_path):
    """1 kPa leads to 46e-2 mm; its noise and its time are those of the file."""
    file = load_rig(EXAMPLES / "fishtail_simulated.yaml")
    assert isinstance(file.rig, SimulatedRig)
    assert (file.rig.pace, file.rig.dt, file.dt) == ("virtual", 1e-3, 5e-3)
    assert file.command_unit == ("bar", 1e5)
    file.rig.open()
    file.rig.write(1e3)
    file.rig.wait(3.0)
    assert file.rig.true == pytest.approx(0.46e-3, rel=1e-9)
    assert np.std([file.rig.measure() for _ in range(300)]) == pytest.approx(5e-5, rel=0.2)


def test_a_simulated_rig_may_be_a_saved_model_beside_its_file(tmp_path):
    save_tail(tmp_path / "tail.nc")
    path = tmp_path / "rig.yaml"
    path.write_text(SAVED)
    file = load_rig(path)
    assert isinstance(file.rig, SimulatedRig)
    assert file.rig.pace == "real"
    assert file.model is not None and file.model.noise == 5e-5
    path.write_text(SAVED.replace("tail.nc", "gone.nc"))
    with pytest.raises(InputError, match=r"gone\.nc") as told:
        load_rig(path)
    assert (told.value.field, told.value.line) == ("model", 6)


def test_the_fishtail_has_round_values():
    """To the last bit: two valves of -1 to 1 bar over 10 V, +-0.6 bar at 3.8 bar/s, +-25 mm."""
    file = load_rig(EXAMPLES / "fishtail_ni.yaml")
    assert isinstance(file.rig, NationalInstruments)
    valves = Valve("Dev1/ao0", 5.0, 2e4), Valve("Dev1/ao1", 5.0, -2e4)
    assert file.rig.wiring == Wiring(valves, Laser("Dev1/ai0", 2.5, 0.01, 0.0, 5.0))
    assert file.limits == Limits(low=-6e4, high=6e4, slew=3.8e5, least=-0.025, most=0.025, error=5e-3)
    assert file.dt == 5e-3


def test_the_others_have_too(tmp_path):
    file = load_rig(EXAMPLES / "servo_dynamixel.yaml")
    assert isinstance(file.rig, Dynamixel)
    assert file.rig.servo == Servo("/dev/ttyUSB0", 1, 57_600, 5.0, 0.2)
    assert file.limits.slew == 4.0
    file = load_rig(EXAMPLES / "motor_serial.yaml")
    assert isinstance(file.rig, SerialMotor)
    assert file.rig.controller == MotorLink("/dev/ttyACM0", 115_200, 0.02, 3.0, 0.2)
    assert (file.limits.low, file.limits.high, file.limits.slew, file.dt) == (0.0, 25.0, 50.0, 0.02)


def test_what_is_left_out_has_its_default_and_the_rest_is_read(tmp_path):
    path = tmp_path / "rig.yaml"
    path.write_text(NI + "  error_time: 200 ms\n  overruns_in_row: 3\nwatchdog: {device: cDAQ1, timeout: 100 ms}\n")
    file = load_rig(path)
    assert (file.limits.error_time, file.limits.overruns_in_row) == (0.2, 3)
    assert (file.limits.saturated_time, file.limits.frozen_time) == (2.0, 0.25)
    assert isinstance(file.rig, NationalInstruments)
    assert file.rig.wiring.watchdog == Watchdog("cDAQ1", 0.1)


WRONG = {  # what stands there, what instead, the field, and words of the message
    "an unknown kind": (NI, "kind: ni", "kind: nidaq", "kind", 'no rig "nidaq".* ni, dynamixel'),
    "no kind": (NI, "kind: ni", "", "kind", "missing.*ni, dynamixel, serial"),
    "an empty kind": (NI, "kind: ni", "kind:", "kind", "missing"),
    "no limits": (NI, NI[NI.index("limits:") :], "", "limits", "missing"),
    "no rate": (NI, "  slew: 3.8 bar/s\n", "", "limits.slew", 'missing.*"3.8 bar/s"'),
    "no sensor's slope": (NI, "slope: 10 mm/V, ", "", "laser.slope", "missing.*volt"),
    "no range": (NI, "  high: 0.6 bar\n", "", "limits.high", "missing.*Pressure"),
    "no valves": (NI, NI[NI.index("valves:") : NI.index("# Scaled")], "valves: []\n", "valves", "at least 1"),
    "an unknown field": (NI, "slew", "slow", "limits.slow", "no field"),
    "another unit": (NI, "3.8 bar/s", "3.8 bar", "limits.slew", "is a pressure. Pressure rate expected"),
    "another unit of volts": (NI, "slope: 0.2 bar/V", "slope: 0.2 V/bar", "valves.0.slope", "not a pressure per volt"),
    "another unit of error": (NI, "error: 5 mm", "error: 5 kPa", "limits.error", "is a pressure"),
    "no unit": (NI, "3.8 bar/s", "3.8", "limits.slew", "no unit"),
    "no unit of time": (NI, "dt: 5 ms", "dt: 5", "dt", "no unit"),
    "NaN": (NI, "3.8 bar/s", ".nan", "limits.slew", "finite"),
    "NaN bar": (NI, "low: -0.6 bar", "low: nan bar", "limits.low", "finite"),
    "infinite": (NI, "error: 5 mm", "error: .inf", "limits.error", "finite"),
    "a zero rate": (NI, "3.8 bar/s", "0 bar/s", "limits.slew", "above 0"),
    "a rate below 0": (NI, "3.8 bar/s", "-3.8 bar/s", "limits.slew", "above 0"),
    "no time": (NI, "dt: 5 ms", "dt: 0 s", "dt", "more than 0 s"),
    "0 not within": (NI, "low: -0.6 bar", "low: 0.1 bar", "limits.low", "0 must be within"),
    "no room": (NI, "least: -25 mm", "least: 25 mm", "limits.least", "no room"),
    "more than the valve's": (NI, "high: 0.6 bar", "high: 1.1 bar", "limits.high", "Dev1/ao0.*10.5 V"),
    "a valve without slope": (NI, "slope: -0.2 bar/V", "slope: 0 bar/V", "valves.1", "Dev1/ao1.*slope"),
    "a sensor without range": (NI, "high: 5 V}", "high: 0 V}", "laser", "Dev1/ai0.*not empty"),
    "a short watchdog": (NI, "limits:", "watchdog: {device: a, timeout: 5 ms}\nlimits:", "watchdog.timeout", "between"),
    "a list as number": (NI, "3.8 bar/s", "[1, 2]", "limits.slew", "no quantity"),
    "a group as number": (NI, "error: 5 mm", "error: {a: 1}", "limits.error", "Length expected"),
    "half a count": (NI, "limits:", "limits:\n  overruns_in_row: 1.5", "limits.overruns_in_row", "whole number"),
    "too fast a servo": (SERVO, "5 rad/s", "2000 rad/s", "speed", "786 rad/s"),
    "too far a servo": (SERVO, "high: 60 deg", "high: 200 deg", "limits.high", "half a turn"),
    "a servo's number": (SERVO, "number: 1", "number: 300", "number", "0 to 252"),
    "a servo's watchdog": (SERVO, "watchdog: 0.2 s", "watchdog: 10 ms", "watchdog", "0.02 to 2.54 s"),
    "no port": (MOTOR, "port: /dev/ttyACM0\n", "", "port", "missing"),
    "no acceleration": (MOTOR, "50 rad/s2", "50 rad/s", "limits.slew", "Angular acceleration expected"),
    "a motor's timeout": (MOTOR, "timeout: 20 ms", "timeout: 0 ms", "timeout", "more than 0 s"),
    "a motor's watchdog": (MOTOR, "watchdog: 0.2 s", "watchdog: 20 ms", "watchdog", "between two samples"),
    "no frequency of a model": (SIMULATED, "frequency: 18.6 rad/s\n", "", "frequency", "missing: give model, or gain"),
    "two models": (SIMULATED, "damping: 1.0", "model: tail.nc", "gain", "belongs to a linear model"),
    "no gain at all": (SIMULATED, "gain: 46 mm/bar", "gain: 0 mm/bar", "gain", "more than 0"),
    "a group that is none": (MOTOR, MOTOR[MOTOR.index("limits:") :], "limits: 3", "limits", "group of fields"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_mistake_is_told_with_file_line_field_and_what_is_allowed(tmp_path, name):
    text, old, new, field, words = WRONG[name]
    assert text.count(old) == 1
    path = tmp_path / "rig.yaml"
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=words) as told:
        load_rig(path)
    assert told.value.file == str(path)
    assert told.value.field == field
    if new and "missing" not in words:
        assert told.value.line is not None


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty.*at least a kind"),
        (b"- ni\n", "no named fields"),
        (b"kind: ni\n  dt: [", "line 2: this is not YAML"),
        (b"kind: ni\nkind: ni\n", "line 2: .*twice"),
        (b"\xff\xfe\x00", "not a text file"),
    ],
)
def test_a_file_that_is_none_is_told(tmp_path, content, words):
    path = tmp_path / "rig.yaml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=words):
        load_rig(path)


def test_a_file_that_is_not_there_or_cannot_be_read_is_told(tmp_path):
    for path in (tmp_path / "none.yaml", tmp_path):
        with pytest.raises(InputError, match="cannot be read"):
            load_rig(path)
