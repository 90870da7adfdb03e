"""Which load when: what a part is to the water by its shape and place, and the loads that fit there.

The table "Which load when" of docs/theory/water.md is made of `ROWS`; `check`, `show` and `periodic` name the same.
"""

import math
from collections.abc import Collection, Iterator, Mapping
from itertools import pairwise
from typing import NamedTuple, get_args

from nectosome.io.discovery import classes_below

from .fields import DIRECTIONS
from .joints import RevoluteJoint
from .left_open import CHAIN, THICK, driven, hinges_in_a_row
from .loads import LoadDescription
from .orientation import Matrix, Vector, applied, from_rpy, product, turn
from .parts import Limb, Rigid, Rod, SoftPlate

_ALONG = math.cos(math.radians(45.0))  # cosine of the angle within which an axis counts as ahead
_SLENDER = 0.5  # aspect ratio below which a fin is a body, as in the ranges of `foil`
_VISCOUS = 0.1  # Reynolds number below which the water's inertia does not count


class Row(NamedTuple):
    """A row of the table. Of each of its `needs` a part has one load of these kinds, the best one first."""

    part: str
    loads: str
    regime: str
    leaves_out: str
    needs: tuple[tuple[str, ...], ...]


_CARRIED = "added_mass", "cylinder_added_mass", "spheroid_added_mass", "mesh_added_mass", "given_added_mass"
_OF_A_HULL = "mesh_added_mass", "spheroid_added_mass", "cylinder_added_mass", "added_mass", "given_added_mass"
_ACROSS = "drag", "plate_drag"
_OF_A_BODY = ("added_mass",), _ACROSS, ("skin_friction", "drag")

ROWS = {
    "fin": Row(
        "a fin or wing whose span is more than about half of its chord, also one that flaps",
        "`foil`",
        "gentle fins to 6 %; thrust and power within a quarter from towing to mooring, with strokes of 0.75 chords and "
        "more (KC above 4.7); below that not known at high frequencies",
        "other parts' wakes",
        (("foil",),),
    ),
    "body": Row(
        "a body from head to tail, longer than high, that undulates: a rod, or a chain of boxes",
        "`added_mass`, `trailing_edge` at its tail, `drag` or `plate_drag`, `skin_friction`",
        "the tail within 30 deg of its path; else give it a tail fin with a `foil`",
        "vortices along its upper and lower edges, but for their drag",
        (*_OF_A_BODY, ("trailing_edge", "foil")),
    ),
    "finned body": Row(
        "the same, with a tail fin that is about as deep as high",
        "as above, and `foil` on the tail fin instead of `trailing_edge`",
        "as the fin above",
        "what the body's wake does to the fin",
        (*_OF_A_BODY, ("foil",)),
    ),
    "hull": Row(
        "a hull",
        "`mesh_added_mass` by panels, `spheroid_added_mass` or `given_added_mass`; `lumped_drag`",
        "steady drag: Reynolds numbers like those of its coefficient",
        "lift of the hull",
        (_OF_A_HULL, ("lumped_drag", "drag")),
    ),
    "paddle": Row(
        "a paddle that rows, a plate that starts, stops or turns back",
        "`plate_drag`, which has a `start_up` by default, `added_mass`",
        "strokes of KC above 1, hardly any speed ahead; where it also moves ahead take a `foil`, which has the same "
        "start-up, and lift",
        "where its vortices go",
        (("plate_drag", "foil"), ("added_mass", "foil")),
    ),
    "limb": Row(
        "a slender limb that moves across",
        "`drag`, `added_mass`",
        "strokes long against its thickness",
        "",
        ((*_ACROSS, "lumped_drag"), _CARRIED),
    ),
    "resting limb": Row(
        "a blade, an arm or a cable that rests in a stream",
        "`plate_drag` or `drag`, and `added_mass`, `separated` by itself",
        "a steady stream",
        "what vortices behind it do: no flutter",
        (("plate_drag", "drag", "lumped_drag"), _CARRIED),
    ),
    "soft plate": Row(
        "a fin that bends along and across, as a `soft_plate`",
        "`plate_drag`, which has a `start_up` by default, and `sheet_added_mass`",
        "slopes below about 0.5; bending whose sign changes along the plate carries less water",
        "suction at its edges and what its rear edge sheds",
        (("plate_drag",), ("sheet_added_mass",)),
    ),
    "thread": Row(
        "a helix or a thread at Reynolds numbers below about 0.1",
        "`stokes_drag`, nothing else",
        "Reynolds numbers below 0.1",
        "the water's inertia, walls",
        (("stokes_drag",),),
    ),
}
"""What parts there are, which loads fit them, in which regime, and what these leave out."""


class PartInWater(NamedTuple):
    """What a part is to the water, with the robot at rest."""

    row: str  # of `ROWS`
    normal: int | None  # axis across a flat part, of x, y, z; None of a round one
    span: int  # axis along its span
    ahead: str | None  # direction along its chord, as in "-x"; None where that does not lie ahead
    last: bool  # whether nothing sits on it that is in the water
    sizes: tuple[float, float, float]  # along its axes, means along a rod [m]

    @property
    def along(self) -> int:
        """Axis of the length of its Reynolds and Keulegan-Carpenter numbers: the chord of a fin, else the height."""
        if self.row == "fin" and self.ahead is not None:
            return "xyz".index(self.ahead[-1])
        return 1 if self.sizes[1] > self.sizes[2] else 2

    @property
    def chord(self) -> float:
        """That length [m]."""
        return self.sizes[self.along]


def parts_in_water(
    parts: Mapping[str, Limb], forward: str, in_stream: bool, pulled: Collection[str]
) -> dict[str, PartInWater]:
    """What each part is to the water; points, which have no size, are left out.

    By its shape, by the hinges on its way, by what drives it, and by which of its axes lies along the first part's axis
    `forward`. `pulled` are the parts over whose joints a tendon is pulled.
    """
    hinges, attitudes, moved = hinges_in_a_row(parts), _attitudes(parts), set(_moved(parts, pulled))
    first = next(iter(parts))
    ahead = applied(attitudes[first], DIRECTIONS[forward])
    found = dict[str, PartInWater]()
    for name, part in reversed([*parts.items()]):  # what sits on others comes first
        if isinstance(part, SoftPlate):
            thin = PartInWater("soft plate", 2, 0, None, True, part.mean_sizes)
            found[name] = thin._replace(last=all(limb.on != name for limb in parts.values()))
        elif isinstance(part, Rod) or part.form != "point":
            own = applied(_transposed(attitudes[name]), ahead)
            on_it = [found[other].row for other, limb in parts.items() if limb.on == name and other in found]
            piece = _alone(part, own)
            row = _row(part, piece, abs(own[0]) >= _ALONG and hinges[name] >= CHAIN, name == first, on_it)
            if in_stream and name not in moved and _is_held(name, parts):
                row = row if row == "hull" else "resting limb"
            found[name] = piece._replace(row=row, last=not on_it)
    return {name: found[name] for name in parts if name in found}


def _row(part: Rigid | Rod, alone: PartInWater, in_chain: bool, is_first: bool, on_it: list[str]) -> str:
    """The row of a part that moves; `on_it` are those of what sits on it."""
    carries = in_chain and any(row in ("fin", "body", "finned body") for row in on_it)
    if is_first and isinstance(part, Rigid) and not (alone.normal and carries):
        return "hull"
    if is_first or carries:
        return "finned body" if any(row in ("fin", "finned body") for row in on_it) else "body"
    return "hull" if alone.normal is None and isinstance(part, Rigid) and part.joint.kind == "fixed" else alone.row


def _alone(part: Rigid | Rod, ahead: Vector) -> PartInWater:
    """A part by itself: a limb; where it is flat a paddle, a fin, or the end of a body."""
    sizes = _sizes(part)
    ways = ["-" * (ahead[k] < 0) + "xyz"[k] for k in range(3)]
    if min(sizes[1:]) >= THICK * max(sizes[1:]):
        return PartInWater("limb", None, 0, ways[0] if abs(ahead[0]) >= _ALONG else None, True, sizes)
    normal = 1 if sizes[1] < sizes[2] else 2
    if abs(ahead[normal]) >= _ALONG:
        return PartInWater("paddle", normal, 0, None, True, sizes)
    chord, span = sorted((0, 3 - normal), key=lambda k: -abs(ahead[k]))
    area = getattr(part.own_shape, "area", None) if isinstance(part, Rigid) else None
    ratio = sizes[span] / (sizes[chord] if area is None else area / sizes[span])
    is_fin = ratio >= _SLENDER and (isinstance(part, Rigid) or span == 0)  # a foil runs along its rod
    return PartInWater("fin" if is_fin else "body", normal, span, ways[chord], True, sizes)


def _sizes(part: Rigid | Rod) -> tuple[float, float, float]:
    if isinstance(part, Rod):
        names = ("radius", "radius") if part.section == "circle" else ("width", "height")
        across = [(2.0 if part.section == "circle" else 1.0) * _mean(part.sections(name)) for name in names]
        return part.length, across[0], across[1]
    if part.radius is not None:
        return part.length or 2 * part.radius, 2 * part.radius, 2 * part.radius
    return part.size("length") or 0.0, part.size("width") or 0.0, part.size("height") or 0.0


def _mean(sections: list[tuple[float, float]]) -> float:
    """Mean size of sections along a rod."""
    return sum((b - a) * (x + y) / 2 for (a, x), (b, y) in pairwise(sections))


def _attitudes(parts: Mapping[str, Limb]) -> dict[str, Matrix]:
    """Rotation of each part into the world, its hinges in the middle of their motions."""
    found = dict[str, Matrix]()
    for name, part in parts.items():
        own = from_rpy(part.rotation)
        if isinstance(part.joint, RevoluteJoint):
            middle = part.joint.position if part.joint.motion is None else getattr(part.joint.motion, "offset", 0.0)
            own = product(own, turn(part.joint.axis, middle))
        found[name] = product(found[part.on], own) if part.on in found else own
    return found


def _transposed(a: Matrix) -> Matrix:
    x, y, z = zip(*a, strict=True)
    return x, y, z


def _moved(parts: Mapping[str, Limb], pulled: Collection[str]) -> Iterator[str]:
    """Parts that a drive moves, by their own joint or by one on their way."""
    moved = set[str]()
    for name, part in parts.items():
        pushed = getattr(part.joint, part.joint.drive_field, None) is not None
        if driven(part) or pushed or name in pulled or part.on in moved:
            moved.add(name)
            yield name


def _is_held(name: str, parts: Mapping[str, Limb]) -> bool:
    """Whether fixed joints and hinges hold a part in the world."""
    part = parts[name]
    turns = part.joint.kind in ("fixed", "revolute", "spherical")
    return turns and (part.on not in parts or part.on == name or _is_held(part.on, parts))


def load_kinds() -> dict[str, type[LoadDescription]]:
    """All kinds of loads by their names in a file."""
    every = classes_below(LoadDescription)
    return {kind: load for load in every for kind in get_args(load.model_fields["kind"].annotation)}


def fitting(form: str, row: str, last: bool) -> list[tuple[str, ...]]:
    """Kinds of loads that fit a part of a row, for each need those that act on its form, "rod" of a rod.

    What a tail sheds is that of the `last` part of a body.
    """
    known, needs = load_kinds(), ROWS[row].needs
    if row in ("body", "finned body") and not last:
        needs = needs[:-1]
    acting = [tuple(kind for kind in kinds if known[kind].acts_on(form)) for kinds in needs]
    return [kinds for kinds in acting if kinds]


def lacking(part: Limb, row: str, last: bool) -> tuple[list[tuple[str, ...]], list[tuple[str, ...]]]:
    """Kinds of loads that fit a part, for each need, and those of them that it has none of."""
    has = {load.kind for load in part.loads.values()}
    fits = fitting("rod" if isinstance(part, Rod) else part.form, row, last)
    return fits, [kinds for kinds in fits if not has & {*kinds}]


def in_regime(row: str, reynolds: float) -> str:
    """The row of a part by the Reynolds number of its diameter, which may be NaN: threads know no inertia."""
    return "thread" if row in ("limb", "body") and reynolds < _VISCOUS else row


def in_words(needs: list[tuple[str, ...]]) -> str:
    """The best kind of load for each need."""
    return ", ".join(dict.fromkeys(kinds[0] for kinds in needs))
