"""Added mass of rigid parts that are meshes, by panels: what was computed goes along with the robot."""

import hashlib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, model_validator

from nectosome.description.fields import ZERO, FixedLength
from nectosome.description.loads import LoadDescription, NearFloorLoad, check_added_mass, matrix_image
from nectosome.description.meshes import MeasuredMesh, MeshShape, Six, path_in
from nectosome.description.mirror import Mirror
from nectosome.io.schema.described import Described, inside, wrong
from nectosome.units import InputError, MeshUnit, show_quantity

if TYPE_CHECKING:
    from nectosome.geometry.panel_added_mass import Boundary, PanelAddedMass

_MOST = 5000
Panels = Annotated[int, Field(strict=True, ge=100, le=_MOST)]
Near = Literal["floor", "slow_surface", "fast_surface"]


class ComputedAddedMass(Described):
    """Added mass of a mesh as it was computed. It is written by nectosome, not by hand."""

    sha256: str
    """Hash of the file of the mesh."""
    unit: MeshUnit
    """Unit of the numbers in that file."""
    mirrored: bool = False
    """Whether it is that of the mirror image."""
    panels: Panels
    """Number of panels that it was computed with."""
    near: Near | None = None
    """What ends the water near it."""
    height: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    """How far away that is from the centre of the volume [m]."""
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
    """Added mass of a rigid part that is a mesh, by panels on its surface: in unbounded water, or near a floor or a
    surface that goes along with the part.

    It is computed when the robot is read, with the extra `mesh`, and kept in the robot from there on.
    """

    kind: Literal["mesh_added_mass"]
    panels: Panels = 1000
    """Number of panels, triangles of even size in place of those of the mesh. The error goes down with more of them,
    and the time goes up."""
    near: Near | None = None
    """What ends the water near the part, across its own z: a `floor` below it; above it a `slow_surface`, which stays
    level under motions far slower than the root of gravity over the part's length, as a wall does, or a
    `fast_surface`, which far faster motions leave no time to rise. Left out: the water has no end."""
    height: FixedLength | None = None
    """How far the centre of the part's volume is from there. The added mass is that at this height and level, wherever
    the part goes."""
    computed: ComputedAddedMass | None = None
    """What was computed. Nectosome writes it, so that neither mesh nor extra is needed again; it is computed anew for
    another mesh."""
    on = ("mesh",)
    mirror = Mirror(computed=ComputedAddedMass.image)

    @model_validator(mode="after")
    def _is_at_a_height(self) -> Self:
        if self.near is not None and self.height is None:
            raise wrong("height", "is missing. Say how far the centre of the part's volume is from there.")
        if self.near is None and self.height is not None:
            raise wrong("height", "is that over a floor or below a surface. Say which in near, or leave it out.")
        return self

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
    changed = dict(loads)
    for name, load in loads.items():
        if isinstance(load, MeshAddedMassLoad):
            with inside(f"loads.{name}"):
                _check_near(load, shape, loads)
                if not _is_of(load, shape):
                    changed[name] = load.model_copy(update={"computed": _computed(load, shape, folder)})
    return changed


def told_of_thin(known: MeasuredMesh, panels: int = 1000) -> str | None:
    """A sentence where the mesh is too thin for so many panels; None of any other."""
    from nectosome.geometry.panel_added_mass import panels_for

    needed = panels_for(known.volume, known.area)
    if needed <= panels:
        return None
    thick = show_quantity(2 * known.volume / known.area, "length")
    why = f"its mean thickness, {thick}, is less than half the side of one of {panels} panels"
    what = f"give panels: {needed}" if needed <= _MOST else f"{needed} were needed, {_MOST} are possible"
    return f"{why}: added mass has the larger error that show lists; {what}"


def _check_near(load: MeshAddedMassLoad, shape: MeshShape, loads: Mapping[str, LoadDescription]) -> None:
    """Raise the error of a field where the part reaches what is near it, or the floor is counted twice."""
    if load.near is None or load.height is None:
        return
    known, below = shape.numbers, load.near == "floor"
    reach = known.centre[2] - known.low[2] if below else known.high[2] - known.centre[2]
    if load.height <= reach:
        where = "below" if below else "above"
        why = f"must be more than {show_quantity(reach, 'length')}: the part reaches so far {where} its centre."
        raise wrong("height", why)
    for name, other in loads.items():
        if below and isinstance(other, NearFloorLoad) and other.mass != ZERO:
            raise wrong("near", f"{name}, a near_floor, adds the floor's added mass as well. Leave one of them out.")


def _is_of(load: MeshAddedMassLoad, shape: MeshShape) -> bool:
    known = load.computed
    if known is None:
        return False
    given = shape.numbers.sha256, shape.unit, shape.mirrored, load.panels, load.near, load.height
    return given == (known.sha256, known.unit, known.mirrored, known.panels, known.near, known.height)


def _computed(load: MeshAddedMassLoad, shape: MeshShape, folder: Path) -> ComputedAddedMass:
    from nectosome.geometry import read_mesh_bytes

    known = shape.numbers
    try:
        data = read_mesh_bytes(path_in(folder, shape.mesh), shape.mesh)
        if hashlib.sha256(data).hexdigest() != known.sha256:
            why = "has changed since it was measured. Take `measured` out of the shape, so that it is measured anew."
            raise InputError(why, file=shape.mesh)
        if known.touch:
            why = "bodies in it touch or overlap, so that faces of them lie inside."
            raise InputError(f"{why} Unite them where they were drawn, or leave this load out.", file=shape.mesh)
        options = load.panels, _boundary(load, known.centre)
        masses = _by_panels(data, shape.unit, shape.mesh, shape.mirrored, known.centre, *options)
    except InputError as error:
        raise wrong("kind", f"added mass of a mesh is computed from its file, and {error}") from None
    a, b, c, d, e, f = (_six(row) for row in masses.matrix)
    return ComputedAddedMass(
        sha256=known.sha256,
        unit=shape.unit,
        mirrored=shape.mirrored,
        panels=load.panels,
        near=load.near,
        height=load.height,
        matrix=(a, b, c, d, e, f),
        error=_six([float(f"{x:.2g}") for x in masses.error.diagonal()]),
    )


def _boundary(load: MeshAddedMassLoad, centre: tuple[float, float, float]) -> "Boundary | None":
    """The plane that ends the water near a part with the centre of its volume at a place of its frame [m]."""
    from nectosome.geometry.panel_added_mass import Boundary

    if load.near is None or load.height is None:
        return None
    out = -1.0 if load.near == "floor" else 1.0
    x, y, z = centre
    kind = "surface" if load.near == "fast_surface" else "wall"
    return Boundary((x, y, z + out * load.height), (0.0, 0.0, out), kind)


@lru_cache(8)
def _by_panels(
    data: bytes,
    unit: MeshUnit,
    file: str,
    mirrored: bool,
    about: tuple[float, float, float],
    panels: int,
    boundary: "Boundary | None",
) -> "PanelAddedMass":
    """Of the contents of a file; those of the last few are remembered, as panels are in the user's cache."""
    from nectosome.geometry import outer_surface
    from nectosome.geometry.panel_added_mass import panel_added_mass

    triangles = outer_surface(data, unit, file)
    return panel_added_mass(triangles.mirrored() if mirrored else triangles, about, panels=panels, boundary=boundary)


def _six(row) -> Six:
    a, b, c, d, e, f = map(float, row)
    return a, b, c, d, e, f
