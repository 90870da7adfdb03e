"""Inertial measurement units: registers of an MPU6050, numbers from their bytes, and lines of a microcontroller."""

import errno
import math
import os
import socket
import sys

import pytest

from nectosome.rigs import RigError
from nectosome.rigs.devices.imu import I2C, IMU, MPU6050, SerialIMU
from nectosome.rigs.devices.serial_line import SerialLink, framed
from nectosome.units import InputError

from .imu_stand_in import ACCELERATIONS, FILTER, POWER, RATES, WHO, Chip, Measuring
from .injected import throws

G = 9.80665


def measured(chip: Chip, sensor: MPU6050) -> dict[str, float]:
    rig = IMU(sensor, chip)
    rig.open()
    told = dict(zip(rig.measurements, rig.measure(), strict=True))
    rig.close()
    return told


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        # 1 g along z; 0x0000 is 36.53 °C; 131 is 1 deg/s
        ("0000 0000 4000 0000 0083 0000 0000", (0, 0, G, math.radians(1), 0, 0, 309.68)),
        # -1 g, 1/2 g, 1 number; -521 is 35 - 0.0024 °C; -131, 262 and 1 number
        (
            "C000 2000 0001 FDF7 FF7D 0106 0001",
            (-G, G / 2, G / 16384, -math.radians(1), math.radians(2), math.radians(1 / 131), 309.68 - 521 / 340),
        ),
    ],
)
def test_numbers_are_those_of_the_register_map(data, expected):
    told = measured(Chip(data=bytes.fromhex(data)), MPU6050())
    assert list(told) == ["ax", "ay", "az", "wx", "wy", "wz", "temperature"]
    assert tuple(told.values()) == pytest.approx(expected, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize(
    ("acceleration", "bits", "per_g"),
    [(2.0, 0x00, 16384), (2.01, 0x08, 8192), (4.0, 0x08, 8192), (7.9, 0x10, 4096), (8.1, 0x18, 2048), (16, 0x18, 2048)],
)
def test_the_range_of_accelerations_is_the_first_one_with_what_is_needed(acceleration, bits, per_g):
    chip = Chip(data=bytes.fromhex("0800 F800 0000 0000 0000 0000 0000"))
    told = measured(chip, MPU6050(acceleration=acceleration * G))
    assert chip.registers[ACCELERATIONS] == bits
    assert (told["ax"], told["ay"]) == pytest.approx((2048 / per_g * G, -2048 / per_g * G), rel=1e-12)


@pytest.mark.parametrize(
    ("rate", "bits", "per_degree"), [(250, 0x00, 131), (251, 0x08, 65.5), (1000, 0x10, 32.8), (1001, 0x18, 16.4)]
)
def test_the_range_of_rates_is_the_first_one_with_what_is_needed(rate, bits, per_degree):
    chip = Chip(data=bytes.fromhex("0000 0000 0000 0000 0000 0000 0148"))
    told = measured(chip, MPU6050(rate=math.radians(rate)))
    assert chip.registers[RATES] == bits
    assert told["wz"] == pytest.approx(math.radians(328 / per_degree), rel=1e-12)


@pytest.mark.parametrize(("bandwidth", "number"), [(1000, 0), (259, 1), (94, 2), (44, 3), (43, 4), (5, 6)])
def test_the_filter_is_the_widest_that_is_not_above_what_is_asked_for(bandwidth, number):
    chip = Chip()
    measured(chip, MPU6050(bandwidth=bandwidth))
    assert chip.registers[FILTER] == number


def test_it_is_woken_with_the_clock_of_a_gyroscope():
    chip = Chip()
    measured(chip, MPU6050())
    assert chip.written[0] == (POWER, 0x01)
    assert chip.open == 0


def test_an_axis_at_an_end_of_its_range_has_no_measurement():
    told = measured(Chip(data=bytes.fromhex("7FFF 7FFE 8000 0000 8000 8001 0000")), MPU6050())
    assert [name for name, value in told.items() if math.isnan(value)] == ["ax", "az", "wx"]


def test_a_sensor_that_was_reset_while_it_measures_is_told():
    """Its numbers are 0 then, as are those of one that floats without turning but for their noise."""
    chip = Chip()
    rig = IMU(MPU6050(), chip)
    rig.open()
    chip.reset()
    with pytest.raises(RigError, match=r"it has been reset, and sleeps. Look at its supply"):
        rig.measure()
    chip.registers[POWER] = 0x01
    chip.data = bytes(14)
    assert rig.measure()[:6] == (0.0,) * 6


def test_another_device_at_its_address_is_told():
    chip = Chip()
    chip.registers[WHO] = 0x71
    with pytest.raises(RigError, match=r"bus 1, address 0x68: it calls itself 0x71, and an MPU6050 0x68"):
        IMU(MPU6050(), chip).open()


def test_a_register_that_does_not_keep_its_value_is_told(monkeypatch):
    chip = Chip()
    write = chip.write
    monkeypatch.setattr(chip, "write", lambda register, value: write(register, value & 0x07))
    with pytest.raises(RigError, match="its register 0x1c keeps 0x00, and 0x18 was set"):
        IMU(MPU6050(acceleration=150.0), chip).open()


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (FileNotFoundError(errno.ENOENT, "No such file or directory"), "whether I2C is switched on"),
        (PermissionError(errno.EACCES, "Permission denied"), "mostly i2c"),
    ],
)
def test_a_bus_that_cannot_be_opened_is_told(monkeypatch, error, words):
    monkeypatch.setattr("os.open", throws(error))
    rig = IMU(MPU6050())
    with pytest.raises(RigError, match=rf"the bus does not work .*{words}"):
        rig.open()
    rig.close()


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"address": 0x70}, "address: 112; 104 or 105"),
        ({"acceleration": 157.0}, "acceleration: .*16 g"),
        ({"acceleration": math.nan}, "acceleration"),
        ({"rate": 35.0}, "rate: .*2000 deg/s"),
        ({"bandwidth": 4.0}, "bandwidth: .*5 Hz"),
    ],
)
def test_settings_that_make_no_sense_are_refused(wrong, words):
    with pytest.raises(InputError, match=words):
        MPU6050(**wrong)


def test_registers_are_read_and_written_as_the_kernel_wants_it(monkeypatch):
    """A write of the register's number, then a read, or a write of number and value, to a file with an address."""
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    asked = []
    monkeypatch.setattr("os.open", lambda path, flags: asked.append((path, flags)) or os.dup(ours.fileno()))
    monkeypatch.setattr("fcntl.ioctl", lambda file, request, address: asked.append((request, address)))
    device = I2C(2, 0x69)
    assert asked == [("/dev/i2c-2", os.O_RDWR), (0x0703, 0x69)]
    its.send(bytes(range(14)))
    assert device.read(0x3B, 14) == bytes(range(14))
    device.write(0x6B, 0x01)
    assert (its.recv(9), its.recv(9)) == (b"\x3b", b"\x6b\x01")
    device.close()
    ours.close()
    assert its.recv(9) == b""
    its.close()


def test_a_machine_that_has_no_i2c_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "fcntl", None)
    with pytest.raises(RigError, match="I2C needs Linux"):
        IMU(MPU6050()).open()


@pytest.fixture
def board():
    with Measuring() as board:
        yield board


@pytest.fixture
def rig(board):
    rig = SerialIMU(SerialLink(board.path, timeout=0.2, start=0.5))
    yield rig
    rig.close()


def test_a_microcontroller_is_asked_by_the_serial_protocol(board, rig):
    rig.open()
    board.values = "0.1 -0.2 9.8 0.01 nan -0.03 290.5"
    board.samples = 1000
    assert rig.measure() == pytest.approx((0.1, -0.2, 9.8, 0.01, math.nan, -0.03, 290.5), nan_ok=True)
    assert board.asked == ["H", "I"]
    assert 1000 <= rig.sample < 9000


@pytest.mark.parametrize("answer", ["I 5 1 2 3", "I 5 1 2 3 4 5 6 warm", "I x 1 2 3 4 5 6 7"])
def test_an_answer_without_all_values_is_told(board, rig, monkeypatch, answer):
    rig.open()
    monkeypatch.setattr(board, "heard", lambda data: framed(f"1 {data.split()[1].decode()} {answer}"))
    with pytest.raises(RigError, match="is no answer"):
        rig.measure()


def test_a_controller_without_a_sensor_says_so(board, rig, monkeypatch):
    rig.open()
    monkeypatch.setattr(board, "_told", lambda question: "E unknown")
    with pytest.raises(RigError, match="'I' was refused: unknown"):
        rig.measure()
