"""Dynamixel servos: packets byte for byte, how they are opened, read and set, and how they stop."""

import importlib
import math
import sys
import time

import pytest

from nectosome.rigs import RigError
from nectosome.rigs.devices.dynamixel import Bus, Dynamixel, Servo
from nectosome.rigs.devices.dynamixel_models import MODELS
from nectosome.units import InputError

from .servo_emulator import (
    ACCESS_ERROR,
    DRIVE_MODE,
    GOAL,
    LEAST,
    MOST,
    OPERATING_MODE,
    PING,
    PRESENT,
    PROFILE_VELOCITY,
    READ,
    STATUS,
    SYNC_WRITE,
    TORQUE,
    TROUBLE,
    WATCHDOG,
    WRITE,
    EmulatedServo,
    Emulator,
    packet,
)

# Packets and answers of a servo of model 1030, firmware 38: examples of ROBOTIS e-Manual, "DYNAMIXEL Protocol 2.0"
PUBLISHED = {
    "ping": ("FF FF FD 00 01 03 00 01 19 4E", "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D"),
    "read": ("FF FF FD 00 01 07 00 02 84 00 04 00 1D 15", "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0"),
    "write": ("FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89", "FF FF FD 00 01 04 00 55 00 A1 0C"),
}


@pytest.fixture
def bus():
    with Emulator() as bus:
        yield bus


@pytest.fixture
def servo(bus):
    return bus.first


@pytest.fixture
def rig(bus):
    rig = Dynamixel(Bus(bus.path, {"fin": Servo()}))
    yield rig
    rig.close()


@pytest.fixture
def sdk(bus):
    """The vendor's packets on a line to the emulator."""
    sdk = importlib.import_module("dynamixel_sdk")
    port = sdk.PortHandler(bus.path)
    port.setBaudRate(57_600)
    yield sdk.Protocol2PacketHandler(), port
    port.closePort()


@pytest.mark.parametrize("name", PUBLISHED)
def test_the_emulator_answers_published_packets_with_the_published_bytes(name):
    with Emulator(EmulatedServo(model=1030, firmware=38)) as bus:
        bus.first.table[PRESENT] = 166
        question, answer = map(bytes.fromhex, PUBLISHED[name])
        assert bus.heard(question) == answer


@pytest.mark.parametrize(
    ("made", "published"),
    [
        (packet(1, PING), PUBLISHED["ping"][0]),
        (packet(0xFE, PING), "FF FF FD 00 FE 03 00 01 31 42"),
        (packet(2, STATUS, b"\x00\x06\x04\x26"), "FF FF FD 00 02 07 00 55 00 06 04 26 6F 6D"),
        (packet(1, READ, b"\x84\x00\x04\x00"), PUBLISHED["read"][0]),
        (packet(2, STATUS, b"\x00\x1f\x08\x00\x00"), "FF FF FD 00 02 08 00 55 00 1F 08 00 00 BA BE"),
        (packet(1, WRITE, b"\x74\x00\x00\x02\x00\x00"), PUBLISHED["write"][0]),
        (packet(1, 0x08), "FF FF FD 00 01 03 00 08 2F 4E"),
    ],
)
def test_packets_are_the_published_ones(made, published):
    assert made == bytes.fromhex(published)


def test_a_packet_in_pieces_after_noise_is_understood():
    question, answer = map(bytes.fromhex, PUBLISHED["ping"])
    with Emulator(EmulatedServo(model=1030, firmware=38)) as bus:
        assert bus.heard(b"\x00\xff" + question[:5]) == b""
        assert bus.heard(question[5:]) == answer


def test_the_sdk_parses_what_the_emulator_answers(servo, sdk):
    """Also an answer with a header within, which is stuffed: FF FF FD 00 is 0xFDFFFF."""
    protocol, port = sdk
    assert protocol.ping(port, 1) == (1170, 0, 0)
    servo.table[PRESENT] = 0x00FDFFFF
    assert packet(1, STATUS, b"\x00\xff\xff\xfd\x00")[9:14] == b"\xff\xff\xfd\xfd\x00"
    assert protocol.read4ByteTxRx(port, 1, PRESENT) == (0x00FDFFFF, 0, 0)
    assert protocol.write4ByteTxRx(port, 1, GOAL, 512) == (0, 0)
    assert servo.table[GOAL] == 512
    assert protocol.write1ByteTxRx(port, 1, TROUBLE, 1) == (0, ACCESS_ERROR)


def test_it_opens_without_a_jump():
    """From 40 degrees off: torque only with the goal where it stands, and then no faster than 0.5 rad/s."""
    with Emulator(EmulatedServo(present=2048 + 100)) as bus:
        servo = bus.first
        servo.table[PROFILE_VELOCITY], servo.table[OPERATING_MODE] = 0, 1
        rig = Dynamixel(Bus(bus.path, {"fin": Servo()}))
        began = time.monotonic()
        rig.open()
        assert time.monotonic() - began > (100 * 2 * math.pi / 4096 - 0.05) / 0.5
        writes = [parameters for instruction, parameters in servo.instructions if instruction == WRITE]
        order = [int.from_bytes(w[:2], "little") for w in writes]
        on = writes.index(bytes([TORQUE, 0, 1]))
        assert int.from_bytes(writes[on - 1][2:], "little") == 2148
        assert order[:on] == [TORQUE, WATCHDOG, OPERATING_MODE, PROFILE_VELOCITY, GOAL]
        assert order[on + 1 :] == [PROFILE_VELOCITY]
        assert [int.from_bytes(w[:2], "little") for i, w in servo.instructions if i == SYNC_WRITE] == [WATCHDOG, GOAL]
        assert servo.table[PROFILE_VELOCITY] * 0.229 * 2 * math.pi / 60 == pytest.approx(5.0, abs=0.024)
        rig.close()


def test_the_operating_mode_is_not_written_where_it_fits(servo, rig):
    """It is kept in a memory that wears out."""
    rig.open()
    assert not any(i == WRITE and p[:2] == bytes([OPERATING_MODE, 0]) for i, p in servo.instructions)


@pytest.mark.parametrize(("angle", "step"), [(0.0, 2048), (math.pi / 2, 3072), (-math.pi, 0), (math.pi - 1e-3, 4095)])
def test_angles_are_steps_of_a_turn(servo, rig, angle, step):
    rig.open()
    rig.write([angle])
    rig.measure()  # whose answer tells that the packet before has been heard
    assert servo.table[GOAL] == step


@pytest.mark.parametrize("angle", [math.pi, -3.15, 100.0])
def test_more_than_half_a_turn_is_refused(servo, rig, angle):
    rig.open()
    with pytest.raises(RigError, match=r"servo fin .* beyond its range of -180 to 179\.9 deg"):
        rig.write([angle])
    assert servo.table[GOAL] == 2048


def test_limits_of_the_servo_are_told(servo, rig):
    """Before anything is sent: a packet for all servos has no answer that could refuse it."""
    servo.table[MOST] = 3000
    rig.open()
    with pytest.raises(RigError, match=r"beyond its range of -180 to 83\.67 deg"):
        rig.write([2.0])
    assert servo.table[GOAL] == 2048


def test_ends_of_a_range_are_checked_before_and_after_a_servo_has_told_its_own(servo, rig):
    rig.check_command("fin", 2.0)
    with pytest.raises(RigError, match="beyond its range"):
        rig.check_command("fin", 3.2)
    servo.table[MOST] = 3000
    rig.open()
    with pytest.raises(RigError, match="beyond its range"):
        rig.check_command("fin", 2.0)


def test_a_servo_whose_limits_leave_0_out_is_not_driven(servo, rig):
    servo.table[LEAST] = 2100
    with pytest.raises(RigError, match=r"a command of 0 deg is beyond its range of 4\.57 to"):
        rig.open()
    assert not servo.powered


@pytest.mark.parametrize(
    ("number", "why"),
    [
        (29, "an MX servo with protocol 1.0: change its firmware"),
        (350, "an XL-320, which has a control table of its own"),
        (2020, "of the P series, which has"),
        (54024, "of the PRO series"),
        (4010, "not known"),
    ],
)
def test_another_model_is_not_driven(rig, servo, number, why):
    servo.table[0] = number
    with pytest.raises(RigError, match=rf"servo fin \(1\) at .*: model {number} is {why}.*one of the X series"):
        rig.open()
    assert not servo.powered


@pytest.mark.parametrize("number", MODELS)
def test_every_model_of_the_table_is_driven(rig, servo, number):
    servo.table[0] = number
    rig.open()
    rig.write([0.3])
    rig.measure()
    assert servo.table[GOAL] == 2244


@pytest.mark.parametrize(("mode", "why"), [(0x04, "times its motions"), (0x08, "takes torque on by itself")])
def test_drive_modes_that_are_not_safe_are_refused(rig, servo, mode, why):
    servo.table[DRIVE_MODE] = mode | 0x01
    with pytest.raises(RigError, match=f"{why}.*Take {mode} from it"):
        rig.open()
    assert not servo.table[TORQUE]


def test_hardware_errors_are_told_in_words(rig, servo):
    rig.open()
    servo.alert(0x20 | 0x04)
    with pytest.raises(RigError, match="hardware error: overheating, overload"):
        rig.measure()
    rig.vent()
    rig.close()
    with pytest.raises(RigError, match="overheating, overload"):
        rig.open()


def test_a_servo_that_is_blocked_on_its_way_to_0_is_told():
    with Emulator(EmulatedServo(present=2048 + 60)) as bus:
        servo = bus.first
        servo.frozen = True
        rig = Dynamixel(Bus(bus.path, {"fin": Servo()}))
        with pytest.raises(RigError, match=r"servo fin .*stays at 5\.27 deg"):
            rig.open()
        rig.vent()
        assert not servo.table[TORQUE]
        rig.close()


def test_without_packets_it_stops_by_itself_and_says_so(bus, servo):
    rig = Dynamixel(Bus(bus.path, {"fin": Servo(speed=1.0)}, watchdog=0.2))
    rig.open()
    rig.write([1.5])
    time.sleep(0.3)
    stopped = servo.table[PRESENT]
    assert 2048 < stopped < 2048 + 0.5 * 4096 / (2 * math.pi)
    with pytest.raises(RigError, match=r"no packet came for 0\.2 s"):
        rig.write([1.5])
    assert abs(servo.table[PRESENT] - stopped) <= 1
    rig.close()
    rig.open()  # forgets it
    rig.write([0.1])
    rig.close()


def test_a_frozen_servo_measures_the_same_angle(servo, rig):
    rig.open()
    servo.frozen = True
    rig.write([0.5])
    time.sleep(0.02)
    assert rig.measure() == (0.0,)


def test_communication_works_again_after_a_lost_answer(bus, rig):
    rig.open()
    bus.silent_from = 0.0
    with pytest.raises(RigError, match=r"There is no status packet.*baud rate"):
        rig.measure()
    bus.silent_from = math.inf
    assert rig.measure() == (0.0,)


def test_an_answer_that_belongs_to_another_question_is_no_angle(bus, rig, monkeypatch):
    """That of a write has no data; the SDK then gives its checksum for some."""
    rig.open()
    monkeypatch.setattr(bus, "heard", lambda data: packet(1, STATUS, b"\x00"))
    with pytest.raises(RigError, match="an answer of 2 bytes where 4 were asked for"):
        rig.measure()


def test_a_broken_line_is_told_as_such_each_time(bus, rig):
    rig.open()
    bus.pull()
    for _ in range(2):
        with pytest.raises(RigError, match="the line does not work"):
            rig.measure()


def test_venting_is_tried_again(bus, servo, rig, monkeypatch):
    rig.open()
    garble, bus.garbled = bus.garble, True
    answers = iter((garble, garble, lambda answer: answer))
    monkeypatch.setattr(bus, "garble", lambda answer: next(answers)(answer))
    rig.vent()
    assert not servo.table[TORQUE]


def test_torque_that_may_still_be_on_is_told(bus, rig):
    rig.open()
    bus.pull()
    with pytest.raises(RigError, match="torque may still be on: switch off its power"):
        rig.vent()


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"speed": 0.0}, "speed: .*known"),
        ({"speed": math.inf}, "speed: .*known"),
        ({"number": 253}, "number: 253; 0 to 252"),
        ({"zero": 4.0}, "zero: 229.183 deg"),
        ({"sign": 0}, "sign: 0; 1 or -1"),
    ],
)
def test_settings_of_a_servo_that_make_no_sense_are_refused(wrong, words):
    with pytest.raises(InputError, match=words):
        Servo(**wrong)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"watchdog": 0.0}, "watchdog: .*known"),
        ({"watchdog": 3.0}, "watchdog: .*known"),
        ({"servos": {}}, "servos: there are none"),
        ({"servos": {"left": Servo(2), "right": Servo(2)}}, r"servos\.right\.number: 2 is the number of left"),
        ({"record": ("speeds",)}, 'record: there is no "speeds".*speed'),
        ({"record": ("speed", "speed")}, "record: each is recorded once"),
    ],
)
def test_settings_of_a_bus_that_make_no_sense_are_refused(wrong, words):
    with pytest.raises(InputError, match=words):
        Bus("/dev/ttyUSB0", **({"servos": {"fin": Servo()}} | wrong))


def test_a_baud_rate_that_the_sdk_does_not_know_is_told(bus):
    with pytest.raises(RigError, match="baud rate of 1234"):
        Dynamixel(Bus(bus.path, {"fin": Servo()}, baud=1234)).open()


def test_a_machine_without_the_sdk_is_told_which_extra_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "dynamixel_sdk", None)
    with pytest.raises(RigError, match=r"dynamixel_sdk is missing: pip install 'nectosome\[rig\]'"):
        Dynamixel(Bus("/dev/ttyUSB0", {"fin": Servo()})).open()
