"""`nectosome identify ROBOT`: what is unknown of any robot, from recordings of its motion."""

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from nectosome.cli.options import planned_files, read_count
from nectosome.cli.output import check_target, write
from nectosome.cli.progress import progress_bar
from nectosome.cli.weights import weigh
from nectosome.description import save_robot
from nectosome.io import provenance, save_dataset
from nectosome.units import InputError, read_positive, shorten


def identify_robot(
    robot: Annotated[str, Parameter(help="Name of a robot that ships, or a robot file.")],
    /,
    *,
    campaign: Annotated[Path, Parameter(help="Campaign (.yaml): recordings; their conditions are the robot's.")],
    find: Annotated[list[str], Parameter("--find", help='"PATH=LOW .. HIGH [log]": is unknown; repeatable.')],
    compare: Annotated[
        list[str],
        Parameter("--compare", help="COLUMN=READING, such as push=-force.x or tip=tail.tip.y; repeatable."),
    ],
    drive: Annotated[
        list[str] | None, Parameter("--drive", help="COLUMN=PATH: a column that is a signal of the robot; repeatable.")
    ] = None,
    error: Annotated[
        list[str] | None,
        Parameter("--error", help="COLUMN=VALUE: its standard error, else what the fit leaves; repeatable."),
    ] = None,
    skip: Annotated[
        str | None, Parameter(help="Nothing is compared in so long at first.", allow_leading_hyphen=True)
    ] = None,
    starts: Annotated[str, Parameter(help="From so many places in the ranges.", allow_leading_hyphen=True)] = "1",
    settings: Annotated[list[str] | None, Parameter("--set", help="PATH=VALUE; may be repeated.")] = None,
    test: Annotated[
        list[str] | None, Parameter(help="Files that are not fitted but predicted.", consume_multiple=True)
    ] = None,
    write_robot: Annotated[
        Path | None, Parameter("--write", help="Write the robot with what was found to this file (.yaml).")
    ] = None,
    save: Annotated[Path | None, Parameter(help="Where parameters and motions go (.nc).")] = None,
    plot: Annotated[Path | None, Parameter(help="Where the page with figures goes (.html).")] = None,
) -> None:
    """Find what is unknown of a robot: its simulated motion is brought to what recordings say, by least squares."""
    many = read_count(starts, "--starts", least=1, most=1000)
    left_out = 0.0 if skip is None else read_positive(skip, "time", "--skip")
    for target, option, suffix in (
        (save, "--save", ".nc"),
        (plot, "--plot", ".html"),
        (write_robot, "--write", ".yaml"),
    ):
        if target is not None:
            check_target(target, option, suffix)

    from nectosome import model, robots
    from nectosome.cli.identify_pages import robot_page
    from nectosome.description.variables import read_variable
    from nectosome.identification.robot.fit import fit_robot, robot_data
    from nectosome.identification.robot.misfit import RobotMisfit
    from nectosome.identification.robot.trials import read_compared, robot_trials

    planned, held_out = planned_files(campaign, test)
    description = robots.describe(robot, settings or ())
    variables = [read_variable(*_pair(text, "--find", "E=1 MPa .. 9 MPa log"), description) for text in find]
    drives = dict(_pair(text, "--drive", "pressure=body.loads.blow.pressure") for text in drive or ())
    built = model.build(description)
    weigh(built, robot)
    compared = [read_compared(text, built) for text in compare]
    for option, names in (("--find", [v.name for v in variables]), ("--compare", [one.column for one in compared])):
        if len(set(names)) < len(names):
            raise InputError("names one twice.", field=option)
    errors = {}
    for text in error or ():
        column, value = _pair(text, "--error", "tip=0.5 mm")
        one = next((one for one in compared if one.column == column), None)
        if one is None:
            raise InputError(f'"{shorten(column)}" is not compared.', field="--error")
        errors[column] = _standard_error(value, one.reading.dimension)
    with progress_bar("identifying") as update:
        trials = robot_trials([p.read() for p in planned.planned], description, compared, drives, left_out)
        fitted = [trial for trial in trials if trial.file not in held_out]
        held = [trial for trial in trials if trial.file in held_out]
        if not fitted:
            raise InputError("all recordings are held out: nothing is left to fit.", field="--test")
        found = fit_robot(description, variables, fitted, compared, errors, starts=many, progress=update)
        predicted = RobotMisfit(held, variables, compared).computed(found.theta) if held else []
        data = robot_data(found, list(zip(held, predicted, strict=True)))
    asked = {"robot": robot, "campaign": campaign, "find": find, "compare": compare, "drive": drive, "error": error}
    asked |= {"skip": skip, "starts": starts, "set": settings, "test": test}
    data.attrs |= {
        "title": f"{description.name}, to {campaign.name}",
        "provenance": json.dumps(provenance({key: value and str(value) for key, value in asked.items()})),
    }
    if save is not None:
        save_dataset(data, save)
    if plot is not None:
        from nectosome.view import show_robot_fit

        show_robot_fit(data, plot)
    if write_robot is not None:
        save_robot(found.described(description), write_robot)
    written = [str(target) for target in (save, plot, write_robot) if target is not None]
    write(robot_page(data), *([f"written: {', '.join(written)}"] if written else []))


def _pair(text: str, option: str, example: str) -> tuple[str, str]:
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals and value):
        raise InputError(f'"{shorten(text)}" must have a name, = and what it is, as in "{example}".', field=option)
    return name, value


def _standard_error(text: str, dimension: str) -> float:
    """A standard error in SI. Raises InputError."""
    return read_positive(text, dimension, "--error")
