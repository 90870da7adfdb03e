"""What rods are made of: their sections and materials from the root to the tip, what fills them, ribs around them."""

from operator import attrgetter
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, ValidationInfo, model_validator

from nectosome.description import fields
from nectosome.description.fields import listed
from nectosome.description.meshes import folder_of
from nectosome.description.ranges import BENT, LOSES, SWUNG, YIELDS
from nectosome.description.rod_fields import Losses, Mark
from nectosome.description.rod_tables import SectionTable, read_sections
from nectosome.io.schema.described import Described, Uncertainty, increasing, wrong
from nectosome.io.schema.quantity import QuantityOrGroup
from nectosome.units import show_quantity

_SIZES = {
    "circle": ("radius",),
    "ellipse": ("width", "height"),
    "rectangle": ("width", "height"),
}
_EVERY_SIZE = ("radius", "width", "height")
_MATTER = ("young", "density", "damping", "wall")
_ORDER = "the sections must be in the order in which they come along the rod."
_Damping = Annotated[float | Losses, QuantityOrGroup("viscosity", minimum=0, group=Losses)]


MATTER_SPREADS = {
    "young": Uncertainty(0.8, 1.25, "data sheets of silicones and plastics, chosen", BENT, law=YIELDS),
    "density": Uncertainty(0.97, 1.03, "fillers and pores, chosen", "weigh it in air and in water"),
    "damping": Uncertainty(0.4, 2.5, "chosen", SWUNG, law=LOSES),
}


class InnerSection(Described):
    """A section of a rod between its ends: all of its sizes or none, and what its material is there.

    What is left out goes over evenly from the section before that has it to the next one.
    """

    at: Mark
    """Fraction of the length, from the root."""
    radius: fields.Length | None = None
    """Radius of a circle."""
    width: fields.Length | None = None
    """Full size along y, of an ellipse or a rectangle."""
    height: fields.Length | None = None
    """Full size along z, of an ellipse or a rectangle."""
    young: fields.Pressure | None = None
    """Young's modulus there."""
    density: fields.Density | None = None
    """Mass per volume there."""
    damping: _Damping | None = None
    """Shear viscosity there, or its losses."""
    wall: fields.Length | None = None
    """Thickness of the wall of a hollow rod there."""
    spreads: ClassVar = MATTER_SPREADS


class Filling(Described):
    """What fills a hollow rod, bonded to its wall: water, foam, a gel. A liquid has no Young's modulus.

    A liquid in a closed tube goes along with it. Its inertia about the rod's axis is counted as if it turned with it.
    """

    density: fields.Density
    """Mass per volume of the filling."""
    young: fields.NonNegativePressure = 0.0
    """Young's modulus of the filling; its Poisson's ratio is the rod's."""
    damping: fields.Viscosity = 0.0
    """Shear viscosity of the filling, where it is soft and not a liquid."""


class Ribs(Described):
    """Rings or plates around a rod, spread evenly along it and bonded to it, all of one size and of the rod's section.

    Between ribs the rod bends as without them, where they are it bends with them: the compliances of both add by their
    shares of the length. Mass adds too. Loads of the water see the rod's own sections.
    """

    count: Annotated[int, Field(strict=True, ge=1, le=1000)]
    """Number of ribs."""
    thickness: fields.Length
    """Thickness of each along the rod."""
    radius: fields.Length | None = None
    """Outer radius, of a rod of section circle."""
    width: fields.Length | None = None
    """Full outer size along y, of an ellipse or a rectangle."""
    height: fields.Length | None = None
    """Full outer size along z, of an ellipse or a rectangle."""
    young: fields.Pressure | None = None
    """Young's modulus of the ribs; the rod's at its root where it is left out."""
    density: fields.Density | None = None
    """Mass per volume of the ribs; the rod's at its root where it is left out."""


class RodMatter(Described):
    """The fields of a rod that say what it is made of, from its root to its tip."""

    kind: Literal["rod"]
    section: Literal["circle", "ellipse", "rectangle"]
    """Shape of its sections. A circle has radius and tip_radius; an ellipse and a rectangle width, height, tip_width,
    tip_height."""
    length: fields.Length
    """Length along x."""
    radius: fields.Length | None = None
    """Radius at the root, of a circle."""
    tip_radius: fields.Length | None = None
    """Radius at the tip; as at the root where it is left out."""
    width: fields.Length | None = None
    """Full size along y at the root, of an ellipse or a rectangle."""
    height: fields.Length | None = None
    """Full size along z at the root, of an ellipse or a rectangle."""
    tip_width: fields.Length | None = None
    """Full size along y at the tip; as at the root where it is left out."""
    tip_height: fields.Length | None = None
    """Full size along z at the tip; as at the root where it is left out."""
    between: Annotated[tuple[InnerSection, ...], increasing(_ORDER, attrgetter("at")), SectionTable()] = ()
    """Sections between root and tip, or the name of a file with a table of them. Sizes and materials go over evenly
    from one section to the next."""
    young: fields.Pressure
    """Young's modulus of the material."""
    tip_young: fields.Pressure | None = None
    """Young's modulus at the tip, where it changes along the rod; `young` is then that at the root."""
    poisson: fields.Poisson = 0.5
    """Poisson's ratio of the material; 0.5 is that of rubber."""
    density: fields.Density
    """Mass per volume of the material."""
    tip_density: fields.Density | None = None
    """Mass per volume at the tip, where it changes along the rod; `density` is then that at the root."""
    damping: _Damping = 0.0
    """Shear viscosity of a Kelvin-Voigt material: torsion and shear act with it, bending and extension with three times
    it. Instead: what a test in tension, or at one frequency, gives, as in `{uniaxial: 9 kPa s}`, or a loss factor that
    is constant over frequency, as in `{loss_factor: 0.11}`. Viscosity by a loss factor follows Young's modulus."""
    tip_damping: _Damping | None = None
    """Damping at the tip, where it changes along the rod; `damping` is then that at the root."""
    wall: fields.Length | None = None
    """Thickness of the wall of a hollow rod, the same all around: its inside has the rod's section, smaller by it on
    every side. It is closed at its ends. Without it the rod is solid."""
    tip_wall: fields.Length | None = None
    """Thickness of the wall at the tip; as at the root where it is left out."""
    filling: Filling | None = None
    """What fills the inside of a hollow rod; without it nothing that has mass."""
    ribs: Ribs | None = None
    """Rings or plates around the rod that stiffen it."""

    @model_validator(mode="before")
    @classmethod
    def _reads_its_table(cls, data: Any, info: ValidationInfo) -> Any:
        if not isinstance(data, dict) or not isinstance(data.get("between"), str):
            return data
        return read_sections(data, folder_of(info))  # from here on it holds its sections

    @property
    def constant_loss(self) -> tuple[float, float, float] | None:
        """A loss factor that is constant, and the frequencies between which it is; None of other damping."""
        return self.damping.constant if isinstance(self.damping, Losses) else None

    @property
    def shear_viscosities(self) -> list[tuple[float, Any]]:
        """Viscosity against shear [Pa s] at fractions of its length, as given or as it follows from its losses.

        One alone is the same all along the rod.
        """
        given, young = self.along("damping"), self.along("young")
        follows = any(isinstance(x, Losses) and x.loss_factor is not None for _, x in given)
        places = sorted({at for at, _ in (*given, *(young if follows else ()))})

        def viscosity(at: float) -> Any:
            E = on_lines(young, at)
            own = [(place, x.shear_viscosity(E) if isinstance(x, Losses) else x) for place, x in given]
            return on_lines(own, at)

        return [(at, viscosity(at)) for at in places]

    def sections(self, size: str) -> list[tuple[float, Any]]:
        """Return a size of its sections at fractions of its length, from the root to the tip."""
        inner = [(one.at, getattr(one, size)) for one in self.between if getattr(one, size) is not None]
        tip = getattr(self, f"tip_{size}")
        return [(0.0, getattr(self, size)), *inner, (1.0, getattr(self, size) if tip is None else tip)]

    def along(self, name: str) -> list[tuple[float, Any]]:
        """Return a number of its material at fractions of its length; the one at the root where it does not change."""
        every = self.sections(name)
        changes = getattr(self, f"tip_{name}") is not None or len(every) > 2
        return every if changes else every[:1]

    @property
    def kinks(self) -> tuple[float, ...]:
        """Fractions of its length at which a number of its material begins to change otherwise."""
        return tuple(one.at for one in self.between if any(getattr(one, name) is not None for name in _MATTER))

    def largest_radius(self) -> float:
        """Return the largest mean half axis of its sections."""
        sizes, share = _SIZES[self.section], 1.0 if self.section == "circle" else 0.25
        return share * max(sum(on_lines(self.sections(name), at) for name in sizes) for at in self._places)

    @property
    def _places(self) -> tuple[float, ...]:
        return (0.0, *(one.at for one in self.between), 1.0)

    @model_validator(mode="after")
    def _section_is_whole(self) -> Self:
        has = _SIZES[self.section]
        for name in (*_EVERY_SIZE, *(f"tip_{name}" for name in _EVERY_SIZE)):
            given, own = getattr(self, name) is not None, name.removeprefix("tip_") in has
            if name in has and not given:
                raise wrong(name, f"is missing. A rod of section {self.section} needs {listed(has)}.")
            if given and not own:
                every = listed((*has, *(f"tip_{name}" for name in has)))
                raise wrong(name, f"a rod of section {self.section} has no {name}, only {every}. Leave it out.")
        for k, inner in enumerate(self.between):
            given = [name for name in _EVERY_SIZE if getattr(inner, name) is not None]
            matter = [name for name in _MATTER if getattr(inner, name) is not None]
            for name in _EVERY_SIZE if given or not matter else ():
                if (name in given) != (name in has):
                    why = "is missing" if name in has else "is none of its sizes. Leave it out"
                    raise wrong(f"between.{k}.{name}", f"{why}: a section of this rod has {listed(has)}.")
        return self

    @model_validator(mode="after")
    def _damping_is_of_one_kind(self) -> Self:
        later = {f"between.{k}.damping": inner.damping for k, inner in enumerate(self.between)}
        for path, one in (later | {"tip_damping": self.tip_damping}).items():
            banded = [x for x in (one, self.damping) if isinstance(x, Losses) and x.constant is not None]
            if one is not None and banded:
                why = "a loss factor that is constant over a band is one for the whole rod. Give each its frequency"
                raise wrong(path, f"{why}, as in {{loss_factor: 0.1, frequency: 2 Hz}}.")
        return self

    @model_validator(mode="after")
    def _has_a_wall(self) -> Self:
        if self.wall is None:
            given = {f"between.{k}.wall": one.wall for k, one in enumerate(self.between)} | {"tip_wall": self.tip_wall}
            later = next((path for path, wall in given.items() if wall is not None), None)
            if later is not None:
                raise wrong(later, "the rod has no wall at its root. Give wall as well, or leave this out.")
            if self.filling is not None:
                raise wrong("filling", "the rod is solid. Give the thickness of its wall, or leave the filling out.")
        return self

    @property
    def beyond(self) -> tuple[str, str] | None:
        """Field of a wall that leaves no room inside, or of ribs that are none, and why."""
        return self._wall_beyond or self._ribs_beyond

    @property
    def _wall_beyond(self) -> tuple[str, str] | None:
        has = _SIZES[self.section]
        for at in self._places if self.wall is not None else ():
            thick = on_lines(self.along("wall"), at)
            half = min(on_lines(self.sections(name), at) for name in has) * (1.0 if len(has) == 1 else 0.5)
            if thick >= half:
                shown, most = (show_quantity(x, "length") for x in (thick, half))
                why = f"{shown} at {100 * at:.3g} % of the length leaves no room inside: half of the section is {most}"
                return "wall", f"{why}. Give a thinner wall, or leave it out where the rod is solid."
        return None

    @property
    def _ribs_beyond(self) -> tuple[str, str] | None:
        ribs = self.ribs
        if ribs is None:
            return None
        if ribs.count * ribs.thickness > self.length:
            long, most = (show_quantity(x, "length") for x in (ribs.count * ribs.thickness, self.length))
            return "ribs.thickness", f"{ribs.count} ribs are {long} together, and the rod is {most} long."
        for name in _SIZES[self.section]:
            own, widest = getattr(ribs, name), max(size for _, size in self.sections(name))
            if own < widest:
                shown, least = (show_quantity(x, "length") for x in (own, widest))
                return f"ribs.{name}", f"{shown} is inside of the rod, whose {name} is {least}: ribs are around it."
        return None

    @model_validator(mode="after")
    def _has_room(self) -> Self:
        has = _SIZES[self.section]
        for name in _EVERY_SIZE if self.ribs is not None else ():
            if (getattr(self.ribs, name) is not None) != (name in has):
                why = "is missing" if name in has else "is none of their sizes. Leave it out"
                raise wrong(f"ribs.{name}", f"{why}: ribs of this rod have {listed(has)}.")
        if self.beyond is not None:
            raise wrong(*self.beyond)
        return self


def on_lines(values: list[tuple[float, Any]], at: float) -> Any:
    """Return the value on straight lines through values at increasing places; a single one holds everywhere."""
    if len(values) == 1:
        return values[0][1]
    k = next((k for k, (place, _) in enumerate(values[1:]) if at <= place), len(values) - 2)
    (a, x), (b, y) = values[k], values[k + 1]
    share = (at - a) / (b - a)
    return x if share == 0 else y if share == 1 else x + (y - x) * share
