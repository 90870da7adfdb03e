"""Several Dynamixel servos on a bus: one packet for all, and what becomes of the others where one is faulty."""

import math
import time

import pytest

from nectosome.rigs import RigError
from nectosome.rigs.devices.dynamixel import Bus, Dynamixel, Servo

from .servo_emulator import (
    CURRENT,
    GOAL,
    PRESENT,
    SYNC_READ,
    SYNC_WRITE,
    TEMPERATURE,
    TORQUE,
    VELOCITY,
    VOLTAGE,
    WATCHDOG,
    EmulatedServo,
    Emulator,
)


@pytest.fixture
def two():
    """A servo of another model, mounted the other way round, beside one that is not."""
    with Emulator(EmulatedServo(3), EmulatedServo(7, model=1200)) as bus:
        yield bus


@pytest.fixture
def pair(two):
    rig = Dynamixel(Bus(two.path, {"left": Servo(3), "right": Servo(7, sign=-1)}, watchdog=2.0))
    yield rig
    rig.close()


def test_one_packet_asks_all_servos_and_one_sets_them(two, pair):
    """0.1 rad is 65.19 steps of 4096 a turn, 0.2 rad are 130.38."""
    pair.open()
    for servo in two.servos.values():
        servo.instructions.clear()
    pair.measure()
    pair.write([0.1, 0.2])
    time.sleep(0.05)
    read, write = (SYNC_READ, bytes([132, 0, 4, 0, 3, 7])), bytes([116, 0, 4, 0])
    for servo in two.servos.values():
        asked, (instruction, given) = servo.instructions
        assert asked == read
        assert (instruction, given[:4]) == (SYNC_WRITE, write)
    assert given[4:] == bytes([3]) + (2113).to_bytes(4, "little") + bytes([7]) + (1918).to_bytes(4, "little")


def test_zero_and_sign_say_how_angles_count(two):
    parts = {"left": Servo(3, zero=math.pi / 4), "right": Servo(7, zero=-math.pi / 8, sign=-1)}
    rig = Dynamixel(Bus(two.path, parts))
    two.servos[3].table[PRESENT] = 2048 + 512
    rig.connect()
    assert rig.measure() == pytest.approx((0.0, -math.pi / 8), abs=1e-12)
    rig.close()
    two.servos[3].table[PRESENT] = 2048
    rig.open()
    rig.write([math.pi / 8, math.pi / 16])
    time.sleep(0.05)
    assert (two.servos[3].table[GOAL], two.servos[7].table[GOAL]) == (2048 + 512 + 256, 2048 - 256 - 128)
    # half a turn to either side of the middle: -5/4 to 3/4 pi, and -9/8 to 7/8 pi, but for a step
    for which, (low, high) in {"left": (-5 / 4, 3 / 4), "right": (-9 / 8, 7 / 8)}.items():
        for angle in (low * math.pi + 2e-3, high * math.pi - 2e-3):
            rig.write([angle if name == which else 0.0 for name in parts])
        for angle in (low * math.pi - 2e-3, high * math.pi + 2e-3):
            with pytest.raises(RigError, match=rf"servo {which} .*beyond its range"):
                rig.write([angle if name == which else 0.0 for name in parts])
    rig.close()


def test_recorded_values_are_those_of_the_bytes_in_si(two):
    """Bytes as in the e-Manual's tables: 0.229 rev/min, 2.69 mA of an XW540, 1 mA of an XL330, 0.1 V, 1 °C."""
    record = ("temperature", "speed", "current", "voltage")
    rig = Dynamixel(Bus(two.path, {"left": Servo(3), "right": Servo(7, sign=-1)}, record=record))
    left, right = two.servos[3].table, two.servos[7].table
    left |= {TEMPERATURE: 31, VELOCITY: -100, CURRENT: 200, VOLTAGE: 119}
    right |= {TEMPERATURE: 29, VELOCITY: 50, CURRENT: -300, VOLTAGE: 51}
    assert list(rig.measurements.items())[:5] == [
        ("left", "rad"),
        ("left.temperature", "K"),
        ("left.speed", "rad/s"),
        ("left.current", "A"),
        ("left.voltage", "V"),
    ]
    rig.connect()
    told = dict(zip(rig.measurements, rig.measure(), strict=True))
    rig.close()
    assert told == pytest.approx(
        {
            "left": 0.0,
            "left.temperature": 304.15,
            "left.speed": -22.9 / 60 * 2 * math.pi,
            "left.current": 0.538,
            "left.voltage": 11.9,
            "right": 0.0,
            "right.temperature": 302.15,
            "right.speed": -11.45 / 60 * 2 * math.pi,
            "right.current": 0.3,
            "right.voltage": 5.1,
        },
        abs=1e-12,
    )


def test_a_model_that_measures_no_current_says_so(two):
    two.servos[7].table[0] = 1060
    rig = Dynamixel(Bus(two.path, {"left": Servo(3), "right": Servo(7)}, record=("current",)))
    with pytest.raises(RigError, match=r"servo right \(7\) .*XL430-W250 measures no current"):
        rig.open()
    assert not any(servo.powered for servo in two.servos.values())


@pytest.mark.parametrize("which", ["left", "right"])
@pytest.mark.parametrize(("fault", "words"), [("silent", "no status packet"), ("garbled", "Incorrect status packet")])
def test_the_servo_that_does_not_answer_is_named(two, pair, which, fault, words):
    pair.open()
    number = pair.bus.servos[which].number
    setattr(two.servos[number], fault, True)
    with pytest.raises(RigError, match=rf"servo {which} \({number}\) at .*{words}"):
        pair.measure()
    setattr(two.servos[number], fault, False)
    assert pair.measure() == (0.0, 0.0)


def test_a_hardware_error_of_one_of_two_is_told_and_both_are_vented(two, pair):
    pair.open()
    two.servos[3].alert(0x20)
    with pytest.raises(RigError, match=r"servo left \(3\) at .*hardware error: overload"):
        pair.measure()
    assert two.servos[7].table[TORQUE]
    pair.vent()
    assert not two.servos[7].table[TORQUE]


def test_no_servo_gets_torque_while_another_has_a_hardware_error(two, pair):
    two.servos[7].alert(0x04)
    with pytest.raises(RigError, match=r"servo right .*overheating"):
        pair.open()
    assert not any(servo.powered for servo in two.servos.values())


@pytest.mark.parametrize("silent", [3, 7])
def test_venting_reaches_every_servo_whatever_becomes_of_the_others(two, pair, silent):
    """A servo that hears and does not answer loses its torque as well; a person is told all the same."""
    pair.open()
    two.servos[silent].silent = True
    with pytest.raises(RigError, match=rf"\({silent}\).*torque may still be on") as told:
        pair.vent()
    assert str(told.value).count("switch off its power") == 1
    assert not any(servo.table[TORQUE] for servo in two.servos.values())


def test_a_pause_is_noticed_whichever_servo_has_stopped(two, pair):
    """The packet that sets them has no answer: their watchdogs are asked."""
    pair.open()
    pair.write([0.3, 0.3])
    two.servos[7].table[WATCHDOG] = 1  # waits 20 ms, as if packets had not reached it
    time.sleep(1.1)  # more than half of what they were told to wait
    assert two.servos[7].table[WATCHDOG] == 0xFF
    pair.measure()
    with pytest.raises(RigError, match=r"servo right \(7\) .*it has stopped"):
        pair.write([0.3, 0.3])


def test_a_watchdog_that_was_not_taken_is_told(two, pair, monkeypatch):
    right = two.servos[7]
    write = right._write
    monkeypatch.setattr(right, "_write", lambda address, data: 0 if address == WATCHDOG else write(address, data))
    with pytest.raises(RigError, match=r"servo right .*its watchdog is 0, and 100 was set"):
        pair.open()
