"""Mirror images: each class says how its fields change in the reflection of a limb in its own x-z plane.

D = diag(1, -1, 1) takes a point of the limb to that of its image, in frames that are images of one another, so that the
image still runs along its x axis. Positions, forces and velocities change the sign of y; axes of hinges, moments and
torsion change those of x and z.
"""

from collections.abc import Callable
from typing import Any, ClassVar, Self

from nectosome.io.schema.described import Described

Change = Callable[[Any], Any]
"""From a value of a limb to that of its image."""


class Mirror:
    """How fields of a group change, by name, as in `Mirror(axis=about)`; those without a value stay as they are."""

    def __init__(self, **changes: Change):
        self.changes = changes

    def __call__(self, group: Any) -> Any:
        """Return the image of a group."""
        known = {name: getattr(group, name) for name in self.changes}
        return group.model_copy(update={n: self.changes[n](x) for n, x in known.items() if x is not None})


class Mirrored(Described):
    """What has a mirror image: `mirror` says which fields change, and how; without it there is none."""

    mirror: ClassVar[Mirror | None] = None

    def image(self) -> Self:
        """Return the image. Equal signals make it move as the image does."""
        return self if self.mirror is None else self.mirror(self)


def along(v: Any) -> Any:
    """Return the image of a position, force or velocity."""
    return (v[0], negative(v[1]), v[2])


def about(v: Any) -> Any:
    """Return the image of an axis, a moment, an angular velocity, a rotation as roll, pitch, yaw."""
    return (negative(v[0]), v[1], negative(v[2]))


def across(v: Any) -> Any:
    """Return the image of a place across a rod, along y and z."""
    return (negative(v[0]), v[1])


def opposite(value: Any) -> Any:
    """Return a number, a row of numbers or a signal with the other sign."""
    if isinstance(value, tuple):
        return tuple(map(opposite, value))
    return value.opposite() if hasattr(value, "opposite") else negative(value)


def negative(x: float) -> float:
    """Return -x, and 0.0 for 0.0."""
    return 0.0 - x
