"""Loads of one kind together: one vectorised call gives the forces of all, and constant indices say where they act."""

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from nectosome.core import (
    CrankState,
    Flow,
    Gaps,
    JointLoad,
    Load,
    PairLoad,
    ReshapingLoad,
    RodLoad,
    SectionedLoad,
    State,
    Strips,
    Water,
)
from nectosome.core.rows import Spread, alike, joined, part_of, rows
from nectosome.description.own_rows import OWN_ROWS
from nectosome.units import InputError, kind_of

from .tendons import JointTendon, TendonGroup
from .tree import PartShape, Tree

AnyLoad = Load | JointLoad | RodLoad | PairLoad
_BASES = (Load, JointLoad, RodLoad, PairLoad)
_MOVING = ("rotation", "position", "angular_velocity", "velocity")


class Attached(eqx.Module):
    """A load and the part on whose stations or joint it acts."""

    name: str = eqx.field(static=True)
    part: int = eqx.field(static=True)
    load: Load | JointLoad | RodLoad
    crank: int = eqx.field(static=True, default=-1)  # part whose hinge turns its crank; -1: none


class Paired(eqx.Module):
    """A load between two parts."""

    name: str = eqx.field(static=True)
    parts: tuple[int, int] = eqx.field(static=True)
    load: PairLoad


class LoadGroup(eqx.Module):
    """Loads of one kind, with their indices among all loads, their names and parts."""

    members: tuple[int, ...] = eqx.field(static=True)
    names: tuple[str, ...] = eqx.field(static=True)
    parts: tuple[Any, ...] = eqx.field(static=True)  # an index each; two of a pair
    load: Any  # stacked
    cranks: tuple[int, ...] = eqx.field(static=True, default=())  # parts whose hinges turn their cranks; () without

    @property
    def one_sided(self) -> bool:
        """Whether the loads have gaps."""
        return all(type(self.load).gaps is not base.gaps for base in _BASES if isinstance(self.load, base))

    @property
    def holds(self) -> bool:
        """Whether the loads hold parts apart, or off a wall or the floor."""
        bases = (base for base in (Load, PairLoad) if isinstance(self.load, base))
        return any(type(self.load).overlap is not base.overlap for base in bases)

    def map(self, f: Callable[..., Any], *args: Any) -> Any:
        """f(load, *its arguments) of all loads, the arguments and the results stacked."""
        return jax.vmap(f, axis_size=len(self.members))(self.load, *args)


class BodyLoads(LoadGroup):
    """Loads on stations."""

    load: Load

    def seen(self, tree: Tree, q: Float[Array, "nq"], v: Float[Array, "nv"], z: Any) -> Any:
        """States z as the loads see them: with angles and speeds of their cranks, from all coordinates."""
        return CrankState(rows(q, self.hinges(tree, "q")), rows(v, self.hinges(tree, "v")), z) if self.cranks else z

    def hinges(self, tree: Tree, what: str) -> Int[np.ndarray, "m"]:
        """Coordinates ("q") or velocities ("v") of the hinges that turn their cranks."""
        return np.array([getattr(tree.layout[i], what).start for i in self.cranks], dtype=int)

    def initial(self) -> Any:
        """Initial states of the loads, stacked; () without states."""
        return self.map(lambda load: load.initial())

    @property
    def crank_speeds(self) -> Float[Array, "m"] | None:
        """Speeds at t = 0 of the cranks that they turn themselves [rad/s]; None without."""
        return self.map(lambda load: load.crank_speed())

    def stations_of_each(self, tree: Tree) -> list[Int[np.ndarray, "n"]]:
        """Stations on which each of the loads acts."""
        places = [tree.layout[i].stations for i in self.parts]
        return [np.arange(place.start, place.start + 1 if self.load.on_first else place.stop) for place in places]

    def stations(self, tree: Tree) -> Int[np.ndarray, "k"]:
        """Those of all loads, one behind the other."""
        return np.concatenate(self.stations_of_each(tree))

    def force(self, tree: Tree, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Array | None, Any]:
        """Wrenches on `stations`, and the rates of the states."""
        if self.load.by_station:
            return self._by_station(tree).force(t, self.here(tree, strips), z, water)
        w, rate = self.map(lambda load, s, z: load.force(t, s, z, water), self.here(tree, strips), z)
        return None if w is None else w.reshape(-1, 6), rate

    def gaps(self, tree: Tree, strips: Strips, z: Any, water: Water) -> Gaps | None:
        """Gaps of the loads with states z."""
        if self.load.by_station:
            return self._by_station(tree).gaps(self.here(tree, strips), z, water)
        return self.map(lambda load, s, z: load.gaps(s, z, water), self.here(tree, strips), z)

    def overlaps(self, tree: Tree, strips: Strips, z: Any, water: Water) -> Float[Array, "m"]:
        """How deep the part of each is in what holds it."""
        return self.map(lambda load, s, z: load.overlap(s, z, water), self.here(tree, strips), z)

    def added(self, tree: Tree, strips: Strips, water: Water) -> Float[Array, "k 6 6"] | None:
        """Constant added mass at `stations`."""
        if self.load.by_station:
            return self._by_station(tree).inertia(self.here(tree, strips), water)
        mass = self.map(lambda load, s: load.inertia(s, water), self.here(tree, strips))
        return None if mass is None else mass.reshape(-1, 6, 6)

    def flow(self, tree: Tree, strips: Strips) -> Flow | None:
        """What the loads see of the water, at the places of all of them, one behind the other; None without ranges."""
        if self.load.by_station:
            return self._by_station(tree).flow(self.here(tree, strips))
        seen = self.map(lambda load, s: load.flow(s), self.here(tree, strips))
        return jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:]), seen)

    def here(self, tree: Tree, strips: Strips) -> Strips:
        """The stations on which the loads act: of all one behind the other, or of each [m, n]."""
        each = self.stations_of_each(tree)
        index = np.concatenate(each) if self.load.by_station else np.array(each)
        return jax.tree.map(lambda x: rows(x, index), strips)

    def _by_station(self, tree: Tree) -> Load:
        """One load that goes station by station, with numbers for each of `stations`."""
        if len(self.members) == 1:
            return jax.tree.map(lambda x: x[0], self.load)
        owner = np.repeat(np.arange(len(self.members)), [len(here) for here in self.stations_of_each(tree)])
        return jax.tree.map(lambda x: rows(x, owner), self.load)


class ReshapingLoads(BodyLoads):
    """Loads whose added mass changes."""

    load: ReshapingLoad  # pyright: ignore[reportIncompatibleVariableOverride]  frozen

    def carried(self, tree: Tree, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Array, Array]:
        """Variable added mass at `stations`, and its rate."""
        both = self.map(lambda load, s, z: load.carried(t, s, z, water), self.here(tree, strips), z)
        return both[0].reshape(-1, 6, 6), both[1].reshape(-1, 6, 6)


class InnerLoads(LoadGroup):
    """Loads on joints, or inside rods."""

    load: JointLoad | RodLoad

    def coordinates(self, tree: Tree, what: str) -> Int[np.ndarray, "m n"]:
        """Coordinates ("q") or velocities ("v") of the joints or rods on which the loads act."""
        out = []
        for i in self.parts:
            place, own = getattr(tree.layout[i], what), getattr(tree.structure[i].joint, "n" + what)
            every = np.arange(place.start, place.stop)
            out.append(every[own:] if isinstance(self.load, RodLoad) else every[:own])
        return np.array(out)

    def displacements(self, tree: Tree, q: Float[Array, "nq"]) -> Float[Array, "m nv"]:
        """Displacements of the joints on which the loads act, from all coordinates."""
        joint, own = tree.structure[self.parts[0]].joint, rows(q, self.coordinates(tree, "q"))
        return own if joint.plain else jax.vmap(joint.displacement)(own)

    def initial(self, tree: Tree) -> Any:
        """Initial states of the loads, stacked; () without states."""
        return self.map(lambda load: load.initial())

    def at_state(
        self, tree: Tree, t: Array, q: Float[Array, "nq"], v: Float[Array, "nv"], z: Any
    ) -> tuple[Float[Array, "m n"], Any]:
        """Forces along the velocities and rates of the states z, from all coordinates and velocities."""
        own = rows(v, self.coordinates(tree, "v"))
        if isinstance(self.load, RodLoad):
            x = rows(q, self.coordinates(tree, "q"))
            return self.map(lambda load, q, v, z: load.at_state(t, q, v, z), x, own, z)
        return self.map(lambda load, x, v, z: load.at_state(x, v, z), self.displacements(tree, q), own, z)

    def gaps(self, tree: Tree, q: Float[Array, "nq"]) -> Gaps | None:
        """Gaps of the loads."""
        own = rows(q, self.coordinates(tree, "q")) if isinstance(self.load, RodLoad) else self.displacements(tree, q)
        return self.map(lambda load, x: load.gaps(x), own)


class PairLoads(LoadGroup):
    """Loads between parts."""

    load: PairLoad

    def stations(self, tree: Tree, side: int) -> Int[np.ndarray, "m n"]:
        """Stations of the first (side = 0) or the second part of each pair."""
        places = [tree.layout[pair[side]].stations for pair in self.parts]
        return np.array([np.arange(place.start, place.stop) for place in places])

    def force(self, tree: Tree, strips: Strips) -> tuple[Float[Array, "k 6"], Float[Array, "l 6"]]:
        """Wrenches on the stations of all first parts, and on those of all second parts, one behind the other."""
        a, b = self.map(lambda load, first, second: load.force(first, second), *self._sides(tree, strips))
        return a.reshape(-1, 6), b.reshape(-1, 6)

    def gaps(self, tree: Tree, strips: Strips) -> Gaps | None:
        """Gaps of the loads."""
        return self.map(lambda load, first, second: load.gaps(first, second), *self._sides(tree, strips))

    def overlaps(self, tree: Tree, strips: Strips) -> Float[Array, "m"]:
        """How deep the parts of each are in one another."""
        return self.map(lambda load, first, second: load.overlap(first, second), *self._sides(tree, strips))

    def _sides(self, tree: Tree, strips: Strips) -> list[Strips]:
        return [jax.tree.map(lambda x, k=k: rows(x, self.stations(tree, k)), strips) for k in (0, 1)]


class Loads(eqx.Module):
    """All loads of a robot, kind by kind."""

    on_bodies: tuple[BodyLoads, ...]
    on_joints: tuple[InnerLoads, ...]
    in_rods: tuple[InnerLoads, ...]
    pairs: tuple[PairLoads, ...]
    tendons: tuple[TendonGroup, ...]

    @classmethod
    def of(
        cls, loads: Sequence[Attached], pairs: Sequence[Paired], tendons: Sequence[JointTendon], tree: Tree
    ) -> "Loads":
        """Loads that one vectorised call can take together are in one group."""
        of_part = [tree.structure[attached.part] for attached in loads]

        def together(base: type, kind: Callable[[int], Any]) -> list[Any]:
            some = {i: attached.load for i, attached in enumerate(loads) if isinstance(attached.load, base)}
            results = []
            for g in alike(some, kind):
                outside = ReshapingLoads if isinstance(g.things, ReshapingLoad) else BodyLoads
                group: Any = outside if base is Load else InnerLoads
                own = [loads[i] for i in g.members]
                names, parts = tuple(x.name for x in own), tuple(x.part for x in own)
                results.append(group(g.members, names, parts, g.things, tuple(x.crank for x in own if x.crank >= 0)))
            return results

        def stations(i: int) -> tuple[int | None, bool]:
            load = loads[i].load
            assert isinstance(load, Load)
            alone = load.by_station or load.on_first
            return None if alone else of_part[i].stations, loads[i].crank >= 0

        between = []
        counts = {i: tuple(tree.structure[part].stations for part in pair.parts) for i, pair in enumerate(pairs)}
        for g in alike({i: pair.load for i, pair in enumerate(pairs)}, counts.__getitem__):
            own = [pairs[i] for i in g.members]
            between.append(PairLoads(g.members, tuple(x.name for x in own), tuple(x.parts for x in own), g.things))
        return cls(
            on_bodies=tuple(together(Load, stations)),
            on_joints=tuple(together(JointLoad, lambda i: of_part[i].joint)),
            in_rods=tuple(together(RodLoad, lambda i: of_part[i].strains)),
            pairs=tuple(between),
            tendons=TendonGroup.of(tendons),
        )

    @property
    def along_joints(self) -> tuple[InnerLoads | TendonGroup, ...]:
        """Those along joints: of one joint each, and tendons over several."""
        return (*self.on_joints, *self.tendons)

    @property
    def inner(self) -> tuple[InnerLoads | TendonGroup, ...]:
        """Those along joints, and those inside rods."""
        return (*self.along_joints, *self.in_rods)

    def initial(self, tree: Tree) -> tuple[Any, ...]:
        """Initial states of each group on bodies, then of each of `inner`."""
        return (*(g.initial() for g in self.on_bodies), *(g.initial(tree) for g in self.inner))

    def states(self, z: tuple[Any, ...]) -> tuple[tuple[Any, ...], tuple[Any, ...], tuple[Any, ...]]:
        """States of those on bodies, of `inner` and of motors, of the states z of the robot."""
        n = len(self.on_bodies)
        m = n + len(self.inner)
        return z[:n], z[n:m], z[m:]

    def inside(self, tree: Tree, t: Array, q: Array, v: Array, z: tuple[Any, ...]) -> list[tuple[Array, Any]]:
        """Forces of each group of `inner`, and the rates of their states, from the states z of the robot."""
        return [g.at_state(tree, t, q, v, own) for g, own in zip(self.inner, self.states(z)[1], strict=True)]

    def inside_rates(self, tree: Tree, t: Array, q: Array, v: Array, z: tuple[Any, ...]) -> tuple[Any, ...]:
        """The rates alone."""
        some = self.inside(tree, t, q, v, z) if jax.tree.leaves(own := self.states(z)[1]) else [((), x) for x in own]
        return tuple(rate for _, rate in some)

    @property
    def acting(self) -> tuple[BodyLoads, ...]:
        """Those on bodies with a force of their own, not added mass alone."""
        return tuple(g for g in self.on_bodies if not g.load.inertial)

    @property
    def reshaping(self) -> dict[int, ReshapingLoads]:
        """Those whose added mass changes, by their place in `on_bodies`."""
        return {k: g for k, g in enumerate(self.on_bodies) if isinstance(g, ReshapingLoads)}

    @property
    def sectioned(self) -> tuple[BodyLoads, ...]:
        """Those whose added mass is that of sections."""
        return tuple(g for g in self.on_bodies if isinstance(g.load, SectionedLoad))

    @property
    def crank_speeds(self) -> tuple[Float[Array, "m"], ...]:
        """Speeds at t = 0 of the cranks that those on bodies turn themselves [rad/s], group by group."""
        return tuple(speeds for g in self.on_bodies if (speeds := g.crank_speeds) is not None)

    @property
    def cranked(self) -> tuple[BodyLoads, ...]:
        """Those whose cranks joints turn."""
        return tuple(g for g in self.on_bodies if g.cranks)

    def seen(self, tree: Tree, q: Float[Array, "nq"], v: Float[Array, "nv"], z: tuple[Any, ...]) -> tuple[Any, ...]:
        """States of the loads on bodies as these see them, from the states z of the robot."""
        return tuple(g.seen(tree, q, v, own) for g, own in zip(self.on_bodies, self.states(z)[0], strict=True))

    def gaps(self, tree: Tree, t: Array, x: State, water: Water) -> Gaps | None:
        """Gaps of all that act on one side only; None without any."""
        q, v, _ = tree.complete(t, x.q, x.v)
        inside = [g for g in (*self.on_joints, *self.in_rods) if g.one_sided]
        gaps = [g.gaps(tree, q) for g in (*inside, *self.tendons)]
        outside = [(g, z) for g, z in zip(self.on_bodies, self.seen(tree, q, v, x.z), strict=True) if g.one_sided]
        between = [g for g in self.pairs if g.one_sided]
        if outside or between:
            shape = tree.shape(q)
            strips = strips_of(tree, shape, jnp.zeros((shape.position.shape[0], 6)))
            gaps += [g.gaps(tree, strips, z, water) for g, z in outside] + [g.gaps(tree, strips) for g in between]
        there = [own for own in gaps if own is not None]
        return jax.tree.map(lambda *each: joined([x.ravel() for x in each]), *there) if there else None

    def added(self, tree: Tree, strips: Strips, water: Water) -> Float[Array, "n 6 6"]:
        """Sum of their constant added mass at all stations."""
        masses = [(g.stations(tree), g.added(tree, strips, water)) for g in self.on_bodies]
        there = [(at, mass) for at, mass in masses if mass is not None]
        return Spread(tree.layout[-1].stations.stop, *(at for at, _ in there))([mass for _, mass in there], (6, 6))

    def torques(self, rates: Sequence[Any]) -> tuple[Float[Array, "m"], ...]:
        """Torques of `cranked` on their cranks [N m], of what all on bodies return."""
        return tuple(rate.torque for g, rate in zip(self.on_bodies, rates, strict=True) if g.cranks)

    def on_cranks(self, tree: Tree, torques: Sequence[Array]) -> Float[Array, "nv"]:
        """Sum of these torques along all velocities."""
        return Spread(tree.layout[-1].v.stop, *(g.hinges(tree, "v") for g in self.cranked))(torques)

    def rates(self, rates: Sequence[Any]) -> tuple[Any, ...]:
        """Rates of the loads' own states, of what all on bodies return."""
        return tuple(rate.own if g.cranks else rate for g, rate in zip(self.on_bodies, rates, strict=True))

    @property
    def beside(self) -> list[str]:
        """Those that are not on one part each, in words."""
        return [f"{kind} {x}" for kind, g in (("pair", self.pairs), ("tendon", self.tendons)) for x in names_of(g)]

    def with_one(self, tree: Tree, on: str | tuple[str, str], load: AnyLoad, name: str | None) -> "Loads":
        """These and a load on a part, along its joint, inside it or between two parts, called `name` or by its class.

        Raises InputError for what is no load, for a part that there is not or that it cannot act on, and for a name
        that results have.
        """
        if not isinstance(load, AnyLoad):
            words = "A load is an instance of a class below Load, JointLoad, RodLoad or PairLoad of nectosome.core."
            raise InputError(f"{kind_of(load)} is given where a load is expected. {words}", field="load")
        parts, several = tuple(on) if isinstance(on, tuple | list) else (on,), isinstance(load, PairLoad)
        if len(parts) != 1 + several:
            needed = 'two parts, as in ("left", "right")' if several else 'one part, as in "body"'
            raise InputError(f"{type(load).__name__} acts on {needed}.", field="part")
        places = tuple(tree.place(part) for part in parts)
        name = name or re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", type(load).__name__).lower()
        taken = {x.name for x in self.one_by_one() if x.part in places} | {*names_of((*self.pairs, *self.tendons))}
        if name in taken | {*OWN_ROWS}:
            why = "is a row of results already, which would mix with it. Give the load another name"
            raise InputError(f'"{name}" {why}, as in with_load(part, load, "mine").', field="name")
        if isinstance(load, PairLoad):
            before = [
                (i, Paired(own, between, part_of(g.load, k)))
                for g in self.pairs
                for k, (i, own, between) in enumerate(zip(g.members, g.names, g.parts, strict=True))
            ]
            every = [pair for _, pair in sorted(before, key=lambda at: at[0])]
            return replace(
                self, pairs=Loads.of((), [*every, Paired(name, (places[0], places[1]), load)], (), tree).pairs
            )
        own = tree.structure[places[0]]
        if (isinstance(load, RodLoad) and own.strains is None) or (isinstance(load, JointLoad) and not own.joint.nv):
            lacks = "is no rod" if isinstance(load, RodLoad) else "has a joint that does not move"
            raise InputError(f"{own.name} {lacks}: {type(load).__name__} has nothing to act on.", field="part")
        loads = (*self.one_by_one(), Attached(name, places[0], load))
        return replace(Loads.of(loads, (), (), tree), pairs=self.pairs, tendons=self.tendons)

    def one_by_one(self) -> tuple[Attached, ...]:
        """All loads of one part, in their order."""
        every = [
            (i, Attached(name, part, part_of(g.load, k), *g.cranks[k : k + 1]))
            for g in (*self.on_bodies, *self.on_joints, *self.in_rods)
            for k, (i, name, part) in enumerate(zip(g.members, g.names, g.parts, strict=True))
        ]
        return tuple(attached for _, attached in sorted(every, key=lambda at: at[0]))


def names_of(groups: Sequence[LoadGroup | TendonGroup]) -> list[str]:
    """Names of all loads of some groups, in their order."""
    return [name for _, name in sorted(pair for g in groups for pair in zip(g.members, g.names, strict=True))]


def strips_of(tree: Tree, shape: PartShape, twist: Float[Array, "n 6"]) -> Strips:
    """All stations, with velocities in the world."""
    moving = shape.rotation, shape.position, twist[:, :3], twist[:, 3:]
    still = vars(tree.stations) | {"half_width": tree.half_width(shape)}
    return Strips(**still, **dict(zip(_MOVING, moving, strict=True)))
