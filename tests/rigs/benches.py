"""Rigs with what is at their other end: cards, servos and motors that stand in for real ones, and a model."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from nectosome.description import parse_robot
from nectosome.identification.hysteresis.fit import Identified
from nectosome.rigs import Devices, ReadingSensor, Rig, SimulatedRig, SimulatedRobot
from nectosome.rigs.devices.dynamixel import Bus, Dynamixel, Servo
from nectosome.rigs.devices.imu import IMU, MPU6050, SerialIMU
from nectosome.rigs.devices.ni import Input, NationalInstruments, Output, Watchdog, Wiring
from nectosome.rigs.devices.serial_line import SerialLink
from nectosome.rigs.devices.serial_motor import MotorLink, SerialMotor
from nectosome.rigs.devices.serial_text import PrintedNumber, PrintingBoard, SentCommand, SerialText
from nectosome.rigs.devices.simulated_actuator import SimulatedActuator
from nectosome.rigs.devices.text_scale import TextScale

from .faulty import simulated
from .imu_stand_in import Chip, Measuring
from .motor_emulator import Microcontroller
from .ni_stand_in import Card
from .printing_board import MIDDLE, REST, PrintingStandIn
from .servo_emulator import CURRENT, TORQUE, EmulatedServo, Emulator

NOWHERE = "/dev/there_is_no_such_port"


@dataclass
class Bench:
    """A rig, what is at its other end, commands, and what is measured some time after them and after commands of 0."""

    rig: Rig
    device: Any
    commands: tuple[float, ...]
    measured: tuple[float, ...]
    rest: tuple[float, ...]
    within: tuple[float, ...]
    where: str  # named in messages


@dataclass(frozen=True)
class Kind:
    bench: Callable[[], AbstractContextManager[Bench]]
    absent: Callable[[], Rig] | None = None  # whose device is not there
    faults: dict[str, Callable[[Any], object]] = field(default_factory=dict)
    sensor: bool = False
    answers_commands: bool = True


VALVE, LASER = Output("Dev1/ao0", 5.0, 2e4, "Pa"), Input("Dev1/ai0", 2.5, 8e-3, "m", 0.5, 4.5)
CELL = Input("Dev1/ai1", 2.5, 46.5, "N", 0.0, 5.0)


@contextmanager
def ni() -> Iterator[Bench]:
    """5 V at a command of 0, at which the laser gives 2.5 V; 1e4 Pa move it by 0.25 V, 2 mm."""
    card = Card()
    wiring = Wiring({"pressure": [VALVE]}, {"displacement": LASER}, Watchdog("Dev1", 5.0))
    yield Bench(NationalInstruments(wiring, card.module()), card, (1e4,), (2e-3,), (0.0,), (1e-4,), "Dev1")


@contextmanager
def card_with_several() -> Iterator[Bench]:
    """Two commands, of which one has two valves that work against each other; a laser and a load cell, at 3 V."""
    card = Card()
    card.inputs["Dev1/ai1"] = 3.0
    against, lamp = Output("Dev1/ao1", 5.0, -2e4, "Pa"), Output("Dev1/ao2", 0.0, 0.1, "A", high=5.0)
    wiring = Wiring({"pressure": [VALVE, against], "lamp": [lamp]}, {"displacement": LASER, "thrust": CELL})
    rig = NationalInstruments(wiring, card.module())
    yield Bench(rig, card, (1e4, 0.2), (2e-3, 23.25), (0.0, 23.25), (1e-4, 1e-9), "Dev1")


@contextmanager
def load_cell() -> Iterator[Bench]:
    card = Card()
    card.inputs["Dev1/ai1"] = 2.0
    rig = NationalInstruments(Wiring(inputs={"thrust": CELL}), card.module())
    yield Bench(rig, card, (), (-23.25,), (-23.25,), (1e-9,), "Dev1")


@contextmanager
def servo() -> Iterator[Bench]:
    with Emulator(EmulatedServo(present=2000)) as bus:
        rig = Dynamixel(Bus(bus.path, {"fin": Servo()}))
        yield Bench(rig, bus, (0.3,), (0.3,), (0.0,), (1e-3,), bus.path)


@contextmanager
def servos() -> Iterator[Bench]:
    """One of them is mounted the other way round; both draw 0.1 A."""
    with Emulator(EmulatedServo(3, present=2000), EmulatedServo(7, model=1200, present=2100)) as bus:
        bus.servos[3].table[CURRENT], bus.servos[7].table[CURRENT] = 37, -100  # 2.69 mA, and 1 mA
        parts = {"left": Servo(3), "right": Servo(7, sign=-1)}
        rig = Dynamixel(Bus(bus.path, parts, record=("current", "voltage")))
        currents = (0.09953, 12.0), (0.1, 12.0)
        measured, rest = ((a, *currents[0], b, *currents[1]) for a, b in ((0.3, -0.2), (0.0, 0.0)))
        yield Bench(rig, bus, (0.3, -0.2), measured, rest, (1e-3, 1e-9, 1e-9) * 2, bus.path)


@contextmanager
def serial_motor() -> Iterator[Bench]:
    with Microcontroller() as motor:
        rig = SerialMotor(MotorLink(motor.path, timeout=0.2, start=0.2))
        yield Bench(rig, motor, (5.0,), (5.0,), (0.0,), (0.2,), motor.path)


@contextmanager
def imu() -> Iterator[Bench]:
    chip = Chip()
    rest = (0.0, 0.0, 9.80665, 0.0, 0.0, 0.0, 296.833)
    yield Bench(IMU(MPU6050(), chip), chip, (), rest, rest, (1e-9,) * 6 + (1e-3,), "I2C bus 1")


@contextmanager
def serial_imu() -> Iterator[Bench]:
    with Measuring() as board:
        rig = SerialIMU(SerialLink(board.path, timeout=0.2, start=0.2))
        rest = tuple(map(float, board.values.split()))
        yield Bench(rig, board, (), rest, rest, (1e-9,) * 7, board.path)


@contextmanager
def motor_and_imu() -> Iterator[Bench]:
    """Both behind one microcontroller, at one port."""
    with Measuring() as board:
        motor = SerialMotor(MotorLink(board.path, timeout=0.2, start=0.2))
        imu = SerialIMU(SerialLink(board.path, timeout=0.2, start=0.2))
        imu.line.share(motor.line)
        level = tuple(map(float, board.values.split()))
        rig = Devices({"hull": imu, "motor": motor})
        yield Bench(rig, board, (5.0,), (*level, 5.0), (*level, 0.0), (1e-9,) * 7 + (0.2,), board.path)


DEGREE = np.pi / 180
CELL_OF_BOARD = {"force": PrintedNumber(2, TextScale(1e-6, "N", REST))}
SERVO_OF_BOARD = {"angle": SentCommand("A{:.2f}\n", TextScale(DEGREE, "rad", MIDDLE, 0.0, 180.0, 0.0))}


@contextmanager
def serial_text() -> Iterator[Bench]:
    """A servo whose 20 degrees bend the load cell by 20 mN."""
    with PrintingStandIn() as board:
        rig = SerialText(
            PrintingBoard(
                board.path, CELL_OF_BOARD, SERVO_OF_BOARD, separator=",", clock=1, timeout=0.4, start=0.6,
            )
        )  # fmt: skip
        yield Bench(rig, board, (20 * DEGREE,), (0.020,), (0.0,), (1e-9,), board.path)


@contextmanager
def model(pace: Literal["virtual", "real"]) -> Iterator[Bench]:
    """2e4 Pa move it by 4 mm."""
    rig = simulated(pace=pace)
    yield Bench(rig, rig, (2e4,), (4e-3,), (0.0,), (2e-4,), "simulated rig")


@contextmanager
def actuator() -> Iterator[Bench]:
    """Linear: 2e4 Pa move it by 4 mm."""
    linear = Identified({"frequency": 60.0, "damping": 1.0}, {}, np.ones(1), np.full(2, 2e-7), 0.0, 2, ())
    rig = SimulatedActuator(linear, 0.005)
    yield Bench(rig, rig, (2e4,), (4e-3,), (0.0,), (2e-4,), "simulated rig")


SPRING = "axis: x, stiffness: 500 N/m, damping: 20 N s/m, force: {kind: constant, value: 0 N}"
SLIDES = parse_robot(f"""
name: slides
water: {{gravity: 0 m/s2}}
body: {{kind: rigid, shape: point, mass: 200 g, volume: 0 m3, joint: {{kind: prismatic, {SPRING}}}}}
limbs:
  top: {{on: body, kind: rigid, shape: point, mass: 100 g, volume: 0 m3, joint: {{kind: prismatic, {SPRING}}}}}
""")


@contextmanager
def robot(pace: Literal["virtual", "real"]) -> Iterator[Bench]:
    """Two slides on springs, one on the other: 1 N and 2 N move them by 2 mm and 4 mm."""
    commands = {"lower": "body.joint.force.value", "upper": "limbs.top.joint.force.value"}
    sensors = {"x": ReadingSensor("body.position", noise=1e-5), "y": ReadingSensor("top.position", resolution=1e-5)}
    rig = SimulatedRobot(SLIDES, commands, sensors, 0.005, pace=pace)
    yield Bench(rig, rig, (1.0, 2.0), (2e-3, 4e-3), (0.0, 0.0), (1e-4, 1e-4), "simulated slides")


def absent_card() -> Rig:
    card = Card()
    card.unplugged = True
    return NationalInstruments(Wiring({"pressure": [VALVE]}, {"displacement": LASER}), card.module())


LINE = {
    "silent": lambda device: setattr(device, "silent_from", 0.0),
    "garbled": lambda device: setattr(device, "garbled", True),
    "late": lambda device: setattr(device, "late", 0.8),
    "pulled": lambda device: device.pull(),
}
CARD = {
    "unplugged": lambda card: setattr(card, "unplugged", True),
    "refused": lambda card: card.fails.update({"Task.write", "Task.read", "Task.close"}),
}
LAST = {
    "one silent": lambda bus: setattr(bus.servos[7], "silent", True),
    "one garbled": lambda bus: setattr(bus.servos[7], "garbled", True),
    "one overheated": lambda bus: bus.servos[7].alert(0x04),
}
RIGS = {
    "ni": Kind(ni, absent_card, CARD),
    "ni, several": Kind(card_with_several, None, CARD),
    "ni, a load cell": Kind(load_cell, None, {"unplugged": CARD["unplugged"]}, sensor=True, answers_commands=False),
    "dynamixel": Kind(
        servo,
        lambda: Dynamixel(Bus(NOWHERE, {"fin": Servo()})),
        LINE | {"overheated": lambda bus: bus.first.alert(0x04)},
        answers_commands=False,
    ),
    "dynamixel, two": Kind(servos, None, LINE | LAST, answers_commands=False),
    "serial_motor": Kind(serial_motor, lambda: SerialMotor(MotorLink(NOWHERE)), LINE),
    "imu": Kind(
        imu,
        lambda: IMU(MPU6050(bus=7), Chip()),
        {"pulled": lambda chip: setattr(chip, "absent", True)},
        sensor=True,
        answers_commands=False,
    ),
    "serial_imu": Kind(serial_imu, lambda: SerialIMU(SerialLink(NOWHERE)), LINE, sensor=True, answers_commands=False),
    "serial_text": Kind(
        serial_text, lambda: SerialText(PrintingBoard(NOWHERE, CELL_OF_BOARD)), LINE, answers_commands=False
    ),
    "motor and imu": Kind(motor_and_imu, None, LINE),
    "simulated": Kind(lambda: model("virtual")),
    "simulated actuator": Kind(actuator),
    "simulated, in real time": Kind(lambda: model("real")),
    "robot": Kind(lambda: robot("virtual")),
    "robot, in real time": Kind(lambda: robot("real")),
}
DRIVEN = [name for name, kind in RIGS.items() if not kind.sensor]


def powered(device: Any) -> bool:
    """Whether anything drives it."""
    if isinstance(device, Card):
        rest = {"Dev1/ao0": 5.0, "Dev1/ao1": 5.0, "Dev1/ao2": 0.0}
        return any(volts != rest[channel] for channel, volts in device.volts.items())
    if isinstance(device, Emulator):
        return any(servo.table[TORQUE] for servo in device.servos.values())
    if isinstance(device, PrintingStandIn):
        device.catch_up()
    if isinstance(device, Microcontroller | PrintingStandIn):
        return device.driven
    device.wait(device.now() + 1.0)
    return bool((np.abs(device.true) > 1e-6).any())


def ever_powered(device: Any) -> bool:
    """Whether anything was ever put on it that may move it."""
    if isinstance(device, Emulator):
        return any(servo.powered for servo in device.servos.values())
    if isinstance(device, SimulatedRig):
        return any(abs(output) > 1e-6 for output in device.outputs)
    if isinstance(device, SimulatedRobot):
        return device.commanded
    return not isinstance(device, Chip) and device.powered
