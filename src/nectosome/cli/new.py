"""`nectosome new`: a file to start from, of a robot or of another kind."""

import json
import re
import shlex
import textwrap
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from nectosome.cli.options import command, tell_far_out
from nectosome.cli.output import Force, Json, check_target, report, tell, write
from nectosome.cli.starter_files import for_editors, write_files
from nectosome.io.extras import is_installed
from nectosome.io.file_system import entries, is_taken
from nectosome.io.schema.kinds import KINDS
from nectosome.io.summary import Summary
from nectosome.io.tables import Table
from nectosome.units import InputError, MeshUnit, did_you_mean, format_quantity, show_quantity

_TEXT = """\
# One free body with the shape of a mesh of {sizes}, in the frame of the mesh. Commands to begin with:
#   nectosome show FILE       its volume, centres and areas
#   nectosome simulate FILE
name: {name}
body:
  kind: rigid
  shape: {{mesh: {mesh}, unit: {unit}}}
  density: {density} # of its matter: neutral in water of 1000 kg/m3; or give a mass
  joint: {{kind: free}}
  loads:
{added}
    # a first guess by the part's form; `nectosome show` lists how far off it may be. Refine it by `nectosome identify`
    drag: {drag}
  # limbs sit on it at offsets in the coordinates of the mesh
aliases: # short names, and the sliders of `nectosome studio`
  rho: body.density
  S_x: body.loads.drag.drag_area.0
  S_y: body.loads.drag.drag_area.1
  S_z: body.loads.drag.drag_area.2
"""
_INSTALL = "pip install 'nectosome[mesh]'"
_ADDED = """\
    # by panels on its surface, when this file is read the first time: some seconds
    water: {kind: mesh_added_mass}"""
_INSIDE = """\
    # water: {kind: mesh_added_mass} # by panels on its surface; it needs bodies that neither touch nor overlap"""
_FOLDER = Path(__file__).parent / "templates"
MESHES = (".stl", ".obj", ".ply")  # those of `nectosome.geometry`, which takes a while to import
_LONGEST = 110  # characters about a template: two lines of a narrow terminal


def mesh_robot(path: Path, unit: MeshUnit | None) -> tuple[str, dict[str, bytes]]:
    """Text of a robot file, and the file of the mesh that belongs beside it, by name.

    Raises InputError for what is no mesh or bounds no body, and without a unit or with one that makes a part of an
    unlikely size, with the sizes that each would give.
    """
    from nectosome.description.mesh_added_mass import told_of_thin
    from nectosome.description.meshes import measured_mesh
    from nectosome.description.shape_facts import guessed_load
    from nectosome.description.water import WaterDescription
    from nectosome.geometry import UNITS, is_likely, read_mesh_bytes

    water = WaterDescription()  # of a robot file that does not say it
    known = measured_mesh(path, unit or "m", str(path))
    size = max(b - a for a, b in zip(known.low, known.high, strict=True))
    number = size / UNITS[unit or "m"]
    each = [f"{show_quantity(number * UNITS[name], 'length')} with --unit {name}" for name in ("mm", "in", "m")]
    if unit is None:
        raise InputError(
            f"is missing: a mesh has numbers without one. Its largest extent is {', '.join(each)}.", field="--unit"
        )
    if not is_likely(size):
        raise InputError(
            f"the largest extent of the part would be {show_quantity(size, 'length')}. It is {', '.join(each)}. If it "
            f"is right, write the robot file by hand, with shape: {{mesh: {_quoted(path.name)}, unit: {unit}}}.",
            field="--unit",
        )
    for sentence in known.told:
        tell(f"{path}: {sentence}")
    sizes = " x ".join(show_quantity(b - a, "length") for a, b in zip(known.low, known.high, strict=True))
    density = format_quantity(float(f"{water.density * known.volume / known.matter:.12g}"), "density")
    if known.touch:
        tell("added mass is left out: bodies touch or overlap. Unite them where they were drawn")
        added = _INSIDE
    elif is_installed("capytaine"):
        added = _ADDED
        if (thin := told_of_thin(known)) is not None:
            tell(f"{path}: {thin}")
    else:
        tell(f"added mass is left out: it needs the package capytaine: {_INSTALL}")
        added = _NOT_ADDED
    tell("the drag is a first guess by the part's form. Measured motions refine it: nectosome identify")
    text = _TEXT.format(
        mesh=_quoted(path.name),
        unit=unit,
        name=_quoted(path.stem[:100]),
        sizes=sizes,
        density=density,
        added=added,
        drag=guessed_load(known, water),
    )
    return text, {path.name: read_mesh_bytes(path, str(path))}


def _quoted(name: str) -> str:
    """A text of YAML, whatever is in it."""
    return json.dumps(name)


_NOT_ADDED = f"""\
    # water: {{kind: mesh_added_mass}} # by panels on its surface; it needs: {_INSTALL}"""


_ROBOT_COMMANDS = ["nectosome show FILE", "nectosome simulate FILE"]


@command
def new(
    template: Annotated[
        str | None,
        Parameter(help="Template, a URDF file, or a mesh; left out, all templates are listed."),
    ] = None,
    file: Annotated[Path | None, Parameter(help="File to write (.yaml); named after the template by default.")] = None,
    /,
    *,
    unit: Annotated[MeshUnit | None, Parameter(help="Unit of a mesh, which its file does not tell.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a file to start from: a robot, or another file that commands read. Without a name, list the templates.

    A URDF file (.urdf) gives its links, joints, boxes, cylinders, spheres and meshes; the rest of it is listed as left
    out. Its meshes are copied beside the file.
    A mesh (.stl, .obj, .ply) gives a free body of its shape, neutral in water; it is copied beside the file.
    The schema of the file is written beside it; editors complete and explain its fields with it.
    """
    if template is None:
        _list_templates()
        return
    kind = template if template in _other_templates() else "robot"
    is_mesh = Path(template).suffix.lower() in MESHES
    if unit is not None and not is_mesh:
        raise InputError("is that of a mesh. Leave it out.", field="--unit")
    target = file or Path(f"{Path(template).stem if is_mesh or _is_urdf(template) else template}.yaml")
    if not force and is_taken(target):
        raise InputError("exists. Give another name, or --force to overwrite it.", field=str(target))
    check_target(target, "FILE", ".yaml", force)
    content, beside = mesh_robot(Path(template), unit) if is_mesh else _content(template, kind)
    files = {target.name: for_editors(content, kind).encode(), **beside}
    write_files(target.parent, files, [kind], force)
    written = [target, *(target.parent / name for name in beside)]
    commands = [line.replace("FILE", shlex.quote(str(target))) for line in _commands(content)]
    report(*written, words=f"wrote {', '.join(map(str, written))}. See {', '.join(commands)}.")


def _other_templates() -> dict[str, Path]:
    return {path.stem: path for path in entries(_FOLDER, "*.yaml")}


def _is_urdf(template: str) -> bool:
    return template.lower().endswith(".urdf")


def _list_templates() -> None:
    from nectosome import robots
    from nectosome.description import load_robot
    from nectosome.robots.shipped import starter_names, starter_of

    shipped = starter_names()
    described = {name: load_robot(starter_of(name)) for name in shipped}
    described |= {name: robots.describe(name) for name in robots.names() if name not in shipped}
    about = [
        (name, textwrap.shorten(_first_sentence(robot.about), _LONGEST, placeholder=" ..."))
        for name, robot in described.items()
    ]
    others = [(name, f"{KINDS[name].title}: {KINDS[name].command}") for name in _other_templates()]
    tables = [Table("robots", {"name": "robot", "about": ""}, about)]
    tables += [Table("other_files", {"name": "other file", "about": ""}, others)]
    hint = "nectosome new NAME writes the file of one; nectosome show NAME says more of a robot"
    write(Summary(tables=tables, notes=[hint]))


def _content(template: str, kind: str) -> tuple[str, dict[str, bytes]]:
    """Text of a template, and the files that belong beside it. Raises InputError for an unknown one."""
    if _is_urdf(template):
        from nectosome.description import import_urdf
        from nectosome.geometry import read_mesh_bytes

        imported = import_urdf(template)
        for words in imported.left_out:
            tell(f"left out: {words}")
        tell_far_out(imported.description, template)
        return imported.text, {name: read_mesh_bytes(path, str(path)) for name, path in imported.meshes.items()}
    if kind != "robot":
        text = _other_templates()[template].read_text(encoding="utf-8")
        return text, {path.name: path.read_bytes() for path in entries(_FOLDER, "*.csv") if path.name in text}

    from nectosome import robots
    from nectosome.description import dump_robot
    from nectosome.robots.shipped import starter_names, starter_of

    shipped = starter_names()
    if template in shipped:
        return starter_of(template).read_text(encoding="utf-8"), {}
    member = robots.of_family(template)
    if member is None:
        known = [*shipped, *robots.names(), *_other_templates()]
        raise InputError(f'there is no template called "{template}".{did_you_mean(template, known)}')
    return dump_robot(member), {}


def _commands(text: str) -> list[str]:
    """The commands that the comments at the beginning of a template name for it."""
    head = re.match(r"(#.*\n)*", text)
    lines = re.findall(r"^#   (nectosome .*?)(?:\s{2,}.*)?$", head[0] if head else "", re.MULTILINE)
    return [line for line in lines if "FILE" in line] or _ROBOT_COMMANDS


def _first_sentence(text: str) -> str:
    return re.split(r"(?<!et al)\. ", text, maxsplit=1)[0].removesuffix(".")
