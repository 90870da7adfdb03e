"""Blocks of actuators and sensors: hysteresis, friction, transfer functions, valves, sensors, and chains of them."""

from .chain import Chain, Curve, Gain, Parallel, antagonistic, respond
from .hysteresis import BoucWen, Dahl, NumericInverse, Polynomial, PrandtlIshlinskii, Tanh, evenly, inverse
from .motor import GearedMotor, PositionServo, VoltageMotor
from .rate_block import Integrated
from .sensor import Sensor
from .transfer import TransferFunction, second_order
from .valve import DeadTime, Saturation, SlewLimit, Stiction, Tank
