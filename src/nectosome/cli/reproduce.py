"""`nectosome reproduce`: studies of published robots, which are a package beside this one."""

from importlib import import_module
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from nectosome.cli.options import command
from nectosome.cli.output import Force, Json
from nectosome.units import InputError

_STUDIES = "nectosome_studies"


@command
def reproduce(
    *studies: Annotated[str, Parameter(help="Names of studies; all of them by default.")],
    quick: Annotated[bool, Parameter(help="Shorter computations that still fill every row.")] = False,
    out: Annotated[
        Path | None, Parameter(help="Write report.html and its pages, scorecard.json, figures and runs to this folder.")
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> int:
    """Run the studies of the published robots and print how they compare with the papers."""
    try:
        package = import_module(f"{_STUDIES}.reproduce")
    except ModuleNotFoundError as error:
        if error.name != _STUDIES:
            raise
        raise InputError(
            "the studies of published robots are a package of their own, which is not installed. They are in the "
            "folder `studies` of a clone: pip install ./nectosome/studies"
        ) from None
    return package.reproduce(studies, quick, out, force)
