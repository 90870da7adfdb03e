"""`nectosome export`: a robot, or a saved run, in a format of other programs."""

from pathlib import Path
from typing import Annotated, NamedTuple

from cyclopts import Parameter

from nectosome.cli.export_formats import WRITERS, Order
from nectosome.cli.options import RobotOrRun, Settings, value
from nectosome.cli.output import Force, Json, check_folder, check_target
from nectosome.io.file_system import entries, is_folder, is_taken
from nectosome.units import InputError, check_choice, read_positive

_TIME, _STEP = "12s", "10ms"  # where none are given


class _Format(NamedTuple):
    ending: str
    added: str = ""  # to the name of the robot, of what is named after it
    instead: str = ""  # of a format for saved runs: what there is for a robot


FORMATS = {
    "csv": _Format(".csv", instead="a table of a robot is --to masses"),
    "rrd": _Format(".rrd", instead="rrd is for a run only"),
    "masses": _Format(".csv", "_masses"),
    "folder": _Format("", "_folder"),
    "urdf": _Format(".urdf"),
    "mjcf": _Format(".xml"),
    "fmu": _Format(".fmu"),
}
_OF_ONE = {"--time": "mjcf", "--command": "fmu", "--measure": "fmu", "--step": "fmu"}  # options of one format alone


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
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a robot, or a saved run, in a format of other programs. What a format cannot hold is listed.

    csv: a saved run as a table over time. rrd: a saved run for the viewer of rerun.io. masses: mass properties and
    added mass of each part and of the whole, as a table. folder: the robot with its meshes as a folder that moves.
    urdf: links with mass and inertia, joints and shapes, rods as chains of links. mjcf: a model of MuJoCo, its water
    fitted to the robot's own motion, and how far off it is. fmu: FMI 2 for co-simulation.
    """
    check_choice(to, FORMATS, "--to")
    for option, given in {"--time": time, "--command": command, "--measure": measure, "--step": step}.items():
        if given is not None and to != _OF_ONE[option]:
            raise InputError(f"is for --to {_OF_ONE[option]}. Leave it out.", field=option)
    seconds = read_positive(_TIME if time is None else time, "time", "--time")
    length = read_positive(_STEP if step is None else step, "time", "--step")
    target = file or Path(f"{Path(what).stem}{FORMATS[to].added}{FORMATS[to].ending}")
    order = Order(what, settings or [], target, force, seconds, command or [], measure or [], length)
    # before the target: what cannot be exported is not helped by another name or --force
    source = order.run(FORMATS[to].instead) if FORMATS[to].instead else order.description()
    if to == "folder":
        _check_new_folder(target, force)
    else:
        check_target(target, "FILE", FORMATS[to].ending, force)
    WRITERS[to](source, order)


def _check_new_folder(folder: Path, force: bool) -> None:
    """Raise InputError where something is there, but for a folder with `force`, and where none can be made."""
    if is_taken(folder) and not is_folder(folder):
        raise InputError(f"{folder} exists and is no folder. Give another name.", field="FILE")
    if entries(folder) and not force:
        raise InputError(f"{folder} exists. Give another name, or --force to overwrite files in it.", field="FILE")
    check_folder(folder if is_folder(folder) else folder.parent, "FILE")
