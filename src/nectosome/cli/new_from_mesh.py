"""The file of a robot that is one free body with the shape of a mesh, from the file of the mesh."""

import json
from pathlib import Path

from nectosome.cli.output import tell
from nectosome.cli.shape_facts import guessed_load
from nectosome.description.mesh_added_mass import told_of_thin
from nectosome.description.meshes import Unit, measured_mesh
from nectosome.description.robot import WaterDescription
from nectosome.io.extras import is_installed
from nectosome.units import InputError, format_quantity, show_quantity

_WATER = WaterDescription()  # of a robot file that does not say it


def mesh_robot(path: Path, unit: Unit | None) -> tuple[str, dict[str, bytes]]:
    """Text of a robot file, and the file of the mesh that belongs beside it, by name.

    Raises InputError for what is no mesh or bounds no body, and without a unit or with one that makes a part of an
    unlikely size, with the sizes that each would give.
    """
    from nectosome.geometry import UNITS, is_likely, read_mesh_bytes

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
    for found in known.told:
        tell(f"{path}: {found}")
    sizes = " x ".join(show_quantity(b - a, "length") for a, b in zip(known.low, known.high, strict=True))
    density = format_quantity(float(f"{_WATER.density * known.volume / known.matter:.12g}"), "density")
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
        drag=guessed_load(known, _WATER),
    )
    return text, {path.name: read_mesh_bytes(path, str(path))}


def _quoted(name: str) -> str:
    """A text of YAML, whatever is in it."""
    return json.dumps(name)


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
_NOT_ADDED = f"""\
    # water: {{kind: mesh_added_mass}} # by panels on its surface; it needs: {_INSTALL}"""
_INSIDE = """\
    # water: {kind: mesh_added_mass} # by panels on its surface; it needs bodies that neither touch nor overlap"""
