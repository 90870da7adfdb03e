"""A motor and an IMU behind one microcontroller: one port, one row of numbers, and a vent whatever fails."""

import time
from pathlib import Path

import numpy as np
import pytest

from nectosome.rigs import Devices, Experiment, Played, RigError
from nectosome.rigs.devices.imu import SerialIMU
from nectosome.rigs.devices.serial_line import SerialLink
from nectosome.rigs.devices.serial_motor import MotorLink, SerialMotor
from nectosome.rigs.rig_file import load_rig
from nectosome.units import InputError

from .imu_stand_in import Measuring, MeasuringOverRadio

EXAMPLE = (Path(__file__).parents[2] / "examples" / "rigs" / "motor_and_imu_radio.yaml").read_text(encoding="utf-8")


def pair(board: Measuring, timeout: float = 0.2, attempts: int = 1) -> Devices:
    link = {"port": board.path, "timeout": timeout, "attempts": attempts, "start": 0.5}
    motor, imu = SerialMotor(MotorLink(**link, watchdog=60.0)), SerialIMU(SerialLink(**link))
    imu.line.share(motor.line)
    return Devices({"motor": motor, "hull": imu})


@pytest.fixture
def board():
    with Measuring() as board:
        yield board


@pytest.fixture
def rig(board):
    rig = pair(board)
    yield rig
    rig.close()


def test_both_ask_in_turn_with_numbers_of_one_row(board, rig):
    rig.open()
    rig.measure()
    rig.write([2.0])
    rig.vent()
    assert board.asked == ["H", "0", "W 60", "S 0.0000", "H", "R", "I", "S 2.0000", "0"]
    assert board.last == rig.devices["hull"].line.port.asked == 9


def test_the_port_is_opened_once_and_closed_with_the_last_of_both(board, rig):
    """Opening resets many boards."""
    motor, imu = rig.devices.values()
    rig.open()
    port = motor.line.port.device
    motor.write([2.0])
    imu.close()
    imu.close()
    with pytest.raises(RigError, match=r"IMU at .* used before it was opened"):
        imu.measure()
    assert port.is_open and motor.measure()
    imu.open()
    assert motor.line.port.device is port
    motor.vent()
    motor.close()
    with pytest.raises(RigError, match=r"motor at .* used before it was opened"):
        motor.measure()
    assert len(imu.measure()) == 7
    imu.close()
    assert not port.is_open
    rig.open()
    assert motor.line.port.device is not port


def test_over_a_radio_link_no_answer_of_one_is_taken_for_one_of_the_other():
    """A fifth of lines is lost and a third late, each way: the motor tells its last speed, the IMU its turn."""
    with MeasuringOverRadio(lost=0.2, delayed=0.3, longest=0.12) as board:
        board.frozen = True
        rig = pair(board, timeout=0.03, attempts=4)
        for _ in range(10):
            try:
                rig.open()
                break
            except RigError:
                rig.close()
        motor, imu = rig.devices.values()
        right = 0
        for k in range(1, 61):
            board.values = f"{k} 0 0 0 0 0 290"
            try:
                motor.write([k / 8])
                assert motor.told.error == k / 8
                told = imu.measure()
                assert k - 1 <= told[0] <= k  # asked for within this turn; the board may have answered before the last
                assert motor.measure() == (0.0,) and motor.told.error == k / 8
                right += 1
            except RigError as error:
                assert "no answer" in str(error)
        assert right > 20
        assert motor.line.port.lost > 30 and motor.line.port.late > 5
        rig.close()


@pytest.mark.parametrize("device", ["hull", "motor"])
def test_a_device_that_fails_ends_the_run_and_the_motor_is_vented(board, device, tmp_path, monkeypatch):
    """After 20 answers those of one device have no sense. The IMU is not asked any more; the motor is, to the end."""
    letter, told, begun = {"hull": "I", "motor": "R"}[device], board._told, []

    def nonsense(question: str) -> str:
        answer = told(question)
        begun.extend(letter if question == letter else "")
        return f"{answer[0]} lost" if question == letter and len(begun) > 20 else answer

    monkeypatch.setattr(board, "_told", nonsense)
    (tmp_path / "rig.yaml").write_text(EXAMPLE.replace("/dev/ttyUSB0", board.path).replace("dt: 0.1 s", "dt: 40 ms"))
    file = load_rig(tmp_path / "rig.yaml")
    signal = np.minimum(np.arange(100) * 0.04 * 5.0, 5.0)
    run = Experiment(file.rig, Played(file.rig, {"motor.speed": signal}), file.limits, file.dt).run(tmp_path / "run.nc")
    assert run.status == "failed"
    assert f"{'IMU' if device == 'hull' else 'motor'} at {board.path}: 'lost' is no answer" in run.reason
    assert "TAKE ITS POWER OUT" not in run.reason
    assert board.asked[-1] == "0" and not board.driven
    after = board.asked[len(board.asked) - board.asked[::-1].index(letter) :]
    assert after[0].startswith("S ") and {one[0] for one in after} == {"S", "0"}
    assert not file.rig.devices["motor"].line.port.users


def test_a_motor_that_has_stopped_by_itself_leaves_the_imu_to_be_read(board, rig):
    rig.open()
    board.expired = True
    with pytest.raises(RigError, match="it has stopped by itself"):
        rig.write([2.0])
    assert len(rig.devices["hull"].measure()) == 7
    rig.vent()
    rig.write([1.0])
    assert board.driven


def test_a_late_answer_of_the_imu_does_not_keep_the_motor_from_its_vent(board, rig):
    rig.open()
    rig.write([5.0])
    board.late = 0.25
    with pytest.raises(RigError, match="no answer to 'I'"):
        rig.devices["hull"].measure()
    board.late = 0.0
    began = time.perf_counter()
    rig.vent()
    assert not board.driven and rig.devices["motor"].line.port.late == 1
    assert time.perf_counter() - began < 0.2


def test_a_rig_file_gives_two_devices_of_one_port_one_line(board, tmp_path):
    (tmp_path / "rig.yaml").write_text(EXAMPLE.replace("/dev/ttyUSB0", board.path))
    rig = load_rig(tmp_path / "rig.yaml").rig
    motor, imu = rig.devices.values()
    assert motor.line.port is imu.line.port
    rig.open()
    assert len(rig.measure()) == 8
    rig.close()
    (tmp_path / "rig.yaml").write_text(
        EXAMPLE.replace("hull: {kind: serial_imu, port: /dev/ttyUSB0", "hull: {kind: serial_imu, port: /dev/ttyUSB1")
    )
    motor, imu = load_rig(tmp_path / "rig.yaml").rig.devices.values()
    assert motor.line.port is not imu.line.port


HULL = "hull: {kind: serial_imu, port: /dev/ttyUSB0, baud: 57600, timeout: 30 ms, attempts: 3}"
SERVOS = "fins: {kind: dynamixel, port: /dev/ttyUSB0, servos: {left: {}}}"


@pytest.mark.parametrize(
    ("before", "after", "field", "line", "words"),
    [
        (HULL, HULL.replace("57600", "9600"), "hull.baud", 8, r'9600, and 57600 for "motor" at the same port'),
        (HULL, HULL.replace("attempts: 3", "attempts: 2"), "hull.attempts", 8, r'2, and 3 for "motor"'),
        (HULL, HULL.replace("30 ms", "50 ms"), "hull.timeout", 8, r'0\.05, and 0\.03 for "motor"'),
        (HULL, HULL.replace("attempts: 3", "attempts: 3, start: 1 s"), "hull.start", 8, r'1, and 3 for "motor"'),
        (HULL, f"{HULL}\n  {HULL.replace('hull', 'tail')}", "tail.port", 9, r'is the port of "hull" too'),
        (HULL, SERVOS, "fins.port", 8, r'is the port of "motor" too'),
        ("watchdog: 0.5 s", "watchdog: 90 ms", "motor.watchdog", 7, "dt is 0.1 s"),
        (
            "watchdog: 0.5 s", "watchdog: 0.2 s, start: 3 s", "motor.watchdog", 7,
            r"0\.2 s, and a question may take 0\.21 s \(3 attempts of 0\.07 s\).* Take more than 0\.21 s",
        ),
    ],
)  # fmt: skip
def test_lines_that_cannot_be_shared_and_watchdogs_that_are_too_short_are_refused(
    before, after, field, line, words, tmp_path
):
    text = EXAMPLE.replace(before, after)
    if "0.2 s" in after:
        text = text.replace("30 ms", "70 ms")
    assert text != EXAMPLE
    (tmp_path / "rig.yaml").write_text(text)
    with pytest.raises(InputError, match=words) as told:
        load_rig(tmp_path / "rig.yaml")
    assert (told.value.field, told.value.line) == (f"devices.{field}", line)


def test_a_watchdog_just_longer_than_all_attempts_is_taken(tmp_path):
    (tmp_path / "rig.yaml").write_text(EXAMPLE.replace("watchdog: 0.5 s", "watchdog: 0.11 s"))
    motor = load_rig(tmp_path / "rig.yaml").rig.devices["motor"]
    assert isinstance(motor, SerialMotor) and motor.controller.watchdog == 0.11
