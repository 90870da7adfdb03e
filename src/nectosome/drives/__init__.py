"""Blocks of actuators and sensors: hysteresis, friction, transfer functions, valves, sensors, and chains of them."""

from .bouc_wen import BoucWen
from .chain import Chain, Curve, Gain, Parallel, antagonistic
from .friction import Dahl
from .hysteresis import Envelope, NumericInverse, Polynomial, PrandtlIshlinskii, Tanh, evenly, inverse
from .rate_block import Driven, Integrated
from .respond import respond
from .sensor import Sensor
from .transfer import TransferFunction, second_order
from .valve import DeadTime, Saturation, SlewLimit, Tank

__all__ = [
    "BoucWen",
    "Chain",
    "Curve",
    "Dahl",
    "DeadTime",
    "Driven",
    "Envelope",
    "Gain",
    "Integrated",
    "NumericInverse",
    "Parallel",
    "Polynomial",
    "PrandtlIshlinskii",
    "Saturation",
    "Sensor",
    "SlewLimit",
    "Tanh",
    "Tank",
    "TransferFunction",
    "antagonistic",
    "evenly",
    "inverse",
    "respond",
    "second_order",
]
