"""The schedule and the crank speeds that take the robot across its tank by the jet, and back on its legs, soonest.

The paper crosses once in each way (section 3) and asks for no best schedule: that which ships is assumed.
"""

import numpy as np
import xarray as xr

from nectosome.description.mission import get_schedule
from nectosome.designs import ScheduleDesign, shipped_problem
from nectosome.robots import describe
from nectosome.search import CmaEs, Evaluation, minimise
from nectosome.solve import mission_data, run_mission
from nectosome.units import show_quantity

from ..study import Progress, StudyPart

ROBOT = "poseidrone"
LEGS = "crawl.legs"
_EVALUATIONS = 120
_SPEEDS = 11  # of the cranks


def part(quick: bool, progress: Progress) -> StudyPart:
    """Rows `schedule`; data `schedule_assumed`, `schedule_shortest` as missions, `schedule_cranks` over crank speed.

    The shortest is that of a search, or of the crank speeds around what it found.
    """
    problem = shipped_problem(ROBOT)
    assert problem is not None
    task = problem.task(describe(ROBOT))
    assert isinstance(task, ScheduleDesign)
    own = task.box.places(np.array([get_schedule(task.mission, name) for name in task.names]))
    assumed = task.prepare()(own, False, None)
    numbers = {"poseidrone/schedule/assumed": _time(assumed), "poseidrone/schedule/shortest": None}
    if quick or not assumed.solved:
        return StudyPart(numbers)

    def tell(done: int, lowest: float) -> None:
        progress(f"schedule: {done} missions", 0.9 * min(done / _EVALUATIONS, 1.0))

    best = minimise(task, CmaEs(tolerance=1e-3, evaluations=_EVALUATIONS), own, progress=tell).best
    if best is None:
        return StudyPart(numbers)
    progress("schedule: crank speeds", 0.9)
    swept = cranks(task, best)
    best = min((e for e in (best, *swept) if e.solved), key=lambda e: e.objective)
    data = {
        "schedule_assumed": mission_data(run_mission(task.mission)),
        "schedule_shortest": mission_data(run_mission(task.mission_at(best.u))),
        "schedule_cranks": cranks_data(task, best, swept),
    }
    return StudyPart(numbers | {"poseidrone/schedule/shortest": _time(best)}, data)


def cranks(task: ScheduleDesign, best: Evaluation) -> list[Evaluation]:
    """Missions with the legs' cranks at speeds in their range, slowest first, all else as in the best."""
    evaluate = task.prepare()
    rows = np.tile(best.u, (_SPEEDS, 1))
    rows[:, task.names.index(LEGS)] = np.linspace(0.0, 1.0, _SPEEDS)
    return [evaluate(row, False, None) for row in rows]


def cranks_data(task: ScheduleDesign, best: Evaluation, swept: list[Evaluation]) -> xr.Dataset:
    """Time of the missions [s] over the speed of the legs' cranks, NaN where they have none; the best one of all."""
    k, values = task.names.index(LEGS), task.box.values(best.u)
    speeds = task.box.values(np.array([e.u for e in swept]))[:, k]
    words = [show_quantity(x, v.dimension) for x, v in zip(values, task.variables, strict=True)]
    return xr.Dataset(
        {
            "time": ("speed", [e.objective for e in swept], {"units": "s"}),
            "best": ("variable", words),
        },
        {"speed": ("speed", speeds, {"units": "rad/s"}), "variable": list(task.names)},
        {
            "shortest": best.objective,
            "best_speed": float(values[k]),
            "assumed_speed": get_schedule(task.mission, LEGS),
        },
    )


def _time(evaluation: Evaluation) -> float | None:
    return evaluation.objective if evaluation.solved else None
