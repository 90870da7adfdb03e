"""Correction: a simulated grid made to agree with recordings, with the experiments that are worth making next."""

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import CancelledError, Executor
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.designs.axes import AxisValues
from nectosome.designs.kept_parts import Progress
from nectosome.designs.sweep import sweep
from nectosome.io import load_dataset
from nectosome.model.inputs import RobotLike, description_of
from nectosome.units import InputError, check_names, read_positive

from ..recordings import CampaignLike, recordings_of
from .gaussian_process import Surface
from .grids import parameter_of, quantity_of, table_of
from .method import Corrected, SimToReal, leave_one_out
from .next_experiment import Aim, Next, next_experiments
from .observe import Experiments, Observed, experiments_of, observe

if TYPE_CHECKING:
    import xarray as xr

_SWEEP = 0.6  # of the work, where a robot is swept first


class CorrectedGrid(NamedTuple):
    """A simulated grid after its correction."""

    data: "xr.Dataset"  # as `corrected_data` has it; attributes: `method`, the `nominal` parameter, `estimated_from`
    observed: list[Observed]
    column: str  # of the recordings

    def to_dataset(self) -> "xr.Dataset":
        """The grid, the experiments and those to make next (`corrected_data`)."""
        return self.data


def correct(
    simulated: "RobotLike | xr.Dataset",
    campaign: CampaignLike,
    settings: Iterable[str] = (),
    *,
    over: Mapping[str, AxisValues] | None = None,
    quantity: str | None = None,
    parameter: str | None = None,
    method: str | None = None,
    lowpass: str | float | None = None,
    count: int = 3,
    aim: Aim = "error",
    folder: Path | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> CorrectedGrid:
    """Correct a simulated grid with recordings, whose conditions are its dimensions.

        ns.correct("grid.nc", "campaign.yaml", quantity="-force.y")
        ns.correct("robot.yaml", "campaign.yaml", over={"f": "0.5..2:0.5Hz", "Cn": [0.8, 1, 1.2]})

    - simulated: a grid, the path of a saved one (.nc), or a robot with `settings`, which is swept `over` its quantities
      first (`sweep`; finished parts are kept in `folder`).
    - campaign: as `recordings_of` takes it: a campaign file, recordings, or arrays.
    - quantity, parameter: as `quantity_of` and `parameter_of` read them.
    - method: of `SimToReal`; left out, cn-gp, or gp where the grid has no axis that is a parameter.
    - lowpass: cutoff for the peaks of recordings, a number in Hz or text with a unit.
    - count, aim: `next_experiments`.
    - executor: where a robot is swept; all else is computed here.
    - progress(what, share): called between steps; where it returns False, CancelledError is raised.

    Raises InputError where grid and recordings do not fit each other, or what is given cannot be read; LostError
    where the executor ends before.
    """
    import xarray as xr

    share = 0.0

    def report(what: str, done: float) -> None:
        if progress is not None and progress(what, share + (1 - share) * done) is False:
            raise CancelledError

    if method is not None:
        SimToReal(method)  # a mistake in its name comes before anything is read
    cutoff = read_positive(lowpass, "frequency", "lowpass") if isinstance(lowpass, str) else lowpass
    saved = isinstance(simulated, str | Path) and str(simulated).endswith(".nc")
    robot = not saved and not isinstance(simulated, xr.Dataset)
    if robot and not isinstance(simulated, str | Path):
        description_of(simulated)  # pyright: ignore[reportArgumentType]  # a wrong robot is the first error
    if robot and not over:
        raise InputError("a robot is swept first: name at least one axis, as in f=0.5..2:0.5Hz.", field="over")
    check_names(over or {}, "over", "{'f': '0.5..2:0.5Hz'}")
    if not robot and (over or settings):
        raise InputError("axes and settings are of a robot, and a grid is given.", field="over")
    recordings = recordings_of(campaign)  # a mistake in them comes before anything long is computed
    if not recordings:
        raise InputError("there is no recording.", field="campaign")
    if robot:
        swept = None if progress is None else lambda what, done: progress(what, _SWEEP * done)
        how = {"folder": folder, "executor": executor, "progress": swept}
        grid = sweep(simulated, over or {}, settings, **how)  # pyright: ignore[reportArgumentType]
        if (grid["status"] == "CANCELLED").any():
            raise CancelledError
        share = _SWEEP
    else:
        grid = load_dataset(simulated) if saved else simulated  # pyright: ignore[reportArgumentType]
    assert isinstance(grid, xr.Dataset)
    columns = [str(name) for name in recordings[0].data_vars]
    conditions = [str(name) for name, value in recordings[0].coords.items() if value.ndim == 0]
    try:
        values, peak, column = quantity_of(grid, columns, quantity)
        name, nominal = parameter_of(values, conditions, parameter, str(grid.attrs.get("robot", "")))
        how = SimToReal(method or ("gp" if name is None else "cn-gp"))
        table = table_of(values, name, nominal)
        peaks = None if peak is None else table_of(peak, name, nominal)
    except InputError as error:
        raise InputError(error.message, file=str(simulated) if saved else error.file, field=error.field) from None
    observed = observe(recordings, values, column, name, lowpass=cutoff)
    experiments = experiments_of(observed, table, peaks)
    report("fitting", 0.0)
    fitted = how.fit(table, experiments)
    report("leaving each out", 0.2)
    left_out = leave_one_out(how, table, experiments)
    report("next experiments", 0.8)
    planned = next_experiments(how, table, experiments, count, aim)
    found = corrected_data(fitted, values, experiments, left_out, planned)
    source = "peaks" if experiments.estimate else "values"
    data = found.assign_attrs(method=how.method, nominal=nominal, estimated_from=source)
    return CorrectedGrid(data, observed, column)


_TAKEN = ("simulated", "parameter", "measured", "predicted", "expected", "reason")


def corrected_data(
    fitted: Corrected,
    simulated: "xr.DataArray",
    experiments: Experiments,
    left_out: Surface,
    planned: Sequence[Next] = (),
) -> "xr.Dataset":
    """All that is known after a correction of `simulated`, the grid that the table was made of.

    - over the conditions: the quantity by its own name, corrected, and `_error` behind it, its standard error;
      `simulated` with the nominal parameter; `parameter` and `parameter_error` (NaN where none is estimated).
    - over `experiment`: `measured`, `measured_error`, `simulated_there`, `parameter_there`, and its prediction
      by the others, `predicted` and `predicted_error` (`leave_one_out`); its conditions are `measured_<name>`.
    - over `next`: `expected`, `expected_error`, `reason`; its conditions are `next_<name>`.

    Attributes name the `quantity`, its `conditions` and the `parameter`.
    """
    import xarray as xr

    table, grid, estimated = fitted.table, fitted.table.points, fitted.field is not None

    def unit(name: str) -> dict[str, str]:
        return {"units": str(simulated[name].attrs.get("units", ""))}

    def parameter(points: Float[np.ndarray, "n d"]) -> Surface:
        none = np.full(len(points), np.nan)
        return fitted.parameter(points) if estimated else Surface(none, none)

    name, own = str(simulated.name), unit(table.called) if estimated else {"units": ""}
    name = "corrected" if name in _TAKEN or name in table.names else name
    found, field, value = fitted.predict(grid), parameter(grid), {"units": table.unit}
    over = {
        name: (found.mean, value),
        f"{name}_error": (found.error, value),
        "simulated": (table.simulated(grid)[0], value),
        "parameter": (field.mean, own),
        "parameter_error": (field.error, own),
    }
    there = {
        "measured": (experiments.values, value),
        "measured_error": (experiments.errors, value),
        "simulated_there": (table.simulated(experiments.conditions)[0], value),
        "parameter_there": (parameter(experiments.conditions).mean, own),
        "predicted": (left_out.mean, value),
        "predicted_error": (left_out.error, value),
    }
    later = {
        "expected": (np.array([one.expected for one in planned], float), value),
        "expected_error": (np.array([one.error for one in planned], float), value),
        "reason": (np.array([one.reason for one in planned], str), {}),
    }
    points = np.array([one.conditions for one in planned]).reshape(-1, len(table.names))
    shape, names = tuple(x.size for x in table.levels), table.names
    return xr.Dataset(
        {key: (names, x.reshape(shape), attrs) for key, (x, attrs) in over.items()}
        | {key: ("experiment", x, attrs) for key, (x, attrs) in there.items()}
        | {key: ("next", x, attrs) for key, (x, attrs) in later.items()},
        coords={key: (key, x, unit(key)) for key, x in zip(names, table.levels, strict=True)}
        | {f"measured_{k}": ("experiment", x, unit(k)) for k, x in zip(names, experiments.conditions.T, strict=True)}
        | {f"next_{k}": ("next", x, unit(k)) for k, x in zip(names, points.T, strict=True)},
        attrs={"quantity": name, "parameter": table.called if estimated else ""},
    )
