"""The firmware of a load cell and a servo, compiled, on a simulated chip, as the board of `serial_text`.

Times are those of the board's clock: a busy machine makes a test longer, not different.
"""

import math
from functools import partial

import numpy as np
import pytest

from nectosome.rigs import RigError
from nectosome.rigs.devices.serial_text import PrintedNumber, PrintingBoard, SentCommand, SerialText
from nectosome.rigs.devices.text_scale import TextScale

from .board import CellBoard, build, lacks

pytestmark = pytest.mark.skipif(bool(lacks()), reason=f"firmware is not tested: {lacks()}")

LEAST, MOST, TICK = 544e-6, 2400e-6, 0.5e-6  # s: pulses at 0 and 180 deg; what timer 1 tells apart
WATCHDOG = 2.0  # s without a command, of 0.5 s: a busy machine may hold up a test
LOAD, BEND = 81_234, 1_000  # counts, counts/deg
DEGREE = math.pi / 180


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cell")
    build(folder, "simulation")
    return build(folder, "cell", f"-DWATCHDOG={WATCHDOG}f")


@pytest.fixture
def board(built, tmp_path):
    return partial(CellBoard, built, tmp_path / "log.csv", load=LOAD, bend=BEND)


@pytest.fixture
def link():
    """Rigs on boards, closed at the end."""
    rigs = []

    def connect(board: CellBoard) -> SerialText:
        inputs = {
            "time": PrintedNumber(1, TextScale(1e-3, "s")),
            "force": PrintedNumber(2, TextScale(1.0, "", 0.0, 1.0 - 2**23, 2**23 - 2.0)),
        }
        outputs = {"angle": SentCommand("A{:.2f}\n", TextScale(DEGREE, "rad", 90.0, 0.0, 180.0))}
        settings = {"separator": ",", "clock": 1, "timeout": 5.0, "start": 60.0}
        rigs.append(SerialText(PrintingBoard(board.path, inputs, outputs, **settings)))
        rigs[-1].open()
        return rigs[-1]

    yield connect
    for rig in rigs:
        rig.close()


def pulse(angle: float) -> float:
    return LEAST + angle / 180 * (MOST - LEAST)


def counts_at(angle: float) -> float:
    """Of the load and the bend at the pulse for an angle, in whole ticks."""
    width = round(pulse(angle) / TICK) * TICK
    return round(LOAD + BEND * ((width - LEAST) / (MOST - LEAST) * 180 - 90))


def test_each_reading_of_the_converter_is_a_line(board, link):
    """80 a second by the board's clock, in whole milliseconds; where the host is late some are for nobody."""
    with board(pace=0.5, bend=0.0) as cell:
        rig = link(cell)
        first, begin = rig.measure()[0], rig.lines
        readings = np.array([rig.measure() for _ in range(120)])
        lines = rig.lines - begin
        lost = cell.log()[-1, 3:]
    behind = 1e3 * (readings[:, 0] - first)
    assert np.abs(behind - 12.5 * np.round(behind / 12.5)).max() < 1.01
    assert lines == np.round(behind[-1] / 12.5)
    assert {*readings[:, 1]} == {LOAD}
    assert rig.skipped == 0
    assert lost.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("load", [0, 1, -1, 8_388_606, -8_388_607, 1_234_567, -5_592_406])
def test_counts_are_those_of_24_bits_with_their_sign(board, link, load):
    with board(load=load, bend=0.0) as cell:
        assert link(cell).measure()[1] == load


@pytest.mark.parametrize("load", [1e7, -1e7])
def test_a_saturated_converter_measures_nothing(board, link, load):
    with board(load=load, bend=0.0) as cell:
        assert math.isnan(link(cell).measure()[1])


@pytest.mark.parametrize("angle", [0.0, 45.0, 90.0, 120.5, 180.0])
def test_an_angle_is_a_pulse_of_the_servo_and_bends_the_cell(board, link, angle):
    with board() as cell:
        rig = link(cell)
        rig.write([(angle - 90) * DEGREE])
        log = cell.wait(0.1)
        rig.measure()
        assert rig.measure()[1] == counts_at(angle)
    assert log[-1, 1] == pytest.approx(pulse(angle), abs=0.51 * TICK)
    assert log[-1, 2] == pytest.approx(angle, abs=0.03)


def test_what_is_no_angle_is_not_obeyed(board, link):
    with board() as cell:
        rig = link(cell)
        rig.write([30 * DEGREE])
        for text in (b"A181\n", b"A-1\n", b"A\n", b"Anan\n", b"A1x\n", b"B20\n", b"\n", b"A20.000000000\n", b"A20"):
            rig._send(text)
        assert cell.wait(0.1)[-1, 1] == pytest.approx(pulse(120.0), abs=TICK)
        rig._send(b"\r\nA40\r\n")
        assert cell.wait(0.1)[-1, 1] == pytest.approx(pulse(40.0), abs=TICK)


def test_commands_do_not_disturb_readings(board, link):
    """Interrupts of bytes that come within a reading make no pulse of the converter's clock too long."""
    with board(pace=0.5, bend=0.0) as cell:
        rig = link(cell)
        values = []
        for _ in range(60):
            rig._send(b"A90.00\n" * 8)
            values.append(rig.measure()[1])
        lost = cell.log()[-1, 3:]
    assert {*values} == {LOAD}
    assert lost.tolist() == [0.0, 0.0]


def test_without_commands_the_servo_goes_back_to_rest(board, link):
    """In the time that is set after the last one, and a pulse later at most."""
    with board() as cell:
        rig = link(cell)
        rig.write([30 * DEGREE])
        cell.wait(0.1)
        before = cell.log()[-1, 0]
        rig.write([30 * DEGREE])
        after = cell.log()[-1, 0]
        log = cell.wait_until(after + WATCHDOG + 0.5)
    away = log[log[:, 2] > 100.0]
    assert before + WATCHDOG - 0.01 < away[-1, 0] < after + WATCHDOG + 0.1
    assert log[-1, 1] == pytest.approx(pulse(90.0), abs=TICK)


@pytest.mark.parametrize("what", ["reset", "hang"])
def test_a_reset_is_told_and_the_servo_is_at_rest(board, link, what):
    """By its button, or by its watchdog after the program hangs: its clock begins anew."""
    with board(pace=2.0) as cell:
        rig = link(cell)
        rig.write([30 * DEGREE])
        cell.wait(0.3)
        getattr(cell, what)()
        with pytest.raises(RigError, match=r"it has restarted, since its clock went back"):
            for _ in range(100):
                rig.measure()
        assert cell.wait(0.1)[-1, 1] == pytest.approx(pulse(90.0), abs=TICK)
