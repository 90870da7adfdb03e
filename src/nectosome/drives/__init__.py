"""Blocks of actuators and sensors: hysteresis, friction, transfer functions, valves, sensors, and chains of them."""

from .chain import Chain, Curve, Gain, Parallel, antagonistic, respond
from .friction import BoucWen, Dahl
from .hysteresis import NumericInverse, Polynomial, PrandtlIshlinskii, Tanh, evenly, inverse
from .motor import GearedMotor, PositionServo, VoltageMotor
from .rate_block import Integrated
from .sensor import Sensor
from .transfer import TransferFunction, second_order
from .valve import DeadTime, Saturation, SlewLimit, Stiction, Tank

__all__ = [
    "BoucWen",
    "Chain",
    "Curve",
    "Dahl",
    "DeadTime",
    "Gain",
    "GearedMotor",
    "Integrated",
    "NumericInverse",
    "Parallel",
    "Polynomial",
    "PositionServo",
    "PrandtlIshlinskii",
    "Saturation",
    "Sensor",
    "SlewLimit",
    "Stiction",
    "Tanh",
    "Tank",
    "TransferFunction",
    "VoltageMotor",
    "antagonistic",
    "evenly",
    "inverse",
    "respond",
    "second_order",
]
