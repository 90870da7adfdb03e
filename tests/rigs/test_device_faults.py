"""Faults of devices during an experiment, in real time: their power is off at the end, or a person is told."""

import signal
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from nectosome.rigs import CommandLimits, Limits, MeasurementLimits, Rig
from nectosome.rigs.devices.dynamixel import Bus, Dynamixel, Servo
from nectosome.rigs.devices.ni import NationalInstruments, Watchdog, Wiring
from nectosome.rigs.devices.serial_motor import MotorLink, SerialMotor
from nectosome.rigs.devices.serial_text import PrintingBoard, SerialText

from .benches import CELL_OF_BOARD, LASER, SERVO_OF_BOARD, VALVE, powered
from .faulty import Hook, Setup, pi
from .injected import Courses
from .motor_emulator import Microcontroller
from .ni_stand_in import Card
from .printing_board import PrintingStandIn
from .servo_emulator import Emulator

DT, COUNT = 0.01, 60
BY_HAND = "TAKE ITS POWER OUT BY HAND"
PATIENT = {"overruns_in_row": 1000, "overruns_share": 1.0, "frozen_time": 0.15, "frozen_share": 0.05}


@contextmanager
def card():
    yield Card()


def ni(card: Card, watchdog: float) -> Rig:
    wiring = Wiring({"pressure": [VALVE]}, {"displacement": LASER}, Watchdog("Dev1", watchdog))
    return NationalInstruments(wiring, card.module())


def printing(board: PrintingStandIn, watchdog: float) -> Rig:
    """It has no watchdog."""
    link = {"separator": ",", "clock": 1, "timeout": 0.4, "start": 1.0}
    return SerialText(PrintingBoard(board.path, CELL_OF_BOARD, SERVO_OF_BOARD, **link))


def limits(command: str, low: float, high: float, slew: float, measurement: str, most: float, error: float) -> Limits:
    return Limits(
        {command: CommandLimits(low, high, slew)},
        {measurement: MeasurementLimits(-most, most, error=error, error_time=0.3)},
        **PATIENT,
    )


def half_sine(amplitude: float) -> np.ndarray:
    return amplitude * np.sin(np.pi * np.arange(COUNT) / COUNT)


@dataclass(frozen=True)
class Kind:
    device: Callable[[], AbstractContextManager[Any]]
    rig: Callable[[Any, float], Rig]
    gains: tuple[float, float]
    amplitude: float
    limits: Limits

    def setup(self, device: Any, watchdog: float) -> Setup:
        reference = half_sine(self.amplitude)
        return Setup(lambda: self.rig(device, watchdog), pi(*self.gains), reference, DT, self.limits, jitter=0.1)


KINDS = {
    "ni": Kind(
        card, ni, (2e6, 5e7), 3e-3,
        limits("pressure", -6e4, 6e4, 4e5, "displacement", 0.015, 3e-3),
    ),
    "dynamixel": Kind(
        Emulator, lambda bus, watchdog: Dynamixel(Bus(bus.path, {"fin": Servo()}, watchdog=watchdog)), (0.2, 20.0), 0.5,
        limits("fin", -1.5, 1.5, 4.0, "fin", 1.6, 0.6),
    ),
    "serial": Kind(
        Microcontroller,
        lambda motor, watchdog: SerialMotor(MotorLink(motor.path, timeout=0.4, start=0.2, watchdog=watchdog)),
        (0.2, 10.0), 4.0,
        limits("speed", -10.0, 10.0, 100.0, "speed", 15.0, 5.0),
    ),
    "serial_text": Kind(
        lambda: PrintingStandIn(0.004), printing, (2.0, 400.0), 0.03,
        limits("angle", -1.2, 1.2, 20.0, "force", 0.08, 0.03),
    ),
}  # fmt: skip


def holds(name: str, value: Any) -> Callable[[Any], None]:
    return lambda device: setattr(device, name, value)


def paused(device: Any) -> None:
    """Longer than its watchdog waits."""
    time.sleep(0.4)


def restarted(board: PrintingStandIn) -> None:
    board.restart()
    board.said.append(b"HX711 ready\r\n")


def interrupted(device: Any) -> None:
    signal.raise_signal(signal.SIGINT)


@dataclass(frozen=True)
class Case:
    does: Callable[[Any], object]
    status: str
    words: str
    watchdog: float = 2.5  # [s]; a busy machine may hold up a sample for some time
    off: bool = True  # whether its power is; else a person is told


ANY = {
    "nothing": Case(lambda device: None, "finished", "all samples"),
    "Ctrl-C": Case(interrupted, "interrupted", "SIGINT"),
}
CASES: dict[str, dict[str, Case]] = {
    "ni": ANY | {
        "unplugged": Case(holds("unplugged", True), "failed", BY_HAND, off=False),
        "outputs refuse": Case(lambda card: card.fails.add("Task.write"), "failed", BY_HAND, off=False),
        "input refuses": Case(lambda card: card.fails.add("Task.read"), "failed", "Dev1/ai0"),
        "target lost": Case(holds("volts_seen", 5.5), "aborted", "nan m"),
        "sensor NaN": Case(holds("volts_seen", float("nan")), "aborted", "nan m"),
        "sensor frozen": Case(holds("volts_seen", 3.0), "aborted", "to the last bit"),
        "watchdog": Case(paused, "failed", "none came for 0.2 s", 0.2),
    },
    "dynamixel": ANY | {
        "cable pulled": Case(Emulator.pull, "failed", BY_HAND, off=False),
        "silent": Case(holds("silent_from", 0.0), "failed", BY_HAND),
        "wrong checksum": Case(holds("garbled", True), "failed", BY_HAND),
        "late": Case(holds("late", 0.8), "failed", "status packet"),
        "blocked": Case(lambda bus: bus.hold(True), "aborted", "to the last bit"),
        "overheated": Case(lambda bus: bus.first.alert(0x04), "failed", "overheating"),
        "watchdog": Case(paused, "failed", "no packet came for 0.2 s", 0.2),
    },
    "serial": ANY | {
        "cable pulled": Case(Microcontroller.pull, "failed", BY_HAND, off=False),
        "silent": Case(holds("silent_from", 0.0), "failed", BY_HAND),
        "wrong checksum": Case(holds("garbled", True), "failed", BY_HAND),
        "late": Case(holds("late", 0.6), "failed", "no answer"),
        "blocked": Case(holds("frozen", True), "aborted", "to the last bit"),
        "speed not known": Case(holds("blind", True), "aborted", "nan rad/s"),
        "watchdog": Case(paused, "failed", "no question came for 0.2 s", 0.2),
    },
    "serial_text": ANY | {
        "cable pulled": Case(PrintingStandIn.pull, "failed", BY_HAND, off=False),
        "silent": Case(holds("silent_from", 0.0), "failed", "no new line with 2 columns in 0.4 s"),
        "another baud rate": Case(holds("garbled", True), "failed", "baud rate"),
        "blocked": Case(holds("frozen", True), "aborted", "to the last bit"),
        "saturated": Case(holds("load", 10**8), "aborted", "are allowed"),
        "restarted": Case(restarted, "failed", "it has restarted"),
    },
}  # fmt: skip


def at(sample: int, device: Any, case: Case) -> Hook:
    def around(n: int, call: Callable, *arguments: Any) -> Any:
        if n == sample:
            assert powered(device)
            case.does(device)
        return call(*arguments)

    return around


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind, cases in CASES.items() for name in cases])
def test_a_fault_of_a_device_ends_safely(tmp_path, monkeypatch, kind, name):
    """At the twenty-first of 60 samples, while it moves; what the device itself says counts."""
    case = CASES[kind][name]
    with KINDS[kind].device() as device:
        setup = KINDS[kind].setup(device, case.watchdog)
        reads = at(20, device, case)
        ended, _, told = Courses(tmp_path, monkeypatch)(setup, {"measure": reads})
        assert ended.status == case.status, told
        assert case.words in told
        assert powered(device) != case.off
        assert (BY_HAND in told) >= (not case.off)
        if case.status != "finished":
            assert ended.data.sizes["time"] < COUNT
