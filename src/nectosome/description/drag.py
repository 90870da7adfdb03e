"""Drag by strips: across plates and bars, also of those that go to and fro or start from rest; in viscous liquid."""

import math
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import model_validator

from nectosome.description.fields import Length, NonNegativeNumber, PositiveNumber, PositiveSpeed
from nectosome.description.loads import LoadDescription
from nectosome.description.mirror import Mirror
from nectosome.description.ranges import QUADRATIC, TOWED, Range, at_least, up_to
from nectosome.io.schema.described import Described, Shorthand, Uncertainty, unfit, wrong
from nectosome.units import shorten, show_quantity

_STEADY = at_least(
    "keulegan_carpenter",
    64.0,
    "a plate that meets its own vortices has more drag than in a steady stream: give a paddle start_up: {}; of a body "
    "that undulates, and of a thick bar, no law is known",
    "Graham 1980",
)
_STARTS = at_least("keulegan_carpenter", 1.0, "with start_up, the drag of so short strokes is too small", "Graham 1980")


class StartUp(Described):
    """What a plate has beside its steady drag until its starting vortices have grown, and again after each reversal.

    Its numbers follow from the measured drag of long plates that go to and fro: `start_up: {}` takes them. The word
    `none` in its place is the drag of a steady stream.
    """

    extra: tuple[NonNegativeNumber, NonNegativeNumber] = (2.39, 1.07)
    """Drag at the start over the steady one, which comes on top of it; in two parts."""
    distance: tuple[PositiveNumber, PositiveNumber] = (0.189, 1.6)
    """Distance over which each part fades, in heights of the plate's larger side."""
    softness: PositiveSpeed = 1e-3
    """Speed with which the vortices go away from a plate at rest."""
    spreads: ClassVar = {
        name: Uncertainty(0.7, 1.4, "Graham 1980: plates that go to and fro", TOWED) for name in ("extra", "distance")
    }
    length: Length | None = None
    """Length of the whole body along its strips. Given, vortices stay behind as the body moves along itself, and the
    water that it comes into has none yet; without it the plate moves across only."""


class _OrNone(Shorthand):
    """A start-up, or `none`."""

    def expand(self, value: Any) -> Any:
        """Take the word for no start-up."""
        if isinstance(value, str) and value != "none":
            raise unfit(f'"{shorten(value)}" is no start-up: write none, {{}}, or its numbers.')
        return None if value == "none" else value

    def shorten(self, row: Any) -> Any:
        """Put the word for no start-up."""
        return "none" if row is None else row

    def json_schema(self, row: dict[str, Any]) -> dict[str, Any]:
        """Return the schema of the word."""
        return {"const": "none"}


class PlateDragLoad(LoadDescription):
    """Blade-element drag of a plate or bar, face by face, strip by strip."""

    kind: Literal["plate_drag"]
    normal: NonNegativeNumber
    """Drag coefficient of a face, by its area, in a steady stream."""
    amplitude: Length | None = None
    """How far the plate moves to either side of its mean place in still water. Given, the coefficient is that of a
    plate that oscillates, where that is larger."""
    start_up: Annotated[StartUp | None, _OrNone()] = None
    """Extra drag of a start from rest and after each reversal, on the larger side, whatever the motion; `none` is the
    steady drag at any time. Left out: a web has it, and a plate, unless it is a rod, on a rod, in a chain of three
    hinges or more, over half as thick as high, or has an amplitude."""
    on = ("box", "plate", "rod", "web", "soft_plate")
    for_mesh = "Take drag, or make a flat part a plate by the section of its mesh: shape: {section_of: ...}."
    per_length = True
    mirror = Mirror()
    reynolds_length = "height"
    ranges = QUADRATIC, _STEADY, _STARTS
    spreads: ClassVar = {"normal": Uncertainty(0.75, 1.35, "Hoerner 1965: 1.1 of a square to 2 of a long plate", TOWED)}

    @property
    def beside_defaults(self) -> frozenset[str]:
        """Whether it has a start-up: what is left open depends on the robot."""
        return frozenset({"start_up"})

    @property
    def leaves_start_up_open(self) -> bool:
        """Whether its file leaves open if there is one."""
        return self.amplitude is None and "start_up" not in self.model_fields_set

    def with_start_up(self, start_up: StartUp | None) -> "PlateDragLoad":
        """Return it with what was decided, still known as left open."""
        return PlateDragLoad.model_construct(self.model_fields_set, **{**dict(self), "start_up": start_up})

    @property
    def own_ranges(self) -> tuple[Range, ...]:
        """Return the ranges of the drag that it has."""
        if self.start_up is not None:
            return QUADRATIC, _STARTS
        return (QUADRATIC, _STEADY) if self.amplitude is None else (QUADRATIC,)

    @model_validator(mode="after")
    def _counts_its_vortices_once(self) -> Self:
        if self.amplitude is not None and self.start_up is not None:
            why = "start_up gives a plate that goes to and fro its larger drag already."
            raise wrong("amplitude", f"{why} Leave it out, or write start_up: none.")
        return self


class StokesDragLoad(LoadDescription):
    """Viscous drag of a slender part at low Reynolds numbers, strip by strip: resistive force theory."""

    kind: Literal["stokes_drag"]
    coefficients: Literal["gray_hancock", "lighthill"]
    """Whose coefficients: those of Gray and Hancock (1955) for waves in a plane, of Lighthill (1976) for a helix that
    swims by itself."""
    wavelength: Length
    """Length of a wave of the part's shape: with gray_hancock straight along the wave, with lighthill along the part,
    which is longer. Of a straight part about its length."""
    on = ("cylinder", "mesh", "rod")
    per_length = True
    mirror = Mirror()
    reynolds_length = "diameter"
    spreads: ClassVar = {"wavelength": Uncertainty(0.4, 2.5, "chosen: its drag goes by the logarithm", TOWED)}
    ranges = (up_to("reynolds", 0.1, "the water's inertia counts, which its viscous drag leaves out", "Lamb 1911"),)

    def check_radius(self, radius: float) -> None:
        """Raise the error of the wavelength for a part that is too thick for it.

        Drag across is more than drag along only where ln(2 l/r) > 1/2 + 2 c, with l and c of `StokesDrag`.
        """
        least = radius / 2 * (math.exp(1.5) if self.coefficients == "gray_hancock" else math.exp(0.5) / 0.09)
        if self.wavelength <= least:
            shown, thick = show_quantity(least, "length"), show_quantity(radius, "length")
            why = f"must be more than {shown} where the radius is {thick}: this drag is that of slender parts."
            raise wrong("wavelength", why)
