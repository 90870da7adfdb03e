"""Shapes of rigid parts by files of meshes: which file, in which unit, and what was measured of it."""

import hashlib
from contextlib import suppress
from functools import cache, lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from pydantic import Field, ValidationInfo, model_validator

from nectosome.description.fields import Length
from nectosome.description.mirror import along
from nectosome.description.shapes import ShapeDescription
from nectosome.io.atomic import cache_folder, read_kept, write_kept
from nectosome.io.file_system import entries
from nectosome.io.schema.described import Described, Text, wrong
from nectosome.io.schema.quantity import QuantitySource
from nectosome.units import InputError, MeshUnit, shorten, show_quantity

if TYPE_CHECKING:
    from nectosome.geometry import MeshSlices, Triangles

Finite = Annotated[float, Field(allow_inf_nan=False)]
Triple = tuple[Finite, Finite, Finite]
Six = tuple[Finite, Finite, Finite, Finite, Finite, Finite]
MOST_STRIPS = 60  # into which a mesh is cut
MOST_DRAWN = 3000  # triangles in pictures
MOST_AFLOAT, LEAST_AFLOAT = 8000, 500  # triangles of all meshes of a robot that float, and of one of many
_KEPT = 0.02  # share of the volume that fewer triangles may take
_LARGEST = 1e3  # extent [m]: nothing in water is larger


def folder_of(info: ValidationInfo) -> Path:
    """Return the folder to which names of files are relative where text of people is read, or else the working one."""
    return info.context.folder if isinstance(info.context, QuantitySource) else Path()


def path_in(folder: Path, name: str) -> Path:
    """Return the path of a file below a folder. Raises InputError where it is outside of it."""
    path = folder / name
    try:
        outside = not path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):
        raise InputError("is no name of a file.") from None
    if outside:
        raise InputError(f"{shorten(name)} is outside of the folder of the robot file. Put it beside that file.")
    return path


class MeasuredMesh(Described):
    """What was measured of a mesh, in SI units and in its own frame. It is written by nectosome, not by hand."""

    file: str
    """File that was measured, as `mesh` names it."""
    unit: MeshUnit
    """Unit in which it was measured."""
    mirrored: bool = False
    """Whether its mirror image was measured."""
    sha256: str
    """Hash of the file."""
    triangles: Annotated[int, Field(ge=1)]
    """Number of its triangles."""
    volume: Annotated[float, Field(gt=0, allow_inf_nan=False)]
    """Volume of the water that it displaces, that of closed cavities among it [m3]."""
    centre: Triple
    """Centre of that volume [m]."""
    low: Triple
    """Least x, y and z [m]."""
    high: Triple
    """Largest x, y and z [m]."""
    matter: Annotated[float, Field(gt=0, allow_inf_nan=False)]
    """Volume of its matter, without cavities [m3]."""
    matter_centre: Triple
    """Centre of its matter [m]."""
    matter_inertia: Six
    """Elements xx, yy, zz, xy, xz, yz of its matter's inertia matrix about that centre, over its density [m5]."""
    area: Annotated[float, Field(gt=0, allow_inf_nan=False)]
    """Wetted area [m2]."""
    area_centre: Triple
    """Centre of that area [m]."""
    area_inertia: Six
    """Elements of the inertia matrix of a thin skin about that centre, over its mass per area [m4]."""
    projected: Triple
    """Areas as seen along x, y and z [m2]."""
    slices: str
    """60 slices of equal thickness along x: share of the volume, centre, half widths; compressed."""
    surface: str
    """Surface of at most 8000 triangles, simplified where it had more; compressed."""
    touch: bool = False
    """Whether bodies in it touch or overlap, so that faces which lie inside count as wetted."""
    told: tuple[str, ...] = ()
    """What was found and repaired."""

    @model_validator(mode="after")
    def _reads_back(self) -> Self:
        for field, read in (("slices", _slices), ("surface", _surface)):
            try:
                read(getattr(self, field))
            except ValueError as error:
                raise wrong(field, f"{error}. Take `measured` out, so that the mesh is measured anew.") from None
        return self

    def image(self) -> Self:
        """Return that of the mirror image, in the plane of x and z."""
        from nectosome.geometry import pack_slices, pack_surface

        changes: dict[str, Any] = {name: along(getattr(self, name)) for name in _PLACES}
        for name in ("matter_inertia", "area_inertia"):
            xx, yy, zz, xy, xz, yz = getattr(self, name)
            changes[name] = (xx, yy, zz, 0.0 - xy, xz, 0.0 - yz)
        (low_x, high_y, low_z), (high_x, low_y, high_z) = changes.pop("low"), changes.pop("high")
        slices, surface = _slices(self.slices).mirrored(), _surface(self.surface).mirrored()
        return self.model_copy(
            update={
                **changes,
                "mirrored": not self.mirrored,
                "low": (low_x, low_y, low_z),
                "high": (high_x, high_y, high_z),
                "slices": pack_slices(slices),
                "surface": pack_surface(surface),
            }
        )


def measured_mesh(path: Path, unit: MeshUnit, file: str) -> MeasuredMesh:
    """Measure the mesh in a file, which a robot and messages call `file`.

    Results are kept in the user's cache, by the contents of the file, its unit and what measures it. Raises InputError
    as `nectosome.geometry.measure`.
    """
    from nectosome.geometry import read_mesh_bytes

    data = read_mesh_bytes(path, file)
    kept = _kept_file(data, unit, Path(file).suffix)
    raw = read_kept(kept) if kept else None
    if raw is not None:
        with suppress(ValueError):  # of fields that this version has no more
            return MeasuredMesh.model_validate_json(raw).model_copy(update={"file": file})
    measured = _measured_bytes(data, unit, file)
    if kept:
        write_kept(kept, measured.model_dump_json().encode())
    return measured


def _kept_file(data: bytes, unit: MeshUnit, kind: str) -> Path | None:
    """Where the cache keeps what was measured; None without a cache."""
    folder = cache_folder()
    if folder is None:
        return None
    digest = hashlib.sha256(f"{unit} {kind}".encode() + _of_what_measures() + data)
    return folder / "meshes" / digest.hexdigest()


@cache
def _of_what_measures() -> bytes:
    """Hash of the sources that measure, and of the versions of the libraries under them."""
    digest = hashlib.sha256(" ".join(version(name) for name in ("numpy", "scipy", "trimesh")).encode())
    for source in (__file__, *entries(Path(__file__).parents[1] / "geometry", "*.py")):
        digest.update(Path(source).read_bytes())
    return digest.digest()


def _measured_bytes(data: bytes, unit: MeshUnit, file: str) -> MeasuredMesh:
    """The same of the contents of the file."""
    from nectosome.geometry import measured_bytes, pack_slices, pack_surface

    numbers = measured_bytes(data, unit, file)
    low, high = numbers.bounds
    return MeasuredMesh(
        file=file,
        unit=unit,
        sha256=numbers.sha256,
        triangles=numbers.triangles,
        volume=numbers.displaced.size,
        centre=_place(numbers.displaced.centre),
        low=_place(low),
        high=_place(high),
        matter=numbers.matter.size,
        matter_centre=_place(numbers.matter.centre),
        matter_inertia=_six(numbers.matter.inertia),
        area=numbers.skin.size,
        area_centre=_place(numbers.skin.centre),
        area_inertia=_six(numbers.skin.inertia),
        projected=_place(numbers.projected),
        slices=pack_slices(numbers.slices),
        surface=pack_surface(numbers.surface),
        touch=numbers.touch,
        told=numbers.told,
    )


_PLACES = ("centre", "low", "high", "matter_centre", "area_centre")


def _place(x: Any) -> tuple[float, float, float]:
    a, b, c = map(float, x)
    return a, b, c


def _six(m: Any) -> tuple[float, float, float, float, float, float]:
    return (*_place((m[0, 0], m[1, 1], m[2, 2])), *_place((m[0, 1], m[0, 2], m[1, 2])))


@lru_cache(32)
def _slices(text: str) -> "MeshSlices":
    from nectosome.geometry import unpack_slices

    return unpack_slices(text)


@lru_cache(32)
def _surface(text: str) -> "Triangles":
    from nectosome.geometry import unpack_surface

    return unpack_surface(text)


@lru_cache(32)
def _fewer(text: str, most: int) -> "Triangles":
    from nectosome.geometry import simplified

    return simplified(_surface(text), most)


class MeshShape(ShapeDescription):
    """The shape of a rigid part by the file of a mesh. The frame of the part is that of the mesh.

    It holds what was measured, so that the file is needed once.
    """

    mesh: Annotated[Text, Field(min_length=1, max_length=300)]
    """File of the mesh, STL, OBJ or PLY, beside the robot file or in a folder below it."""
    unit: MeshUnit
    """Unit of the numbers in that file, which does not tell it."""
    thickness: Length | None = None
    """Thickness of a shell: its matter lies along the wetted surface, thin against the part. Without it the part is
    solid inside."""
    mirrored: bool = False
    """Whether the part is the mirror image of the mesh, y against -y."""
    measured: MeasuredMesh | None = None
    """What was measured of the mesh. Nectosome writes it, so that the file is not needed again; it is measured anew
    where the file has changed."""

    form: ClassVar = "mesh"
    no_sizes: ClassVar = "has the size of its file"

    def check(self, part: Any) -> None:
        """Raise the error of a field for sizes, and for more strips than there are slices."""
        super().check(part)
        if part.strips > MOST_STRIPS:
            raise wrong("strips", f"a mesh has at most {MOST_STRIPS} of them.")

    @model_validator(mode="after")
    def _is_measured(self, info: ValidationInfo) -> Self:
        known = self.measured
        if known is None or (known.file, known.unit, known.mirrored) != (self.mesh, self.unit, self.mirrored):
            object.__setattr__(self, "measured", self._measure(folder_of(info)))
        if self.thickness is not None:
            if self.numbers.matter < (1 - 1e-9) * self.numbers.volume:
                raise wrong("thickness", "the mesh has a cavity, so that its walls are there already. Leave it out.")
            if self.numbers.touch:
                why = "bodies in the mesh touch or overlap, so that the shell would have inner walls."
                raise wrong("thickness", f"{why} Unite them where they were drawn, or leave it out.")
            most = self.numbers.volume / self.numbers.area
            if self.thickness > most:
                why = f"such a shell has more matter than the solid part: it must be at most {1e3 * most:.3g} mm."
                raise wrong("thickness", why)
        return self

    def _measure(self, folder: Path) -> MeasuredMesh:
        try:
            numbers = measured_mesh(path_in(folder, self.mesh), self.unit, self.mesh)
        except InputError as error:
            raise wrong("mesh", str(error)) from None
        size = max(high - low for low, high in zip(numbers.low, numbers.high, strict=True))
        if size > _LARGEST:
            raise wrong("unit", f"in {self.unit} the mesh is {show_quantity(size, 'length')} large. Check its unit.")
        return numbers.image() if self.mirrored else numbers

    @property
    def numbers(self) -> MeasuredMesh:
        """What was measured of the mesh."""
        assert self.measured is not None
        return self.measured

    @property
    def slices(self) -> "MeshSlices":
        """Its slices along x."""
        return _slices(self.numbers.slices)

    @property
    def surface(self) -> "Triangles":
        """Its surface, simplified where it had many triangles, in the part's frame."""
        return _surface(self.numbers.surface)

    @property
    def drawn(self) -> "Triangles":
        """The same with as many triangles as a picture needs."""
        return _fewer(self.numbers.surface, MOST_DRAWN)

    def afloat(self, beside: int) -> "Triangles":
        """The same for uplift at a surface, in a robot with so many meshes: all triangles of a lone one."""
        few = _fewer(self.numbers.surface, max(MOST_AFLOAT // beside, LEAST_AFLOAT))
        return few if abs(few.volume / self.surface.volume - 1) < _KEPT else self.surface

    def largest_radius(self, part: Any) -> float:
        """Return the largest mean half axis of its slices [m]."""
        return float(self.slices.half.mean(axis=1).max())

    def size(self, name: str, part: Any = None) -> float:
        """Return its extent along x as length, along y as width, along z as height [m]."""
        k = ("length", "width", "height").index(name)
        return self.numbers.high[k] - self.numbers.low[k]

    def image(self) -> Self:
        """Return the mirror image."""
        return self.model_copy(update={"mirrored": not self.mirrored, "measured": self.numbers.image()})

    def refreshed(self, folder: Path) -> Self:
        """Return the same, measured anew where its file is in `folder` and has another hash than what was measured."""
        from nectosome.geometry import file_hash

        try:
            same = file_hash(folder / self.mesh) == self.numbers.sha256
        except InputError:
            return self  # it was measured, and is not needed again
        if same:
            return self
        renewed = self._measure(folder)
        told = ("the file has changed since it was measured: measured anew", *renewed.told)
        return self.model_copy(update={"measured": renewed.model_copy(update={"told": told})})
