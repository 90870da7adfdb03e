"""Designs of robots whose limbs all do the same: one limb and its share of the body stands for the whole robot."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from nectosome.core.tracers import Untraced
from nectosome.description import RobotDescription, numeric_paths, resolve, with_values
from nectosome.mechanism import Robot
from nectosome.model import Template, build, instantiate, template_of
from nectosome.solve import in_still_water
from nectosome.solve.equal_limbs import OneLimb, one_limb, with_one_limb


class AlikeLimbs(eqx.Module):
    """One of the equal limbs of all designs, as a template to be filled with the numbers of a design."""

    one: OneLimb  # of the robot as its file describes it
    template: Template
    numbers: Float[Array, "k"]
    where: tuple[tuple[int, ...], ...] = eqx.field(static=True)  # of each variable among the numbers

    def of(self, whole: Robot, x: Float[Array, "n"]) -> OneLimb:
        """That of the robot of a design, whose variables have the values x; both may be traced."""
        numbers = self.numbers
        for k, group in enumerate(self.where):
            numbers = numbers.at[np.array(group, int)].set(x[k])
        part = replace(instantiate(self.template, numbers), water=whole.water, share=self.one.robot.share)
        return replace(self.one, whole=whole, robot=replace(part, made_from=Untraced()))


def alike_limbs(
    description: RobotDescription, names: Sequence[str], corners: Sequence[Mapping[str, float]], carried: bool
) -> AlikeLimbs | None:
    """Limbs that all do the same in a robot and in its designs at all `corners`, which set one of the `names` each.

    None where there are none, and where a design's part is not that of the robot with the number of its variable:
    batteries, which serve one limb there, and places of the first part are variables of the whole.
    """
    limbs, parts = list[OneLimb](), list[RobotDescription]()
    for values in ({}, *corners):
        design = with_values(description, values)
        robot = in_still_water(build(design)) if carried else build(design)
        limb = one_limb(robot, robot.initial())
        if limb is None or (limbs and not _alike(limb, limbs[0])):
            return None
        limbs.append(limb)
        parts.append(with_one_limb(design))
    known = numeric_paths(parts[0])
    inside = {name: tuple(path for path in resolve(description, name) if path in known) for name in names}
    also = tuple(path for group in inside.values() for path in group)
    template, numbers = template_of(parts[0], also)
    places = {name: tuple(map(template.paths.index, group)) for name, group in inside.items()}
    for values, part in zip(corners, parts[1:], strict=True):
        other, own = template_of(part, also)
        expected = np.array(numbers)
        for name, value in values.items():
            expected[[*places[name]]] = value
        if other.plan != template.plan or not np.array_equal(expected, np.asarray(own)):
            return None
    return AlikeLimbs(limbs[0], template, numbers, tuple(places.values()))


def _alike(one: OneLimb, other: OneLimb) -> bool:
    """Whether states of both parts make states of their robots alike."""
    if (one.count, one.rows, one.own_rows) != (other.count, other.rows, other.own_rows):
        return False
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("origin", "of_q", "of_v"))
