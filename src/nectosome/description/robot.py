"""The description of a robot: its parts, the water around it, and its quantities by path or by short name."""

from collections.abc import Mapping
from functools import partial
from itertools import chain
from typing import Annotated, Any, Self

from pydantic import BaseModel, Field, model_validator

from nectosome.description import fields
from nectosome.description.auto_loads import with_auto_loads
from nectosome.description.copies import BODY, on_all_copies, spread
from nectosome.description.cranks import CrankLoad
from nectosome.description.drives import BatteryDescription, MotorDescription
from nectosome.description.fields import AliasName, Direction, Name, listed
from nectosome.description.left_open import with_fins, with_separation, with_start_ups
from nectosome.description.own_rows import check_row
from nectosome.description.pairs import PairDescription, check_pair
from nectosome.description.parts import Limb, Powered, Rod
from nectosome.description.rays import RaysDescription, expanded
from nectosome.description.rod_fields import Losses
from nectosome.description.tendons import TendonDescription, check_tendon, on_all_tendons, on_each_copy
from nectosome.description.water import WaterDescription
from nectosome.description.webs import WebDescription, check_webs, on_all_limbs
from nectosome.description.which_load import PartInWater, parts_in_water
from nectosome.io.schema.described import Described, OneOf, OneOrMany, wrong
from nectosome.io.schema.quantity import Quantity
from nectosome.io.schema.structure import at_path, changed, decider, numeric_paths, value_at
from nectosome.units import InputError, did_you_mean, kind_of, shorten


def check_description(given: Any) -> None:
    """Raise InputError unless `given` is a description."""
    if not isinstance(given, RobotDescription):
        raise InputError(
            f"{kind_of(given)} is given where a robot's description is expected. ns.describe gives that of a name or a "
            "path, and takes settings; a built robot has one as its attribute description."
        )


class ReferenceDescription(Described):
    """What a swimmer is measured by, whatever hangs on it besides."""

    length: fields.Length | None = None
    """Length of the body, for body lengths per second and the stride length. Without it, the extent of the robot along
    its forward axis at the start, with rods unbent."""
    tail: str | None = None
    """Part whose rearmost end the tail amplitude and the Strouhal number are of, as `limbs.tail`. Without it, the
    rearmost end of the robot."""


class Correlation(Described):
    """How the errors of two numbers with +- go together, as `identify` finds it."""

    between: tuple[str, str]
    """Paths or short names of the two numbers."""
    value: Annotated[float, Quantity("number", minimum=-1, maximum=1, fixed=True)]
    """Their correlation."""


class RobotDescription(Described):
    """A robot in water. The numbers are SI floats; each has a path such as `limbs.filament.young`.

    Limbs that come several times stand here each on its own: a path of the limb as it was written, in an alias, is that
    of all its copies.
    """

    name: Annotated[str, Field(min_length=1, max_length=100)]
    """Name of the robot; it stands in results and on pages."""
    about: str = ""
    """What the robot is and where its numbers come from, in sentences."""
    water: WaterDescription = WaterDescription()
    """The water around the robot, with gravity, surface, floor, walls and current."""
    forward: Direction = "x"
    """Axis of the body, or of the first limb where there is no body, that points ahead: the speed along it has the sign
    plus. A fish that is one rod from its head to its tail has -x."""
    reference: ReferenceDescription = ReferenceDescription()
    """What a swimmer is measured by: the length of its body, and its tail."""
    body: Limb | None = None
    """The part that all others hang on. Without it, limbs sit on the world."""
    limbs: dict[Name, Limb] = Field(default_factory=dict)
    """The other parts, by name. Each sits on the body, on a limb before it, or on the world."""
    rays: dict[Name, RaysDescription] = Field(default_factory=dict)
    """Fins of rays in a row with a sheet between them, by name: each stands for its limbs and its web."""
    webs: dict[Name, WebDescription] = Field(default_factory=dict)
    """Soft sheets between neighbouring limbs, by name: of bells, rays, webbed arms."""
    pairs: dict[Name, Annotated[PairDescription, OneOf()]] = Field(default_factory=dict)
    """What acts between two parts, by name: bushings, which close loops, and contacts."""
    tendons: dict[Name, TendonDescription] = Field(default_factory=dict)
    """Tendons over hinges of several parts, by name. Those inside a rod are among its loads."""
    batteries: dict[Name, BatteryDescription] = Field(default_factory=dict)
    """Batteries, by name: each supplies the drives that name it, and sags with their current."""
    aliases: dict[AliasName, Annotated[tuple[str, ...], Field(min_length=1), OneOrMany()]] = Field(default_factory=dict)
    """Short names for one path, as in `E: limbs.tail.young`, or for a list of paths that are set together: quantities
    of one kind, or choices such as the models of servos."""

    correlations: tuple[Correlation, ...] = ()
    """Correlations of numbers with +-, as `identify --write` writes them: `--spread` takes them into account."""

    def __repr__(self) -> str:
        short = ", ".join(self.aliases)
        return f"<RobotDescription {self.name}: parts {', '.join(self.parts)}; short names {short or 'none'}>"

    __str__ = __repr__

    @property
    def parts(self) -> dict[str, Limb]:
        """The body, where there is one, and the limbs, by name; those that others sit on come first."""
        return self.limbs if self.body is None else {BODY: self.body, **self.limbs}

    @property
    def carriers(self) -> dict[str, Limb | WebDescription]:
        """All that the water acts on, by name: the parts, then the webs between them."""
        return {**self.parts, **self.webs}

    @property
    def powered(self) -> dict[str, Powered]:
        """The drives with motors and their paths, by the coordinate that each one moves: `arm.angle`."""
        return {
            f"{name}.{coordinate}": Powered(f"{self.place_of(name)}.{path}", drive)
            for name, part in self.parts.items()
            for coordinate, (path, drive) in part.powered.items()
        }

    @property
    def number_aliases(self) -> dict[str, tuple[str, ...]]:
        """Aliases of quantities, without those of choices."""
        return {name: paths for name, paths in self.aliases.items() if not is_choice(paths[0], self)}

    def with_part(self, name: str, **fields: Any) -> Self:
        """Return the robot with other fields of one part; they are not checked."""
        part = self.parts[name].model_copy(update=fields)
        return self.model_copy(update={BODY: part} if name == BODY else {"limbs": {**self.limbs, name: part}})

    def place_of(self, part: str) -> str:
        """Return the path of a part or a web: `body`, `limbs.tail`, `webs.bell`."""
        return BODY if part == BODY else f"webs.{part}" if part in self.webs else f"limbs.{part}"

    def supply_voltage(self, drive: MotorDescription) -> float | None:
        """Return the voltage of the supply of a drive, or of its battery without a current [V]; None without either."""
        return drive.supply if drive.battery is None else self.batteries[drive.battery].voltage

    @model_validator(mode="after")
    def _limbs_stand_alone(self) -> Self:
        if self.body is None and not self.limbs:
            raise wrong("body", "is missing. Give a body, or limbs that sit on the world.")
        for name in ("on", "at", "repeat"):
            if self.body is not None and name in self.body.model_fields_set:
                raise wrong(f"body.{name}", "the body is what all else hangs on, it sits on nothing. Leave it out.")
        self._rays_are_limbs()
        water, viscosity = self.water, self.water.viscosity / self.water.density
        among = self.forward, water.streams, self._pulled
        body, written = with_auto_loads(self.body, self.limbs, *among, viscosity)
        for field, value in {BODY: body, "limbs": written}.items():
            object.__setattr__(self, field, value)
        limbs, copies = spread(self.body, self.limbs)
        object.__setattr__(self, "webs", on_all_limbs(self.webs, self.limbs, copies))
        tendons = on_each_copy(self.tendons, copies)
        if limbs == self.limbs:
            return self
        aliases = {}
        for name, paths in self.aliases.items():
            try:
                of_limbs = chain.from_iterable(on_all_copies(self.body, self.limbs, path) for path in paths)
                every = [on_all_tendons(self.tendons, tendons, path) for path in of_limbs]
            except ValueError as error:
                raise wrong(f"aliases.{name}", str(error)) from None
            aliases[name] = tuple(chain.from_iterable(every))
        alone = {own: tendon for each in tendons.values() for own, tendon in each.items()}
        for field, value in {"limbs": limbs, "tendons": alone, "aliases": aliases}.items():
            object.__setattr__(self, field, value)  # what was written is of no use from here on
        return self

    def _rays_are_limbs(self) -> None:
        """Put limbs and webs in the place of rays."""
        found = expanded(self.rays, self.limbs)
        for field, made in (("limbs", found.limbs), ("webs", found.webs)):
            taken = next((name for name in made if name in getattr(self, field)), None)
            if taken is not None:
                raise wrong(f"{field}.{taken}", "rays have a part of this name. Choose another name.")
            object.__setattr__(self, field, {**getattr(self, field), **made})
        aliases = {name: tuple(chain.from_iterable(map(found.paths, paths))) for name, paths in self.aliases.items()}
        object.__setattr__(self, "aliases", aliases)
        object.__setattr__(self, "rays", {})

    @property
    def in_water(self) -> dict[str, PartInWater]:
        """What each part is to the water, by its shape and its place."""
        return parts_in_water(self.parts, self.forward, self.water.streams, self._pulled)

    @property
    def _pulled(self) -> set[str]:
        """Parts over whose joints a tendon is pulled."""
        return {name for tendon in self.tendons.values() if tendon.pulled_by is not None for name in tendon.over}

    @model_validator(mode="after")
    def _what_is_left_open_is_known(self) -> Self:
        separation = partial(with_separation, in_stream=self.water.streams, pulled=self._pulled)
        for decided in (with_fins, with_start_ups, separation):
            parts = decided(self.parts)
            for field, value in {BODY: parts.pop(BODY, self.body), "limbs": {**self.limbs, **parts}}.items():
                object.__setattr__(self, field, value)
        return self

    @model_validator(mode="after")
    def _tail_is_a_part(self) -> Self:
        known = [self.place_of(part) for part in self.parts]
        tail = self.reference.tail
        if tail is not None and tail not in known:
            hint = did_you_mean(tail, known) or f" Parts: {', '.join(known)}."
            raise wrong("reference.tail", f"there is no part {shorten(tail)}.{hint}")
        return self

    @model_validator(mode="after")
    def _rows_are_apart(self) -> Self:
        for part, limb in self.carriers.items():
            for name, load in limb.loads.items():
                check_row(f"{self.place_of(part)}.loads", name, load.kind)
        for field in ("pairs", "tendons"):
            for name in getattr(self, field):
                check_row(field, name)
        return self

    @model_validator(mode="after")
    def _tendons_are_over_parts(self) -> Self:
        for name, tendon in self.tendons.items():
            if name in self.pairs or any(name in part.loads for part in self.carriers.values()):
                what = "pair" if name in self.pairs else "load"
                why = f"a {what} is called {name} too, and results tell them apart by name. Choose another name."
                raise wrong(f"tendons.{name}", why)
            check_tendon(name, tendon, self.parts)
        return self

    @model_validator(mode="after")
    def _webs_join_parts(self) -> Self:
        check_webs(self.webs, self.parts)
        return self

    @model_validator(mode="after")
    def _pairs_are_of_parts(self) -> Self:
        for name, pair in self.pairs.items():
            check_pair(name, pair, self.parts)
        return self

    @model_validator(mode="after")
    def _hinges_turn_cranks(self) -> Self:
        for name, part in self.parts.items():
            for key, load in part.loads.items():
                if not isinstance(load, CrankLoad) or load.turned_by is None:
                    continue
                field, turned_by = f"{self.place_of(name)}.loads.{key}.turned_by", load.turned_by
                if turned_by not in self.parts:
                    raise wrong(field, f'there is no part "{turned_by}".{did_you_mean(turned_by, self.parts)}')
                kind = self.parts[turned_by].joint.kind
                if kind != "revolute":
                    why = f"{turned_by} sits on a {kind} joint. A crank is turned by a part on a revolute joint."
                    raise wrong(field, why)
        return self

    @model_validator(mode="after")
    def _batteries_supply_drives(self) -> Self:
        used = set()
        for path, drive in self.powered.values():
            if drive.battery is None:
                continue
            if drive.battery not in self.batteries:
                known = did_you_mean(drive.battery, self.batteries) or " Describe it under batteries."
                raise wrong(f"{path}.battery", f'there is no battery "{drive.battery}".{known}')
            used.add(drive.battery)
        for name in self.batteries:
            if name not in used:
                raise wrong(f"batteries.{name}", "no drive names this battery. Leave it out, or name it in a drive.")
        return self

    @model_validator(mode="after")
    def _aliases_lead_somewhere(self) -> Self:
        known = numeric_paths(self)
        for name, paths in self.aliases.items():
            if all(is_choice(path, self) for path in paths):
                continue
            for path in paths:
                if path not in known:
                    why = why_without_effect(self, path)
                    hint = f'"{path}" {why}' if why else f'"{path}" is no quantity of this robot.'
                    raise wrong(f"aliases.{name}", hint + ("" if why else did_you_mean(path, known)))
            if len({known[path].dimension for path in paths}) > 1:
                raise wrong(f"aliases.{name}", "these paths are quantities of different kinds.")
        return self

    @model_validator(mode="after")
    def _correlations_are_of_numbers(self) -> Self:
        known, taken = numeric_paths(self), set[frozenset[str]]()
        for k, pair in enumerate(self.correlations):
            if len({*pair.between}) < 2 or frozenset(pair.between) in taken:
                why = "is of two different numbers, and each pair is told once."
                raise wrong(f"correlations.{k}.between", why)
            taken.add(frozenset(pair.between))
            for name in pair.between:
                if name not in self.number_aliases and name not in known:
                    why = f"there is no quantity called {shorten(name)}.{did_you_mean(name, [*self.aliases, *known])}"
                    raise wrong(f"correlations.{k}.between", why)
        return self


def is_choice(name: str, description: RobotDescription) -> bool:
    """Return whether a path or an alias is that of texts or switches of the robot: `body.joint.servo.model`."""
    here, value = at_path(description, description.aliases.get(name, (name,))[0])
    return here is not None and here.quantity is None and isinstance(value, str | bool)


def resolve(description: RobotDescription, name: str) -> list[str]:
    """Return the paths that an alias stands for, or the path itself. Raises InputError for an unknown name."""
    if name in description.aliases and not is_choice(name, description):
        return list(description.aliases[name])
    here, value = at_path(description, name)
    beyond = value is None and name[-1:].isdigit()  # of a row
    if here is not None and here.quantity is not None and not isinstance(value, BaseModel) and not beyond:
        why = why_without_effect(description, name)
        if value is None:
            why = "is left out here, so that other fields say what it would. Give it in the file or by --set first."
        elif not here.varies:
            why = "does not vary: what follows from it is computed when the file is read. Change it there, or by --set."
        if not why:
            return [name]
        raise InputError(why, field=name)
    known = numeric_paths(description)
    near = did_you_mean(name, [*description.number_aliases, *known])
    raise InputError(f'there is no quantity called "{shorten(name)}" in {description.name}.{near}')


def why_without_effect(description: RobotDescription, path: str) -> str:
    """Return what decides the quantity at a path in its place, and which paths to take instead; empty where none."""
    by = decider(description, path)
    if by is None:
        return ""
    others = [other for other in numeric_paths(description) if f"{other}.".startswith(f"{by}.")]
    more = f" Take {listed(tuple(others[:4]), 'or')}." if others else ""
    return f"has no effect here: {by} decides it.{more}"


def get_value(description: RobotDescription, name: str) -> Any:
    """Return the SI value at a path or alias; an alias of several paths gives that of the first. Raises InputError."""
    return value_at(description, resolve(description, name)[0])


def check_numbers(description: RobotDescription) -> None:
    """Raise InputError where numbers that were put in make a motor that gives more than it takes, what relaxes gain, or
    the wall of a rod leave no room inside.

    Those of a file are checked when it is read.
    """
    for path, drive in description.powered.values():
        if drive.beyond_energy is not None:
            field, why = drive.beyond_energy
            raise InputError(why, field=f"{path}.{field}")
    for name, part in description.parts.items():
        if isinstance(part, Rod) and isinstance(part.damping, Losses) and part.damping.beyond is not None:
            field, why = part.damping.beyond
            raise InputError(why, field=f"{description.place_of(name)}.damping.{field}")
        if isinstance(part, Rod) and part.beyond is not None:
            field, why = part.beyond
            raise InputError(why, field=f"{description.place_of(name)}.{field}")


def with_values(description: RobotDescription, values: Mapping[str, Any]) -> RobotDescription:
    """Return a copy with SI values put at paths or aliases. They are not checked, so that they may be JAX tracers.

    Raises InputError for an unknown name.
    """
    return changed(description, {path: value for name, value in values.items() for path in resolve(description, name)})
