"""`nectosome check`: what a robot file describes, or what is wrong with it."""

from itertools import chain
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from nectosome.cli.options import Settings, command
from nectosome.cli.output import Json, tell, write
from nectosome.io.summary import Summary
from nectosome.io.tables import Number
from nectosome.units import InputError, count


@command
def check(
    file: Annotated[Path, Parameter(help="A robot file.")],
    /,
    *,
    settings: Settings = None,
    write_out: Annotated[
        bool, Parameter("--write", negative="", help="Write into the file the loads that water: auto chooses.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Check a robot file: print parts, degrees of freedom and mass, or the mistake.

    Values of no material, no water and no robot, mass outside of its part, tendons and chambers outside of their rods,
    and parts that pass through each other at the start give warnings. Of parts that motions move it estimates sweep,
    Reynolds, Keulegan-Carpenter and Strouhal numbers, and says which loads fit them.
    """
    from nectosome.description import apply_settings, load_robot
    from nectosome.description.auto_file import auto_loads, write_auto_loads
    from nectosome.description.plausible import implausible
    from nectosome.description.uncertainty import idle_correlations
    from nectosome.description.water_left_out import water_left_out

    if write_out and settings:
        raise InputError("leaves the file as it is, and --write changes it. Leave one of the two out.", field="--set")
    description = load_robot(file)
    chosen = auto_loads(file, description)
    if settings:
        description = apply_settings(description, settings)

    from nectosome.mechanism import check_inertia, weigh
    from nectosome.model import build
    from nectosome.model.fitting_loads import auto_table, before_run
    from nectosome.model.overlaps import overlaps

    robot = build(description)
    parts = weigh(robot, str(file))
    try:
        check_inertia(robot)
    except InputError as error:
        raise InputError(error.message, file=str(file), field=error.field) from None
    doubts = implausible(description), water_left_out(description), idle_correlations(description)
    for path, sentence in [*chain(*doubts), *overlaps(description, robot)]:
        tell(f"{file}, {path}: {sentence}")
    freedoms = sum(len(part.freedoms) for part in parts)
    mass = sum(part.mass for part in parts)
    said = f"{file}: ok, {count(len(parts), 'part')}, {count(freedoms, 'degree')} of freedom, {mass:.4g} kg"
    values = {"parts": Number(len(parts)), "degrees_of_freedom": Number(freedoms), "mass": Number(mass, "kg")}
    if write_out:
        write_auto_loads(file, chosen)
    tables, meaning = before_run(description)
    tables = [*auto_table(chosen, description), *tables]
    write(Summary(notes=[said], values=values, facts=tables, after=[*tables, *meaning]))
