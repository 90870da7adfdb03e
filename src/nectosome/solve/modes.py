"""Small motions about an equilibrium: frequencies, damping ratios and shapes."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Complex, Float

from nectosome.core import Status
from nectosome.description import RobotDescription, dump_robot
from nectosome.io import provenance
from nectosome.model import RobotLike
from nectosome.units import InputError

from .small_motions import SmallMotion, Stability, small_motion, spectrum
from .static import Static, static
from .steady import Steady
from .symmetry import Symmetry, find_symmetry

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class NaturalModes:
    r"""Small motions $\delta = \mathrm{Re}(\phi\,e^{\lambda t})$ about an equilibrium, slowest first.

    Of each pair of complex eigenvalues that with the positive imaginary part is kept; a real one, of a motion that goes
    back or away without oscillation, stands by itself, with frequency 0.
    """

    eigenvalue: Complex[np.ndarray, "k"]  # lambda [1/s], by increasing magnitude
    shape: Complex[np.ndarray, "k n"]  # phi: displacement of each coordinate; the largest one is 1
    coordinates: tuple[str, ...]
    description: RobotDescription | None = None

    @property
    def frequency(self) -> Float[np.ndarray, "k"]:
        """Frequency Im(lambda)/2 pi of the damped oscillation [Hz]."""
        return np.imag(self.eigenvalue) / (2 * np.pi)

    @property
    def damping_ratio(self) -> Float[np.ndarray, "k"]:
        """-Re(lambda)/|lambda|: 0 undamped, 1 without oscillation, negative where the motion grows."""
        size = np.abs(self.eigenvalue)
        return np.where(size > 0, -np.real(self.eigenvalue) / np.where(size > 0, size, 1.0), 0.0)

    @property
    def stability(self) -> Stability:
        """Of the small motion that grows fastest, or decays slowest."""
        return Stability.of(self.eigenvalue)

    @property
    def stable(self) -> bool:
        """Whether no small motion grows."""
        return self.stability.stable

    def __repr__(self) -> str:
        shown = ", ".join(f"{f:.4g}" for f in self.frequency[:6])
        return f"<NaturalModes: {'stable' if self.stable else 'unstable'}, {len(self.eigenvalue)} modes; {shown} Hz>"

    def to_dataset(self) -> "xr.Dataset":
        """The same with labels: `frequency`, `damping_ratio`, `growth_rate`, and `shape` by coordinate."""
        import xarray as xr

        name = "" if self.description is None else f"{self.description.name}: "
        parts = np.stack([np.real(self.shape), np.imag(self.shape)], axis=-1)
        return xr.Dataset(
            {
                "frequency": ("mode", self.frequency, {"units": "Hz"}),
                "damping_ratio": ("mode", self.damping_ratio, {"units": "1"}),
                "growth_rate": ("mode", np.real(self.eigenvalue), {"units": "1/s"}),
                "shape": (("mode", "coordinate", "component"), parts, {"units": "1"}),
            },
            coords={
                "mode": np.arange(1, len(self.eigenvalue) + 1),
                "coordinate": np.array(self.coordinates, dtype=str),
                "component": ["real", "imaginary"],
            },
            attrs={
                "title": f"{name}small motions about an equilibrium",
                "robot": dump_robot(self.description) if self.description else "",
                "provenance": json.dumps(provenance({})),
            },
        )


def modes(about: RobotLike | Static | Steady, *, settings: Iterable[str] = ()) -> NaturalModes:
    r"""Frequencies, damping ratios and shapes of small motions about an equilibrium.

    - about: what `static` or `steady` found; or a robot by name, path, description or built, of which the static
      equilibrium is taken, with `settings` such as "E=3MPa".

    Eigenvalues and eigenvectors of the linearised equations of motion, with the added mass, the damping and the change
    of all loads with place and velocity; drag that grows with the square of the speed damps nothing at rest. Loops of
    servos are continuous; one with an update rate has an eigenvalue besides, minus this rate, of what it holds. What
    may drift for ever (place, heading) is left out. Raises InputError for what is no robot, and where it has no such
    equilibrium.
    """
    if not isinstance(about, Static | Steady):
        about = static(about, settings=settings)
    status = Status(int(about.status))
    if status not in (Status.SOLVED, Status.UNSTABLE):
        loose = ""
        if isinstance(about, Static) and (about.loose or about.turning):
            why = about.why.partition(". ")[0] if about.turning else f"Nothing holds {', '.join(about.loose)}"
            loose = f" {why[0].upper()}{why[1:]}."
        raise InputError(f"{status.reason}.{loose} Small motions are those about what ns.static or ns.steady finds.")
    robot = about.value.system
    symmetry = find_symmetry(robot)
    return modes_of(small_motion(robot, about.state), symmetry, robot.coordinate_names, robot.description)


def modes_of(
    motion: SmallMotion,
    symmetry: Symmetry,
    names: tuple[str, ...],
    description: RobotDescription | None = None,
) -> NaturalModes:
    """Modes of a linear motion, of coordinates with these names."""
    values, vectors = spectrum(motion, symmetry.drift)
    kept = np.flatnonzero(np.imag(values) >= 0)
    if symmetry.spin:  # the heading is free too, but no coordinate of its own
        kept = np.delete(kept, np.argmin(np.abs(values[kept])))
    kept = kept[np.argsort(np.abs(values[kept]), kind="stable")]
    shape = vectors[:, kept].T
    largest = shape[np.arange(kept.size), np.argmax(np.abs(shape), axis=1)] if names else np.ones(kept.size)
    shape = shape / np.where(largest == 0, 1.0, largest)[:, None]
    return NaturalModes(values[kept], shape, names, description)
