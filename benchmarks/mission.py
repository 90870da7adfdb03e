"""PoseiDRONE's mission: swim, sink, walk back, rise; in steps of 1 ms, and what finer ones change."""

import numpy as np

from nectosome.description.mission import load_mission
from nectosome.robots import describe, mission_of
from nectosome.solve import run_mission

from .timing import timed

_ROBOT = "poseidrone"


def main() -> None:
    path = mission_of(_ROBOT)
    assert path is not None
    mission = load_mission(path, describe(_ROBOT))
    print("\nmission of PoseiDRONE, modes that end with events, on one core")
    runs = {}
    for what, step in (("1 ms, with compilation", 1e-3), ("1 ms, compiled", 1e-3), ("0.5 ms, compiled", 5e-4)):
        wall, spent, flown = timed(lambda step=step: run_mission(mission, step=step))
        lasted = flown.passed[-1].time
        line = (
            f"{len(flown.passed)} modes, {lasted:.1f} s in {spent:.1f} s, {lasted / spent:.0f} times as fast as it is"
        )
        print(f"    {what:24s} {line} (wall {wall:.1f} s)", flush=True)
        runs[step] = np.array([passed.time for passed in flown.passed])
    print(f"    events at half the step: within {1e3 * np.abs(runs[1e-3] - runs[5e-4]).max():.3g} ms")


if __name__ == "__main__":
    main()
