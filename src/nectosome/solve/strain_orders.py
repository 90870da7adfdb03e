"""How far the tips of rods are off for the orders of their strains: shapes at rest with finer and finer strains."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from nectosome.core import Status
from nectosome.description import RobotDescription, Rod
from nectosome.io.tables import Number, Table
from nectosome.model import RobotLike, description_of
from nectosome.units import InputError, show_quantity

from .branches import Branch
from .static import static

_MOST = 20  # the largest order of a strain
_FINER = 2  # times, the second of which shows whether the first was fine enough
_ENOUGH = 0.01  # of a rod's length, by which its tip may be off


@dataclass(frozen=True)
class OrderError:
    """How far a rod's tip is off at rest, seen from its shape with finer strains."""

    rod: str
    length: float  # [m]
    orders: tuple[int, ...]  # the largest of its strains: as described, and finer
    ways: Float[np.ndarray, "k"]  # from its tip to that with each finer order [m]; NaN without a shape at rest

    @property
    def off(self) -> float:
        """Distance of the tip from that with the finest strains [m]."""
        return float(self.ways[-1])

    @property
    def enough(self) -> bool:
        """Whether the tip is off by at most 1 % of the length."""
        return bool(self.off <= _ENOUGH * self.length)

    def __str__(self) -> str:
        first, *finer = self.orders
        by = " and ".join(map(str, finer))
        if not self.off < np.inf:
            return f"{self.rod}: nothing is known of order {first}: there is no shape at rest with order {by}."
        tip = f"its tip is {show_quantity(self.off, 'length')} off ({self.off / self.length:.2g} of its length)"
        seen = f", seen from order {by}"
        if self.ways.size > 1 and abs(self.ways[0] - self.off) > 0.5 * max(self.off, 1e-3 * _ENOUGH * self.length):
            seen += f", of which the first is {show_quantity(float(self.ways[0]), 'length')} away: it may be more"
        return f"{self.rod}: order {first} is {'' if self.enough else 'not '}enough: {tip}{seen}."


def strain_order_errors(
    robot: RobotLike, *, settings: Iterable[str] = (), branch: Branch | None = None
) -> list[OrderError]:
    """Return for each rod with free strains how far the order of its strains puts its tip off at rest, on a branch.

    All orders n become 2 n + 2, and once more, at most 20: a single order more hardly moves a shape whose strains go to
    and fro along it. Each order is a structure of its own, which takes its time to compile. Raises InputError for a
    robot without such rods, or without a shape at rest, and for rods of the largest order.
    """
    described = description_of(robot, settings)
    rods = {name: part for name, part in described.parts.items() if isinstance(part, Rod) and part.strains}
    if not rods:
        raise InputError("no rod of this robot has free strains, so there is no order to judge.")
    levels = [described]
    for _ in range(_FINER):
        if finer_of(levels[-1]) != levels[-1]:
            levels.append(finer_of(levels[-1]))
    if len(levels) == 1:
        raise InputError(f"all strains are of order {_MOST}, the largest: nothing finer shows how far they are off.")
    tips = [_tips(one, rods, branch) for one in levels]
    if tips[0] is None:
        raise InputError("there is no shape at rest, of which the tips could be compared. See nectosome static.")
    errors = []
    for name, rod in rods.items():
        here = tips[0][name]
        ways = np.array([np.nan if tip is None else np.linalg.norm(tip[name] - here) for tip in tips[1:]])
        orders = [max(part.strains.values()) for one in levels if isinstance(part := one.parts[name], Rod)]
        errors.append(OrderError(name, float(rod.length), tuple(orders), ways))
    return errors


def order_table(errors: Iterable[OrderError]) -> Table:
    """Return the orders and the distances of tips as a table."""
    rows = [(one.rod, Number(one.orders[0]), Number(one.orders[-1]), Number(one.off, "m")) for one in errors]
    return Table("strain_orders", {"rod": "rod", "order": "order", "finest": "finest", "off": "tip off by"}, rows)


def finer_of(described: RobotDescription) -> RobotDescription:
    """Return the robot with finer strains, and with as many points as these need."""

    def finer(part: object) -> object:
        if not isinstance(part, Rod) or not part.strains:
            return part
        orders = {name: min(2 * n + 2, _MOST) for name, n in part.strains.items()}
        return part.model_copy(update={"strains": orders, "points": max(part.points, max(orders.values()) + 4)})

    limbs = {name: finer(part) for name, part in described.limbs.items()}
    return described.model_copy(update={"body": finer(described.body), "limbs": limbs})


def _tips(described: RobotDescription, rods: Iterable[str], branch: Branch | None) -> dict[str, np.ndarray] | None:
    """Places of the tips of rods at rest [m]; None without a shape at rest."""
    found = static(described, branch=branch)
    if Status(int(found.status)) == Status.NO_EQUILIBRIUM:
        return None
    arrays = found.results().arrays
    return {name: arrays["position"][0, arrays["station_part"] == name][-1] for name in rods}
