r"""What follows from the paper's own numbers and equations where one of them does not fit the others.

The drag of a blade that turns with $\dot\beta$ about the servo, by eq. 7 over the blade, peaks at

$$ F_{pk} = \tfrac12 C_n \rho w \dot\beta^2 \int_{r_1}^{r_2} r^2 dr $$

so that Cn comes back from it as in `transfer.drag_coefficient`; eq. 17 gives something of the unit 1/m.
"""

import math
from collections.abc import Mapping

import numpy as np

from nectosome.description import get_value
from nectosome.loads import Spring
from nectosome.model import build
from nectosome.robots import beetle, describe

from ..study import printed
from .swim import SPEEDS
from .transfer import drag_coefficient
from .truths import AMPLITUDES, FREQUENCIES


def numbers() -> Mapping[str, float]:
    """Right values by scorecard row."""
    book, robot = printed("paddle"), describe("paddle")
    rod, segment, width, thickness, density = (
        float(get_value(robot, path))
        for path in (
            "limbs.arm.length",
            "limbs.segment1.length",
            "limbs.segment1.height",
            "limbs.segment1.joint.flexure.thickness",
            "water.density",
        )
    )
    stiffness = next(float(a.load.stiffness) for a in build(robot).loads if isinstance(a.load, Spring))
    cube = book["paddle/eq16/k"]["printed"] / stiffness  # stiffness goes with the cube of the thickness
    slow, fast = (SPEEDS[3, math.radians(a), f] for a, f in ((30, 0.3), (75, 1.1)))
    average = book["paddle/misprint/eq30-sum"]["printed"]
    own = {
        "thickness": 1e3 * thickness * cube ** (1 / 3),
        "segment-length": 1e3 * segment,
        "width": 2 * (get_value(beetle(3), "body.radius") + rod + 3 * segment),
        "eq7-sign": -1.0,  # drag turns round with the motion
        "eq17-cn": _coefficient_back(rod, rod + 3 * segment, density * width),
        "eq22-centroid": 1.0,  # it moves by T, as eq. 28 has it
        "eq30-sum": AMPLITUDES.size * FREQUENCIES.size * average,
        "ratio-abstract": fast / slow,
        "ratio-conclusions": fast / slow,
        "yaw-fp1jp": 0.0,  # of two robots, as at 30 deg
    }
    return {f"paddle/misprint/{name}": value for name, value in own.items()}


def _coefficient_back(inner: float, outer: float, density_width: float) -> float:
    """Cn from the peak force of a stretched blade of Cn 1, from one radius to the other [m], at 75 deg and 1.1 Hz."""
    amplitude, frequency = math.radians(75), 1.1
    rate = 2 * math.pi * frequency * amplitude
    places = np.linspace(inner, outer, 1001)
    peak = np.trapezoid(0.5 * density_width * (rate * places) ** 2, places)
    return float(drag_coefficient(np.array([peak]), np.array([amplitude]), np.array([frequency]))[0])
