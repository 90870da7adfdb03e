"""The summary of a cycle: its means, largest magnitudes, stroke and cost of transport."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nectosome.io.summary import Summary
from nectosome.io.tables import AXES, Label, Number, Table, number, with_error
from nectosome.units import show_quantity
from nectosome.units.zero import counts_as_zero

from ..cycle_means import CyclePath
from .motor_tables import MOTOR_PEAKS, motors, servos, tendons
from .run_summary import Arrays, acting, driven, frames, largest, mount, powers, still, stored, streams
from .stroke_tables import EFFICIENCIES, regime, stroke, tail_first, too_soft, transport

_OVER_GROUND = {key: key.replace("_", " ") for key in ("speed_over_ground", "forward_speed_over_ground")}
_FLAT = 1e-6  # of the radius: a pitch as small is rounding
_BALANCED = 1e-4  # of the sizes of mean powers, off balance by more than which is said to be of the samples


def cycle_summary(
    arrays: Arrays, course: CyclePath, attributes: Mapping[str, Any], each: bool = False, multipliers: bool = False
) -> Summary:
    """Return drives, the body's motion, bending, powers of a cycle, and by how much the powers are off balance.

    `arrays` are those of `mean_results`; with `each`, each load on each part; with `multipliers`, the text has them.
    """
    period = float(attributes["period"])
    names = ("reaction", "drive_velocity", "reaction_power", "load_power")
    peaks = {name: arrays[f"{name}_peak"] for name in names}
    most = float(peaks["load_power"].sum() + peaks["reaction_power"].sum())
    loads, joints = arrays["load_power"].sum(axis=1), arrays["reaction_power"]
    stays = not arrays["velocity_peak"][0].any() and counts_as_zero(float(arrays["turn_rate"]), 0.0, 1 / period)
    tables = [driven(arrays, arrays["reaction"], peaks), _body(arrays), _cycle(arrays, period, stays)]
    tables += [mount(arrays["force"], arrays["force_peak"])] if stays else []
    tables += [stroke(arrays, _fastest(arrays)), transport(arrays, most), _path(course, period), _bending(arrays)]
    if each:
        means = arrays["load_force"], arrays["load_power"]
        tables += [acting(arrays, *means, period), stored(arrays, arrays["part_energy"])]
    tables.append(powers(arrays, loads, joints, (peaks["load_power"], peaks["reaction_power"], most)))
    total = float(abs(loads).sum() + abs(joints).sum())
    off = 0.0 if counts_as_zero(total, 0.0, most) else abs(float(loads.sum() + joints.sum())) / total
    flow, meaning, cautions = regime(arrays, attributes)
    limits, beyond = servos(arrays, peaks)
    of_motors = {name: arrays[f"{name}_peak"] for name in MOTOR_PEAKS if "motor" in arrays}
    held = streams(arrays) and np.isnan(arrays["range"])
    more, saturated = motors(arrays, attributes, arrays, of_motors, math.nan if held else float(arrays["speed"]))
    if "tension" in arrays:
        more += tendons(arrays, arrays["tension"], arrays["tension_peak"])
    decay = [_multipliers(arrays)]
    return Summary(
        f"{attributes['title']}, period {show_quantity(period, 'time')}",
        [*tables, *flow, *limits, *more, *(decay if multipliers else [])],
        notes=[
            *tail_first(*_speeds(arrays), _fastest(arrays), str(arrays["part"][0]), attributes),
            *meaning,
            *frames(arrays),
            f"mean powers: off balance by {off:.2g}{'; more --samples closes it' if off > _BALANCED else ''}",
        ],
        warnings=[*beyond, *saturated],
        cautions=[*cautions, *too_soft(attributes)],
        attributes=attributes,
        values={"power_balance": Number(off)},
        facts=[] if multipliers else decay,
    )


def _multipliers(arrays: Arrays) -> Table:
    """Floquet multipliers, each with its error."""
    heads = {"multiplier": "multiplier", "real": "real", "imaginary": "imaginary", "error": "error"}
    heads |= {"size": "magnitude"}
    rows = list[tuple[str | Number, ...]]()
    each = (arrays[f"multiplier_{part}"].tolist() for part in ("real", "imaginary", "error"))
    for k, (real, imaginary, error) in enumerate(zip(*each, strict=True)):
        size = abs(complex(real, imaginary))
        shown = (Number(x, shown=with_error(x, error).split(" +- ")[0]) for x in (real, imaginary))
        rows.append((str(k + 1), *shown, Number(error), Number(size)))
    return Table("multipliers", heads, rows, listed=True)


def _body(arrays: Arrays) -> Table:
    each = zip(arrays["velocity"][0], arrays["velocity_peak"][0], strict=True)
    row = (Label("velocity", "mean velocity"), *(Number(float(x), "m/s", float(most)) for x, most in each))
    heads = {"of": str(arrays["part"][0]), **AXES}
    beside = {"m/s": largest(arrays["velocity_peak"])}
    return Table("body", heads, [row], computed=True, hidden=still(arrays["velocity_peak"][0], beside), beside=beside)


def _cycle(arrays: Arrays, period: float, stays: bool) -> Table:
    """Averages that are defined: a body that stays has no efficiency. In a stream, speeds by water and by ground."""
    fastest = _fastest(arrays)
    through, over_ground = (" through the water", _OVER_GROUND) if streams(arrays) else ("", {})
    known = {
        "speed": (f"speed{through}", "m/s", fastest),
        "forward_speed": (f"forward speed{through}", "m/s", fastest),
        **{key: (name, "m/s", fastest) for key, name in over_ground.items()},
        "turn_rate": ("turn rate about z", "rad/s", 1 / period),  # a radian a cycle
        **{key: (name, unit, 0.0) for key, (name, unit) in EFFICIENCIES.items()},
    }
    each = ((Label(key, name), Number(float(arrays[key]), unit, peak)) for key, (name, unit, peak) in known.items())
    nothing = ({"turn_rate"} if streams(arrays) else {"speed", "forward_speed", "turn_rate"}) if stays else set[str]()
    rows = [row for row in each if row[1].measured and row[0].key not in nothing]
    beside = {"m/s": largest(arrays["velocity_peak"])}
    return Table("cycle", {"what": "cycle", "value": ""}, rows, computed=True, beside=beside)


def _speeds(arrays: Arrays) -> tuple[float, float]:
    return float(arrays["forward_speed"]), float(arrays["speed"])


def _fastest(arrays: Arrays) -> float:
    """Largest speed of the body, at most [m/s]."""
    return float(sum(x * x for x in arrays["velocity_peak"][0]) ** 0.5)


def _path(course: CyclePath, period: float) -> Table:
    """The circle or the helix of a robot that turns; no rows for one that does not."""
    rows = list[tuple[Label, Number]]()
    if math.isfinite(course.radius) and not counts_as_zero(course.rate, 0.0, 1 / period):
        axis = ", ".join(number(0.0 if counts_as_zero(x, 1.0) else x) for x in course.axis)
        rows.append((Label("rate", f"turns about ({axis}) by"), Number(float(course.rate), "rad/s")))
        rows.append((Label("radius", "radius"), Number(float(course.radius), "m")))
        if abs(course.pitch) > _FLAT * course.radius:
            rows.append((Label("pitch", "path along the axis in a turn"), Number(float(course.pitch), "m")))
    return Table("path", {"what": "path", "value": ""}, rows)


def _bending(arrays: Arrays) -> Table:
    """What bends: hinges with a flexible layer, and soft parts."""
    rows = list[tuple[Label, Number, Number]]()
    for i, name in enumerate(map(str, arrays["part"])):
        for what, place in (("hinge", f"hinge of {name}"), ("bending", name)):
            strain, stress = (float(arrays[f"{what}_{x}_peak"][i]) for x in ("strain", "stress"))
            if strain == strain:  # NaN: nothing bends there
                shown = show_quantity(stress, "pressure")
                rows.append((Label(place, place), Number(strain), Number(stress, "Pa", shown=shown)))
    return Table("bending", {"what": "bends", "strain": "largest strain", "stress": "largest stress"}, rows)
