"""PoseiDRONE's mission: swim, sink, walk back, rise; and what a finer tolerance changes."""

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
    for what, rtol in (("with compilation", 1e-6), ("compiled", 1e-6), ("tolerance 1e-8, compiled", 1e-8)):
        wall, spent, flown = timed(lambda rtol=rtol: run_mission(mission, rtol=rtol, atol=1e-2 * rtol))
        lasted = flown.passed[-1].time
        line = (
            f"{len(flown.passed)} modes, {lasted:.1f} s in {spent:.1f} s, {lasted / spent:.0f} times as fast as it is"
        )
        print(f"    {what:24s} {line} (wall {wall:.1f} s)", flush=True)
        runs[rtol] = np.array([passed.time for passed in flown.passed])
    print(f"    events at the finer one: within {1e3 * np.abs(runs[1e-6] - runs[1e-8]).max():.3g} ms")


if __name__ == "__main__":
    main()
