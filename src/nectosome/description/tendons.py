"""Tendons over joints: cords over hinges of several parts, pulled by a winch, a crank or a slide, and their copies."""

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, Self

from pydantic import Field, model_validator

from nectosome.description import fields
from nectosome.description.copies import Copies
from nectosome.description.fields import Name
from nectosome.description.joints import PrismaticJoint, RevoluteJoint
from nectosome.description.parts import Limb
from nectosome.io.schema.described import Described, Uncertainty, inside, wrong
from nectosome.io.schema.quantity import QuantityOrGroup
from nectosome.units import did_you_mean

_WAYS = ("radius", "crank", "ratio")


class TendonGuides(Described):
    """Holes on both sides of a hinge between which a tendon runs straight: its moment arm changes with the angle."""

    before: tuple[fields.Length, fields.Coordinate]
    """Place of the hole in the part that the hinge is on: distance from the axis, away from the other part as it lies
    with the joint at 0, and height above the line through the axis; positive on the side of a positive arm."""
    after: tuple[fields.Length, fields.Coordinate]
    """Place of the hole in the part that turns: distance from the axis, and height above the same line."""

    @model_validator(mode="after")
    def _passes_the_axis(self) -> Self:
        (d, h), (e, i) = self.before, self.after
        if abs(d * i + e * h) < 1e-9 * math.hypot(d, h) * math.hypot(e, i):
            raise wrong("after", "its arm is 0 where the joint is at 0. Change the height of a hole.")
        return self

    @property
    def range(self) -> tuple[float, float]:
        """Angles of the joint [rad] between which its arm keeps its sign: where cord and axis are in line."""
        (d, h), (e, i) = self.before, self.after
        between = math.atan2(d * i + e * h, h * i - d * e)  # from the hole that turns to the other one
        return (between - math.pi, between) if between > 0 else (between, between + math.pi)


class TendonPull(Described):
    """What pulls a tendon: the joint of a part, as a winch, a crank or a slide. It may pull several tendons."""

    part: Name
    """The part whose hinge or slide pulls; any motion, servo or motor may drive it."""
    radius: fields.Coordinate | None = None
    """Radius of a winch's drum; a positive one winds the tendon up towards positive angles, a negative one towards
    negative angles."""
    crank: fields.Length | None = None
    """Radius of a crank's pin, to which the tendon is fixed."""
    guide: fields.Length | None = None
    """Distance from the crank's axis to the guide through which the tendon comes; more than the crank's radius."""
    angle: fields.Angle = 0.0
    """Angle from the direction of the guide to the pin where the crank's joint is at 0; with 90 deg it pulls towards
    positive angles, with -90 deg towards negative ones."""
    ratio: fields.Number | None = None
    """Length drawn in per displacement of a slide: 1 for a slide that pulls towards positive displacements, -1 towards
    negative ones, 2 over a loose pulley."""

    @property
    def decided(self) -> dict[str, str]:
        """The angle of a crank, where there is none."""
        return {} if self.crank is not None else {"angle": "ratio" if self.radius is None else "radius"}

    @model_validator(mode="after")
    def _pulls_one_way(self) -> Self:
        given = [name for name in _WAYS if getattr(self, name) is not None]
        if not given:
            raise wrong("radius", "is missing. Give the radius of a winch, a crank with its guide, or a slide's ratio.")
        if len(given) > 1:
            raise wrong(given[1], f"there is a {given[0]} as well. Leave one of the two out.")
        if getattr(self, given[0]) == 0:
            raise wrong(given[0], "is 0, so that nothing is pulled. Give another value, or leave pulled_by out.")
        if self.crank is None:
            for name in ("guide", "angle"):
                if name in self.model_fields_set and getattr(self, name):
                    raise wrong(name, "goes with a crank. Leave it out.")
        elif self.guide is None:
            raise wrong("guide", "is missing. Give the distance from the crank's axis to the tendon's guide.")
        elif self.guide <= self.crank:
            raise wrong("guide", "must be more than the radius of the crank.")
        return self


class TendonDescription(Described):
    """An elastic cord without mass over the hinges of parts; it pulls and never pushes.

    Its stretch is e = e0 - sum of arms times angles + pull; where it runs straight between holes, what their distance
    gets shorter stands for arm times angle. Its tension T is that of a spring and a damper, at least 0, and its moment
    about each hinge T times the arm. It slides without friction unless that is given.
    """

    over: Annotated[
        dict[Name, Annotated[float | TendonGuides, QuantityOrGroup("length", group=TendonGuides)]], Field(min_length=1)
    ]
    """Moment arm at the hinge of each part that it runs over: a positive one turns the part towards positive angles, so
    that it lies on the +y side of a hinge about z. Where the sign changes the tendon crosses over. Or the holes on
    both sides of the hinge, where the arm is not constant: `{before: [20 mm, 8 mm], after: [20 mm, 8 mm]}`."""
    pulled_by: TendonPull | None = None
    """What pulls it; without it, its ends are fixed."""
    stiffness: fields.PositiveStiffness
    """Stiffness of the whole length."""
    damping: fields.Damping = 0.0
    """Damping of the whole length, while it is taut."""
    pretension: fields.Tension = 0.0
    """Tension where all its joints are at 0."""
    slack: fields.NonNegativeLength = 0.0
    """Length by which it hangs loose where all its joints are at 0, instead of a pretension."""
    spreads: ClassVar = {
        "stiffness": Uncertainty(0.6, 1.5, "cords as they are knotted, chosen", "pull it, and measure its stretch"),
        "friction": Uncertainty(0.5, 2.0, "chosen", "pull it to and fro over its guides"),
    }
    softness: fields.Length = 1e-4
    """Stretch over which it becomes taut smoothly, and sliding over which friction turns its direction."""
    friction: fields.NonNegativeNumber = 0.0
    """Coefficient mu of friction on its guides, with `over` in the order in which it runs from what pulls it: each
    hinge bent by theta from 0 takes exp(-mu theta) of the tension where it is drawn in, exp(mu theta) where it is let
    out, and holds between. In `static` it was drawn in or let out, as its pull is above or below 0. 0: none."""

    @model_validator(mode="after")
    def _has_arms(self) -> Self:
        for part, arm in self.over.items():
            if arm == 0:
                raise wrong(f"over.{part}", "the arm is 0: it does not act on this hinge. Leave the part out.")
        if self.pretension and self.slack:
            raise wrong("slack", "there is a pretension as well. Leave one of the two out.")
        if self.friction and self.pulled_by is None:
            raise wrong("friction", "it slides only where something pulls it. Give pulled_by, or leave friction out.")
        return self

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of all its parts, that which pulls last."""
        return (*self.over, *(() if self.pulled_by is None else (self.pulled_by.part,)))

    def of_copies(self, names: Mapping[str, str]) -> Self:
        """Return the tendon on copies of its parts, by name."""
        pull, over = self.pulled_by, {names[part]: arm for part, arm in self.over.items()}
        pulled_by = None if pull is None else pull.model_copy(update={"part": names[pull.part]})
        return self.model_copy(update={"over": over, "pulled_by": pulled_by})


TendonCopies = dict[str, dict[str, TendonDescription]]
"""Tendons on each set of copies of their parts by name, by the name that they were written under."""


def on_each_copy(tendons: Mapping[str, TendonDescription], copies: Copies) -> TendonCopies:
    """Return the tendons on their own. One over limbs that come several times comes as often, on copies of one number.

    Arms stay as they are: an image at the same angles is the image of the limb. Raises the error of a field.
    """
    found: TendonCopies = {}
    for name, tendon in tendons.items():
        most = max((copies.get(part, ()) for part in tendon.parts), key=len)
        found[name] = {}
        for copy in most if len(most) > 1 else ():
            names = {}
            for part in tendon.parts:
                own = copies.get(part, ())
                alone = len(own) < 2
                fits = [one.name for one in own if copy.numbers[: len(one.numbers)] == one.numbers]
                if not alone and not fits:
                    why = f"{part} comes {len(own)} times, another of its parts {len(most)} times, not on one another."
                    raise wrong(f"tendons.{name}", f"{why} Write a tendon for each copy, over {own[0].name} and so on.")
                names[part] = part if alone else fits[0]
            found[name][name + "_".join(map(str, copy.numbers))] = tendon.of_copies(names)
        found[name] = found[name] or {name: tendon}
    names = [own for each in found.values() for own in each]
    double = next((own for own in names if names.count(own) > 1), None)
    if double is not None:
        raise wrong(f"tendons.{double}", "a copy of another tendon is called so. Choose another name.")
    return found


def on_all_tendons(written: Mapping[str, TendonDescription], found: TendonCopies, path: str) -> tuple[str, ...]:
    """Return the paths that a path of a tendon as written stands for: one on each copy, or itself."""
    group, _, rest = path.partition(".")
    name, _, rest = rest.partition(".")
    if group != "tendons" or name not in found or name in found[name]:
        return (path,)
    field, _, inner = rest.partition(".")
    part, dot, inner = inner.partition(".")
    if field == "over" and part in written[name].over:
        place = [*written[name].over].index(part)
        return tuple(f"tendons.{own}.over.{[*one.over][place]}{dot}{inner}" for own, one in found[name].items())
    return tuple(f"tendons.{own}.{rest}" for own in found[name])


def check_tendon(own: str, tendon: TendonDescription, parts: Mapping[str, Limb]) -> None:
    """Raise the error of a tendon called `own` that does not fit its parts."""
    with inside(f"tendons.{own}"):
        for part in tendon.over:
            field = f"over.{part}"
            if part not in parts:
                raise wrong(field, f'there is no part "{part}".{did_you_mean(part, parts)}')
            joint = parts[part].joint
            if not isinstance(joint, RevoluteJoint):
                raise wrong(field, f"{part} has a {joint.kind} joint: tendons run over hinges. Leave the part out.")
            _check_range(field, tendon.over[part], joint)
        pull = tendon.pulled_by
        if pull is None:
            return
        if pull.part not in parts:
            raise wrong("pulled_by.part", f'there is no part "{pull.part}".{did_you_mean(pull.part, parts)}')
        if pull.part in tendon.over:
            raise wrong("pulled_by.part", f"the tendon runs over {pull.part} already. Let another part pull it.")
        needed = PrismaticJoint if pull.ratio is not None else RevoluteJoint
        if not isinstance(parts[pull.part].joint, needed):
            kind = parts[pull.part].joint.kind
            way = next(name for name in _WAYS if getattr(pull, name) is not None)
            why = f"goes with a {'slide' if way == 'ratio' else 'hinge'}; {pull.part} has a {kind} joint."
            raise wrong(f"pulled_by.{way}", f"{why} Hinges pull by a radius or a crank, slides by a ratio.")


def _check_range(field: str, arm: float | TendonGuides, joint: RevoluteJoint) -> None:
    """Raise the error of holes whose cord is beyond the axis where the joint starts."""
    if isinstance(arm, TendonGuides) and not arm.range[0] < joint.position < arm.range[1]:
        low, high = map(math.degrees, arm.range)
        words = f"the joint starts at {math.degrees(joint.position):.4g} deg, where the cord is beyond the axis."
        raise wrong(field, f"{words} Between these holes it turns the part from {low:.4g} to {high:.4g} deg.")
