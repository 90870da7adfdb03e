"""The summary of a robot at rest: how it lies in the water, its places, reactions, and what acts on it."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from nectosome.io.summary import Summary
from nectosome.io.tables import AXES, Label, Number, Table
from nectosome.mechanism import Free, Robot
from nectosome.units.zero import counts_as_zero

from .float_tables import Righting, float_tables
from .motor_tables import MOTOR_MEANS, MOTOR_PEAKS, endurance, motors
from .run_summary import Arrays, largest, reaction_unit
from .stroke_tables import too_soft

if TYPE_CHECKING:
    from ..floating import Floating


def rest_summary(
    robot: Robot,
    arrays: Arrays,
    attributes: Mapping[str, Any],
    floats: "tuple[Floating, Righting] | None" = None,
) -> Summary:
    """Return where a robot at rest lies, with which reactions, under which forces; `floats`: how it lies in water."""
    motor_rows, warnings = _motors(arrays, attributes)
    tables = [
        *([] if floats is None else float_tables(*floats)),
        _places(arrays),
        _reactions(arrays),
        *([_support(arrays)] if _is_held(robot) else []),
        _forces(arrays),
        *motor_rows,
    ]
    return Summary(attributes["title"], tables, warnings=warnings, cautions=too_soft(attributes), attributes=attributes)


def _places(arrays: Arrays) -> Table:
    """Where the tips of rods and the centres of bodies lie, and how far rods are bent."""
    rows = list[tuple[str | Number, ...]]()
    for part in map(str, arrays["part"]):
        own = arrays["station_part"] == part
        is_rod = arrays["station_x"][own][0] == 0  # the first station of a rigid part is its centre
        place = (Number(float(x), "m") for x in arrays["position"][0, own][-1 if is_rod else 0])
        strain = float(abs(arrays["bending_strain"][0, own]).max())
        rows.append((part, *place, *([Number(strain)] if strain > 0 else [])))
    heads = {"part": "tip of rod, centre of body", **AXES, "bending_strain_peak": "largest bending strain"}
    return Table("position", heads, rows, computed=True)


def _reactions(arrays: Arrays) -> Table:
    each = zip(map(str, arrays["prescribed"]), map(float, arrays["reaction"][0]), strict=True)
    rows = [(name, Number(x, reaction_unit(name))) for name, x in each]
    heads, beside = {"joint": "driven joint", "reaction": "reaction"}, {"N": largest(arrays["load_force"])}
    return Table("driven_joints", heads, rows, computed=True, beside=beside)


def _motors(arrays: Arrays, attributes: Mapping[str, Any]) -> tuple[list[Table], list[str]]:
    """What motors hold at rest, and warnings."""
    here = {name: arrays[name][0] for name in (*MOTOR_PEAKS, *MOTOR_MEANS) if name in arrays}
    if "battery_power" in arrays:
        here["battery_endurance"] = endurance(arrays, attributes, np.ones(1))
    return motors(arrays, attributes, here, {name: abs(here[name]) for name in MOTOR_PEAKS if name in here}, math.nan)


def _is_held(robot: Robot) -> bool:
    """Whether a part sits on the world by a joint that holds it along some direction."""
    at_root = (part for part in robot.tree.structure if part.parent < 0)
    return any(part.prescribed or not issubclass(part.joint, Free) for part in at_root)


def _support(arrays: Arrays) -> Table:
    """What the robot gives to what holds it."""
    force, place = largest(arrays["load_force"]), arrays["position"][0]
    beside = {"N": force, "N m": force * largest(place - place.mean(axis=0))}
    each = (("force", "support_force", "N"), ("moment about the root", "support_moment", "N m"))
    rows = [(Label(key, says), *(Number(float(x), unit) for x in arrays[key][0])) for says, key, unit in each]
    return Table("support", {"of": "on its support", **AXES}, rows, computed=True, beside=beside)


def _forces(arrays: Arrays) -> Table:
    """Sums over all parts; loads that act nowhere are left out."""
    forces = arrays["load_force"][0].sum(axis=1)
    there = ~counts_as_zero(forces, largest(forces)).all(axis=1)
    each = zip(map(str, arrays["load"][there]), forces[there], strict=True)
    rows = [(Label(name, name.replace("_", " ")), *(Number(float(x), "N") for x in force)) for name, force in each]
    return Table("load_force", {"load": "load", **AXES}, rows, computed=True)
