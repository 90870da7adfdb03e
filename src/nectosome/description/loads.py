"""Loads: what the water, and anything else outside, does to a part."""

from collections.abc import Collection
from typing import Any, ClassVar, Literal, Self

from pydantic import model_validator

from nectosome.description import fields
from nectosome.description.fields import ZERO, Place, listed
from nectosome.description.mirror import Mirror, Mirrored, about, along, opposite
from nectosome.description.ranges import QUADRATIC, SHAKEN, THRUST, TOWED, Range, up_to
from nectosome.description.shapes import shape_forms
from nectosome.io.schema.described import Uncertainty, wrong

RIGID = ("rigid",)
"""All shapes of rigid parts."""
ROD = ("rod",)
WEB = "web"
SOFT_PLATE = "soft_plate"
SOFT = (*ROD, WEB, SOFT_PLATE)
"""What is no rigid part."""


class LoadDescription(Mirrored):
    """What acts on a part. `on` are the shapes of part that it acts on: "rigid" for all of rigid parts, "rod", "web",
    "soft_plate".

    One that acts `per_length` is worked out strip by strip along a part. `ranges` say where its model holds, with all
    options, `reynolds_length` which length its Reynolds number has; the `flow` of the load tells the numbers.
    `for_mesh` says what to take instead on a mesh.
    """

    kind: Any  # its name in a file, a literal of each class
    on: ClassVar[tuple[str, ...]] = (*RIGID, *ROD)
    per_length: ClassVar[bool] = False
    ranges: ClassVar[tuple[Range, ...]] = ()
    reynolds_length: ClassVar[str] = ""
    for_mesh: ClassVar[str] = ""

    @property
    def own_ranges(self) -> tuple[Range, ...]:
        """Return the ranges that hold with its own options."""
        return self.ranges

    def image(self) -> Self:
        """Return the image; what is in the world's frame stays as it is."""
        return self if getattr(self, "frame", None) == "world" else super().image()

    @classmethod
    def acts_on(cls, shape: str) -> bool:
        """Return whether it acts on parts of a shape, or per length on what that is like."""
        if shape in SOFT or shape in cls.on:
            return shape in cls.on
        return "rigid" in cls.on or (cls.per_length and shape_forms()[shape].like in cls.on)

    def check(self, shape: str, marks: tuple[float, ...] = (), strains: Collection[str] = ()) -> None:
        """Raise the error of a field for a part that it does not act on: its shape, its marks, its free strains."""
        if not self.acts_on(shape):
            rigid = tuple(name for name in self.on if name not in SOFT)
            if shape == WEB:
                why = "does not act on a web. Take plate_drag, sheet_added_mass or bell_jet."
            elif shape == SOFT_PLATE:
                why = "does not act on a soft plate. Take plate_drag and sheet_added_mass."
            elif self.on == (WEB,):
                why = "acts on a web only."
            elif self.on == (WEB, SOFT_PLATE):
                why = "acts on a web or a soft plate only."
            elif shape == "rod":
                why = "acts on rigid parts, not on a rod."
            elif not rigid:
                why = "acts on a rod, not on a rigid part."
            else:
                why = f"acts on {listed(rigid, 'or')}, not on a {shape}."
            raise wrong("kind", f"{self.kind} {why} {self.for_mesh if shape == 'mesh' else ''}".rstrip())

    def check_plate(self, plane: str) -> None:
        """Raise the error of a field for a plate by its outline in a plane of the part that it does not fit."""

    def check_radius(self, radius: float) -> None:
        """Raise the error of a field for a part whose largest radius, the mean half axis of a section, is too large."""


class DragLoad(LoadDescription):
    """Quadratic drag and lift of a slender part, strip by strip."""

    kind: Literal["drag"]
    normal: fields.NonNegativeNumber
    """Drag coefficient across the part, by its projected area."""
    tangential: fields.NonNegativeNumber = 0.0
    """Drag coefficient along the part."""
    lift: fields.Number = 0.0
    """Lift coefficient, across the part and across the flow."""
    on = ("cylinder", "mesh", "rod")
    per_length = True
    mirror = Mirror(lift=opposite)
    reynolds_length = "diameter"
    ranges = QUADRATIC, up_to("reynolds", 2e5, "the drag of a smooth round part falls to a third", "Roshko 1961")
    spreads: ClassVar = {
        "normal": Uncertainty(0.75, 1.3, "Hoerner 1965: round bars, ends, roughness", TOWED),
        "tangential": Uncertainty(0.5, 2.0, "chosen", TOWED),
        "lift": Uncertainty(0.5, 1.5, "chosen", TOWED),
    }


class AddedMassLoad(LoadDescription):
    """Added mass of a slender part, strip by strip."""

    kind: Literal["added_mass"]
    normal: fields.NonNegativeNumber
    """Coefficient across the part: 1 for a slender one in potential flow."""
    tangential: fields.NonNegativeNumber = 0.0
    """Coefficient along the part."""
    wavelength: fields.Length | None = None
    """Wavelength of a motion that runs along the body as a wave. Given, the added mass across is that much smaller;
    without it the wave is long against the section."""
    length: fields.Length | None = None
    """Length of the whole body along its strips, also where the part is one of several behind each other. Given, the
    added mass across is that of a plate which ends; without it the body is long against its height."""
    fin: bool | None = None
    """Whether it is a fin, as long as the body. Left out: if it is a box or plate over twice as high as long and its
    carrier."""
    separated: bool | None = None
    """Whether the flow across separates, as behind a limb that is held in a stream. Then the water carried resists
    accelerations only (Morison); otherwise its momentum also moves along the part (Lighthill, Munk). Left out: of a
    limb in a current that joints hold, nothing drives, and that has no `trailing_edge`."""
    on = ("cylinder", "box", "mesh", "plate", "rod")
    per_length = True
    mirror = Mirror()
    spreads: ClassVar = {
        "normal": Uncertainty(0.8, 1.15, "Brennen 1982: sections, ends", SHAKEN),
        "tangential": Uncertainty(0.5, 2.0, "chosen", SHAKEN),
    }


class SheetAddedMassLoad(LoadDescription):
    """Added mass of a web or a soft plate, as it moves across itself: of the whole sheet."""

    kind: Literal["sheet_added_mass"]
    normal: fields.NonNegativeNumber = 1.0
    """Factor on that of potential flow about a sheet that moves as one, or in waves of one length."""
    wavelength: fields.Length | None = None
    """Length of the waves that run along a web, from limb to limb: short ones carry less water. Without it, that of a
    sheet that moves as one."""
    on = (WEB, SOFT_PLATE)
    per_length = True
    mirror = Mirror()
    spreads: ClassVar = {"normal": Uncertainty(0.6, 1.2, "curved sheets, gaps of unequal motion, chosen", SHAKEN)}

    def check(self, shape: str, marks: tuple[float, ...] = (), strains: Collection[str] = ()) -> None:
        """Raise the error of a field for a part that it does not act on."""
        super().check(shape, marks, strains)
        if shape == SOFT_PLATE and self.wavelength is not None:
            raise wrong(
                "wavelength", "is of waves along a web. Leave it out: a soft plate has the water of its sections."
            )


class BellJetLoad(LoadDescription):
    """Jet of a bell, which a ring of limbs with this web closes: its pressure, its thrust, and the water within."""

    kind: Literal["bell_jet"]
    contraction: fields.PositiveShare = 1.0
    """Area of the jet over that of the opening at the tips of the limbs."""
    refill: fields.Fraction = 0.0
    """Share of the momentum of the water that comes in which pulls the bell back: 0 if it comes from all around, 1 if
    it comes as a jet from behind."""
    reynolds_length = "opening"
    ranges = (
        up_to("formation", 4.0, "the vortex ring pinches off, and what follows pushes less", "Gharib et al. 1998"),
    )
    on = (WEB,)
    mirror = Mirror()
    spreads: ClassVar = {
        "contraction": Uncertainty(0.6, 1.0, "from a sharp edge to a smooth nozzle", THRUST),
        "refill": Uncertainty(0.0, 1.0, "from all around to Giorgio-Serchi et al. 2017", THRUST, absolute=True),
    }


class LumpedDragLoad(LoadDescription):
    """Quadratic drag of a rigid part as a whole, along and about its own axes."""

    kind: Literal["lumped_drag"]
    drag_area: tuple[fields.Area, fields.Area, fields.Area]
    """Drag coefficient times area, along x, y and z."""
    rotational: tuple[fields.NonNegativeInertia, fields.NonNegativeInertia, fields.NonNegativeInertia] = ZERO
    """c in the torque -c |w| w, about x, y and z, in water of 1000 kg/m3. It goes with the water's density."""
    on = RIGID
    mirror = Mirror()
    reynolds_length = "root of the drag area"
    ranges = (QUADRATIC,)
    spreads: ClassVar = {
        "drag_area": Uncertainty(0.65, 1.5, "Hoerner 1965: hulls of like shapes", TOWED),
        "rotational": Uncertainty(0.4, 2.5, "chosen", "let it turn and stop"),
    }


class SpheroidAddedMassLoad(LoadDescription):
    """Added mass of a rigid spheroid, from its shape."""

    kind: Literal["spheroid_added_mass"]
    on = ("spheroid",)
    for_mesh = "Take mesh_added_mass."
    mirror = Mirror()


class CylinderAddedMassLoad(LoadDescription):
    """Added mass of a rigid cylinder across its axis."""

    kind: Literal["cylinder_added_mass"]
    coefficient: fields.NonNegativeNumber = 1.0
    """Added mass over the displaced mass."""
    separated: bool | None = None
    """Whether the flow across separates, as behind a limb that is held in a stream. Then the water carried resists
    accelerations only (Morison); otherwise its momentum also moves along the part (Lighthill, Munk). Left out: of a
    limb in a current that joints hold, nothing drives, and that has no `trailing_edge`."""
    on = ("cylinder",)
    for_mesh = "Take mesh_added_mass, or added_mass by strips."
    mirror = Mirror()
    spreads: ClassVar = {"coefficient": Uncertainty(0.85, 1.1, "Brennen 1982: ends", SHAKEN)}


def matrix_image(rows: Any) -> Any:
    """Return the image of a 6 x 6 matrix, rotation before translation."""
    signs = (-1, 1, -1, 1, -1, 1)
    return tuple(
        tuple(a * b * x + 0.0 for b, x in zip(signs, row, strict=True)) for a, row in zip(signs, rows, strict=True)
    )


def check_added_mass(rows: Any) -> None:
    """Raise ValueError for a matrix that is not symmetric, or by which some motion has a negative energy."""
    import numpy as np

    matrix = np.array(rows)
    slack = 1e-9 * max(np.abs(matrix).max(), 1e-300)
    if np.abs(matrix - matrix.T).max() > slack:
        raise ValueError("an added-mass matrix is symmetric, this one is not.")
    if np.linalg.eigvalsh(matrix).min() < -slack:
        raise ValueError("an added mass takes energy in every direction, this matrix gives some: it is not valid.")


_Row = tuple[fields.Number, fields.Number, fields.Number, fields.Number, fields.Number, fields.Number]


class GivenAddedMassLoad(LoadDescription):
    """Added mass of a rigid part about the centre of its shape, along and about its own axes."""

    kind: Literal["given_added_mass"]
    mass: tuple[fields.NonNegativeMass, fields.NonNegativeMass, fields.NonNegativeMass] | None = None
    """Added mass along x, y and z, instead of a matrix."""
    inertia: tuple[fields.NonNegativeInertia, fields.NonNegativeInertia, fields.NonNegativeInertia] = ZERO
    """Added moment of inertia about x, y and z."""
    matrix: tuple[_Row, _Row, _Row, _Row, _Row, _Row] | None = None
    """The full matrix, instead of mass and inertia: six rows of six plain numbers in SI units, rotation before
    translation, symmetric and without negative eigenvalues."""
    on = RIGID
    mirror = Mirror(matrix=matrix_image)
    spreads: ClassVar = {
        "mass": Uncertainty(0.85, 1.15, "Brennen 1982: shapes like it", SHAKEN),
        "inertia": Uncertainty(0.7, 1.4, "chosen", SHAKEN),
    }
    decided_by = {"inertia": "matrix"} | {f"matrix.{i}.{j}": f"matrix.{j}.{i}" for i in range(6) for j in range(i)}

    @model_validator(mode="after")
    def _is_an_inertia(self) -> Self:
        if (self.mass is None) == (self.matrix is None):
            raise wrong("mass", "give either a mass for each axis or the full matrix, one of the two.")
        if self.matrix is None:
            return self
        if self.inertia != ZERO:
            raise wrong("inertia", "the matrix says it already. Leave it out.")
        try:
            check_added_mass(self.matrix)
        except ValueError as error:
            raise wrong("matrix", str(error)) from None
        return self


class ForceLoad(LoadDescription):
    """A constant force and moment at one place of a part, in the world's or the part's own frame."""

    kind: Literal["force"]
    force: tuple[fields.Force, fields.Force, fields.Force]
    """Force along x, y and z."""
    moment: tuple[fields.Torque, fields.Torque, fields.Torque] = ZERO
    """Moment about x, y and z."""
    at: Place = "tip"
    """Where it acts: at the `tip`, the `root`, or one of the marks of a rod."""
    frame: Literal["world", "body"] = "world"
    """The frame of force and moment: that of the world, or the part's own."""
    mirror = Mirror(force=along, moment=about)

    def check(self, shape: str, marks: tuple[float, ...] = (), strains: Collection[str] = ()) -> None:
        """Raise the error of a field for a place that the part does not have."""
        if not isinstance(self.at, str) and self.at not in marks:
            why = f"the rod has no mark at {self.at}. Add it to its marks."
            raise wrong("at", why if shape == "rod" else "only a rod has marks. Write tip or root.")


class DistributedForceLoad(LoadDescription):
    """A constant force per length along a part, in the world's or the part's own frame."""

    kind: Literal["distributed_force"]
    force: tuple[fields.LineForce, fields.LineForce, fields.LineForce]
    """Force per length, along x, y and z."""
    frame: Literal["world", "body"] = "world"
    """The frame of the force: that of the world, or the part's own."""
    on = ("cylinder", "box", "spheroid", "mesh", "plate", "rod")
    per_length = True
    mirror = Mirror(force=along)


class NearFloorLoad(LoadDescription):
    """Added mass and drag that a rigid part has near the floor, on top of what it has everywhere."""

    kind: Literal["near_floor"]
    mass: tuple[fields.NonNegativeMass, fields.NonNegativeMass, fields.NonNegativeMass] = ZERO
    """Added mass along x, y and z of the part's own axes."""
    drag_area: tuple[fields.Area, fields.Area, fields.Area] = ZERO
    """Drag coefficient times area, along the same axes."""
    rotational: tuple[fields.NonNegativeInertia, fields.NonNegativeInertia, fields.NonNegativeInertia] = ZERO
    """c in the torque -c |w| w, about the same axes, in water of 1000 kg/m3. It goes with the water's density."""
    full: fields.Coordinate
    """Height of the part's centre over the floor up to which all of it is there."""
    none: fields.Coordinate
    """Height of the part's centre over the floor from which on there is nothing of it; in between it goes over
    smoothly."""
    on = RIGID
    mirror = Mirror()

    @model_validator(mode="after")
    def _goes_over(self) -> Self:
        if not self.full < self.none:
            raise wrong("none", "must be higher than full.")
        return self


class WallContactLoad(LoadDescription):
    """The soft hull of a rigid part, which the walls of the tank push back: a spring and a damper that only push."""

    kind: Literal["wall_contact"]
    reach: fields.Length
    """Distance of the hull's two ends from the part's centre, along the world's x."""
    stiffness: fields.PositiveStiffness
    """Stiffness of either end."""
    damping: fields.Damping = 0.0
    """Damping of either end."""
    softness: fields.Length = 1e-3
    """Way into the wall over which the damper sets in."""
    on = RIGID
    mirror = Mirror()


class TrailingEdgeLoad(LoadDescription):
    """What is shed into the wake at the tip of the last part of a body, which points to the tail, beside its strips of
    added mass: a rod, the last link of a chain, a plate."""

    kind: Literal["trailing_edge"]
    normal: fields.NonNegativeNumber = 1.0
    """Coefficient of the strips of added mass."""
    softness: fields.PositiveSpeed = 0.01
    """Speed of the water at the tip, tail first, at about which the load fades away."""
    chord: fields.Length | None = None
    """Depth of the tail fin that ends here. Given, what is shed follows with the lag and by the lift slope of a foil of
    that depth; without it the body is slender, and sheds at once."""
    fin: bool | None = None
    """Whether the part's length is that depth; where this is left out as of `added_mass`."""
    on = ("cylinder", "box", "rod")
    for_mesh = "A mesh has no tip: give the load to a box or a cylinder that ends the tail."
    mirror = Mirror()
    ranges = (
        up_to("reduced_frequency", 1.0, "its wake has short waves, with less momentum", "Lighthill 1960"),
        up_to(
            "stalled",
            0.5,
            "the flow leaves a tail at more than 30 deg to its path: give it a fin with foil",
            "chosen",
        ),
    )
    spreads: ClassVar = {"normal": Uncertainty(0.8, 1.2, "Lighthill 1971: slender bodies", THRUST)}


class SkinFrictionLoad(LoadDescription):
    """Friction of the water along a slender part by its Reynolds number, more where the part moves across as well."""

    kind: Literal["skin_friction"]
    length: fields.Length | None = None
    """Length of the whole body along the flow, where the part is one of several behind each other. Without it that of
    the part."""
    on = ("cylinder", "box", "mesh", "plate", "rod")
    per_length = True
    mirror = Mirror()
    reynolds_length = "body's length"
    ranges = (
        Range(
            "reynolds", 1e3, 1e9, "the friction of a plate is not that of Blasius or Schlichting", "Schlichting 1979"
        ),
    )
