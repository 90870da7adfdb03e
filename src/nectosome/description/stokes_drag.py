"""Stokes drag: slender parts in viscous liquid."""

import math
from typing import Literal

from nectosome.description.fields import Length
from nectosome.description.loads import LoadDescription
from nectosome.description.mirror import Mirror
from nectosome.description.ranges import up_to
from nectosome.io.schema.described import wrong
from nectosome.units import show_quantity


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
