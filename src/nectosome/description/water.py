"""The water around a robot: gravity, surface, floor, walls, and what moves it."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from nectosome.description import fields
from nectosome.description.fields import ZERO, Name, Velocity
from nectosome.description.flow_fields import FlowFieldDescription
from nectosome.io.schema.described import Described, OneOf, inside, wrong


class WaterDescription(Described):
    """The water, and what is around it."""

    density: fields.Density = 1000.0
    """Mass of the water per volume."""
    viscosity: fields.PositiveViscosity = 1.0016e-3
    """Dynamic viscosity of the water, for Reynolds numbers and viscous drag. That of fresh water at 20 degrees
    Celsius."""
    gravity: fields.Gravity = 9.80665
    """Acceleration of gravity; it acts along -z. With 0 m/s2 nothing has weight or buoyancy."""
    surface: fields.Coordinate | None = None
    """Height z of the free surface at rest: buoyancy, drag and added mass end there. Without one the water has no end.
    """
    floor: fields.Coordinate | None = None
    """Height z of the ground that legs step on. Without one there is none."""
    walls: tuple[fields.Coordinate, fields.Coordinate] | None = None
    """Places along x of the tank's two ends, the smaller first. Without them there are none."""
    current: Velocity | None = None
    """Velocity of the water in the world, along x, y, z. Without one it is still."""
    flows: dict[Name, Annotated[FlowFieldDescription, OneOf()]] = Field(default_factory=dict)
    """What else moves the water, by name: currents that change over time or height, and waves. All of it adds up."""

    @model_validator(mode="after")
    def _holds_water(self) -> Self:
        if self.walls is not None and not self.walls[0] < self.walls[1]:
            raise wrong("walls", "the second wall must stand further along x than the first one.")
        if self.surface is not None and self.floor is not None and not self.floor < self.surface:
            raise wrong("surface", "the surface must be above the floor.")
        for name, flow in self.flows.items():
            with inside(f"flows.{name}"):
                if flow.waves and self.surface is None:
                    raise wrong("kind", "waves run on a surface, and the water has none. Give its height, as surface.")
                flow.check(*self.around_waves)
        return self

    @property
    def around_waves(self) -> tuple[float, float | None, tuple[float, float, float]]:
        """Return what waves depend on: gravity, depth and current."""
        return self.gravity, self.depth, self.current or ZERO

    @property
    def depth(self) -> float | None:
        """Return the depth of the water [m]; None where it has no floor."""
        return None if self.surface is None or self.floor is None else self.surface - self.floor

    @property
    def streams(self) -> bool:
        """Return whether the water moves by itself."""
        return self.current is not None or bool(self.flows)
