"""`nectosome periodic`: the cycle that a robot keeps whose drives repeat themselves."""

import math
import time as clock
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from rich.console import Group
from rich.table import Table

from nectosome import robots
from nectosome.cli.options import Loads, Robot, Settings, read_count, value
from nectosome.cli.output import Outputs, progress_bar, tell, write
from nectosome.cli.page import (
    Arrays,
    acting,
    columns,
    ending,
    is_joint,
    number,
    page,
    powers,
    reaction_unit,
    servos,
    stored,
)
from nectosome.cli.weights import build_weighed
from nectosome.description import drive_period
from nectosome.units import InputError, read_positive, show_quantity

if TYPE_CHECKING:
    from nectosome.solve import CyclePath

_FLAT = 1e-6  # of the radius: a pitch as small is rounding
_FEWEST, _MOST = 17, 10_000  # samples: fewer miss the peaks and spoil the means


def periodic(
    robot: Robot,
    /,
    *,
    settings: Settings = None,
    period: Annotated[str | None, value("Period of the drives; by default that of the robot file.")] = None,
    samples: Annotated[str, value("Number of evenly spaced times of the cycle that are kept.")] = "129",
    outputs: Outputs = Outputs(),
    loads: Loads = False,
) -> int:
    """Find the periodic motion (limit cycle) of a robot, its cycle averages and its stability."""
    count = read_count(samples, "--samples", least=_FEWEST, most=_MOST)
    seconds = None if period is None else read_positive(period, "time", "--period")
    outputs.check()

    description = robots.describe(robot, settings or ())
    if seconds is None:
        seconds = drive_period(description)

    from nectosome.core import Status
    from nectosome.solve import Results, attributes_of, drive_limits, mean_data, prepare_means
    from nectosome.solve import periodic as find

    start = clock.perf_counter()
    with progress_bar(description.name):
        built = build_weighed(description, robot)
        prepare_means(built, count)
        try:
            found = find(built, seconds, samples=count)
        except InputError as error:
            raise InputError(error.message, file=robot) from None
        status = Status(int(found.status))
        if status not in (Status.SOLVED, Status.SETTLED, Status.UNSTABLE):
            way_out = " Leave --period out to take that of the robot file." if status == Status.OTHER_PERIOD else ""
            tell(f"{description.name}: {status.reason}.{way_out}")
            return 1
        inputs = {"robot": robot, "set": settings or [], "period": seconds, "samples": count}
        data, names = mean_data(built, found.means())
        attributes = attributes_of(found, inputs)
        attributes["seconds"] = round(clock.perf_counter() - start, 3)
        arrays = Results(data | drive_limits(built), names, attributes).arrays
        write(_page(arrays, found.course(), attributes, loads))
        if outputs.given:
            from nectosome.view import show_run

            results = found.results(inputs)
            results.attributes["seconds"] = attributes["seconds"]
            outputs.write(results.to_dataset(), show_run)
    if status == Status.UNSTABLE:
        tell(f"{description.name}: {status.reason}.")
        return 1
    return 0


def _page(arrays: Arrays, course: "CyclePath", attributes: Mapping[str, Any], each: bool) -> Group:
    """Drives, the body's motion, bending, powers, and how well the samples tell them."""
    tables = [_drives(arrays)] if any(map(is_joint, arrays["prescribed"])) else []
    loads, joints = arrays["load_power"].sum(axis=1), arrays["reaction_power"]
    tables += [_body(arrays), _motion(arrays), *_turning(course), *_bending(arrays)]
    if each:
        means = arrays["load_force"], arrays["load_power"]
        tables += [acting(arrays, *means, attributes["period"]), stored(arrays, arrays["part_energy"])]
    tables += [powers(arrays, loads, joints)]
    off = abs(loads.sum() + joints.sum()) / max(abs(loads).sum() + abs(joints).sum(), 1e-300)
    lines = [f"mean powers: off balance by {off:.1e}"]
    if "reaction_limit" in arrays:
        lines += servos(arrays, arrays["reaction_peak"], arrays["drive_velocity_peak"])
    title = f"{attributes['title']}, period {show_quantity(attributes['period'], 'time')}"
    return page(title, tables, [*lines, ending(attributes)])


def _drives(arrays: Arrays) -> Table:
    table = columns("driven joint", "mean reaction", "largest", "unit", "fastest", "unit", "mean power", "unit")
    for i, name in enumerate(map(str, arrays["prescribed"])):
        if not is_joint(name):
            continue
        unit = reaction_unit(name)
        speed = number(arrays["drive_velocity_peak"][i]), "rad/s" if unit == "N m" else "m/s"
        forces = number(arrays["reaction"][i]), number(arrays["reaction_peak"][i]), unit
        table.add_row(name, *forces, *speed, number(arrays["reaction_power"][i]), "W")
    return table


def _body(arrays: Arrays) -> Table:
    row = ("mean velocity", *map(number, arrays["velocity"][0]), "m/s")
    return columns(str(arrays["part"][0]), "x", "y", "z", "unit", rows=[row])


def _motion(arrays: Arrays) -> Table:
    table = columns("cycle", "", "unit")
    units = {"speed": "m/s", "turn_rate": "rad/s", "power": "W", "efficiency": "", "cost_of_transport": ""}
    for name, unit in units.items():
        value = float(arrays[name])
        if value == value:  # NaN: not defined for a body that stays
            about = " about z" if name == "turn_rate" else ""
            table.add_row(name.replace("_", " ") + about, number(value), unit)
    return table


def _turning(course: "CyclePath") -> list[Table]:
    """The circle or the helix of a robot that turns."""
    if not math.isfinite(course.radius):
        return []
    table = columns("path", "", "unit")
    table.add_row(f"turns about ({', '.join(number(x) for x in course.axis)}) by", number(course.rate), "rad/s")
    table.add_row("radius", number(course.radius), "m")
    if abs(course.pitch) > _FLAT * course.radius:
        table.add_row("path along the axis in a turn", number(course.pitch), "m")
    return [table]


def _bending(arrays: Arrays) -> list[Table]:
    """What bends: hinges with a flexible layer, and soft parts."""
    table = columns("bends", "largest strain", "largest stress")
    for i, name in enumerate(map(str, arrays["part"])):
        for what, place in (("hinge", f"hinge of {name}"), ("bending", name)):
            strain, stress = (float(arrays[f"{what}_{x}_peak"][i]) for x in ("strain", "stress"))
            if strain == strain:  # NaN: nothing bends there
                table.add_row(place, number(strain), show_quantity(stress, "pressure"))
    return [table] if table.row_count else []
