"""A Dynamixel servo: packets byte for byte, how it is opened, and how it stops."""

import importlib
import math
import sys
import time

import pytest

from nectosome.rigs import RigError
from nectosome.rigs.dynamixel import Dynamixel, Servo
from nectosome.units import InputError

from .servo_emulator import (
    ACCESS_ERROR,
    DRIVE_MODE,
    GOAL,
    MOST,
    OPERATING_MODE,
    PING,
    PRESENT,
    PROFILE_VELOCITY,
    READ,
    STATUS,
    TORQUE,
    TROUBLE,
    WATCHDOG,
    WRITE,
    Emulator,
    packet,
)

# Packets and answers of a servo of model 1030, firmware 38: examples of ROBOTIS e-Manual, "DYNAMIXEL Protocol 2.0"
PUBLISHED = {
    "ping": ("FF FF FD 00 01 03 00 01 19 4E", "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D"),
    "read": ("FF FF FD 00 01 07 00 02 84 00 04 00 1D 15", "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0"),
    "write": ("FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89", "FF FF FD 00 01 04 00 55 00 A1 0C"),
}


@pytest.fixture(autouse=True)
def _patience(monkeypatch):
    """The SDK waits 34 ms for an answer, which a busy machine may take to let the emulator's thread run."""
    monkeypatch.setattr("dynamixel_sdk.port_handler.LATENCY_TIMER", 100)


@pytest.fixture
def servo():
    with Emulator() as servo:
        yield servo


@pytest.fixture
def rig(servo):
    rig = Dynamixel(Servo(servo.path))
    yield rig
    rig.close()


@pytest.fixture
def sdk(servo):
    """The vendor's packets on a line to the emulator."""
    sdk = importlib.import_module("dynamixel_sdk")
    port = sdk.PortHandler(servo.path)
    port.setBaudRate(57_600)
    yield sdk.Protocol2PacketHandler(), port
    port.closePort()


@pytest.mark.parametrize("name", PUBLISHED)
def test_the_emulator_answers_published_packets_with_the_published_bytes(name):
    with Emulator(model=1030, firmware=38) as servo:
        servo.table[PRESENT] = 166
        question, answer = map(bytes.fromhex, PUBLISHED[name])
        assert servo.heard(question) == answer


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
    with Emulator(model=1030, firmware=38) as servo:
        assert servo.heard(b"\x00\xff" + question[:5]) == b""
        assert servo.heard(question[5:]) == answer


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
    with Emulator(present=2048 + 100) as servo:
        servo.table[PROFILE_VELOCITY], servo.table[OPERATING_MODE] = 0, 1
        rig = Dynamixel(Servo(servo.path))
        began = time.monotonic()
        rig.open()
        assert time.monotonic() - began > (100 * 2 * math.pi / 4096 - 0.05) / 0.5
        writes = [parameters for instruction, parameters in servo.instructions if instruction == WRITE]
        order = [int.from_bytes(w[:2], "little") for w in writes]
        on = writes.index(bytes([TORQUE, 0, 1]))
        assert int.from_bytes(writes[on - 1][2:], "little") == 2148
        assert order[:on] == [TORQUE, WATCHDOG, OPERATING_MODE, PROFILE_VELOCITY, GOAL]
        assert order[on + 1 :] == [WATCHDOG, GOAL, PROFILE_VELOCITY]
        assert servo.table[PROFILE_VELOCITY] * 0.229 * 2 * math.pi / 60 == pytest.approx(5.0, abs=0.024)
        rig.close()


def test_the_operating_mode_is_not_written_where_it_fits(servo, rig):
    """It is kept in a memory that wears out."""
    rig.open()
    assert not any(i == WRITE and p[:2] == bytes([OPERATING_MODE, 0]) for i, p in servo.instructions)


@pytest.mark.parametrize(("angle", "step"), [(0.0, 2048), (math.pi / 2, 3072), (-math.pi, 0), (math.pi - 1e-3, 4095)])
def test_angles_are_steps_of_a_turn(servo, rig, angle, step):
    rig.open()
    rig.write(angle)
    assert servo.table[GOAL] == step


@pytest.mark.parametrize("angle", [math.pi, -3.15, 100.0])
def test_more_than_half_a_turn_is_refused(servo, rig, angle):
    rig.open()
    with pytest.raises(RigError, match="half a turn"):
        rig.write(angle)
    assert servo.table[GOAL] == 2048


def test_limits_of_the_servo_are_told(servo, rig):
    servo.table[MOST] = 3000
    rig.open()
    with pytest.raises(RigError, match="exceeds the limit"):
        rig.write(2.0)


def test_another_model_is_not_driven(rig, servo):
    servo.table[0] = 1030
    with pytest.raises(RigError, match=r"model 1030, but XW540-T260 \(1170\) or XW540-T140 \(1180\)"):
        rig.open()
    assert not servo.table[TORQUE]


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
    with Emulator(present=2048 + 60) as servo:
        servo.frozen = True
        rig = Dynamixel(Servo(servo.path))
        with pytest.raises(RigError, match=r"stays at 0.09 rad"):
            rig.open()
        rig.vent()
        assert not servo.table[TORQUE]
        rig.close()


def test_without_packets_it_stops_by_itself_and_says_so(servo):
    rig = Dynamixel(Servo(servo.path, speed=1.0, watchdog=0.2))
    rig.open()
    rig.write(1.5)
    time.sleep(0.3)
    stopped = servo.table[PRESENT]
    assert 2048 < stopped < 2048 + 0.5 * 4096 / (2 * math.pi)
    with pytest.raises(RigError, match=r"no packet came for 0\.2 s"):
        rig.write(1.5)
    assert abs(servo.table[PRESENT] - stopped) <= 1
    rig.close()
    rig.open()  # forgets it
    rig.write(0.1)
    rig.close()


def test_a_frozen_servo_measures_the_same_angle(servo, rig):
    rig.open()
    servo.frozen = True
    rig.write(0.5)
    time.sleep(0.02)
    assert rig.measure() == 0.0


def test_communication_works_again_after_a_lost_answer(servo, rig):
    rig.open()
    servo.silent_from = 0.0
    with pytest.raises(RigError, match=r"There is no status packet.*baud rate"):
        rig.measure()
    servo.silent_from = math.inf
    assert rig.measure() == 0.0


def test_an_answer_that_belongs_to_another_question_is_no_angle(servo, rig, monkeypatch):
    """That of a write has no data; the SDK then gives its checksum for some."""
    rig.open()
    monkeypatch.setattr(servo, "heard", lambda data: packet(1, STATUS, b"\x00"))
    with pytest.raises(RigError, match="an answer of 2 bytes where 4 were asked for"):
        rig.measure()


def test_a_broken_line_is_told_as_such_each_time(servo, rig):
    rig.open()
    servo.pull()
    for _ in range(2):
        with pytest.raises(RigError, match="the line does not work"):
            rig.measure()


def test_venting_is_tried_again(servo, rig, monkeypatch):
    rig.open()
    garble, servo.garbled = servo.garble, True
    answers = iter((garble, garble, lambda answer: answer))
    monkeypatch.setattr(servo, "garble", lambda answer: next(answers)(answer))
    rig.vent()
    assert not servo.table[TORQUE]


def test_torque_that_may_still_be_on_is_told(servo, rig):
    rig.open()
    servo.pull()
    with pytest.raises(RigError, match="torque may still be on: switch off its power"):
        rig.vent()


@pytest.mark.parametrize("wrong", [{"speed": 0.0}, {"speed": math.inf}, {"watchdog": 0.0}, {"watchdog": 3.0}])
def test_settings_that_the_servo_does_not_know_are_refused(wrong):
    with pytest.raises(InputError, match=f"{next(iter(wrong))}: .*known"):
        Servo("/dev/ttyUSB0", **wrong)


def test_a_baud_rate_that_the_sdk_does_not_know_is_told(servo):
    with pytest.raises(RigError, match="baud rate of 1234"):
        Dynamixel(Servo(servo.path, baud=1234)).open()


def test_a_machine_without_the_sdk_is_told_which_extra_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "dynamixel_sdk", None)
    with pytest.raises(RigError, match=r"dynamixel_sdk is missing: pip install 'nectosome\[rig\]'"):
        Dynamixel(Servo("/dev/ttyUSB0")).open()
