"""The run of Figs. 5, 6 and 13: swim, sink, walk back, rise, with one set of equations; and the shortest such run.

The parameters are those of Tables 1 and 3; the schedule is that of the mission file that ships, most of it assumed.
The paper crosses once in each way (section 3) and asks for no best schedule. The shortest one varies the schedule and
the crank speeds: across the tank by the jet, and back on the legs.
"""

import numpy as np
import xarray as xr

from nectosome.description.mission import get_schedule, load_mission
from nectosome.designs import ScheduleDesign, shipped_problem
from nectosome.robots import describe, mission_of
from nectosome.search import CmaEs, Evaluation, minimise
from nectosome.solve import Flown, mission_data, run_mission
from nectosome.units import show_quantity

from ..study import Progress, StudyPart

ROBOT, TURNING = "poseidrone", "poseidrone_turning"
_TURNS = 10  # of the cranks, at the end of crawling: the paper takes the last 5 s
_LEGS = "crawl.legs"
_EVALUATIONS = 120
_SPEEDS = 11  # of the cranks


def part(quick: bool, progress: Progress) -> StudyPart:
    """Rows `mission`; data `mission`, as `solve.mission_data` has it."""
    description, path = describe(ROBOT), mission_of(ROBOT)
    assert path is not None
    mission = load_mission(path, description)
    flown = run_mission(mission, progress=lambda mode, done: progress(f"mission: {mode}", done))
    numbers = {
        "poseidrone/mission/touchdown": flown.event_time("dive"),
        "poseidrone/mission/crawl-speed": crawl_speed(flown),
        "poseidrone/mission/liftoff": flown.event_time("inflate"),
    }
    data = {"mission": mission_data(flown, {"robot": ROBOT, "mission": path.name})}
    if not quick:
        data["mission_turning"] = mission_data(_turning(progress))
    return StudyPart(numbers, data)


def _turning(progress: Progress) -> Flown:
    """The crawler, free in space, that turns round at a wall of its tank."""
    path = mission_of(TURNING)
    assert path is not None
    mission = load_mission(path, describe(TURNING))
    return run_mission(mission, progress=lambda mode, _: progress(f"turning: {mode}", 0.9))


def crawl_speed(flown: Flown, mode: str = "crawl") -> float | None:
    """Mean speed [m/s] along x over the last ten turns of the cranks in a mode; None where it does not last."""
    end, (crank,) = flown.event_time(mode), [m for m in flown.mission.modes if m.name == mode]
    speed = crank.changes["body.loads.front.speed"].value
    began = flown.time[flown.mode == flown.mission.modes.index(crank)][0]
    length = _TURNS * 2 * np.pi / abs(speed)
    if end is None or end - length < began:
        return None
    x = np.interp([end - length, end], flown.time, flown.measures.position[:, 0])
    return float(x[1] - x[0]) / length


def schedule_part(quick: bool, progress: Progress) -> StudyPart:
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
    rows[:, task.names.index(_LEGS)] = np.linspace(0.0, 1.0, _SPEEDS)
    return [evaluate(row, False, None) for row in rows]


def cranks_data(task: ScheduleDesign, best: Evaluation, swept: list[Evaluation]) -> xr.Dataset:
    """Time of the missions [s] over the speed of the legs' cranks, NaN where they have none; the best one of all."""
    k, values = task.names.index(_LEGS), task.box.values(best.u)
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
            "assumed_speed": get_schedule(task.mission, _LEGS),
        },
    )


def _time(evaluation: Evaluation) -> float | None:
    return evaluation.objective if evaluation.solved else None
