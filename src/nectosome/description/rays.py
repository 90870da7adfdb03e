"""Rays: the fin of a knifefish, a cuttlefish or a ray as servos in a row, with a web between them, in one group."""

import math
from collections.abc import Mapping, Sequence
from itertools import accumulate, chain, pairwise
from typing import Annotated, Literal, NamedTuple, Self

from pydantic import Field, model_validator

from nectosome.description import fields
from nectosome.description.fields import ZERO, Name, Place
from nectosome.description.joints import RevoluteJoint
from nectosome.description.orientation import Vector, applied, reflection, to_rpy
from nectosome.description.parts import Limb, Rigid
from nectosome.description.signal_contract import of_quantity
from nectosome.description.signals import Envelope, RaySignal
from nectosome.description.webs import WebDescription, WebSheet
from nectosome.io.schema.described import Described, inside, wrong
from nectosome.io.schema.quantity import Quantity

FixedPlace = Annotated[float, Quantity("length", fixed=True)]
Line = Annotated[tuple[tuple[FixedPlace, FixedPlace, FixedPlace], ...], Field(min_length=2, max_length=1000)]


class FinWave(Described):
    """A wave along a fin: the ray at the place x, from 0 to 1, turns to `offset + e(x) amplitude sin(2 pi (frequency t
    - waves x) + phase)`."""

    amplitude: fields.Angle
    """Largest angle from the middle."""
    frequency: fields.Frequency
    """Number of cycles per second."""
    waves: fields.Number
    """Number of waves along the fin. Positive ones run from its first ray to the last, negative ones back; with 0 all
    rays swing together."""
    envelope: Envelope = (1.0,)
    """Numbers at places spread evenly from the first ray to the last, joined by straight lines, by which the amplitude
    is multiplied."""
    phase: fields.Angle = 0.0
    """Angle by which all rays are ahead."""
    offset: fields.Angle = 0.0
    """Middle of the motion."""
    ramp: fields.Duration = 0.0
    """Time in which the amplitude grows to its full size."""


class RaysDescription(Described):
    """Thin stiff rays in a row, each on a hinge that a servo moves, with a sheet between them.

    The rays of `fin` are limbs called `fin1`, `fin2`, ... and the sheet is a web called `fin`; of a mirrored fin they
    are `fin1_1`, `fin1_2`, ..., `fin2_1`, ..., and `fin1` and `fin2`.
    """

    on: Name = "body"
    """The part that they sit on: the body, or a limb that comes once."""
    at: Place = "tip"
    """Where on that part: its `tip`, its `root`, or the fraction of one of its marks."""
    count: Annotated[int, Field(strict=True, ge=2, le=100)]
    """Number of rays, on one side."""
    roots: Line
    """Line of the hinges, by points from there along the axes of the part, joined by straight lines: rays are spread
    evenly along it. A ray turns about this line, by the right hand; an image as an image does."""
    tips: Line
    """Line of the free ends of the rays, spread evenly in the same order."""
    mirror: Literal["x", "y", "z"] | None = None
    """The fin comes twice; the second is the image of the first in the plane normal to this axis."""
    radius: fields.Length
    """Radius of the rays, round bars."""
    density: fields.Density
    """Mass per volume of the rays."""
    motion: FinWave
    """The wave along the fin."""
    web: WebSheet
    """The sheet between the rays."""

    @model_validator(mode="after")
    def _rays_have_hinges(self) -> Self:
        for name in ("roots", "tips"):
            if any(math.dist(a, b) == 0 for a, b in pairwise(getattr(self, name))):
                raise wrong(name, "two points that follow each other are in one place. Leave one of them out.")
        for k, (root, tip, along) in enumerate(_rays(self)):
            ray = _less(tip, root)
            if math.hypot(*_cross(ray, along)) < 1e-6 * math.hypot(*ray):
                raise wrong(
                    "tips", f"ray {k + 1} has no length across the line of the roots. Move the tips away from it."
                )
        return self


class Expanded(NamedTuple):
    """What rays stand for, and the paths that each of theirs stands for."""

    limbs: dict[str, Limb]
    webs: dict[str, WebDescription]
    names: dict[str, tuple[tuple[str, ...], tuple[str, ...]]]  # of limbs and of webs, by that of rays or of one side

    def paths(self, path: str) -> tuple[str, ...]:
        """Paths of limbs and webs that one of rays stands for: `rays.fin.motion.waves`; of one side `rays.fin1...`."""
        group, _, rest = path.partition(".")
        name, _, rest = rest.partition(".")
        if group != "rays" or name not in self.names:
            return (path,)
        limbs, webs = self.names[name]
        if rest.startswith("web."):
            return tuple(f"webs.{web}.{rest.removeprefix('web.')}" for web in webs)
        return tuple(f"limbs.{limb}.{'joint.' * rest.startswith('motion.')}{rest}" for limb in limbs)


def expanded(rays: Mapping[str, RaysDescription], limbs: Mapping[str, Limb]) -> Expanded:
    """Return the limbs and webs of rays; `limbs` are those of the file. Raises the error of a field."""
    found = Expanded({}, {}, {})
    for name, fin in rays.items():
        with inside(f"rays.{name}"):
            _check_part(fin, limbs)
        sides = {name: name} if fin.mirror is None else {f"{name}{k}": f"{name}{k}_" for k in (1, 2)}
        names = {side: tuple(f"{start}{k + 1}" for k in range(fin.count)) for side, start in sides.items()}
        sheet = {key: getattr(fin.web, key) for key in WebSheet.model_fields}
        for number, (side, between) in enumerate(names.items()):
            if side in found.webs or not found.limbs.keys().isdisjoint(between):
                raise wrong(f"rays.{name}", "its parts are called as those of other rays. Choose another name.")
            found.limbs.update(zip(between, _side(fin, image=number > 0), strict=True))
            found.webs[side] = WebDescription.model_construct(between=between, **sheet)
            found.names[side] = between, (side,)
        found.names[name] = (tuple(chain.from_iterable(names.values())), tuple(names))
    return found


def _check_part(fin: RaysDescription, limbs: Mapping[str, Limb]) -> None:
    part = limbs.get(fin.on)
    while part is not None:
        if part.repeat is not None:
            raise wrong("on", f"{fin.on} comes several times. Put rays on what comes once, and mirror them.")
        part = limbs.get(part.on)


def _side(fin: RaysDescription, image: bool) -> list[Limb]:
    """Rays of one side of a fin."""
    flip = reflection(fin.mirror) if image and fin.mirror is not None else None
    made: list[Limb] = []
    for k, (root, tip, along) in enumerate(_rays(fin)):
        place = k / (fin.count - 1)
        if flip is not None:  # an axis that things turn about has the other sign in a mirror
            root, tip, along = applied(flip, root), applied(flip, tip), applied(flip, _less(ZERO, along))
        ray = _less(tip, root)
        x, z = _unit(ray), _unit(_across(along, ray))
        y = _cross(z, x)
        wave = {key: getattr(fin.motion, key) for key in FinWave.model_fields}
        motion = of_quantity(RaySignal, fields.Angle, motion=True).model_construct(kind="ray", place=place, **wave)
        made.append(
            Rigid.model_construct(
                kind="rigid",
                on=fin.on,
                at=fin.at,
                offset=root,
                rotation=to_rpy(((x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2]))),
                joint=RevoluteJoint.model_construct(kind="revolute", axis=(0.0, 0.0, 1.0), motion=motion),
                shape="cylinder",
                length=math.hypot(*ray),
                radius=fin.radius,
                density=fin.density,
            )
        )
    return made


def _rays(fin: RaysDescription) -> list[tuple[Vector, Vector, Vector]]:
    """Root, tip and direction of the line of the roots, of each ray."""
    roots, tips = (_spread(line, fin.count) for line in (fin.roots, fin.tips))
    ahead = [_less(after, before) for before, after in zip(roots, [*roots[1:], roots[-1]], strict=True)]
    behind = [_less(after, before) for before, after in zip([roots[0], *roots[:-1]], roots, strict=True)]
    along = [tuple(a + b for a, b in zip(one, other, strict=True)) for one, other in zip(ahead, behind, strict=True)]
    return [*zip(roots, tips, along, strict=True)]  # pyright: ignore[reportReturnType]


def _spread(line: Sequence[Vector], count: int) -> list[Vector]:
    """Return points at even distances along a line of straight pieces, ends included."""
    pieces = [math.dist(a, b) for a, b in pairwise(line)]
    until = [0.0, *accumulate(pieces)]
    found: list[Vector] = []
    for k in range(count):
        s = until[-1] * k / (count - 1)
        piece = max(i for i in range(len(pieces)) if until[i] <= s or i == 0)
        w = min((s - until[piece]) / pieces[piece], 1.0)
        x, y, z = ((1 - w) * a + w * b for a, b in zip(line[piece], line[piece + 1], strict=True))
        found.append((x, y, z))
    return found


def _less(a: Sequence[float], b: Sequence[float]) -> Vector:
    x, y, z = (i - j for i, j in zip(a, b, strict=True))
    return (x, y, z)


def _cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _unit(a: Sequence[float]) -> Vector:
    size = math.hypot(*a)
    return (a[0] / size, a[1] / size, a[2] / size)


def _across(a: Sequence[float], ray: Sequence[float]) -> Vector:
    """Return what of a vector is across a ray."""
    share = sum(i * j for i, j in zip(a, ray, strict=True)) / sum(i * i for i in ray)
    return _less(a, [share * i for i in ray])
