"""A rig file says all that is needed of a rig; each mistake in it is told with its place, before anything is opened."""

import math
from pathlib import Path

import numpy as np
import pytest

from nectosome.controllers import eased, wave
from nectosome.rigs import actuator_bench
from nectosome.rigs.devices.dynamixel import Bus, Dynamixel, Servo
from nectosome.rigs.devices.imu import IMU, SerialIMU
from nectosome.rigs.devices.ni import Input, NationalInstruments, Output, Watchdog, Wiring
from nectosome.rigs.devices.serial_line import SerialLink
from nectosome.rigs.devices.serial_motor import MotorLink, SerialMotor
from nectosome.rigs.devices.serial_text import PrintedNumber, PrintingBoard, SentCommand, SerialText
from nectosome.rigs.devices.text_scale import TextScale
from nectosome.rigs.guards import CommandLimits, Limits, MeasurementLimits
from nectosome.rigs.rig_file import load_rig
from nectosome.rigs.simulated_rig import SimulatedRig
from nectosome.units import InputError

from .tail import save_tail

EXAMPLES = Path(__file__).parents[2] / "examples" / "rigs"
NI = (EXAMPLES / "fishtail_ni.yaml").read_text(encoding="utf-8")
SERVO = (EXAMPLES / "servo_dynamixel.yaml").read_text(encoding="utf-8")
SIMULATED = (EXAMPLES / "fishtail_simulated.yaml").read_text(encoding="utf-8")
LINEAR = "gain: 40 mm/bar, frequency: 18.6 rad/s, damping: 1.0, noise: 0.05 mm"
SAVED = SIMULATED.replace(LINEAR, "model: tail.nc, real_time: true")
MOTOR = (EXAMPLES / "motor_serial.yaml").read_text(encoding="utf-8")
BENCH = (EXAMPLES / "fins_bench.yaml").read_text(encoding="utf-8")


def test_every_example_is_a_rig():
    names = {path.stem for path in EXAMPLES.glob("*.yaml") if load_rig(path).rig.commands}
    assert {
        "fishtail_ni",
        "fishtail_simulated",
        "motor_serial",
        "servo_dynamixel",
        "fins_bench",
        "fin_arduino",
    } <= names


def test_a_simulated_actuator_is_a_linear_model():
    """1 kPa leads to 40e-2 mm; its noise and its time are those of the file."""
    file = load_rig(EXAMPLES / "fishtail_simulated.yaml")
    tail = file.rig.devices["tail"]
    assert isinstance(tail, SimulatedRig)
    assert (tail.pace, tail.dt, file.dt) == ("virtual", 1e-3, 5e-3)
    assert (file.rig.commands, file.rig.measurements) == ({"tail.pressure": "Pa"}, {"tail.displacement": "m"})
    assert file.unit_size("tail.pressure") == 1e5
    assert [*file.models] == ["tail.pressure"]
    file.rig.open()
    file.rig.write((1e3,))
    file.rig.wait(3.0)
    assert tail.true == pytest.approx(0.40e-3, rel=1e-9)
    assert np.std([file.rig.measure()[0] for _ in range(300)]) == pytest.approx(5e-5, rel=0.2)


def test_simulated_actuators_have_noises_of_their_own(tmp_path):
    """Of 50 pairs of readings at rest no two are the same; each has its deviation of 0.05 mm within a third."""
    two = SIMULATED.replace("  tail: {", "  left: {kind: simulated, " + LINEAR + "}\n  tail: {")
    two = two.replace("commands:\n", "commands:\n  left.pressure: {low: -1 bar, high: 1 bar, slew: 1 bar/s}\n")
    two = two.replace("measurements:\n", "measurements:\n  left.displacement: {least: -25 mm, most: 25 mm}\n")
    (tmp_path / "two.yaml").write_text(two)
    rig = load_rig(tmp_path / "two.yaml").rig
    rig.connect()
    readings = np.array([rig.measure() for _ in range(50)])
    assert (readings[:, 0] != readings[:, 1]).all()
    assert readings.std(axis=0) == pytest.approx(5e-5, rel=1 / 3)


def test_a_simulated_actuator_may_be_a_saved_model_beside_its_file(tmp_path):
    save_tail(tmp_path / "tail.nc")
    path = tmp_path / "rig.yaml"
    path.write_text(SAVED)
    file = load_rig(path)
    tail = file.rig.devices["tail"]
    assert isinstance(tail, SimulatedRig)
    assert tail.pace == "real"
    assert file.models["tail.pressure"].noise == 5e-5
    path.write_text(SAVED.replace("tail.nc", "gone.nc"))
    with pytest.raises(InputError, match=r"gone\.nc") as told:
        load_rig(path)
    assert (told.value.field, told.value.line) == ("devices.tail.model", 7)


def test_the_fishtail_has_round_values():
    """To the last bit: two valves of -1 to 1 bar over 10 V, +-0.6 bar at 3.8 bar/s, +-25 mm."""
    file = load_rig(EXAMPLES / "fishtail_ni.yaml")
    tail = file.rig.devices["tail"]
    assert isinstance(tail, NationalInstruments)
    valves = Output("Dev1/ao0", 5.0, 2e4, "Pa"), Output("Dev1/ao1", 5.0, -2e4, "Pa")
    assert tail.wiring == Wiring({"pressure": valves}, {"displacement": Input("Dev1/ai0", 2.5, 0.01, "m", 0.0, 5.0)})
    assert file.limits == Limits(
        {"tail.pressure": CommandLimits(-6e4, 6e4, 3.8e5)},
        {"tail.displacement": MeasurementLimits(-0.025, 0.025, 5e-3)},
    )
    assert file.dt == 5e-3


def test_the_others_have_too():
    file = load_rig(EXAMPLES / "servo_dynamixel.yaml")
    servo = file.rig.devices["servo"]
    assert isinstance(servo, Dynamixel)
    assert servo.bus == Bus("/dev/ttyUSB0", {"angle": Servo(1, speed=5.0)}, 57_600, 0.2)
    assert file.limits.commands["servo.angle"].slew == 4.0
    file = load_rig(EXAMPLES / "motor_serial.yaml")
    motor = file.rig.devices["motor"]
    assert isinstance(motor, SerialMotor)
    assert motor.controller == MotorLink("/dev/ttyACM0", timeout=0.02, watchdog=0.2)
    assert (file.limits.commands["motor.speed"], file.dt) == (CommandLimits(0.0, 25.0, 50.0), 0.02)


def test_a_board_that_prints_has_them_too():
    """27 uN/count from 81234 counts on, a converter at an end of its 24 bits sees nothing, 90 deg are an angle of 0."""
    file = load_rig(EXAMPLES / "fin_arduino.yaml")
    bench = file.rig.devices["bench"]
    assert isinstance(bench, SerialText)
    degree = math.pi / 180
    assert bench.board == PrintingBoard(
        "/dev/ttyACM0",
        {"thrust": PrintedNumber(2, TextScale(27e-6, "N", 81234.0, 1.0 - 2**23, 2**23 - 2.0))},
        {"fin": SentCommand("A{:.1f}\n", TextScale(degree, "rad", 90.0, 0.0, 180.0, 0.0))},
        separator=",",
        clock=1,
        timeout=0.2,
    )
    assert file.limits.commands["bench.fin"] == CommandLimits(-60 * degree, 60 * degree, 300 * degree)


def test_inertial_measurement_units_are_on_a_bus_or_behind_a_microcontroller(tmp_path):
    """30 m/s2 and 400 deg/s need the ranges of 4 g and 500 deg/s; 50 Hz has the filter of 44 Hz."""
    path = tmp_path / "rig.yaml"
    path.write_text(
        "dt: 10 ms\n"
        "devices:\n"
        "  hull: {kind: imu, bus: 2, address: 0x69, acceleration: 30 m/s2, rate: 400 deg/s, bandwidth: 50 Hz}\n"
        "  fish: {kind: serial_imu, port: /dev/ttyUSB0, baud: 9600, timeout: 150 ms, attempts: 3}\n"
        "measurements:\n"
        "  hull.wz: {least: -400 deg/s, most: 400 deg/s}\n"
        "  fish.temperature: {least: 0 °C, most: 60 °C}\n"
    )
    file = load_rig(path)
    hull, fish = file.rig.devices.values()
    assert isinstance(hull, IMU) and isinstance(fish, SerialIMU)
    assert (hull.sensor.bus, hull.sensor.address, hull.sensor.ranges) == (2, 0x69, (1, 1, 3))
    assert fish.link == SerialLink("/dev/ttyUSB0", 9600, 0.15, attempts=3)
    assert file.rig.commands == {}
    assert list(file.rig.measurements)[:3] == ["hull.ax", "hull.ay", "hull.az"]
    for wrong, field in (("acceleration: 30 m/s2", "acceleration: 200 m/s2"), ("attempts: 3", "attempts: 0")):
        (tmp_path / "wrong.yaml").write_text(path.read_text().replace(wrong, field))
        with pytest.raises(InputError, match=field.split(":")[0]):
            load_rig(tmp_path / "wrong.yaml")


def test_a_bench_joins_its_devices():
    """60 deg and 300 deg/s in rad, 70 °C in K; the load cell, which has no command, counts 8 N a volt from 2.5 V."""
    file = load_rig(EXAMPLES / "fins_bench.yaml")
    assert file.rig.commands == {"servos.left": "rad", "servos.right": "rad"}
    assert file.rig.measurements == {
        "servos.left": "rad", "servos.left.current": "A", "servos.left.temperature": "K",
        "servos.right": "rad", "servos.right.current": "A", "servos.right.temperature": "K",
        "cell.thrust": "N",
    }  # fmt: skip
    assert file.limits.commands["servos.right"] == pytest.approx(
        CommandLimits(-math.pi / 3, math.pi / 3, 5 * math.pi / 3)
    )
    warm = file.limits.measurements["servos.left.temperature"]
    assert (warm.least, warm.most) == pytest.approx((273.15, 343.15), abs=1e-9)
    cell = file.rig.devices["cell"]
    assert isinstance(cell, NationalInstruments)
    assert cell.wiring.inputs["thrust"].measured(3.0) == 4.0


def test_what_is_left_out_has_its_default_and_the_rest_is_read(tmp_path):
    path = tmp_path / "rig.yaml"
    text = NI.replace("    # watchdog:", "    watchdog:").replace("error: 5 mm", "error: 5 mm, error_time: 200 ms")
    path.write_text(text + "guards: {overruns_in_row: 3}\n")
    file = load_rig(path)
    assert (file.limits.measurements["tail.displacement"].error_time, file.limits.overruns_in_row) == (0.2, 3)
    assert (file.limits.saturated_time, file.limits.frozen_time) == (2.0, 0.25)
    tail = file.rig.devices["tail"]
    assert isinstance(tail, NationalInstruments)
    assert tail.wiring.watchdog == Watchdog("cDAQ1", 0.1)


PRESSURE, LASER = "commands.tail.pressure", "measurements.tail.displacement"
WRONG = {  # what stands there, what instead, the field, and words of the message
    "an unknown kind": (NI, "kind: ni", "kind: nidaq", "devices.tail", 'no kind "nidaq".*ni'),
    "no kind": (NI, "    kind: ni\n", "", "devices.tail", "kind is missing.*dynamixel.*ni"),
    "an empty kind": (NI, "kind: ni", "kind:", "devices.tail.kind", "kind is missing"),
    "no devices": (NI, NI[NI.index("devices:") : NI.index("commands:")], "", "devices", "missing"),
    "no device": (NI, NI[NI.index("devices:") : NI.index("commands:")], "devices: {}\n", "devices", "at least 1"),
    "a device's name": (MOTOR, "  motor: {kind", "  The Motor: {kind", "devices.The Motor", "as a name"),
    "no limits": (NI, NI[NI.index("commands:") : NI.index("measurements:")], "", PRESSURE, "low, high and slew"),
    "limits of nothing": (NI, "  tail.pressure: {low", "  tail.presure: {low", "commands.tail.presure", "tail"),
    "a measurement of nothing": (BENCH, "cell.thrust: {least", "cell.force: {least", "measurements.cell.force",
                                 "no measurement.*cell.thrust"),
    "a command for a sensor": (NI, "measurements:", "  tail.displacement: {low: 0 m, high: 1 m, slew: 1 m/s}\n"
                               "measurements:", "commands.tail.displacement", "no command"),
    "no rate": (NI, ", slew: 3.8 bar/s", "", f"{PRESSURE}.slew", "missing"),
    "no sensor's slope": (NI, "slope: 10 mm/V, ", "", "devices.tail.inputs.displacement.slope", "missing"),
    "no range": (NI, "high: 0.6 bar, ", "", f"{PRESSURE}.high", "missing"),
    "no valves": (NI, NI[NI.index("      pressure:") : NI.index("    inputs:")], "      pressure: []\n",
                  "devices.tail.outputs.pressure", "at least 1"),
    "an unknown field": (NI, "slew", "slow", f"{PRESSURE}.slow", "no field"),
    "another unit": (NI, "3.8 bar/s", "3.8 bar", f"{PRESSURE}.slew", "is in Pa, and Pa/s is needed"),
    "another unit of volts": (NI, "slope: 0.2 bar/V", "slope: 0.2 V/bar", "devices.tail.outputs.pressure.0.slope",
                              "not per volt"),
    "two units of one command": (NI, "slope: -0.2 bar/V", "slope: -0.2 N/V", "devices.tail.outputs.pressure.1.slope",
                                 "one command has one unit"),
    "another unit of error": (NI, "error: 5 mm", "error: 5 kPa", f"{LASER}.error", "is in Pa, and m is needed"),
    "another unit of angles": (BENCH, "left: {low: -60 deg", "left: {low: -60 mm", "commands.servos.left.low",
                               "is in m, and rad is needed"),
    "no unit": (NI, "3.8 bar/s", "3.8", f"{PRESSURE}.slew", "no unit"),
    "an unknown unit": (NI, "3.8 bar/s", "3.8 baz/s", f"{PRESSURE}.slew", "baz"),
    "no unit of time": (NI, "dt: 5 ms", "dt: 5", "dt", "no unit"),
    "NaN": (NI, "3.8 bar/s", ".nan", f"{PRESSURE}.slew", "finite"),
    "NaN bar": (NI, "low: -0.6 bar", "low: nan bar", f"{PRESSURE}.low", "finite"),
    "infinite": (NI, "error: 5 mm", "error: .inf", f"{LASER}.error", "finite"),
    "a zero rate": (NI, "3.8 bar/s", "0 bar/s", f"{PRESSURE}.slew", "above 0"),
    "a rate below 0": (NI, "3.8 bar/s", "-3.8 bar/s", f"{PRESSURE}.slew", "above 0"),
    "a temperature as a difference": (BENCH, "right.temperature: {least: 0 °C",
                                      "right.temperature: {error: 5 °C, least: 0 °C",
                                      "measurements.servos.right.temperature.error", "difference of two"),
    "no time": (NI, "dt: 5 ms", "dt: 0 s", "dt", "more than 0 s"),
    "0 not within": (NI, "low: -0.6 bar", "low: 0.1 bar", f"{PRESSURE}.low", "0 must be within"),
    "no room": (NI, "least: -25 mm", "least: 25 mm", f"{LASER}.least", "no room"),
    "more than the valve's": (NI, "high: 0.6 bar", "high: 1.1 bar", f"{PRESSURE}.high", "Dev1/ao0.*10.5 V"),
    "a valve without slope": (NI, "slope: -0.2 bar/V", "slope: 0 bar/V", "devices.tail.outputs.pressure.1",
                              "Dev1/ao1.*slope"),
    "a sensor without range": (NI, "high: 5 V}", "high: 0 V}", "devices.tail.inputs.displacement", "not empty"),
    "a short watchdog": (NI, "    inputs:", "    watchdog: {device: a, timeout: 5 ms}\n    inputs:",
                         "devices.tail.watchdog.timeout", "between"),
    "a list as number": (NI, "3.8 bar/s", "[1, 2]", f"{PRESSURE}.slew", "no quantity"),
    "a group as number": (NI, "error: 5 mm", "error: {a: 1}", f"{LASER}.error", "no quantity"),
    "half a count": (NI, "commands:", "guards: {overruns_in_row: 1.5}\ncommands:", "guards.overruns_in_row",
                     "whole number"),
    "too fast a servo": (SERVO, "speed: 5 rad/s", "speed: 2000 rad/s", "devices.servo.servos.angle.speed",
                         "786 rad/s"),
    "too far a servo": (SERVO, "high: 60 deg", "high: 200 deg", "commands.servo.angle.high", "beyond its range"),
    "a servo's number": (SERVO, "number: 1,", "number: 300,", "devices.servo.servos.angle.number", "0 to 252"),
    "one number twice": (BENCH, "number: 2", "number: 1", "devices.servos.servos.right.number", "number of left"),
    "a servo's watchdog": (SERVO, "watchdog: 0.2 s", "watchdog: 3 s", "devices.servo.watchdog", "0.02 to 2.54 s"),
    "nothing to record": (BENCH, "[current, ", "[torque, ", "devices.servos.record.0", "not known here.*current"),
    "what follows nothing": (BENCH, "error: 15 deg}\n  servos.right: {least", "follows: left}\n  servos.right: {least",
                             "measurements.servos.left.follows", "no command.*servos.left"),
    "no port": (MOTOR, "port: /dev/ttyACM0, ", "", "devices.motor.port", "missing"),
    "no acceleration": (MOTOR, "50 rad/s2", "50 rad/s", "commands.motor.speed.slew", "rad/s2 is needed"),
    "a motor's timeout": (MOTOR, "timeout: 20 ms", "timeout: 0 ms", "devices.motor.timeout", "more than 0 s"),
    "a motor's watchdog": (MOTOR, "watchdog: 0.2 s", "watchdog: 20 ms", "devices.motor.watchdog",
                           "between two samples"),
    "no frequency of a model": (SIMULATED, "frequency: 18.6 rad/s, ", "", "devices.tail.frequency",
                                "missing: give model, or gain"),
    "two models": (SIMULATED, "damping: 1.0", "model: tail.nc", "devices.tail.gain", "belongs to a linear model"),
    "a gain without a command": (SIMULATED, "gain: 40 mm/bar", "gain: 46 mm", "devices.tail.gain", "measurement per"),
    "noise of another unit": (SIMULATED, "noise: 0.05 mm", "noise: 0.05 deg", "devices.tail.noise", "m is needed"),
    "no gain at all": (SIMULATED, "gain: 40 mm/bar", "gain: 0 mm/bar", "devices.tail.gain", "more than 0"),
    "a simulated sensor's range": (SIMULATED, SIMULATED[SIMULATED.index("measurements:") :], "", LASER,
                                   "needs least and most"),
    "a group that is none": (MOTOR, MOTOR[MOTOR.index("commands:") : MOTOR.index("measurements:")], "commands: 3\n",
                             "commands", "does not fit"),
}  # fmt: skip


def test_a_simulated_actuator_has_the_units_of_its_gain(tmp_path):
    """A servo of 20 deg/V, from its voltage to its angle, which is rehearsed, tuned and run like any other."""
    text = (
        "dt: 10 ms\ndevices: {fin: {kind: simulated, gain: 20 deg/V, frequency: 20 rad/s, noise: 0.1 deg, "
        "command: voltage, measurement: angle}}\n"
        "commands: {fin.voltage: {low: -5 V, high: 5 V, slew: 100 V/s}}\n"
        "measurements: {fin.angle: {least: -120 deg, most: 120 deg, error: 60 deg}}\n"
    )
    (tmp_path / "rig.yaml").write_text(text)
    told = load_rig(tmp_path / "rig.yaml")
    assert (told.rig.commands, told.rig.measurements) == ({"fin.voltage": "V"}, {"fin.angle": "rad"})
    reference = eased(wave("sine", 4.0, told.dt, amplitude=np.radians(30), frequency=0.5), 1.0, told.dt)
    bench = actuator_bench(told.rig, told.limits, told.dt, reference, model=told.models["fin.voltage"])
    assert len(bench.rehearse()) == 1
    (run,) = bench.runs([tmp_path / "run.nc"])
    assert run.status == "finished" and bench.errors(run)["true"][0] < 1.0
    assert 1.3 < np.abs(run.data["fin.voltage.command"].values).max() < 1.7


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


def test_the_form_of_a_single_device_is_refused_with_what_to_write(tmp_path):
    path = tmp_path / "rig.yaml"
    path.write_text("dt: 5 ms\nkind: simulated\ngain: 46 mm/bar\nlimits: {low: -0.6 bar}\n")
    with pytest.raises(InputError, match=r"devices: \{NAME: \{kind: \.\.\.\}\}.*commands: \{NAME\.CHANNEL") as told:
        load_rig(path)
    assert (told.value.line, told.value.field) == (2, "kind")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty.*at least dt, devices"),
        (b"- ni\n", "no named fields"),
        (b"dt: 5 ms\n  devices: [", "line 2: this is not YAML"),
        (b"dt: 5 ms\ndt: 5 ms\n", "line 2: .*twice"),
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
