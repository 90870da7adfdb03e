"""The run of Figs. 5, 6 and 13: swim, sink, walk back, rise, in one go, with one set of equations.

The parameters are those of Tables 1 and 3; the schedule is that of the mission file that ships, most of it assumed.
"""

import numpy as np

from nectosome.description.mission import load_mission
from nectosome.robots import describe, mission_of
from nectosome.solve import Flown, mission_data, run_mission

from ..study import Progress, StudyPart

ROBOT, TURNING = "poseidrone", "poseidrone_turning"
_TURNS = 10  # of the cranks, at the end of crawling: the paper takes the last 5 s
_STEP, _QUICK = 5e-4, 1e-3  # s


def part(quick: bool, progress: Progress) -> StudyPart:
    """Rows `mission`; data `mission`, as `solve.mission_data` has it."""
    description, path = describe(ROBOT), mission_of(ROBOT)
    assert path is not None
    mission = load_mission(path, description)
    step = _QUICK if quick else _STEP
    flown = run_mission(mission, step=step, progress=lambda mode, done: progress(f"mission: {mode}", done))
    numbers = {
        "poseidrone/mission/touchdown": flown.event_time("dive"),
        "poseidrone/mission/crawl-speed": crawl_speed(flown),
        "poseidrone/mission/liftoff": flown.event_time("inflate"),
    }
    data = {"mission": mission_data(flown, {"robot": ROBOT, "mission": path.name, "step": step})}
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
