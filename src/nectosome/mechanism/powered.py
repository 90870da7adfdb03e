r"""Drives with motors along joints and strains of rods, and the batteries that they share.

A battery of open-circuit voltage $U_0$ and resistance R supplies all drives that name it and the electronics, of the
power $P_0$, at one voltage U, which is a root of

$$ U = U_0 - \frac{R}{U} \left( P_0 + P(U) \right), \qquad P(U) = \sum_k P_k(U) $$

A battery without regeneration gives max(0, P) to its drives.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from nectosome.core import Drive, DriveOutput
from nectosome.core.rows import Spread, alike, joined, rows, stacked
from nectosome.core.updates import due
from nectosome.units import InputError, did_you_mean, kind_of

from .tree import Tree

_ITERATIONS = 6  # of Newton's method, from the voltage without a current


class Battery(eqx.Module):
    """A battery."""

    voltage: Float[Array, ""]  # U_0 [V]
    resistance: Float[Array, ""]  # [ohm]
    idle_power: Float[Array, ""]  # P_0 [W]
    regenerative: Float[Array, ""]  # 1, or 0
    energy: Float[Array, ""]  # that its charge is worth at U_0 [J]; NaN where not known


class Attachment(eqx.Module):
    """A drive, the part whose joint or strain it moves, and its supply."""

    part: int = eqx.field(static=True)
    strain: int = eqx.field(static=True)  # index among the coordinates of a rod; -1: it moves the joint
    battery: int = eqx.field(static=True)  # index; -1: none
    drive: Drive
    supply: Float[Array, ""] | None  # voltage without a battery [V]; None where it has no end


class DriveGroup(eqx.Module):
    """Drives of one kind, stacked."""

    parts: tuple[int, ...] = eqx.field(static=True)
    strains: tuple[int, ...] = eqx.field(static=True)
    batteries: tuple[int, ...] = eqx.field(static=True)
    drive: Any
    supply: Float[Array, "m"] | None

    def map(self, f: Callable[..., Any], *args: Any) -> Any:
        """f(drive, *its arguments) of all drives."""
        return jax.vmap(f, axis_size=len(self.parts))(self.drive, *args)

    def coordinates(self, tree: Tree, what: str) -> Int[np.ndarray, "m"]:
        """Coordinates ("q") or velocities ("v") that they move."""
        before = [getattr(tree.structure[i].joint, "n" + what) for i in self.parts]
        own = [k + n if k >= 0 else 0 for k, n in zip(self.strains, before, strict=True)]
        return np.array([getattr(tree.layout[i], what).start for i in self.parts]) + np.array(own)

    def initial(self) -> Any:
        """Initial states, stacked; () without states."""
        return self.map(lambda drive: drive.initial())

    def output(self, t: Array, x: Array, v: Array, voltages: Float[Array, "b"], z: Any) -> tuple[DriveOutput, Any]:
        """Outputs of the drives at these voltages of all batteries, and the rates of their states, leaves [m]."""
        if self.batteries[0] < 0 and self.supply is None:
            return self.map(lambda drive, x, v, z: drive.output(t, x, v, None, z), x, v, z)
        supply = self.supply if self.supply is not None else rows(voltages, np.array(self.batteries))
        return self.map(lambda drive, x, v, U, z: drive.output(t, x, v, U, z), x, v, supply, z)


class PoweredDrives(eqx.Module):
    """All drives with motors, kind by kind, and the batteries."""

    groups: tuple[DriveGroup, ...]
    batteries: Battery | None  # stacked
    battery_names: tuple[str, ...] = eqx.field(static=True)

    @classmethod
    def of(cls, drives: Sequence[Attachment], batteries: dict[str, Battery]) -> "PoweredDrives":
        """Drives that one vectorised call can take together are in one group."""
        groups = []
        for g in alike({i: (d.drive, d.supply) for i, d in enumerate(drives)}, lambda i: drives[i].battery < 0):
            own = [drives[i] for i in g.members]
            parts, strains, batteries_of = zip(*((d.part, d.strain, d.battery) for d in own), strict=True)
            groups.append(DriveGroup(parts, strains, batteries_of, *g.things))
        return cls(tuple(groups), stacked([*batteries.values()]) if batteries else None, tuple(batteries))

    def beside(self, tree: Tree) -> list[str]:
        """Batteries and drives, in words."""
        moved = [f"motor of {tree.names[i]}" for g in self.groups for i in g.parts]
        return [*(f"battery {name}" for name in self.battery_names), *moved]

    def with_one(self, tree: Tree, on: str, drive: Any, battery: str | None, supply: float | None) -> "PoweredDrives":
        """These and a drive along the joint of a part, as `Robot.with_drive` says, in a group of its own."""
        if not isinstance(drive, Drive):
            words = "A drive is an instance of a class below nectosome.core.Drive."
            raise InputError(f"{kind_of(drive)} is given where a drive is expected. {words}", field="drive")
        part = tree.place(on)
        own, v = tree.structure[part], tree.layout[part].v.start
        if own.joint.nv != 1 or own.prescribed or v in self.places(tree, "v"):
            why = f"the joint of {on} is not free to turn or slide one way, or has a servo or a motor already."
            raise InputError(f"{why} A drive needs a hinge or a slide without.", field="part")
        if battery is not None and battery not in self.battery_names:
            words = did_you_mean(battery, self.battery_names) or " The robot has none."
            raise InputError(f'there is no battery "{battery}".{words}', field="battery")
        index = -1 if battery is None else self.battery_names.index(battery)
        supplied = None if supply is None or battery is not None else jnp.full(1, float(supply))
        return replace(self, groups=(*self.groups, DriveGroup((part,), (-1,), (index,), stacked([drive]), supplied)))

    def places(self, tree: Tree, what: str) -> Int[np.ndarray, "m"]:
        """Coordinates ("q") or velocities ("v") of all drives, in the order of the groups."""
        return np.concatenate([np.zeros(0, int), *(g.coordinates(tree, what) for g in self.groups)])

    def inertia(self, tree: Tree) -> Float[Array, "nv"]:
        """Inertia of the rotors along all velocities [kg m2, kg]."""
        places = (g.coordinates(tree, "v") for g in self.groups)
        return Spread(tree.layout[-1].v.stop, *places)([g.map(lambda drive: drive.inertia) for g in self.groups])

    def initial(self) -> tuple[Any, ...]:
        """Initial states of each group."""
        return tuple(g.initial() for g in self.groups)

    def output(
        self, tree: Tree, t: Array, q: Array, v: Array, z: tuple[Any, ...]
    ) -> tuple[DriveOutput, tuple[Any, ...], Float[Array, "b"]]:
        """Outputs of the drives at all coordinates and velocities, with the states z of each group.

        Leaves [m]; with the rates of the states, and the voltages of the batteries.
        """

        def at(voltages: Array) -> tuple[DriveOutput, tuple[Any, ...]]:
            each = [
                g.output(t, rows(q, g.coordinates(tree, "q")), rows(v, g.coordinates(tree, "v")), voltages, own)
                for g, own in zip(self.groups, z, strict=True)
            ]
            if not each:
                return DriveOutput(*[jnp.zeros(0)] * len(DriveOutput._fields)), ()
            return jax.tree.map(lambda *x: jnp.concatenate(x), *(p for p, _ in each)), tuple(rate for _, rate in each)

        find = lambda voltages: at(voltages)[0].electrical  # noqa: E731
        voltages = jnp.zeros(0) if self.batteries is None else self._voltages(self.batteries, find)
        return *at(voltages), voltages

    @property
    def update_rates(self) -> Float[Array, "k"] | None:
        """Rates of all sampled loops [Hz]; None without any."""
        rates = [g.drive.updates for g in self.groups if g.drive.updates is not None]
        return joined(rates) if rates else None

    def updated(self, tree: Tree, t: Array, q: Array, v: Array, z: tuple[Any, ...]) -> tuple[Any, ...]:
        """States of each group after the updates of the loops that are due at t, at all coordinates and velocities."""

        def of(g: DriveGroup, own: Any) -> Any:
            rates = g.drive.updates
            if rates is None:
                return own
            now, read = due(t, rates), (rows(q, g.coordinates(tree, "q")), rows(v, g.coordinates(tree, "v")))
            later = g.map(lambda drive, x, v, z: drive.updated(t, x, v, z), *read, own)
            return jax.tree.map(lambda a, b: jnp.where(now, a, b), later, own)

        return tuple(of(g, own) for g, own in zip(self.groups, z, strict=True))

    def battery_powers(self, electrical: Float[Array, "m"]) -> Float[Array, "b"]:
        """Power that each battery gives [W], of those that its drives take."""
        if self.batteries is None:
            return jnp.zeros(0)
        supplied = [k for g in self.groups for k in g.batteries]
        mine = (np.array(supplied)[None, :] == np.arange(len(self.battery_names))[:, None]).astype(float)
        drawn, b = jnp.asarray(mine) @ electrical, self.batteries
        return b.idle_power + jnp.where(b.regenerative > 0, drawn, jnp.maximum(drawn, 0.0))

    @property
    def stored(self) -> tuple[Float[Array, "b"], Float[Array, "b"]]:
        """Energies of the batteries [J], NaN where not known, and their voltages without a current [V]."""
        b = self.batteries
        return (jnp.zeros(0), jnp.zeros(0)) if b is None else (b.energy, b.voltage)

    def _voltages(self, b: Battery, electrical: Callable[[Array], Array]) -> Float[Array, "b"]:
        """Voltages by Newton's method, from the electrical powers of all drives at them."""

        def lacks(U: Array) -> Array:
            return U - b.voltage + b.resistance * self.battery_powers(electrical(U)) / U

        def corrected(_: Array, U: Array) -> Array:
            # a battery's voltage acts on its own drives alone: the Jacobian is diagonal
            value, slope = jax.jvp(lacks, (U,), (jnp.ones_like(U),))
            return U - value / slope

        return jax.lax.fori_loop(0, _ITERATIONS, corrected, b.voltage)

    def frozen(self) -> "PoweredDrives":
        """The drives with their signals fixed at the values of t = 0, and loops that are continuous."""
        return self._changed(lambda drive: drive.frozen().continuous())

    def continuous(self) -> "PoweredDrives":
        """The drives with loops that are continuous."""
        return self._changed(lambda drive: drive.continuous())

    def _changed(self, change: Callable[[Any], Drive]) -> "PoweredDrives":
        return replace(self, groups=tuple(replace(g, drive=g.map(change)) for g in self.groups))
