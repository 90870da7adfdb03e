"""Rigs with what is at their other end: cards, servos and motors that stand in for real ones, and a model."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from typing import Any, Literal

from nectosome.rigs import Rig
from nectosome.rigs.dynamixel import Dynamixel, Servo
from nectosome.rigs.ni import Laser, NationalInstruments, Valve, Watchdog, Wiring
from nectosome.rigs.serial_motor import MotorLink, SerialMotor

from .faulty import simulated
from .motor_emulator import Microcontroller
from .ni_stand_in import Card
from .servo_emulator import TORQUE, Emulator

NOWHERE = "/dev/there_is_no_such_port"


@dataclass
class Bench:
    """A rig, what is at its other end, a command, and what is measured some time after."""

    rig: Rig
    device: Any
    command: float
    measured: float
    within: float
    where: str  # named in messages


@dataclass(frozen=True)
class Kind:
    bench: Callable[[], AbstractContextManager[Bench]]
    absent: Callable[[], Rig] | None = None  # whose device is not there
    faults: dict[str, Callable[[Any], object]] = field(default_factory=dict)


@contextmanager
def ni() -> Iterator[Bench]:
    """5 V at a command of 0, at which the laser gives 2.5 V; 1e4 Pa move it by 0.25 V, 2 mm."""
    card = Card()
    wiring = Wiring((Valve("Dev1/ao0", 5.0, 2e4),), Laser("Dev1/ai0", 2.5, 8e-3, 0.5, 4.5), Watchdog("Dev1", 5.0))
    yield Bench(NationalInstruments(wiring, card.module()), card, 1e4, 2e-3, 1e-4, "Dev1")


@contextmanager
def dynamixel() -> Iterator[Bench]:
    with Emulator(present=2000) as servo:
        yield Bench(Dynamixel(Servo(servo.path)), servo, 0.3, 0.3, 1e-3, servo.path)


@contextmanager
def serial_motor() -> Iterator[Bench]:
    with Microcontroller() as motor:
        yield Bench(SerialMotor(MotorLink(motor.path, timeout=0.2, start=0.2)), motor, 5.0, 5.0, 0.2, motor.path)


@contextmanager
def model(pace: Literal["virtual", "real"]) -> Iterator[Bench]:
    """2e4 Pa move it by 4 mm."""
    rig = simulated(pace=pace)
    yield Bench(rig, rig, 2e4, 4e-3, 2e-4, "simulated rig")


def absent_card() -> Rig:
    card = Card()
    card.unplugged = True
    return NationalInstruments(Wiring((Valve("Dev1/ao0", 5.0, 2e4),), Laser("Dev1/ai0", 0, 1, 0, 5)), card.module())


LINE = {
    "silent": lambda device: setattr(device, "silent_from", 0.0),
    "garbled": lambda device: setattr(device, "garbled", True),
    "late": lambda device: setattr(device, "late", 0.45),
    "pulled": lambda device: device.pull(),
}
RIGS = {
    "ni": Kind(
        ni,
        absent_card,
        {
            "unplugged": lambda card: setattr(card, "unplugged", True),
            "refused": lambda card: card.fails.update({"Task.write", "Task.read", "Task.close"}),
        },
    ),
    "dynamixel": Kind(
        dynamixel, lambda: Dynamixel(Servo(NOWHERE)), LINE | {"overheated": lambda servo: servo.alert(0x04)}
    ),
    "serial_motor": Kind(serial_motor, lambda: SerialMotor(MotorLink(NOWHERE)), LINE),
    "simulated": Kind(lambda: model("virtual")),
    "simulated, in real time": Kind(lambda: model("real")),
}


def powered(device: Any) -> bool:
    """Whether anything drives it."""
    if isinstance(device, Card):
        return device.volts != {"Dev1/ao0": 5.0}
    if isinstance(device, Emulator):
        return bool(device.table[TORQUE])
    if isinstance(device, Microcontroller):
        return device.driven
    device.wait(device.now() + 1.0)
    return abs(device.true) > 1e-6
