"""`nectosome static` and `steady`: the shape of a robot at rest, and the motion that it keeps with steady drives."""

import math
import time as clock
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from nectosome import robots
from nectosome.cli.float_facts import float_tables, righting
from nectosome.cli.layout import Label, Number, Table
from nectosome.cli.motor_tables import MOTOR_MEANS, MOTOR_PEAKS, endurance, motors
from nectosome.cli.options import Loads, Robot, Settings
from nectosome.cli.output import Outputs, unsolved, write
from nectosome.cli.page import Summary
from nectosome.cli.progress import progress_bar
from nectosome.cli.run_summary import AXES, Arrays, largest, reaction_unit, summary
from nectosome.cli.weights import build_weighed
from nectosome.units import InputError
from nectosome.units.zero import counts_as_zero

if TYPE_CHECKING:
    from nectosome import mechanism
    from nectosome.description import RobotDescription

_WATCHED = 10.0  # s of simulation that show what happens where nothing is steady
Found = TypeVar("Found")


def static(robot: Robot, /, *, settings: Settings = None, outputs: Outputs = Outputs()) -> int:
    """Find the static equilibrium of a robot under weight, buoyancy and other steady loads; drives stay at t = 0.

    A free robot floats or, if it is neutral, hangs: draught, trim, heel, metacentric heights, righting arms.

    Force and moment on the support are those of the robot on what holds it, about its root, as a load cell measures.
    """
    outputs.check()
    description = robots.describe(robot, settings or ())

    from nectosome import solve
    from nectosome.core import Status

    start = clock.perf_counter()
    with progress_bar(f"{description.name}: finding the shape at rest"):
        found = _equilibrium(solve.static, description, robot)
        status = Status(int(found.status))
        if status == Status.NO_EQUILIBRIUM:
            return unsolved(description.name, status, why=found.why)
        results = found.results({"robot": robot, "set": settings or []})
    results.attributes["seconds"] = round(clock.perf_counter() - start, 3)
    arrays = results.arrays
    support = [_support(arrays)] if _is_held(found.value.system) else []
    curve = None if found.lies is None else righting(found.value.system, found.lies)
    floats = [] if found.lies is None or curve is None else float_tables(found.lies, curve)
    tables = [*floats, _places(arrays), _reactions(arrays), *support, _forces(arrays)]
    held, beyond = _motors(arrays, results.attributes)
    tables += held
    write(Summary(results.attributes["title"], tables, warnings=beyond, attributes=results.attributes))
    if outputs.given:
        from nectosome.view import righting_panel, show_still

        texts = [table.texts() for table in tables if table.rows]
        more = []
        if found.lies is not None and curve is not None:
            more = [righting_panel(*curve, float(found.lies.heel), float(found.lies.metacentric_heights[0]))]
        outputs.write(results.to_dataset(), lambda data, path: show_still(data, path, texts, more))
    return unsolved(description.name, status) if status == Status.UNSTABLE else 1 if beyond else 0


def steady(robot: Robot, /, *, settings: Settings = None, outputs: Outputs = Outputs(), loads: Loads = False) -> int:
    """Find the steady motion of a robot and its stability."""
    outputs.check()
    description = robots.describe(robot, settings or ())

    from nectosome import solve
    from nectosome.core import Status

    start = clock.perf_counter()
    with progress_bar(description.name) as update:
        update("finding the steady motion", 0.0)
        found = _equilibrium(solve.steady, description, robot)
        status = Status(int(found.status))
        if status in (Status.SOLVED, Status.UNSTABLE):
            results = found.results({"robot": robot, "set": settings or []})
            results.attributes["seconds"] = round(clock.perf_counter() - start, 3)
            page = summary(results.arrays, results.attributes, loads)
            write(page)
            if outputs.given:
                from nectosome.view import show_run

                outputs.write(results.to_dataset(), show_run)
            if status == Status.SOLVED:
                return 1 if page.warnings else 0
        update("no steady motion; simulating what happens instead", 0.0)
        instead = found.instead(_WATCHED)
    cycle = ' Its cycle is found by "nectosome periodic".' if instead.kind == "oscillating" else ""
    watched = f"{status.reason}. Simulated from rest for {_WATCHED:.0f} s, {instead}.{cycle}"
    return unsolved(description.name, status, why=watched)


def _equilibrium(find: "Callable[[mechanism.Robot], Found]", description: "RobotDescription", robot: str) -> Found:
    """Equilibrium of a robot; a mistake names the robot."""
    from nectosome.solve import prepare_results

    built = build_weighed(description, robot)
    prepare_results(built, 1)
    try:
        return find(built)
    except InputError as error:
        raise InputError(error.message, file=robot) from None


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
    import numpy as np

    here = {name: arrays[name][0] for name in (*MOTOR_PEAKS, *MOTOR_MEANS) if name in arrays}
    if "battery_power" in arrays:
        here["battery_endurance"] = endurance(arrays, attributes, np.ones(1))
    return motors(arrays, attributes, here, {name: abs(here[name]) for name in MOTOR_PEAKS if name in here}, math.nan)


def _is_held(robot: "mechanism.Robot") -> bool:
    """Whether a part sits on the world by a joint that holds it along some direction."""
    from nectosome.mechanism import Free

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
