"""Added mass of rigid parts that are meshes, by panels: what was computed goes along with the robot."""

import hashlib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, model_validator

from nectosome.description.loads import LoadDescription, check_added_mass, matrix_image
from nectosome.description.meshes import MeshShape, Six, Unit
from nectosome.description.mirror import Mirror
from nectosome.io.schema.described import Described, inside, wrong
from nectosome.units import InputError

if TYPE_CHECKING:
    from nectosome.geometry.panel_added_mass import PanelAddedMass

Panels = Annotated[int, Field(strict=True, ge=100, le=5000)]


class ComputedAddedMass(Described):
    """Added mass of a mesh as it was computed. It is written by nectosome, not by hand."""

    sha256: str
    """Hash of the file of the mesh."""
    unit: Unit
    """Unit of the numbers in that file."""
    mirrored: bool = False
    """Whether it is that of the mirror image."""
    panels: Panels
    """Number of panels that it was computed with."""
    matrix: tuple[Six, Six, Six, Six, Six, Six]
    """Added mass over the water's density, about the centre of the volume and along the axes of the mesh, rotation
    before translation: [m5, m4; m4, m3]."""
    error: Six
    """About how far off each number of its diagonal may be."""

    @model_validator(mode="after")
    def _is_an_inertia(self) -> Self:
        try:
            check_added_mass(self.matrix)
        except ValueError as error:
            raise wrong("matrix", f"{error} Take `computed` out, so that it is computed anew.") from None
        return self

    def image(self) -> Self:
        """Return that of the mirror image, in the plane of x and z."""
        return self.model_copy(update={"mirrored": not self.mirrored, "matrix": matrix_image(self.matrix)})


class MeshAddedMassLoad(LoadDescription):
    """Added mass of a rigid part that is a mesh, in unbounded water, by panels on its surface.

    It is computed when the robot is read, with the extra `mesh`, and kept in the robot from there on.
    """

    kind: Literal["mesh_added_mass"]
    panels: Panels = 1000
    """Number of panels, triangles of even size in place of those of the mesh. The error goes down with more of them,
    and the time goes up."""
    computed: ComputedAddedMass | None = None
    """What was computed. Nectosome writes it, so that neither mesh nor extra is needed again; it is computed anew for
    another mesh."""
    on = ("mesh",)
    mirror = Mirror(computed=ComputedAddedMass.image)

    @property
    def known(self) -> ComputedAddedMass:
        """What was computed."""
        assert self.computed is not None
        return self.computed


def with_added_mass(
    loads: Mapping[str, LoadDescription], shape: MeshShape, folder: Path
) -> Mapping[str, LoadDescription]:
    """Loads of a part with a shape, of whose added mass by panels all is computed; files of meshes are in `folder`.

    Raises the error of a field where it has to be, and the mesh is not there, is not the one that was measured, or has
    none, or the extra is missing.
    """
    found = dict(loads)
    for name, load in loads.items():
        if isinstance(load, MeshAddedMassLoad) and not _is_of(load, shape):
            with inside(f"loads.{name}"):
                found[name] = load.model_copy(update={"computed": _computed(shape, load.panels, folder)})
    return found


def _is_of(load: MeshAddedMassLoad, shape: MeshShape) -> bool:
    known = load.computed
    if known is None:
        return False
    given = shape.numbers.sha256, shape.unit, shape.mirrored, load.panels
    return given == (known.sha256, known.unit, known.mirrored, known.panels)


def _computed(shape: MeshShape, panels: int, folder: Path) -> ComputedAddedMass:
    from nectosome.geometry import read_mesh_bytes

    known = shape.numbers
    try:
        data = read_mesh_bytes(shape.path_in(folder), shape.mesh)
        if hashlib.sha256(data).hexdigest() != known.sha256:
            why = "has changed since it was measured. Take `measured` out of the shape, so that it is measured anew."
            raise InputError(why, file=shape.mesh)
        found = _by_panels(data, shape.unit, shape.mesh, shape.mirrored, known.centre, panels)
    except InputError as error:
        raise wrong("kind", f"added mass of a mesh is computed from its file, and {error}") from None
    a, b, c, d, e, f = (_six(row) for row in found.matrix)
    return ComputedAddedMass(
        sha256=known.sha256,
        unit=shape.unit,
        mirrored=shape.mirrored,
        panels=panels,
        matrix=(a, b, c, d, e, f),
        error=_six([float(f"{x:.2g}") for x in found.error.diagonal()]),
    )


@lru_cache(8)
def _by_panels(
    data: bytes, unit: Unit, file: str, mirrored: bool, about: tuple[float, float, float], panels: int
) -> "PanelAddedMass":
    """Of the contents of a file; those of the last few are remembered, as panels are in the user's cache."""
    from nectosome.geometry import outer_surface
    from nectosome.geometry.panel_added_mass import panel_added_mass

    triangles = outer_surface(data, unit, file)
    return panel_added_mass(triangles.mirrored() if mirrored else triangles, about, panels=panels)


def _six(row) -> Six:
    a, b, c, d, e, f = map(float, row)
    return a, b, c, d, e, f
