"""Shapes of rigid parts: their names or fields in a file, the sizes that they need, what fits on them."""

from typing import Any, ClassVar, Literal

from nectosome.description.fields import listed
from nectosome.description.mirror import Mirrored
from nectosome.io.discovery import classes_below
from nectosome.io.schema.described import wrong
from nectosome.units import show_quantity

_SIZES = ("length", "radius", "width", "height")
_ROUND = "contact is between rods, cylinders, capsules and spheres. Add a cylinder to it."


class ShapeDescription(Mirrored):
    """A shape of rigid parts: in a file its `form`, or the group of its fields if it has fields.

    `sizes` are the fields of the part that give its size; `no_sizes` says why there are none. A part of `flat` section
    may be a fin; one that `touches` has contact. Loads that act per length on the shape that it is `like` act on it.
    """

    form: ClassVar[str]
    sizes: ClassVar[tuple[str, ...]] = ()
    no_sizes: ClassVar[str] = ""
    section: ClassVar[Literal["round", "flat", ""]] = ""
    like: ClassVar[str] = ""
    bends: ClassVar[bool] = False
    touches: ClassVar[bool] = False

    def check(self, part: Any) -> None:
        """Raise the error of a field for sizes of a part that are missing or not its own."""
        for name in _SIZES:
            given = getattr(part, name) is not None
            if name in self.sizes and not given:
                raise wrong(name, f"is missing. A {self.form} needs {listed(self.sizes)}.")
            if given and name not in self.sizes:
                has = f"needs only {listed(self.sizes)}" if self.sizes else self.no_sizes
                raise wrong(name, f"a {self.form} has no {name}, it {has}. Leave it out.")
        if part.bend != 0 and not self.bends:
            raise wrong("bend", f"a {self.form} has no bend, only a cylinder has one. Leave it out.")

    def check_load(self, load: Any) -> None:
        """Raise the error of a field for a load that does not fit the shape."""

    def no_contact(self, part: Any) -> str:
        """Return why a part has no contact with others; empty if it has."""
        return "" if self.touches else f"is a {self.form}: {_ROUND}"

    def size(self, name: str, part: Any = None) -> float | None:
        """Return the length, width or height of a part, None without such a size [m]."""
        return getattr(part, name)

    def largest_radius(self, part: Any) -> float:
        """Return the largest mean half axis of a section of a part [m]."""
        return part.radius or 0.0


class CylinderShape(ShapeDescription):
    """A cylinder has length and radius."""

    form = "cylinder"
    sizes = ("length", "radius")
    section = "round"
    bends = touches = True


class BoxShape(ShapeDescription):
    """A box has length, width and height."""

    form = "box"
    sizes = ("length", "width", "height")
    section = "flat"


class SpheroidShape(ShapeDescription):
    """A spheroid has length, its full axis, and radius."""

    form = "spheroid"
    sizes = ("length", "radius")
    section = "round"

    def no_contact(self, part: Any) -> str:
        """Return why one that is no sphere has none."""
        sphere = abs(part.length - 2 * part.radius) <= 1e-6 * part.length
        return "" if sphere else "is no sphere: a spheroid in contact needs a length of twice its radius."


class CapsuleShape(ShapeDescription):
    """A capsule, a cylinder with half spheres as ends, has length, from end to end, and radius."""

    form = "capsule"
    sizes = ("length", "radius")
    section = "round"
    like = "cylinder"
    touches = True

    def check(self, part: Any) -> None:
        """Raise the error of a field for sizes, and for one that is shorter than its ends."""
        super().check(part)
        if part.length <= 2 * part.radius:
            least = show_quantity(2 * part.radius, "length")
            raise wrong("length", f"must be more than {least}, twice the radius: between them is a cylinder.")


class PointShape(ShapeDescription):
    """A point has no size."""

    form = "point"
    no_sizes = "has no size"


def shape_forms() -> dict[str, type[ShapeDescription]]:
    """Return all shapes by their forms."""
    return {cls.form: cls for cls in classes_below(ShapeDescription)}


def shape_image(shape: str | ShapeDescription) -> str | ShapeDescription:
    """Return the image of the shape of a rigid part: of a name the same."""
    return shape if isinstance(shape, str) else shape.image()
