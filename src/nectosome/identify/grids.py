"""Simulated grids: which of their quantities is meant, and which axis is a parameter's."""

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, NamedTuple

from nectosome.io import InputError, did_you_mean, get_value, parse_robot
from nectosome.io.units import read_any, unit_to_si

if TYPE_CHECKING:
    import xarray as xr


class Quantity(NamedTuple):
    """What is simulated, in SI units over dimensions with numbers, and the column of recordings it belongs to."""

    values: "xr.DataArray"
    peak: "xr.DataArray | None"  # its largest magnitude, where the grid has it
    column: str


def quantity_of(grid: "xr.Dataset", columns: Sequence[str], asked: str | None) -> Quantity:
    """The quantity that is asked for, `force.y` or `-force.y`; else the only one that grid and columns both have.

    Raises InputError where there is none, or where it is not said which.
    """
    if asked is None:
        both = [name for name in columns if _known(grid, name)]
        if len(both) != 1:
            what = f"which of {', '.join(both)} is meant?" if both else "the grid and the recordings share no quantity:"
            names = f"the recordings have {', '.join(columns)}, the grid has {', '.join(_numeric(grid))}"
            raise InputError(f"{what} {names}. Name one, as in force.y.", field="quantity")
        asked = both[0]
    name = asked.removeprefix("-").strip()
    values, stem = _values(grid, name)
    peak = f"{stem}_peak" in grid and grid[f"{stem}_peak"].dims == grid[stem].dims
    column = name if name in columns else stem
    return Quantity(
        -values if asked.startswith("-") else values,
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
    values: "xr.DataArray", conditions: Collection[str], asked: str | None, robot: str
) -> tuple[str | None, float]:
    """Name and nominal value of the axis that is no condition, None and 1 where there is none.

    `asked` is `Cn=1`, or a name alone; else it is the only such axis, and its value that in the `robot` (YAML), which
    the sweep was made of. Raises InputError where either is not known.
    """
    dims = [str(dim) for dim in values.dims]
    others = [dim for dim in dims if dim not in conditions]
    if asked is None and not others:
        return None, 1.0
    if asked is None and len(others) > 1:
        raise InputError(
            f"the grid has {' and '.join(others)}, which are no conditions of the campaign; only one of them can be "
            "the parameter. Name it, as in Cn=1, and write the others into the campaign.",
            field="parameter",
        )
    name, _, text = (others[0] if asked is None else asked).partition("=")
    name, text = name.strip(), text.strip()
    if name not in dims:
        raise InputError(f'"{name}" is no dimension of the grid, which has {", ".join(dims)}.', field="parameter")
    if name in conditions:
        raise InputError(f"{name} is a condition of the campaign, and so no parameter to be told.", field="parameter")
    return name, _given(values, name, text) if text else _own(name, robot)


def _given(values: "xr.DataArray", name: str, text: str) -> float:
    try:
        value, unit = read_any(text)
    except ValueError as error:
        raise InputError(str(error), field="parameter") from None
    wanted = str(values[name].attrs.get("units", ""))
    if unit != wanted:
        raise InputError(
            f'"{text}" is in {unit or "no unit"}, in the grid {name} is in {wanted or "no unit"}.', field="parameter"
        )
    return value


def _own(name: str, robot: str) -> float:
    way = f"Give what the simulator takes it to be, as in {name}=1."
    if not robot:
        raise InputError(f"the grid does not hold the robot, which would tell {name}. {way}", field="parameter")
    try:
        return float(get_value(parse_robot(robot, "the grid's robot"), name))
    except (InputError, TypeError, ValueError):
        raise InputError(f"the grid's robot has no {name}. {way}", field="parameter") from None
