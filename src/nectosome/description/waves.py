"""Waves along a rod: moments of muscles, and shapes that a rod is made to take."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from nectosome.description.base import Described, wrong
from nectosome.description.fields import Angle, Curvature, Duration, Frequency, Length, NonNegativeNumber, Torque


class _Wave(Described):
    """`e(x) (offset + amplitude sin(2 pi (frequency t - x/wavelength) + phase))` at the place x along a rod.

    It goes from the root to the tip; without a wavelength all of the rod is in phase. The `envelope` e are numbers at
    places spread evenly from the root to the tip, joined by straight lines. It grows to its full size in `ramp`.
    """

    kind: Literal["wave"]
    frequency: Frequency
    wavelength: Length | None = None
    phase: Angle = 0.0
    envelope: Annotated[tuple[NonNegativeNumber, ...], Field(min_length=1)] = (1.0,)
    ramp: Duration = 0.0

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        if not any(self.envelope):
            raise wrong("envelope", "is 0 everywhere, so that there is no wave.")
        return self


class MomentWave(_Wave):
    """The moment `e(x) (offset + amplitude sin(2 pi (frequency t - x/wavelength) + phase))` [N m; Hz; m; rad; s].

    It goes from the root to the tip; without a wavelength all of the rod is in phase. The `envelope` e are numbers at
    places spread evenly from the root to the tip, joined by straight lines. It grows to its full size in `ramp`.
    """

    amplitude: Torque
    offset: Torque = 0.0


class CurvatureWave(_Wave):
    """The curvature `e(x) (offset + amplitude sin(2 pi (frequency t - x/wavelength) + phase))` [rad/m; Hz; m; rad; s].

    It goes from the root to the tip; without a wavelength all of the rod is in phase. The `envelope` e are numbers at
    places spread evenly from the root to the tip, joined by straight lines. It grows to its full size in `ramp`.
    """

    amplitude: Curvature
    offset: Curvature = 0.0


class PrescribedStrains(Described):
    """Strains that a rod is made to take, whatever that needs: curvatures [rad/m] about its sections' axes."""

    torsion: CurvatureWave | None = None
    bending_y: CurvatureWave | None = None
    bending_z: CurvatureWave | None = None


def wave_missed(wave: _Wave, length: float, order: int) -> float:
    """Share of the root mean square of a wave along a rod that polynomials of an order miss."""
    import numpy as np

    s, w = np.polynomial.legendre.leggauss(60)
    x = 0.5 * (s + 1)
    envelope = wave.envelope * 2 if len(wave.envelope) == 1 else wave.envelope
    e = np.interp(x, np.linspace(0, 1, len(envelope)), envelope)
    turn = 2 * np.pi * x * (length / wave.wavelength if wave.wavelength else 0.0)
    f = np.stack([e * np.cos(turn), e * np.sin(turn)])
    P = np.polynomial.legendre.legvander(s, order)
    c = (f * w) @ P * (np.arange(order + 1) + 0.5)
    return float(np.sqrt((((f - c @ P.T) ** 2) @ w).sum() / ((f**2) @ w).sum()))
