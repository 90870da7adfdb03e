"""What all parts share: where they sit, how they move against it, what acts on them."""

from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import Field

import nectosome.description.cranks
import nectosome.description.drag
import nectosome.description.foil_planform
import nectosome.description.plates
import nectosome.description.propeller  # noqa: F401  so that these kinds of loads and shapes are known here
from nectosome.description import fields
from nectosome.description.drives import MotorDescription
from nectosome.description.fields import ZERO, Name, Place, Position, Rotation
from nectosome.description.joints import FixedJoint, JointDescription
from nectosome.description.loads import LoadDescription
from nectosome.description.mirror import Mirrored
from nectosome.description.repeat import Repeat
from nectosome.io.schema.described import OneOf, inside, unfit


class Powered(NamedTuple):
    """A drive with a motor, and the path at which it stands."""

    path: str
    drive: MotorDescription


class Part(Mirrored):
    """What rigid bodies, rods and soft plates share: where they sit, how they move against it, what acts on them."""

    kind: Any  # its name in a file, a literal of each class
    on: Name = "body"
    """The part that this one sits on: `body`, an earlier limb, or `world`."""
    at: Place = "tip"
    """Where on that part: its `tip`, its `root`, or the fraction of one of its marks."""
    offset: Position = ZERO
    """Distance from there, along the axes of the part that this one sits on. For the body: its place in the world."""
    rotation: Rotation = ZERO
    """Roll, pitch and yaw against the part that this one sits on: first about x, then y, then z, of fixed axes. The
    joint comes after it. For the body: its orientation in the world."""
    repeat: Repeat | None = None
    """How often the limb comes, with all that sits on it: around an axis, along a row, or twice by a mirror."""
    joint: Annotated[JointDescription, OneOf()] = FixedJoint(kind="fixed")
    """How the part moves against what it sits on."""
    loads: dict[Name, Annotated[LoadDescription, OneOf()]] = Field(default_factory=dict)
    """What acts on the part, by name: drag, added mass, thrust, forces."""
    water: Annotated[Literal["auto"] | None, fields.WordAuto()] = None
    """`auto` adds the loads of the water that fit the part by its shape and its place, and that it has none of, with
    first guesses of their numbers. `nectosome check --write` writes them out."""

    @property
    def powered(self) -> dict[str, Powered]:
        """Its drives with motors, at paths in the part, by the coordinate that each one moves."""
        drive = self.joint.powered
        return {} if drive is None else {self.joint.coordinate: Powered(f"joint.{drive.field}", drive)}

    def image(self) -> Self:
        """Return the image but for where it sits. Equal signals of its joints make it move as the image does.

        Forces in the world's frame stay as they are. Raises the error of a field for what has no image.
        """
        with inside("joint"):
            joint = _image(self.joint)
        loads = {}
        for name, load in self.loads.items():
            with inside(f"loads.{name}"):
                loads[name] = _image(load)
        return super().image().model_copy(update={"joint": joint, "loads": loads})


def _image(part: JointDescription | LoadDescription) -> Mirrored:
    if part.mirror is None:
        raise unfit(f"{part.kind} cannot be mirrored. Write both limbs out.")
    return part.image()
