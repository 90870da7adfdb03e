"""Webs: soft sheets between neighbouring limbs."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, PrivateAttr

from nectosome.description.copies import Copies
from nectosome.description.drag import PlateDragLoad, StartUp
from nectosome.description.fields import Density, Length, Name, NonNegativeNumber, Pressure
from nectosome.description.loads import WEB, BellJetLoad, LoadDescription
from nectosome.description.orientation import Matrix
from nectosome.description.parts import Limb, Rod, SoftPlate
from nectosome.description.ranges import BENT, YIELDS
from nectosome.io.schema.described import Described, OneOf, OneOrMany, Uncertainty, inside, wrong
from nectosome.units import did_you_mean


class WebSheet(Described):
    """The sheet of a web: what it is made of, and what the water does to it."""

    root: Literal["open", "closed"] | None = None
    """Whether water can pass around its edge at the roots of the limbs, or a body closes it there. Left out: closed
    where the web is, as in a bell."""
    thickness: Length
    """Thickness of the sheet."""
    young: Pressure
    """Young's modulus of the material."""
    density: Density
    """Mass per volume of the material."""
    slack: NonNegativeNumber = 0.0
    """How much wider the sheet is than the gaps at the start, with rods unbent, as a share of these."""
    loads: dict[Name, Annotated[LoadDescription, OneOf(lambda load: WEB in load.on)]] = Field(default_factory=dict)
    """What the water does to it, by name: plate_drag, sheet_added_mass, and in a ring bell_jet."""


class WebDescription(WebSheet):
    """A soft sheet between neighbouring limbs, from their roots to their tips.

    Each of its gaps is straight across from the edge of one limb to that of the next. It has mass and buoyancy, and a
    tension across where it is wider than unstressed; it folds without a force, and nothing bends it.
    """

    between: Annotated[tuple[Name, ...], Field(min_length=1, max_length=100), OneOrMany()]
    """Limbs that it joins, in the order in which they stand side by side; or one that comes several times, for all its
    copies."""
    closed: bool | None = None
    """Whether it also joins the last limb and the first. Left out: if they are the copies of one that goes around an
    axis."""
    _turn: Matrix | None = PrivateAttr(default=None)
    shape: ClassVar[str] = WEB
    spreads: ClassVar = {
        "young": Uncertainty(0.8, 1.25, "data sheets of silicones and plastics, chosen", BENT, law=YIELDS),
        "density": Uncertainty(0.97, 1.03, "fillers and pores, chosen", "weigh it in air and in water"),
    }

    @property
    def turn(self) -> Matrix | None:
        """Of a ring with one limb for all, as no file has it: what takes a limb to the next, first part's frame."""
        return self._turn

    def with_one_limb(self, turn: Matrix) -> Self:
        """Return a ring of which one limb is there for all, which do the same; `between` still has their names."""
        one = self.model_copy()
        one._turn = turn
        return one

    @property
    def gaps(self) -> tuple[tuple[str, str], ...]:
        """Names of the two limbs of each gap."""
        return (*pairwise(self.between), *((self.between[-1], self.between[0]),) * bool(self.closed))


def on_all_limbs(
    webs: Mapping[str, WebDescription], limbs: Mapping[str, Limb], copies: Copies
) -> dict[str, WebDescription]:
    """Return webs with all their limbs by name and nothing left open. `limbs` are as written. Raises field errors."""
    found = dict[str, WebDescription]()
    for name, web in webs.items():
        first = web.between[0]
        if len(web.between) > 1:
            names, around = web.between, False
        else:
            names = tuple(copy.name for copy in copies.get(first, ()))
            repeat = limbs[first].repeat if first in limbs else None
            around = repeat is not None and repeat.around is not None
        closed = around if web.closed is None else web.closed
        root = ("closed" if closed else "open") if web.root is None else web.root
        drags = {key: load for key, load in web.loads.items() if isinstance(load, PlateDragLoad)}
        starting = {key: load.with_start_up(StartUp()) for key, load in drags.items() if load.leaves_start_up_open}
        decided = {"between": names or web.between, "closed": closed, "root": root, "loads": {**web.loads, **starting}}
        found[name] = web.model_copy(update=decided)
    return found


def check_webs(webs: Mapping[str, WebDescription], parts: Mapping[str, Limb]) -> None:
    """Raise the error of a field of a web that does not fit the parts."""
    for name, web in webs.items():
        if name in parts:
            raise wrong(f"webs.{name}", f"a limb is called {name} too, and results tell them apart by name.")
        with inside(f"webs.{name}"):
            _check_limbs(web.between, parts)
            if web.closed and len(web.between) < 3:
                raise wrong("closed", "a ring has three limbs or more. Name more limbs, or write closed: false.")
            for key, load in web.loads.items():
                with inside(f"loads.{key}"):
                    load.check(WEB)
                    if isinstance(load, BellJetLoad) and not web.closed:
                        raise wrong("kind", "bell_jet needs a ring of limbs, and this web is open: closed: true.")


def _check_limbs(between: Sequence[str], parts: Mapping[str, Limb]) -> None:
    for limb in between:
        if limb not in parts:
            raise wrong("between", f'there is no limb "{limb}".{did_you_mean(limb, parts)}')
        if isinstance(parts[limb], SoftPlate):
            raise wrong("between", f"{limb} is a soft plate. A web joins rods, or rigid bodies with a length.")
        if parts[limb].length is None:
            why = "has no length along which a web could lie. Join rods, or rigid bodies with a length."
            raise wrong("between", f"{limb} {why}")
        if between.count(limb) > 1:
            raise wrong("between", f"{limb} stands twice. Name each limb once; closed: true makes a ring.")
    if len(between) < 2:
        raise wrong("between", f"{between[0]} comes once: a web joins two limbs or more. Name another limb.")
    rods = [(name, part) for name in between if isinstance(part := parts[name], Rod)]
    for name, rod in rods[1:]:
        _, other = rods[0]
        if rod.steps != other.steps:
            raise wrong("between", f"{name} and {rods[0][0]} change abruptly at other places. Let their tables agree.")
        if (rod.points, rod.marks) != (other.points, other.marks):
            each = (f"{own} has {one.points} points, marks {[*one.marks]}" for own, one in (rods[0], (name, rod)))
            raise wrong("between", f"{'; '.join(each)}. Give the rods of a web the same points and marks.")
