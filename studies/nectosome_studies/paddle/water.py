r"""The rowing robot in water by published laws, beside that of the paper: one piece exchanged, then all.

The paper's plates have a drag coefficient of 1 and no added mass; drives are ideal here. A plate of aspect ratio A
across a steady stream has 1.11 + 0.018 A (Viterna and Corrigan 1982). One that goes back and forth meets its own
vortices: $8\,KC^{-1/3}$ (Graham 1980), here with the stroke of the middle of the paddle, $a = A_\phi r$; that law is
for long plates without a stream, these are 2.6 times as long as wide and advance by a quarter of their speed across.
Added mass is that of potential flow with the 0.8 of a plate of that length (DNV-RP-H103, Table A-2).

The hull's drag area was fitted to one printed speed with the paper's water and is kept. It is 1.8 times the frontal
area, several times what a spheroid has: it makes up for what the paper's water lacks and for what is not printed.
"""

import math

import jax.numpy as jnp

from nectosome.description import get_value
from nectosome.loads.drag import oscillating_drag
from nectosome.loads.foil_theory import broadside_drag
from nectosome.robots import beetle, describe

from .carried import carrying
from .swim import on_a_slide, slide_speed, with_ideal_drives

_STROKE = math.radians(75), 1.1  # rad, Hz
_CARRIED = 0.8  # of the added mass of an endless plate


def numbers(drag_area: float) -> dict[str, float]:
    """Speed with three joints and with one by scorecard row, the hull's drag area [m2] being that of the paper's water.

    Raises RuntimeError where no cycle is found.
    """
    steady, oscillating = coefficients(_STROKE[0])
    waters = {
        "paper": (0.0, 1.0),
        "plate": (0.0, steady),
        "oscillating": (0.0, oscillating),
        "added-mass": (_CARRIED, 1.0),
        "all": (_CARRIED, oscillating),
    }
    return {
        f"paddle/better-water/{name}/fp{n}jp/speed": slide_speed(
            on_a_slide(carrying(with_ideal_drives(beetle(n)), share)), *_STROKE, drag_area, cn
        )
        for name, (share, cn) in waters.items()
        for n in (3, 1)
    }


def coefficients(amplitude: float) -> tuple[float, float]:
    """Drag coefficients of the stretched paddle: in a steady stream, and at a stroke [rad]."""
    robot = describe("paddle1")
    sizes = ("arm.length", "segment1.length", "segment1.height")
    inner, length, height = (jnp.asarray(get_value(robot, f"limbs.{size}")) for size in sizes)
    reach = amplitude * (inner + 0.5 * length)
    return float(broadside_drag(length / height)), float(oscillating_drag(2 * jnp.pi * reach / height))
