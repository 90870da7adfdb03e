"""`nectosome new`: a robot file to start from."""

import re
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from nectosome.cli.output import Force, check_target, tell, write
from nectosome.cli.page import columns
from nectosome.description import import_urdf, load_robot, save_robot
from nectosome.io import write_atomic
from nectosome.units import InputError, did_you_mean


def new(
    template: Annotated[
        str | None,
        Parameter(help="Template, or a URDF file; left out, all templates are listed."),
    ] = None,
    file: Annotated[
        Path | None, Parameter(help="Robot file to write (.yaml); named after the template by default.")
    ] = None,
    /,
    *,
    force: Force = False,
) -> None:
    """Write a robot file to start from, or list the templates.

    A URDF file (.urdf) gives its links, joints, boxes, cylinders and spheres; the rest of it is listed as left out.
    """
    from nectosome import robots
    from nectosome.robots.shipped import starter_names, starter_of

    shipped = starter_names()
    known = [*shipped, *(name for name in robots.names() if name not in shipped)]
    if template is None:
        table = columns("template", "")
        for name in known:
            about = load_robot(starter_of(name)).about if name in shipped else robots.describe(name).about
            table.add_row(name, _first_sentence(about))
        write(table)
        return
    urdf = template.lower().endswith(".urdf")
    member = None if urdf or template in shipped else robots.of_family(template)
    if not urdf and template not in shipped and member is None:
        raise InputError(f'there is no template called "{template}".{did_you_mean(template, known)}')
    target = file or Path(f"{Path(template).stem if urdf else template}.yaml")
    if not force and (target.exists() or target.is_symlink()):
        raise InputError("exists. Give another name, or --force to overwrite it.", field=str(target))
    check_target(target, "FILE", ".yaml", force)
    if urdf:
        imported = import_urdf(template)
        write_atomic(target, imported.text.encode())
        for words in imported.left_out:
            tell(f"left out: {words}")
    elif member is not None:
        save_robot(member, target)
    else:
        write_atomic(target, starter_of(template).read_bytes())
    tell(f"wrote {target}. See nectosome show {target}, nectosome simulate {target}.")


def _first_sentence(text: str) -> str:
    return re.split(r"(?<!et al)\. ", text, maxsplit=1)[0].removesuffix(".")
