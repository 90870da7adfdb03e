"""`nectosome export`: a robot, or a saved run, in a format of other programs."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from nectosome.cli.exports import FORMATS, Order
from nectosome.cli.options import RobotOrRun, Settings, command, value
from nectosome.cli.output import Force, Json, check_folder, check_target
from nectosome.io.discovery import first_paragraph
from nectosome.io.file_system import entries, is_folder, is_taken
from nectosome.units import InputError, check_choice, check_share, read_positive, read_quantity

_TIME, _STEP, _RTOL, _ATOL = "12s", "10ms", "1e-4", "1e-6"  # where none are given


@command
def export(
    what: RobotOrRun,
    file: Annotated[Path | None, Parameter(help="File or folder to write; named after the robot by default.")] = None,
    /,
    *,
    to: Annotated[str, Parameter(help=f"Format: {', '.join(FORMATS)}.")],
    settings: Settings = None,
    time: Annotated[
        str | None, value(f"Length of the run that the water of mjcf is fitted to; {_TIME} by default.")
    ] = None,
    command: Annotated[
        list[str] | None, Parameter(help="Quantity that is an input of fmu, by its path or alias; may be repeated.")
    ] = None,
    measure: Annotated[
        list[str] | None,
        Parameter(help="Reading that is an output of fmu, such as arm.angle; by default the body's place and heading."),
    ] = None,
    step: Annotated[str | None, value(f"Step of fmu, for which inputs are held; {_STEP} by default.")] = None,
    rtol: Annotated[str | None, value(f"Relative tolerance of the time steps of fmu; {_RTOL} by default.")] = None,
    atol: Annotated[str | None, value(f"Absolute tolerance, likewise; {_ATOL} by default.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a robot, or a saved run, in a format of other programs. What a format cannot hold is listed."""
    check_choice(to, FORMATS, "--to")
    chosen = FORMATS[to]
    options = {
        "--time": time,
        "--command": command,
        "--measure": measure,
        "--step": step,
        "--rtol": rtol,
        "--atol": atol,
    }
    for option, given in options.items():
        if given is not None and option not in chosen.options:
            (own,) = (one.name for one in FORMATS.values() if option in one.options)
            raise InputError(f"is for --to {own}. Leave it out.", field=option)
    seconds = read_positive(_TIME if time is None else time, "time", "--time")
    length = read_positive(_STEP if step is None else step, "time", "--step")
    tolerances = tuple(
        read_quantity(usual if given is None else given, "number", option)
        for option, given, usual in (("--rtol", rtol, _RTOL), ("--atol", atol, _ATOL))
    )
    for option, tolerance in zip(("--rtol", "--atol"), tolerances, strict=True):
        check_share(tolerance, option)
    target = file or Path(f"{Path(what).stem}{chosen.added}{chosen.ending}")
    order = Order(what, settings or [], target, force, seconds, command or [], measure or [], length, *tolerances)
    # before the target: what cannot be exported is not helped by another name or --force
    source = order.run(chosen.instead) if chosen.instead else order.description()
    if not chosen.ending:
        _check_new_folder(target, force)
    else:
        check_target(target, "FILE", chosen.ending, force)
    chosen.write(source, order)


export.__doc__ = f"{export.__doc__}\n\n" + (
    " ".join(f"{name}: {first_paragraph(type(one))}" for name, one in FORMATS.items())
)


def _check_new_folder(folder: Path, force: bool) -> None:
    """Raise InputError where something is there, but for a folder with `force`, and where none can be made."""
    if is_taken(folder) and not is_folder(folder):
        raise InputError(f"{folder} exists and is no folder. Give another name.", field="FILE")
    if entries(folder) and not force:
        raise InputError(f"{folder} exists. Give another name, or --force to overwrite files in it.", field="FILE")
    check_folder(folder if is_folder(folder) else folder.parent, "FILE")
