"""How a robot floats or hangs in the water, in numbers that people read: draught, trim, heel, metacentres, levers."""

import math
from typing import TYPE_CHECKING, NamedTuple

from nectosome.cli.layout import Label, Number, Table, number
from nectosome.units import show_quantity

if TYPE_CHECKING:
    import numpy as np

    from nectosome.mechanism import Robot
    from nectosome.solve import Floating

_EVERY, _SHOWN = 5, 30  # deg, of the curve and of the table
_NEUTRAL = 1e-6  # share of the weight: less in water counts as none
_SMALL = 1e-5  # rad, below which an angle is rounding, as of the surface that is kept of a mesh


class Righting(NamedTuple):
    """Righting arms [m] over heels [rad], 0 to 180 deg."""

    heels: "np.ndarray"
    arms: "np.ndarray"


def righting(robot: "Robot", found: "Floating") -> Righting:
    """Return the righting curve of a robot."""
    import numpy as np

    from nectosome.solve import righting_curve

    heels = np.radians(np.arange(0, 181, _EVERY))
    return Righting(heels, righting_curve(robot, found, heels))


def float_tables(found: "Floating", curve: Righting) -> list[Table]:
    """Return how it lies in the water, and its righting arms and moments by angle."""
    import numpy as np

    weight, heights = float(found.weight), [float(x) for x in found.metacentric_heights]
    rows = [
        *_place(found),
        (Label("net_weight", "weight in water, all of it under"), _net(float(found.net_weight), weight)),
    ]
    for key, says, height in zip(("heel", "trim"), ("against heel", "against trim"), heights, strict=True):
        rows.append((Label(f"metacentric_height_{key}", f"metacentric height {says}"), Number(height, "m")))
    rows.append((Label("righting_stiffness", "righting moment per heel"), Number(weight * heights[0], "N m/rad")))
    if bool(found.afloat):
        rows.append((Label("waterplane", "area at the surface"), Number(float(found.waterplane), "m2")))
    top = int(np.argmax(curve.arms))
    if curve.arms[top] > 0:
        at = f"{number(float(curve.arms[top]))} m at a heel of {math.degrees(curve.heels[top]):.0f} deg"
        rows.append(
            (Label("largest_righting_arm", "largest righting arm"), Number(float(curve.arms[top]), "m", shown=at))
        )
        rows.append((Label("vanishing_heel", "it turns over beyond"), _vanishes(curve, top)))
    shown = slice(None, None, _SHOWN // _EVERY)
    levers = [
        (f"{math.degrees(heel):.0f} deg", Number(float(arm), "m"), Number(weight * float(arm), "N m"))
        for heel, arm in zip(curve.heels[shown], curve.arms[shown], strict=True)
    ]
    heads = {"heel": "heel", "arm": "righting arm", "moment": "righting moment"}
    lies = "afloat" if bool(found.afloat) else "all under water"
    return [
        Table("floating", {"of": lies, "value": ""}, rows),
        Table("righting", heads, levers, computed=True, beside={"m": _SMALL, "N m": _SMALL * weight}),
    ]


def float_words(found: "Floating") -> list[tuple[str, str]]:
    """Return the same in two rows: how it floats or hangs, and its metacentric heights."""
    names = {"draught": "draught", "trim": "trim", "heel": "heel"}
    place = ", ".join(f"{names[label.key]} {cell.shown}" for label, cell in _place(found))
    heights = [number(float(x)) for x in found.metacentric_heights]
    return [
        ("floats" if bool(found.afloat) else "hangs", place),
        ("metacentric height", f"{heights[0]} m against heel, {heights[1]} m against trim"),
    ]


def _place(found: "Floating") -> list[tuple[Label, Number]]:
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


def _vanishes(curve: Righting, top: int) -> Number:
    """Heel beyond the largest arm from which it does not turn back, between those of the curve by a line."""
    arms, heels = curve.arms[top:], curve.heels[top:]
    after = next((k for k, arm in enumerate(arms) if arm < -1e-9 * arms[0]), None)
    if after is None:
        return Number(math.pi, "rad", shown="no heel: it turns back from any")
    share = arms[after - 1] / (arms[after - 1] - arms[after])
    heel = float(heels[after - 1] + share * (heels[after] - heels[after - 1]))
    return Number(heel, "rad", shown=f"{math.degrees(heel):.0f} deg of heel")
