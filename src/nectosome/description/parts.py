"""The parts of a robot: rigid bodies, soft rods and soft plates."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, ClassVar, Literal, Self

from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from nectosome.description import fields
from nectosome.description.fields import ZERO, Name, Position, listed
from nectosome.description.loads import SOFT, LoadDescription
from nectosome.description.mesh_added_mass import with_added_mass
from nectosome.description.meshes import MeshShape, folder_of
from nectosome.description.mirror import Mirror, about, along, opposite
from nectosome.description.part_base import Part, Powered
from nectosome.description.rest_lines import fitted_rest
from nectosome.description.rod_fields import (
    DrivenStrains,
    Mark,
    PrescribedStrains,
    RestStrains,
    StartStrains,
)
from nectosome.description.rod_loads import TURNED
from nectosome.description.rod_matter import MATTER_SPREADS, RodMatter
from nectosome.description.shapes import ShapeDescription, shape_forms, shape_image
from nectosome.description.signals import RecordedStrain, WaveSignal
from nectosome.description.soft_plates import SoftPlate
from nectosome.io.schema.described import (
    NameOrGroup,
    OneOf,
    increasing,
    inside,
    wrong,
)

StrainName = Literal["torsion", "bending_y", "bending_z", "extension", "shear_y", "shear_z"]
STRAIN_NAMES: tuple[StrainName, ...] = ("torsion", "bending_y", "bending_z", "extension", "shear_y", "shear_z")
Order = Annotated[int, Field(strict=True, ge=0, le=20)]


_GROUPS = (
    "Or a mesh, as in {mesh: hull.stl, unit: mm}, or a plate, as in {drawing: fin.svg, thickness: 3 mm} or "
    "{outline: [[0 mm, 0 mm], [60 mm, 0 mm], [60 mm, 40 mm]], thickness: 3 mm}."
)


class Rigid(Part):
    """A rigid body, along its own x axis from 0 to `length`; exactly one of `mass` and `density` is given.

    Inertia and volume follow from the shape where they are left out. A mesh lies where its own frame says.
    """

    kind: Literal["rigid"]
    loads: dict[Name, Annotated[LoadDescription, OneOf(lambda load: not {*load.on} <= {*SOFT})]] = Field(
        default_factory=dict
    )
    """What acts on the part, by name: drag, added mass, thrust, forces."""
    shape: Annotated[str | ShapeDescription, NameOrGroup(_GROUPS)]
    """Shape of the body, by its name. Or a mesh, as in `{mesh: hull.stl, unit: mm}`, or a plate, by its outline."""
    length: fields.Length | None = None
    """Length along x, from end to end."""
    radius: fields.Length | None = None
    """Radius of a round shape, where it is largest."""
    width: fields.Length | None = None
    """Full size of a box along y."""
    height: fields.Length | None = None
    """Full size of a box along z."""
    bend: fields.Bend = 0.0
    """Angle by which the axis of a cylinder turns about y, evenly over its length."""
    mass: fields.NonNegativeMass | None = None
    """Mass, instead of a density. What is fixed to another part may weigh nothing: it is counted there."""
    density: fields.Density | None = None
    """Mass per volume of the shape, instead of a mass."""
    inertia: tuple[fields.NonNegativeInertia, fields.NonNegativeInertia, fields.NonNegativeInertia] | None = None
    """Moments of inertia about the centre of mass, along the part's axes. Without them they follow from the shape; a
    point has none."""
    products: tuple[fields.ProductOfInertia, fields.ProductOfInertia, fields.ProductOfInertia] | None = None
    """Elements xy, xz, yz of the inertia matrix (xy is minus the integral of x y dm), where the axes of the part are
    not the principal ones."""
    centre_of_mass: Position = ZERO
    """Place of the centre of mass, seen from the centre of the shape."""
    volume: fields.Volume | None = None
    """Volume of water that the part displaces. Without it, that of the shape."""
    strips: Annotated[int, Field(strict=True, ge=1, le=200)] = 5
    """Number of points along the axis at which loads per length act."""
    mirror = Mirror(shape=shape_image, centre_of_mass=along, products=about)  # products xy and yz change their sign

    @property
    def own_shape(self) -> ShapeDescription:
        """Its shape, also where the file has only a name."""
        return shape_forms()[self.shape]() if isinstance(self.shape, str) else self.shape

    @property
    def decided(self) -> dict[str, str]:
        """The bend of what has none, by the shape; the thickness of a shell, whose mass is given, by that."""
        straight = {} if self.own_shape.bends else {"bend": "shape"}
        shell = isinstance(self.shape, MeshShape) and self.mass is not None
        return straight | ({"shape.thickness": "mass"} if shell else {})

    @property
    def form(self) -> str:
        """The name of its shape: `mesh`, or `plate` of one by its outline."""
        return self.own_shape.form

    def size(self, name: str) -> float | None:
        """Return its length, width or height as given, or as its mesh or outline has them [m]."""
        return self.own_shape.size(name, self)

    @model_validator(mode="after")
    def _shape_is_whole(self) -> Self:
        self.own_shape.check(self)
        return self

    @model_validator(mode="after")
    def _mass_is_known_once(self) -> Self:
        if self.mass is None and self.density is None:
            also = "" if self.form == "point" else " or a density"
            raise wrong("mass", f"is missing. Give a mass{also}.")
        rotor = self.joint.powered is not None and self.joint.powered.inertia > 0
        if self.mass == 0 and self.joint.kind != "fixed" and not rotor:
            why = "what moves against the part it sits on must weigh something, more than 0 kg"
            raise wrong("mass", f"{why}, or be moved by a motor with an inertia.")
        if self.density is not None:
            if self.mass is not None:
                raise wrong("density", "the mass is given already. Leave one of the two out.")
            if self.form == "point":
                raise wrong("density", "a point has no size, so a density gives it no mass. Give its mass instead.")
        return self

    @model_validator(mode="after")
    def _inertia_of_a_body(self) -> Self:
        if self.inertia is None:
            if self.products is not None:
                raise wrong("products", "the inertia is missing. Give its moments as well.")
            return self
        principal = principal_moments(self.inertia, self.products)
        if has_a_body(principal):
            return self
        if self.products is None:
            largest, others = principal[-1], principal[0] + principal[1]
            shown = f"{largest:.4g} kg m2 is larger than the sum of the other two, {others:.4g} kg m2"
            raise wrong("inertia", f"no body has these moments: {shown}.")
        shown = ", ".join(format(moment, ".4g") for moment in principal)
        why = (
            f"with the inertia they lead to principal moments of {shown} kg m2, which no body has: none may be below 0,"
        )
        raise wrong("products", f"{why} or larger than the sum of the other two.")

    @model_validator(mode="after")
    def _loads_fit(self) -> Self:
        for name, load in self.loads.items():
            with inside(f"loads.{name}"):
                load.check(self.form)
                load.check_radius(self.own_shape.largest_radius(self))
                self.own_shape.check_load(load)
        return self

    @model_validator(mode="after")
    def _added_mass_is_computed(self, info: ValidationInfo) -> Self:
        if isinstance(self.shape, MeshShape):
            object.__setattr__(self, "loads", with_added_mass(self.loads, self.shape, folder_of(info)))
        return self


_MISSED = 0.05  # of a wave's root mean square, which polynomials may miss


def _in_canonical_order(strains: dict[StrainName, int]) -> dict[StrainName, int]:
    return {name: strains[name] for name in STRAIN_NAMES if name in strains}


_TURNED = dict.fromkeys((*TURNED, "shear_y"), opposite)  # strains with the other sign in a mirror


class Rod(RodMatter, Part):
    """A soft rod along its own x axis, from 0 to `length`; its sections go over evenly from the root to the tip.

    Strains are polynomials along the rod, so that a few numbers say how it bends.
    """

    loads: dict[Name, Annotated[LoadDescription, OneOf(lambda load: "rod" in load.on)]] = Field(default_factory=dict)
    """What acts on the rod, by name: drag, added mass, tendons, chambers, muscles, forces."""
    strains: Annotated[dict[StrainName, Order], AfterValidator(_in_canonical_order)] = Field(default_factory=dict)
    """Strains that are free, each with the order of its polynomial along the rod: `{bending_z: 2}`. All others are
    held, but for those that motors drive."""
    rest: RestStrains = RestStrains()
    """Strains at which the rod is free of stress."""
    start: StartStrains = StartStrains()
    """Strains with which the rod starts, beyond those at rest, and how fast they change."""
    motion: PrescribedStrains = PrescribedStrains()
    """Strains that the rod is made to take, whatever that needs."""
    drive: DrivenStrains = DrivenStrains()
    """Strains of one shape each that a motor or a servo drives, instead of free ones."""
    points: Annotated[int, Field(strict=True, ge=2, le=200)] = 10
    """Number of Gauss points along the rod, which carry mass and loads."""
    marks: Annotated[tuple[Mark, ...], increasing("the marks must increase along the rod.")] = ()
    """Fractions of the length where limbs and forces may sit, increasing."""
    spreads: ClassVar = MATTER_SPREADS | {f"tip_{name}": one for name, one in MATTER_SPREADS.items()}
    mirror = Mirror(
        rest=Mirror(**_TURNED),
        start=Mirror(**_TURNED, rate=Mirror(**_TURNED)),
        motion=Mirror(**dict.fromkeys(TURNED, opposite)),
        drive=Mirror(**dict.fromkeys(TURNED, opposite)),
    )

    @property
    def powered(self) -> dict[str, Powered]:
        """Its drives with motors, at paths in the part, by the coordinate that each one moves."""
        given = self.drive.given.items()
        strains = {f"{n}.angle": Powered(f"drive.{n}.{one.powered.field}", one.powered) for n, one in given}
        return super().powered | strains

    @property
    def steps(self) -> tuple[float, ...]:
        """Middles of changes of its material that its points cannot resolve, as fractions of its length."""
        return tuple(0.5 * (a + b) for a, b in pairwise(self.kinks) if b - a < 0.5 / self.points)

    @model_validator(mode="after")
    def _has_its_rest(self, info: ValidationInfo) -> Self:
        if self.rest.line or self.rest.file is not None:
            with inside("rest"):
                fitted = fitted_rest(self.rest, self.length, folder_of(info))
            object.__setattr__(self, "rest", fitted)  # from here on it holds its strains, wherever the file is
        elif self.rest.order is not None:
            raise wrong("rest.order", "goes with a line or a file. Leave it out.")
        return self

    @model_validator(mode="after")
    def _strains_move_one_way(self) -> Self:
        if not self.strains and not self.drive.given:
            raise wrong("strains", f"a rod needs at least one of {listed(STRAIN_NAMES)}, free or driven.")
        for name in ("shear_y", "shear_z") if self.wall is not None and self.section != "circle" else ():
            if name in self.strains:
                raise wrong(f"strains.{name}", f"the shear of a hollow {self.section} is not known here. Leave it out.")
        for name in self.drive.given:
            why = f"a motor drives {name} (drive.{name}). Leave one of the two out."
            if getattr(self.motion, name) is not None:
                raise wrong(f"motion.{name}", why)
            if name in self.strains:
                raise wrong(f"strains.{name}", f"it has the shape of an envelope, since {why}")
        return self

    @model_validator(mode="after")
    def _starts_by_itself(self) -> Self:
        moved = {name: f"motion.{name}" for name, strain in self.motion if strain is not None}
        moved |= {name: f"drive.{name}" for name in self.drive.given}
        with inside("start"):
            self.start.check(self.strains, moved)
        return self

    @model_validator(mode="after")
    def _loads_fit(self) -> Self:
        for name, load in self.loads.items():
            with inside(f"loads.{name}"):
                load.check("rod", self.marks, self.strains.keys())
                load.check_radius(self.largest_radius())
        return self

    @model_validator(mode="after")
    def _takes_its_shape(self) -> Self:
        for name in type(self.motion).model_fields:
            wave = getattr(self.motion, name)
            if wave is None:
                continue
            if name not in self.strains:
                raise wrong(f"motion.{name}", f"the rod's strains do not name {name}. Give it an order there.")
            missed = [share_missed(wave, self.length, order) for order in range(self.strains[name], 21)]
            if missed[0] > _MISSED:
                enough = next((self.strains[name] + k for k, m in enumerate(missed) if m <= _MISSED), None)
                remedy = "Choose a longer wavelength" if enough is None else f"It takes order {enough}"
                why = f"polynomials of order {self.strains[name]} miss {100 * missed[0]:.0f} % of this wave. {remedy}."
                raise wrong(f"strains.{name}", why)
        return self


def share_missed(strain: WaveSignal | RecordedStrain, length: float, order: int) -> float:
    """Return the share of a strain's root mean square along a rod that polynomials of an order miss."""
    import numpy as np

    s, w = np.polynomial.legendre.leggauss(60)
    x = 0.5 * (s + 1)
    envelope = strain.envelope * 2 if len(strain.envelope) == 1 else strain.envelope
    e = np.interp(x, np.linspace(0, 1, len(envelope)), envelope)
    wavelength = strain.wavelength if isinstance(strain, WaveSignal) else None
    turn = 2 * np.pi * x * (length / wavelength if wavelength else 0.0)
    f = np.stack([e * np.cos(turn), e * np.sin(turn)])
    P = np.polynomial.legendre.legvander(s, order)
    c = (f * w) @ P * (np.arange(order + 1) + 0.5)
    return float(np.sqrt((((f - c @ P.T) ** 2) @ w).sum() / ((f**2) @ w).sum()))


Limb = Annotated[Rigid | Rod | SoftPlate, Field(discriminator="kind")]


def principal_moments(moments: Sequence[float], products: Sequence[float] | None) -> tuple[float, ...]:
    """Return the principal moments of inertia [kg m2], smallest first, from moments and products xy, xz, yz."""
    if products is None:
        return tuple(sorted(moments))
    import numpy as np

    (a, b, c), (xy, xz, yz) = moments, products
    return tuple(np.linalg.eigvalsh(np.array([[a, xy, xz], [xy, b, yz], [xz, yz, c]])).tolist())


def has_a_body(principal: Sequence[float]) -> bool:
    """Whether some body has these principal moments: none is larger than the sum of the others, so none is negative."""
    return 2 * max(principal) <= sum(principal) * (1 + 1e-9)


def has_place(part: Limb, at: str | float) -> bool:
    """Whether a part has a place: a tip, a root, or one of its marks."""
    return isinstance(at, str) or (isinstance(part, Rod) and at in part.marks)
