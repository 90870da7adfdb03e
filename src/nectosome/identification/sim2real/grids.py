"""Simulated grids: which of their quantities is meant, which axis is a parameter's, and values between their points."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline

from nectosome.description import get_value, parse_robot
from nectosome.measure.labels import unit_of
from nectosome.units import InputError, did_you_mean, dimension_of, read_any, show_quantity, unit_to_si

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class GridTable:
    """Values at every point of a grid of conditions, for each value of a parameter that the simulator does not know.

    To simulate again with another parameter is to interpolate along its axis: it takes no simulator. A simulator whose
    parameters are all known has one level of it.
    """

    names: tuple[str, ...]  # of the conditions
    levels: tuple[Float[np.ndarray, "_"], ...]  # of each condition, increasing
    values: Float[np.ndarray, "*n p"]
    parameter: Float[np.ndarray, "p"]  # increasing
    nominal: float  # what the simulator takes it to be
    called: str = "parameter"
    unit: str = ""  # of the values

    @property
    def points(self) -> Float[np.ndarray, "k d"]:
        """All points of the grid, the last condition running fastest."""
        return np.stack(np.meshgrid(*self.levels, indexing="ij"), axis=-1).reshape(-1, len(self.levels))

    def in_box(self, points: Float[np.ndarray, "m d"]) -> Float[np.ndarray, "m d"]:
        """Conditions scaled to 0..1 between the ends of the grid."""
        low, high = (np.array([x[k] for x in self.levels]) for k in (0, -1))
        return (points - low) / (high - low)

    def holds(self, parameter: Float[np.ndarray, "m"]) -> Bool[np.ndarray, "m"]:
        """Whether values of the parameter lie between the table's ends; no for NaN."""
        return (parameter > self.parameter[0]) & (parameter < self.parameter[-1])

    def curves(self, points: Float[np.ndarray, "m d"]) -> Float[np.ndarray, "m p"]:
        """Values at any conditions within the grid, for each level of the parameter: cubic splines along all axes.

        Raises InputError outside of the grid.
        """
        for name, level, x in zip(self.names, self.levels, points.T, strict=True):
            slack = 1e-9 * (level[-1] - level[0])
            outside = x[~((x >= level[0] - slack) & (x <= level[-1] + slack))]
            if outside.size:
                raise InputError(
                    f"{outside[0]:.6g} is outside of the simulated grid, which goes from {level[0]:.6g} to "
                    f"{level[-1]:.6g}. Simulate a wider grid, or leave this experiment out.",
                    field=name,
                )
        out = np.broadcast_to(self.values, (len(points), *self.values.shape))
        for level, x in zip(self.levels, points.T, strict=True):
            out = np.einsum("mn,mn...->m...", CubicSpline(level, np.eye(level.size))(x), out)
        return out

    def simulated(
        self, points: Float[np.ndarray, "m d"], parameter: Float[np.ndarray, "m"] | None = None
    ) -> tuple[Float[np.ndarray, "m"], Float[np.ndarray, "m"]]:
        """Values at conditions with a parameter at each, else the nominal one; and their derivatives by the parameter.

        Raises InputError where the parameter is outside of the table.
        """
        curves = self.curves(points)
        if self.parameter.size == 1:
            return curves[:, 0], np.zeros(len(points))
        x = np.full(len(points), self.nominal) if parameter is None else parameter
        if not np.all((x >= self.parameter[0]) & (x <= self.parameter[-1])):
            ends = f"{self.parameter[0]:.6g} to {self.parameter[-1]:.6g}"
            raise InputError(
                f"must be within the simulated grid, {ends}. Simulate more values of it.", field=self.called
            )
        along = CubicSpline(self.parameter, curves, axis=1)
        k = np.clip(np.searchsorted(self.parameter, x, side="right") - 1, 0, self.parameter.size - 2)
        c3, c2, c1, c0 = along.c[:, k, np.arange(len(points))]
        h = x - self.parameter[k]
        return c0 + h * (c1 + h * (c2 + h * c3)), c1 + h * (2 * c2 + 3 * h * c3)

    def matching(
        self, points: Float[np.ndarray, "m d"], values: Float[np.ndarray, "m"], errors: Float[np.ndarray, "m"]
    ) -> tuple[Float[np.ndarray, "m"], Float[np.ndarray, "m"]]:
        """Parameter with which the simulator gives these values, and its standard error; NaN where no level does.

        The nearest to the nominal one where there are several.
        """
        found = np.full(len(values), np.nan)
        for i, (curve, value) in enumerate(zip(self.curves(points), values, strict=True)):
            roots = CubicSpline(self.parameter, curve).solve(value, extrapolate=False)
            if roots.size and np.isfinite(roots).all():
                found[i] = roots[np.argmin(np.abs(roots - self.nominal))]
        known, found_errors = np.isfinite(found), np.full(len(values), np.nan)
        with np.errstate(divide="ignore"):
            found_errors[known] = errors[known] / np.abs(self.simulated(points[known], found[known])[1])
        return found, found_errors


def table_of(simulated: "xr.DataArray", parameter: str | None = None, nominal: float = 1.0) -> GridTable:
    """Table of a labelled grid, whose dimensions are the conditions and, where it is named, a parameter.

    Raises InputError where a dimension is missing, has fewer than two levels or one twice, where values are missing,
    and where the nominal parameter is not within the grid's.
    """
    names = tuple(str(dim) for dim in simulated.dims if dim != parameter)
    if parameter is not None and parameter not in simulated.dims:
        raise InputError(f"is no dimension of the simulated grid, which has {', '.join(names)}.", field=parameter)
    if not names:
        raise InputError("the simulated grid has no condition: at least one dimension beside the parameter is needed.")
    dims = [*names, *([] if parameter is None else [parameter])]
    grid = simulated.transpose(*dims).sortby(dims)
    levels = [np.asarray(grid[name].values, dtype=float) for name in grid.dims]
    for name, level in zip(grid.dims, levels, strict=True):
        if level.size < 2 or not np.isfinite(level).all() or not np.all(np.diff(level) > 0):
            raise InputError("needs two levels or more in the simulated grid, each once.", field=str(name))
    values, unit = np.asarray(grid.values, dtype=float), str(simulated.attrs.get("units", ""))
    missing = int(np.sum(~np.isfinite(values)))
    if missing:
        raise InputError(
            f"{missing} of {values.size} values of the simulated grid are NaN or infinite.", field=str(simulated.name)
        )
    if parameter is None:
        return GridTable(names, tuple(levels), values[..., None], np.array([nominal]), nominal, unit=unit)
    if not levels[-1][0] < nominal < levels[-1][-1]:
        own, low, high = (_shown(x, grid[parameter]) for x in (nominal, levels[-1][0], levels[-1][-1]))
        raise InputError(
            f"is {own} in the simulator itself, which must lie between the ends of the simulated grid, {low} and "
            f"{high}.",
            field=parameter,
        )
    return GridTable(names, tuple(levels[:-1]), values, levels[-1], nominal, parameter, unit)


def _shown(value: float, of: "xr.DataArray") -> str:
    """A value of a quantity with its unit."""
    return show_quantity(value, dimension_of(unit_of(of)))


class GridQuantity(NamedTuple):
    """What is simulated, in SI units over dimensions with numbers, and the column of recordings it belongs to."""

    values: "xr.DataArray"
    peak: "xr.DataArray | None"  # its largest magnitude, where the grid has it
    column: str


def quantity_of(grid: "xr.Dataset", columns: Sequence[str], requested: str | None) -> GridQuantity:
    """The quantity that is requested, `force.y` or `-force.y`; else the only one that grid and columns both have.

    Raises InputError where there is none, or where it is not said which.
    """
    if requested is None:
        both = [name for name in columns if _known(grid, name)]
        if len(both) != 1:
            what = f"which of {', '.join(both)} is meant?" if both else "the grid and the recordings share no quantity:"
            names = f"the recordings have {', '.join(columns)}, the grid has {', '.join(_numeric(grid))}"
            raise InputError(f"{what} {names}. Name one, as in force.y.", field="quantity")
        requested = both[0]
    name = requested.removeprefix("-").strip()
    values, stem = _values(grid, name)
    peak = f"{stem}_peak" in grid and grid[f"{stem}_peak"].dims == grid[stem].dims
    column = name if name in columns else stem
    return GridQuantity(
        -values if requested.startswith("-") else values,
        _values(grid, f"{stem}_peak{name.removeprefix(stem)}")[0] if peak else None,
        column,
    )


def _numeric(grid: "xr.Dataset") -> list[str]:
    return [str(name) for name, x in grid.data_vars.items() if x.dtype.kind in "iuf" and x.ndim]


def _known(grid: "xr.Dataset", name: str) -> bool:
    return bool({name, name.partition(".")[0]} & {*_numeric(grid)})


def _values(grid: "xr.Dataset", name: str) -> tuple["xr.DataArray", str]:
    """Values by the name of a variable, or by that and a label of its extra dimension; and the variable's name."""
    stem, _, label = (name, "", "") if name in grid.data_vars else name.partition(".")
    if stem not in _numeric(grid):
        near = did_you_mean(stem, _numeric(grid))
        raise InputError(f'the grid has no quantity with numbers called "{stem}".{near}', field="quantity")
    values = grid[stem].squeeze()
    for dim in values.dims:
        if dim not in values.coords:
            raise InputError(f"{stem} has no values of its dimension {dim} in the grid.", field="quantity")
    worded = [str(dim) for dim in values.dims if values[dim].dtype.kind not in "iuf"]
    labels = [str(x) for x in values[worded[0]].values] if len(worded) == 1 else []
    if len({*labels}) < len(labels):
        raise InputError(f"{stem} has a label of {worded[0]} twice in the grid.", field="quantity")
    if len(worded) > 1 or (label and label not in labels) or (labels and not label):
        has = f"has several along {', '.join(worded)}" if worded else "is a single quantity"
        names = " or ".join(f"{stem}.{x}" for x in labels) or ("another one" if worded else stem)
        raise InputError(f'"{name}": {stem} {has}. Write {names}.', field="quantity")
    values = values.sel({worded[0]: label}, drop=True) if labels else values
    return _in_si(values.assign_coords({dim: _in_si(values[dim]) for dim in values.dims})), stem


def _in_si(values: "xr.DataArray") -> "xr.DataArray":
    try:
        factor, unit = unit_to_si(str(values.attrs.get("units", "")))
    except ValueError as error:
        raise InputError(f"its unit in the grid {error}.", field=str(values.name)) from None
    return (values if factor == 1 else values * factor).assign_attrs(values.attrs | {"units": unit})


def parameter_of(
    values: "xr.DataArray", conditions: Collection[str], requested: str | None, robot: str
) -> tuple[str | None, float]:
    """Name and nominal value of the axis that is no condition, None and 1 where there is none.

    `requested` is `Cn=1`, or a name alone; else it is the only such axis, and its value that in the `robot` (YAML),
    which the sweep was made of. Raises InputError where either is not known.
    """
    dims = [str(dim) for dim in values.dims]
    others = [dim for dim in dims if dim not in conditions]
    if requested is None and not others:
        return None, 1.0
    if requested is None and len(others) > 1:
        raise InputError(
            f"the grid has {' and '.join(others)}, which are no conditions of the campaign; only one of them can be "
            "the parameter. Name it, as in Cn=1, and write the others into the campaign.",
            field="parameter",
        )
    name, _, text = (others[0] if requested is None else requested).partition("=")
    name, text = name.strip(), text.strip()
    if name not in dims:
        raise InputError(f'"{name}" is no dimension of the grid, which has {", ".join(dims)}.', field="parameter")
    if name in conditions:
        raise InputError(f"{name} is a condition of the campaign, and so no parameter to estimate.", field="parameter")
    return name, _given(values, name, text) if text else _own(name, robot)


def simulated_at(grid: "xr.Dataset", measured: "xr.Dataset", quantity: str | None) -> "xr.DataArray":
    """What a grid has at the conditions of a table by `condition_means`, over its `condition`; as the grid's robot is.

    `quantity` is as `quantity_of` takes it. Raises InputError where the grid has no such quantity, other conditions or
    units than the table, or ends before one of them.
    """
    import xarray as xr

    column, conditions = str(measured.attrs["column"]), measured.attrs["conditions"].splitlines()
    values, _, of = quantity_of(grid, [column], quantity)
    units = [(name, values[name], measured[name]) for name in values.dims if name in conditions]
    for name, ours, theirs in [(column, values, measured["mean"]), *units]:
        if unit_of(ours) != unit_of(theirs):
            here, there = (unit_of(x) or "no unit" for x in (theirs, ours))
            raise InputError(f"is measured in {here}, and in {there} in the grid.", field=str(name))
    if of != column and quantity is None:
        raise InputError(f"the grid has {of}, and measured is {column}. Name one, as in force.y.", field="quantity")
    others = [str(name) for name in values.dims if name not in conditions]
    try:
        table = table_of(values, *parameter_of(values, conditions, None, str(grid.attrs.get("robot", ""))))
    except InputError as error:
        if error.field != "parameter":
            raise
        why = "is a dimension of the grid, and no condition of the campaign. Sweep at one value of it."
        raise InputError(why, field=", ".join(others)) from None
    for name in table.names:
        if name not in conditions:
            raise InputError("is a dimension of the grid, and no condition of the campaign.", field=name)
    points = np.stack([measured[name].values for name in table.names], axis=1)
    return xr.DataArray(table.simulated(points)[0], dims="condition", attrs={"units": table.unit or "1"})


def _given(values: "xr.DataArray", name: str, text: str) -> float:
    try:
        value, unit = read_any(text)
    except ValueError as error:
        raise InputError(str(error), field="parameter") from None
    expected = str(values[name].attrs.get("units", ""))
    if unit != expected:
        words = f'"{text}" is in {unit or "no unit"}, in the grid {name} is in {expected or "no unit"}.'
        raise InputError(words, field="parameter")
    return value


def _own(name: str, robot: str) -> float:
    way = f"Give what the simulator takes it to be, as in {name}=1."
    if not robot:
        raise InputError(f"the grid does not hold the robot, which would give {name}. {way}", field="parameter")
    try:
        return float(get_value(parse_robot(robot, "the grid's robot"), name))
    except (InputError, TypeError, ValueError):
        raise InputError(f"the grid's robot has no {name}. {way}", field="parameter") from None
