"""A simulated grid corrected with the recordings of a campaign, from what was asked to what is known then."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from .conditions import Experiments
from .corrected_data import corrected_data
from .grids import parameter_of, quantity_of, table_of
from .method import SimToReal, leave_one_out
from .next_experiment import Aim, next_experiments
from .observe import Observed, experiments_of, observe

if TYPE_CHECKING:
    import xarray as xr


class CorrectedGrid(NamedTuple):
    """What `correct_grid` gives."""

    data: "xr.Dataset"  # as `corrected_data` has it; attributes tell the `method`, the `nominal` parameter, `told_by`
    observed: list[Observed]
    column: str  # of the recordings


def correct_grid(
    grid: "xr.Dataset",
    recordings: "Sequence[xr.Dataset]",
    *,
    quantity: str | None = None,
    parameter: str | None = None,
    method: str | None = None,
    lowpass: float | None = None,
    count: int = 3,
    aim: Aim = "error",
    progress: Callable[[str, float], object] = lambda _what, _share: None,
) -> CorrectedGrid:
    """Correct a simulated grid with recordings, which have their conditions as coordinates without dimensions.

    - quantity, parameter: as `quantity_of` and `parameter_of` read them.
    - method: of `SimToReal`; left out, cn-gp, or gp where the grid has no axis that is a parameter.
    - lowpass: cutoff for the peaks of recordings [Hz].
    - count, aim: `next_experiments`.
    - progress(what, share) is called now and then; what it raises ends the work.

    Raises InputError where grid and recordings do not fit each other.
    """
    columns = [str(name) for name in recordings[0].data_vars]
    simulated, peak, column = quantity_of(grid, columns, quantity)
    conditions = [str(name) for name, value in recordings[0].coords.items() if value.ndim == 0]
    name, nominal = parameter_of(simulated, conditions, parameter, str(grid.attrs.get("robot", "")))
    how = SimToReal(method or ("gp" if name is None else "cn-gp"))
    table = table_of(simulated, name, nominal)
    peaks = None if peak is None else table_of(peak, name, nominal)
    observed = observe(recordings, simulated, column, name, lowpass=lowpass)
    experiments: Experiments = experiments_of(observed, table, peaks)
    progress("fitting", 0.0)
    fitted = how.fit(table, experiments)
    progress("leaving each out", 0.2)
    left_out = leave_one_out(how, table, experiments)
    progress("next experiments", 0.8)
    planned = next_experiments(how, table, experiments, count, aim)
    found = corrected_data(fitted, simulated, experiments, left_out, planned)
    told_by = "peaks" if experiments.told else "values"
    return CorrectedGrid(found.assign_attrs(method=how.method, nominal=nominal, told_by=told_by), observed, column)
