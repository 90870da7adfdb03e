"""How a robot floats or hangs in the water, in numbers that people read: draught, trim, heel, metacentres, levers."""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from nectosome.io.tables import Label, Number, Table, number
from nectosome.mechanism import Robot
from nectosome.units import show_quantity
from nectosome.units.zero import ROUNDING

from ..floating import Floating, righting_curve

_EVERY, _SHOWN = 5, 30  # deg, of the curve and of the table
_NEUTRAL = 1e-6  # share of the weight: less in water counts as none
_ALIKE = 1e-3  # share by which the largest arms of a robot with two sides alike differ, as of the surface of a mesh
_SMALL = 1e-5  # rad, below which an angle is rounding, as of the surface that is kept of a mesh


class Righting(NamedTuple):
    """Righting arms [m] to each side over heels to that side [rad], 0 to 180 deg; above 0 the robot turns back."""

    heels: np.ndarray
    starboard: np.ndarray
    port: np.ndarray


def righting(robot: Robot, found: Floating) -> Righting:
    """Return the righting curves of a robot."""
    heels = np.radians(np.arange(0, 181, _EVERY))
    arms = righting_curve(robot, found, np.concatenate([-heels[:0:-1], heels]))
    port, starboard = -arms[len(heels) - 1 :: -1], arms[len(heels) - 1 :]
    return Righting(heels, starboard, port)


def float_tables(found: Floating, curve: Righting) -> list[Table]:
    """Return how it lies in the water, its largest righting arm to each side, and its righting arms by angle."""
    weight, heights = float(found.weight), [float(x) for x in found.metacentric_heights]
    rows: list[tuple[Label, Number | str]] = [
        *_place(found),
        (Label("net_weight", "weight in water, all of it under"), _net(float(found.net_weight), weight)),
    ]
    for key, says, height in zip(("heel", "trim"), ("against heel", "against trim"), heights, strict=True):
        rows.append((Label(f"metacentric_height_{key}", f"metacentric height {says}"), Number(height, "m")))
    rows.append((Label("righting_stiffness", "righting moment per heel"), Number(weight * heights[0], "N m/rad")))
    if bool(found.afloat):
        rows.append((Label("waterplane", "area at the surface"), Number(float(found.waterplane), "m2")))
    sides = {"starboard": curve.starboard, "port": curve.port}
    rows.append((Label("smaller_side", "side with the smaller arms"), _smaller_side(sides)))
    shown = slice(None, None, _SHOWN // _EVERY)
    levers = [
        (f"{math.degrees(heel):.0f} deg", *(Number(float(x), "m") for x in arms))
        for heel, *arms in zip(*(each[shown] for each in curve), strict=True)
    ]
    lies = "afloat" if bool(found.afloat) else "all under water"
    heads = {"side": "heel to", "largest_arm": "largest righting arm", "at": "at", "moment": "moment"}
    heads |= {"vanishing_heel": "turns over beyond"}
    of_sides = [(side, *_largest(curve.heels, arms, weight)) for side, arms in sides.items()]
    by_heel = {"heel": "heel", "starboard": "righting arm to starboard", "port": "to port"}
    beside = {"m": _SMALL, "N m": _SMALL * weight}
    return [
        Table("floating", {"of": lies, "value": ""}, rows),
        Table("sides", heads, of_sides, computed=True, beside=beside, apart=True),
        Table("righting", by_heel, levers, computed=True, beside=beside),
    ]


def float_words(found: Floating) -> list[tuple[str, str]]:
    """Return the same in two rows: how it floats or hangs, and its metacentric heights."""
    names = {"draught": "draught", "trim": "trim", "heel": "heel"}
    place = ", ".join(f"{names[label.key]} {cell.shown}" for label, cell in _place(found))
    heights = [number(float(x)) for x in found.metacentric_heights]
    return [
        ("floats" if bool(found.afloat) else "hangs", place),
        ("metacentric height", f"{heights[0]} m against heel, {heights[1]} m against trim"),
    ]


def _place(found: Floating) -> list[tuple[Label, Number]]:
    draught = float(found.draught)
    rows = [(Label("draught", "draught"), Number(draught, "m", shown=show_quantity(draught, "length")))]
    ways = (("trim", "bow up", "bow down"), ("heel", "to starboard", "to port"))
    for key, above, below in ways:
        angle = float(getattr(found, key))
        way = "" if abs(angle) < _SMALL else f" {above if angle > 0 else below}"
        degrees = 0.0 if not way else abs(math.degrees(angle))
        rows.append((Label(key, key), Number(angle, "rad", shown=f"{number(degrees)} deg{way}")))
    return rows if bool(found.afloat) else rows[1:]


def _net(net: float, weight: float) -> Number:
    neutral, way = abs(net) <= _NEUTRAL * weight, "downward" if net > 0 else "upward"
    return Number(net, "N", shown="none: it is neutral" if neutral else f"{number(abs(net))} N {way}")


def _smaller_side(sides: Mapping[str, np.ndarray]) -> str:
    """The side to which the largest righting arm is smaller."""
    largest = {side: float(arms.max()) for side, arms in sides.items()}
    smaller = min(largest, key=lambda side: largest[side])
    alike = math.isclose(*largest.values(), rel_tol=_ALIKE, abs_tol=ROUNDING * _SMALL)
    return "both alike" if alike else smaller


def _largest(heels: np.ndarray, arms: np.ndarray, weight: float) -> tuple[Number, Number, Number, Number]:
    """Largest righting arm to a side, its heel, its moment, and the heel beyond which the robot turns over."""
    top = int(arms.argmax())
    arm, heel = float(arms[top]), float(heels[top])
    if arm <= 0:
        none, nowhere, no_moment = (Number(math.nan, unit, shown="none") for unit in ("m", "rad", "N m"))
        return none, nowhere, no_moment, Number(0.0, "rad", shown="0 deg")
    at = Number(heel, "rad", shown=f"{math.degrees(heel):.0f} deg")
    return Number(arm, "m"), at, Number(weight * arm, "N m"), _vanishes(heels[top:], arms[top:])


def _vanishes(heels: np.ndarray, arms: np.ndarray) -> Number:
    """Heel, after that of the largest arm, from which it does not turn back; between those of the curve by a line."""
    after = next((k for k, arm in enumerate(arms) if arm < -1e-9 * arms[0]), None)
    if after is None:
        return Number(math.pi, "rad", shown="no heel")
    share = arms[after - 1] / (arms[after - 1] - arms[after])
    heel = float(heels[after - 1] + share * (heels[after] - heels[after - 1]))
    return Number(heel, "rad", shown=f"{math.degrees(heel):.0f} deg")
