"""`nectosome new`, `check` and `schema`: a robot file to start from, its mistakes, and its schema for editors."""

import json
import re
import textwrap
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from nectosome import robots
from nectosome.cli.layout import Number, Table
from nectosome.cli.output import Force, Json, check_target, report, tell, write, write_text
from nectosome.cli.page import Summary
from nectosome.cli.weights import weigh
from nectosome.description import import_urdf, json_schema, load_robot, save_robot
from nectosome.description.plausible import implausible
from nectosome.io import write_atomic
from nectosome.robots.shipped import starter_names, starter_of
from nectosome.units import InputError, count, did_you_mean

_LONGEST = 110  # characters about a template: two lines of a narrow terminal


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
    as_json: Json = False,
) -> None:
    """Write a robot file to start from, or list the templates.

    A URDF file (.urdf) gives its links, joints, boxes, cylinders and spheres; the rest of it is listed as left out.
    """
    shipped = starter_names()
    known = [*shipped, *(name for name in robots.names() if name not in shipped)]
    if template is None:
        each = {name: load_robot(starter_of(name)) if name in shipped else robots.describe(name) for name in known}
        rows = [
            (name, textwrap.shorten(_first_sentence(robot.about), _LONGEST, placeholder=" ..."))
            for name, robot in each.items()
        ]
        hint = "nectosome new NAME writes the file of one; nectosome show NAME says more"
        write(Summary(tables=[Table("templates", {"name": "template", "about": ""}, rows)], notes=[hint]))
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
    report(target, words=f"wrote {target}. See nectosome show {target}, nectosome simulate {target}.")


def _first_sentence(text: str) -> str:
    return re.split(r"(?<!et al)\. ", text, maxsplit=1)[0].removesuffix(".")


def check(file: Annotated[Path, Parameter(help="A robot file.")], /, *, as_json: Json = False) -> None:
    """Check a robot file: print parts, degrees of freedom and mass, or the mistake.

    Values far outside of those of materials and water give warnings.
    """
    description = load_robot(file)

    from nectosome.model import build

    parts = weigh(build(description), str(file))
    for path, sentence in implausible(description):
        tell(f"{file}, {path}: {sentence}")
    freedoms = sum(len(part.freedoms) for part in parts)
    mass = sum(part.mass for part in parts)
    said = f"{file}: ok, {count(len(parts), 'part')}, {count(freedoms, 'degree')} of freedom, {mass:.4g} kg"
    values = {"parts": Number(len(parts)), "degrees_of_freedom": Number(freedoms), "mass": Number(mass, "kg")}
    write(Summary(notes=[said], values=values))


def schema() -> None:
    """Print the JSON Schema of robot files, for editors."""
    write_text(json.dumps(json_schema(), indent=2))
