"""`nectosome periodic`: the cycle that a robot keeps whose drives repeat themselves."""

import math
import time as clock
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from nectosome import robots
from nectosome.cli.layout import Label, Number, Table, number
from nectosome.cli.motor_tables import MOTOR_PEAKS, motors, servos, tendons
from nectosome.cli.options import Loads, Robot, Settings, read_count, value
from nectosome.cli.output import Outputs, unsolved, write
from nectosome.cli.page import Summary
from nectosome.cli.progress import progress_bar
from nectosome.cli.regime import regime
from nectosome.cli.run_summary import AXES, Arrays, acting, driven, largest, powers, still, stored
from nectosome.cli.stroke_tables import EFFICIENCIES, stroke, transport
from nectosome.cli.swimming import tail_first
from nectosome.cli.weights import build_weighed, sinking
from nectosome.description import drive_period
from nectosome.units import InputError, read_positive, show_quantity
from nectosome.units.zero import counts_as_zero

if TYPE_CHECKING:
    from nectosome.mechanism import Robot as BuiltRobot
    from nectosome.solve import CyclePath

_FLAT = 1e-6  # of the radius: a pitch as small is rounding
_FEWEST, _MOST = 17, 10_000  # samples: fewer miss the peaks and spoil the means


def periodic(
    robot: Robot,
    /,
    *,
    settings: Settings = None,
    period: Annotated[str | None, value("Period; by default that of the drives, or of a motor's turns.")] = None,
    samples: Annotated[str, value("Number of evenly spaced times of the cycle that are kept.")] = "129",
    outputs: Outputs = Outputs(),
    loads: Loads = False,
) -> int:
    """Find the periodic motion (limit cycle) of a robot, its cycle averages and its stability."""
    count = read_count(samples, "--samples", least=_FEWEST, most=_MOST)
    seconds = None if period is None else read_positive(period, "time", "--period")
    outputs.check()

    description = robots.describe(robot, settings or ())
    if seconds is None and not description.powered:
        seconds = drive_period(description)  # a motor may find its own: known with the cycle

    from nectosome.core import Status
    from nectosome.solve import Results, attributes_of, drive_limits, mean_data, prepare_means, reading
    from nectosome.solve import periodic as find

    start = clock.perf_counter()
    with progress_bar(f"{description.name}: finding the cycle"):
        built = build_weighed(description, robot)
        prepare_means(built, count)
        try:
            found = find(built, seconds, samples=count)
        except InputError as error:
            raise InputError(error.message, field=error.field, file=robot) from None
        status = Status(int(found.status))
        if status not in (Status.SOLVED, Status.SETTLED, Status.UNSTABLE):
            way_out = " Leave --period out to take that of the robot file." if status == Status.OTHER_PERIOD else ""
            if status == Status.NO_TURN:
                way_out = " Give it more voltage or less load; nectosome static finds where it may rest."
            if status == Status.NO_PERIOD:
                way_out = sinking(description, built, reading(found, "velocity.z")) or _of_motors(built, period)
            return unsolved(description.name, status, f"{status.reason}.{way_out}")
        inputs = {"robot": robot, "set": settings or [], "period": float(found.stats["period"]), "samples": count}
        data, names = mean_data(built, found.means())
        attributes = attributes_of(found, inputs)
        attributes["seconds"] = round(clock.perf_counter() - start, 3)
        arrays = Results(data | drive_limits(built), names, attributes).arrays
        page = _summary(arrays, found.course(), attributes, loads)
        write(page)
        if outputs.given:
            from nectosome.view import show_run

            results = found.results(inputs)
            results.attributes["seconds"] = attributes["seconds"]
            outputs.write(results.to_dataset(), show_run)
    if status == Status.UNSTABLE:
        return unsolved(description.name, status)
    return 1 if page.warnings else 0


def _of_motors(robot: "BuiltRobot", period: str | None) -> str:
    """Why a robot with motors at speeds of their own has no such cycle; empty for others."""
    from nectosome.solve import find_symmetry, free_hinges

    free = [robot.coordinate_names[k] for k in free_hinges(robot, find_symmetry(robot))]
    if free and period is not None:
        return f" The motor of {free[0]} finds its own speed, and the period with it: leave --period out."
    if len(free) > 1:
        return f" The motors of {' and '.join(free)} each find their own speed. Simulate the robot."
    return ""


def _summary(arrays: Arrays, course: "CyclePath", attributes: Mapping[str, Any], each: bool) -> Summary:
    """Drives, the body's motion, bending, powers, and how well the samples tell them."""
    period = float(attributes["period"])
    names = ("reaction", "drive_velocity", "reaction_power", "load_power")
    peaks = {name: arrays[f"{name}_peak"] for name in names}
    most = float(peaks["load_power"].sum() + peaks["reaction_power"].sum())
    loads, joints = arrays["load_power"].sum(axis=1), arrays["reaction_power"]
    tables = [driven(arrays, arrays["reaction"], peaks), _body(arrays), _cycle(arrays, period)]
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
    more, saturated = motors(arrays, attributes, arrays, of_motors, float(arrays["speed"]))
    if "tension" in arrays:
        more += tendons(arrays, arrays["tension"], arrays["tension_peak"])
    return Summary(
        f"{attributes['title']}, period {show_quantity(period, 'time')}",
        [*tables, *flow, *limits, *more],
        notes=[
            *tail_first(*_speeds(arrays), _fastest(arrays), str(arrays["part"][0]), attributes),
            *meaning,
            f"mean powers: off balance by {off:.2g}",
        ],
        warnings=[*beyond, *saturated],
        cautions=cautions,
        attributes=attributes,
        values={"power_balance": Number(off)},
    )


def _body(arrays: Arrays) -> Table:
    each = zip(arrays["velocity"][0], arrays["velocity_peak"][0], strict=True)
    row = (Label("velocity", "mean velocity"), *(Number(float(x), "m/s", float(most)) for x, most in each))
    heads = {"of": str(arrays["part"][0]), **AXES}
    beside = {"m/s": largest(arrays["velocity_peak"])}
    return Table("body", heads, [row], computed=True, hidden=still(arrays["velocity_peak"][0], beside), beside=beside)


def _cycle(arrays: Arrays, period: float) -> Table:
    """Averages that are defined: a body that stays has no efficiency."""
    fastest = _fastest(arrays)
    known = {
        "speed": ("speed", "m/s", fastest),
        "forward_speed": ("forward speed", "m/s", fastest),
        "turn_rate": ("turn rate about z", "rad/s", 1 / period),  # a radian a cycle
        **{key: (name, unit, 0.0) for key, (name, unit) in EFFICIENCIES.items()},
    }
    each = ((Label(key, name), Number(float(arrays[key]), unit, peak)) for key, (name, unit, peak) in known.items())
    rows = [row for row in each if row[1].measured]
    beside = {"m/s": largest(arrays["velocity_peak"])}
    return Table("cycle", {"what": "cycle", "value": ""}, rows, computed=True, beside=beside)


def _speeds(arrays: Arrays) -> tuple[float, float]:
    return float(arrays["forward_speed"]), float(arrays["speed"])


def _fastest(arrays: Arrays) -> float:
    """Largest speed of the body, at most [m/s]."""
    return float(sum(x * x for x in arrays["velocity_peak"][0]) ** 0.5)


def _path(course: "CyclePath", period: float) -> Table:
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
