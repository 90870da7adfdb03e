"""The file of a robot that is one free body with the shape of a mesh, from the file of the mesh."""

import json
from pathlib import Path

from nectosome.cli.output import tell
from nectosome.description.meshes import Unit, measured_mesh
from nectosome.units import InputError, format_quantity, show_quantity

_WATER = 1000.0  # kg/m3, of a robot file that does not say it


def mesh_robot(path: Path, unit: Unit | None) -> tuple[str, dict[str, bytes]]:
    """Text of a robot file, and the file of the mesh that belongs beside it, by name.

    Raises InputError for what is no mesh or bounds no body, and without a unit, with the sizes that each would give.
    """
    from nectosome.geometry import UNITS, read_mesh_bytes

    known = measured_mesh(path, unit or "m", str(path))
    size = max(b - a for a, b in zip(known.low, known.high, strict=True))
    if unit is None:
        sizes = (f"{show_quantity(size * UNITS[name], 'length')} with --unit {name}" for name in ("mm", "in", "m"))
        raise InputError(
            f"is missing: a mesh has numbers without one. Its largest extent is {', '.join(sizes)}.", field="--unit"
        )
    for found in known.told:
        tell(f"{path}: {found}")
    sizes = " x ".join(show_quantity(b - a, "length") for a, b in zip(known.low, known.high, strict=True))
    density = format_quantity(float(f"{_WATER * known.volume / known.matter:.12g}"), "density")
    return _TEXT.format(
        mesh=_quoted(path.name), unit=unit, name=_quoted(path.stem[:100]), sizes=sizes, density=density
    ), {path.name: read_mesh_bytes(path, str(path))}


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
  # limbs sit on it at offsets in the coordinates of the mesh; what the water does to it stands in its loads
"""
