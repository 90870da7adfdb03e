"""What drives a robot and is no mechanism: hysteresis, transfer functions, valves, dead time, sensors, and chains."""

from .chain import Chain, Gain, Parallel, antagonistic
from .hysteresis import Envelope, NumericInverse, Polynomial, PrandtlIshlinskii, Tanh, evenly, inverse
from .integrated import Driven, Integrated
from .respond import respond
from .sensor import Sensor
from .transfer import TransferFunction, second_order
from .valve import DeadTime, Saturation, SlewLimit, Tank

__all__ = [
    "Chain",
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
