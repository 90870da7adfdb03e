"""The damping of a rod's material, as tests of materials give it."""

import math
from typing import Self

from pydantic import model_validator

from nectosome.description.fields import NonNegativeNumber, NonNegativePressure, PositiveFrequency, Viscosity
from nectosome.io.schema.described import Described, wrong

_WAYS = ("uniaxial", "loss_factor", "loss_modulus")


class Losses(Described):
    """The damping of a rod by what a test gives; exactly one of uniaxial viscosity, loss factor and loss modulus.

    Stress of a Kelvin-Voigt material in tension is E e + 3 eta de/dt with the shear viscosity eta, so that its loss
    modulus is 3 eta w and its loss factor 3 eta w / E at the angular frequency w. Both grow with the frequency: they
    are right at the one that is given.
    """

    uniaxial: Viscosity | None = None
    """Viscosity in tension and bending: three times that in shear."""
    loss_factor: NonNegativeNumber | None = None
    """Loss modulus over storage modulus (tan delta) in tension or bending, at the frequency."""
    loss_modulus: NonNegativePressure | None = None
    """Loss modulus in tension or bending, at the frequency; three times that in shear."""
    frequency: PositiveFrequency | None = None
    """Frequency at which loss factor or loss modulus were measured: take that of the motion."""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        given = [name for name in _WAYS if getattr(self, name) is not None]
        if not given:
            raise wrong("uniaxial", "is missing. Give it, or a loss_factor or a loss_modulus with its frequency.")
        if len(given) > 1:
            raise wrong(given[1], f"there is a {given[0]} as well. Leave one of the two out.")
        if self.uniaxial is None and self.frequency is None:
            raise wrong("frequency", f"is missing. Give the frequency at which the {given[0]} was measured.")
        if self.uniaxial is not None and self.frequency is not None:
            raise wrong("frequency", "goes with a loss_factor or a loss_modulus. Leave it out.")
        return self

    def shear_viscosity(self, young: float) -> float:
        """Return the shear viscosity eta [Pa s] of a material of Young's modulus `young` [Pa]."""
        if self.uniaxial is not None:
            return self.uniaxial / 3
        assert self.frequency is not None
        loss_modulus = young * self.loss_factor if self.loss_factor is not None else self.loss_modulus
        assert loss_modulus is not None
        return loss_modulus / (6 * math.pi * self.frequency)
