r"""Recordings whose rows are shapes at rest: what was set and read, readings computed, and their exact derivatives.

Of the equilibrium $r(q, \theta) = 0$ that `static` finds, by the implicit function theorem:

$$ \frac{dy}{d\theta} = \frac{\partial y}{\partial \theta} - \frac{\partial y}{\partial q} K^{-1}
   \frac{\partial r}{\partial \theta}, \qquad K = \frac{\partial r}{\partial q} $$
"""

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from nectosome.core import Solution, State, Status
from nectosome.core.programs.remember import remembered
from nectosome.description import RobotDescription, apply_settings, numeric_paths, resolve
from nectosome.io.schema.quantity import Si
from nectosome.io.schema.structure import at_path
from nectosome.measure.labels import conditions_of, unit_of
from nectosome.mechanism import Robot
from nectosome.model.build import Template, instantiate
from nectosome.solve.branches import leaves_first, settle
from nectosome.solve.equilibrium import changed, no_change, solvable, unbalanced
from nectosome.solve.readings import Reading, values_of
from nectosome.solve.small_motions import SmallMotion, Stability, linearised
from nectosome.solve.static import frozen_drives, own_shape
from nectosome.units import InputError, count, did_you_mean

from ..recordings import column_of

if TYPE_CHECKING:
    import xarray as xr

_MOST = 2000  # rows of a recording


class SetRows(NamedTuple):
    """Numbers of a robot that were set by hand, row by row."""

    paths: tuple[str, ...]
    values: Float[np.ndarray, "n s"]  # [SI]


def is_at_rest(recording: "xr.Dataset", file: str) -> bool:
    """Whether each row of a recording is a shape at rest: it has no time, or a single row, which is no motion.

    Raises InputError for several rows without a time of which nobody says so, and for too many of them.
    """
    if "row" not in recording.dims:
        return recording.sizes.get("time") == 1
    rows, provenance = recording.sizes["row"], json.loads(recording.attrs.get("provenance", "{}"))
    sheet = provenance.get("settings", {}).get("sheet", {"time": None})
    if rows > 1 and "time" not in sheet:
        how = "or its rate; or write time: none there, where each row is a shape at rest."
        raise InputError(f"has no time. Say in the campaign which column it is, {how}", file=file)
    if rows > _MOST:
        what = f"has {rows} rows, each a shape at rest; {_MOST} are the most. Leave some out, or take their means."
        raise InputError(what, file=file)
    return True


def set_rows(
    recording: "xr.Dataset", file: str, description: RobotDescription, inputs: Mapping[str, str]
) -> tuple[RobotDescription, SetRows]:
    """What was set in each row: conditions of the recording, and `inputs`, columns and the paths that they set.

    A path is that of a number, or of a signal: then the returned robot has a constant in its place. Raises InputError
    that names file and column for a value that is missing, in another unit or not allowed, a path that is neither, and
    one that is set twice.
    """
    rows = next(iter(recording.sizes.values()))
    given = {str(name): (np.full(rows, float(x)), unit_of(x)) for name, x in conditions_of(recording).items()}
    paths = {name: name for name in given}
    for column, path in inputs.items():
        given[column], paths[column] = column_of(recording, column, file), path
    found = dict[str, Float[np.ndarray, "n"]]()
    for name, path in paths.items():
        try:
            description, numbers = _set(description, path, *given[name])
        except InputError as error:
            raise InputError(error.message, file=file, field=name) from None
        double = next((one for one in numbers if one in found), None)
        if double is not None:
            raise InputError(f"{double} is set twice.", file=file, field=name)
        found |= numbers
    values = np.stack([*found.values()], axis=1) if found else np.zeros((rows, 0))
    return description, SetRows(tuple(found), values)


def _set(
    description: RobotDescription, path: str, values: Float[np.ndarray, "n"], unit: str
) -> tuple[RobotDescription, dict[str, Float[np.ndarray, "n"]]]:
    """The robot with the first of these values at a path, and all of them for each number that the path stands for."""
    missing = np.flatnonzero(~np.isfinite(values))
    if missing.size:
        raise InputError(f"is missing in row {missing[0] + 1}. Leave the row out, or fill it in.")
    known = numeric_paths(description)
    if path not in known and path not in description.aliases:
        slot, _ = at_path(description, path)
        if slot is None or "constant" not in slot.kinds():
            near = did_you_mean(path, [*description.aliases, *known])
            raise InputError(
                f'"{path}" is no number and no signal of {description.name}, so that nothing sets it.{near}'
            )
        description = apply_settings(description, {path: {"kind": "constant", "value": Si(values[0], unit)}})
        path, known = f"{path}.value", numeric_paths(description)
    names = resolve(description, path)
    for k, value in enumerate(values.tolist(), start=1):
        try:
            for name in names:
                known[name].read(Si(value, unit), units_required=True)
        except ValueError as error:
            raise InputError(f"row {k}: {error}") from None
    return apply_settings(description, {path: Si(values[0], unit)}), dict.fromkeys(names, values)


def read_rows(
    recording: "xr.Dataset", file: str, columns: Sequence[tuple[str, str, str]]
) -> tuple[Float[np.ndarray, "k n"], tuple[str, ...]]:
    """What was read in each row of columns (name, reading, its SI unit), NaN where it is missing, and notes.

    Raises InputError for a column that is missing, empty or in another unit.
    """
    out = []
    for column, reading, expected in columns:
        values, given = column_of(recording, column, file)
        check_unit(given, column, reading, expected, file)
        if not np.isfinite(values).any():
            raise InputError("has no values: nothing can be identified from it.", file=file, field=column)
        out.append(values)
    gaps = int(np.sum(~np.isfinite(out)))
    notes = [f"{count(gaps, 'value')} of shapes at rest missing: not compared"] if gaps else []
    return np.where(np.isfinite(out), out, np.nan), tuple(notes)


def check_unit(given: str, column: str, reading: str, expected: str, file: str) -> None:
    """Raise InputError for a column that is not in the SI unit of what it measures."""
    if given != expected:
        how = "Give its unit in the campaign, or compare it with something else."
        what = f"is in {given or 'no unit'}, and {reading} in {expected or 'no unit'}. {how}"
        raise InputError(what, file=file, field=column)


class RestingRobot(eqx.Module):
    """What a robot is besides its numbers, and what of it is compared."""

    template: Template
    readings: tuple[Reading, ...]
    signs: Float[Array, "k"]

    def made(self, numbers: Float[Array, "n"]) -> Robot:
        """The robot with its drives as at t = 0."""
        return frozen_drives(instantiate(self.template, numbers))

    def shape(
        self, numbers: Float[Array, "n"], x: State, directions: Float[Array, "p n"]
    ) -> tuple[Float[Array, "k"], Float[Array, "p k"]]:
        """Readings of one row in a shape, and their derivatives along directions of the numbers."""
        p, n, none = len(directions), x.v.size, no_change(x)

        def at(numbers: Array, y: Array) -> tuple[Array, Array]:
            """Unbalanced forces and readings, displaced by y."""
            robot = self.made(numbers)
            moved = changed(robot, x, y)
            return unbalanced(robot, moved), self.signs * values_of(self.readings, robot, jnp.zeros(()), moved)

        (r, y), change = jax.linearize(at, numbers, none)
        still = jnp.zeros((p, none.size)), jnp.zeros((none.size, numbers.size))
        dr, dy = jax.vmap(change)(
            jnp.concatenate([directions, still[1]]), jnp.concatenate([still[0], jnp.eye(none.size)])
        )
        K, _, free = solvable(dr[p:].T, r, n)
        moved = -jnp.linalg.solve(K, jnp.where(free, 0.0, dr[:p]).T).T
        return y, dy[:p] + moved @ dy[p : p + r.size]


class Rests(NamedTuple):
    """Shapes of all rows at rest."""

    state: State  # leaves [m, ...]
    status: Int[np.ndarray, "m"]  # a `core.Status`
    stability: list[Stability]


def rests(robot: RestingRobot, numbers: Float[Array, "m n"], size: int) -> Rests:
    """Shapes of the rows as `static` finds them, without a branch, of the first `size` of which others are copies.

    A row without an equilibrium has the shape under the last load that had one.
    """
    first = remembered(first_shapes, robot, numbers)
    stability = _stability(robot, numbers, first.value, size)
    state, status, load = jax.tree.map(np.asarray, (first.value, first.status, first.stats["load"]))
    solved = status[:size] == Status.SOLVED
    leave = np.array([leaves_first(robot.template.plan.description, one) for one in stability]) & solved
    leave |= ~solved & (load[:size] == 0)
    if not leave.any():
        return Rests(state, status, stability)
    there = remembered(settled_shapes, robot, numbers)
    beside = _stability(robot, numbers, there.value, size)
    leave &= (np.asarray(there.status)[:size] == Status.SOLVED) & [one.stable for one in beside]
    each = np.pad(leave, (0, len(numbers) - size), mode="edge")

    def chosen(a: np.ndarray, b: Array) -> np.ndarray:
        return np.where(each.reshape(-1, *[1] * (a.ndim - 1)), b, a)

    stability = [b if left else a for a, b, left in zip(stability, beside, leave, strict=True)]
    return Rests(jax.tree.map(chosen, state, there.value), np.where(each, int(Status.SOLVED), status), stability)


def _stability(robot: RestingRobot, numbers: Array, x: State, size: int) -> list[Stability]:
    found = jax.tree.map(np.asarray, remembered(motions, robot, numbers, x))
    return [jax.tree.map(lambda x, k=k: x[k], found).stability for k in range(size)]


def first_shapes(robot: RestingRobot, numbers: Float[Array, "m n"]) -> Solution:
    """First shapes of all rows, by `own_shape`, leaves [m, ...]."""
    return jax.vmap(lambda row: own_shape(robot.made(row)))(numbers)


def settled_shapes(robot: RestingRobot, numbers: Float[Array, "m n"]) -> Solution:
    """Shapes into which the rows fall from their start, leaves [m, ...]."""

    def one(row: Array) -> Solution:
        made = robot.made(row)
        return settle(made, made.initial())

    return jax.vmap(one)(numbers)


def shapes(
    robot: RestingRobot, numbers: Float[Array, "m n"], x: State, directions: Float[Array, "p n"]
) -> tuple[Float[Array, "k m"], Float[Array, "p k m"]]:
    """Readings of all rows in their shapes, and their derivatives along directions of the numbers."""
    y, dy = jax.vmap(robot.shape, in_axes=(0, 0, None))(numbers, x, directions)
    return y.T, jnp.moveaxis(dy, 0, -1)


def motions(robot: RestingRobot, numbers: Float[Array, "m n"], x: State) -> SmallMotion:
    """About the shapes of all rows, leaves [m, ...]."""
    return jax.vmap(lambda row, x: linearised(robot.made(row), x))(numbers, x)
