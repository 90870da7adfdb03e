"""Strains along a rod as numbers: those at which it is free of stress, and those with which it starts."""

from collections.abc import Mapping
from typing import Annotated, Any

from nectosome.description.fields import Curvature, CurvatureRate, Number, StrainRate
from nectosome.io.schema.described import Described, OneOrMany, wrong


class _Strains(Described):
    """Strains as coefficients of Legendre polynomials along a rod."""

    torsion: Annotated[tuple[Curvature, ...], OneOrMany()] = ()
    """Twist per length, about the axis of the rod."""
    bending_y: Annotated[tuple[Curvature, ...], OneOrMany()] = ()
    """Curvature about y."""
    bending_z: Annotated[tuple[Curvature, ...], OneOrMany()] = ()
    """Curvature about z."""
    extension: Annotated[tuple[Number, ...], OneOrMany()] = ()
    """Elongation: 0.01 is 1 % longer."""
    shear_y: Annotated[tuple[Number, ...], OneOrMany()] = ()
    """Shear along y."""
    shear_z: Annotated[tuple[Number, ...], OneOrMany()] = ()
    """Shear along z."""


class RestStrains(_Strains):
    """The strains at which a rod is free of stress, as coefficients of Legendre polynomials along it.

    A single number is the same all along the rod.
    """


class StrainRates(Described):
    """How fast the strains of a rod change at the start, as coefficients of Legendre polynomials along it."""

    torsion: Annotated[tuple[CurvatureRate, ...], OneOrMany()] = ()
    """Rate of the twist per length."""
    bending_y: Annotated[tuple[CurvatureRate, ...], OneOrMany()] = ()
    """Rate of the curvature about y."""
    bending_z: Annotated[tuple[CurvatureRate, ...], OneOrMany()] = ()
    """Rate of the curvature about z."""
    extension: Annotated[tuple[StrainRate, ...], OneOrMany()] = ()
    """Rate of the elongation."""
    shear_y: Annotated[tuple[StrainRate, ...], OneOrMany()] = ()
    """Rate of the shear along y."""
    shear_z: Annotated[tuple[StrainRate, ...], OneOrMany()] = ()
    """Rate of the shear along z."""


class StartStrains(_Strains):
    """The strains with which a rod starts, beyond those at rest, as coefficients of Legendre polynomials along it.

    A single number is the same all along the rod; what is left out starts at 0, free of stress.
    """

    rate: StrainRates = StrainRates()
    """How fast they change at the start."""

    @property
    def given(self) -> bool:
        """Whether any is given."""
        return any(len(values) for own in (self, self.rate) for name, values in own if name != "rate")

    def check(self, orders: Mapping[Any, int], moved: Mapping[str, str]) -> None:
        """Raise the error of a field for a strain that does not start by itself.

        `orders` are those of the free strains, `moved` says what moves another, by strain.
        """
        for where, own in (("", self), ("rate.", self.rate)):
            for name, values in own:
                if name == "rate" or not values:
                    continue
                if name in moved:
                    raise wrong(f"{where}{name}", f"{moved[name]} already says how it starts. Leave this out.")
                if name not in orders:
                    raise wrong(f"{where}{name}", f"the rod's strains do not name {name}. Give it an order there.")
                if len(values) > orders[name] + 1:
                    most = f"{name} has an order of {orders[name]}, so {orders[name] + 1} at most"
                    raise wrong(f"{where}{name}", f"has {len(values)} numbers; {most}.")
