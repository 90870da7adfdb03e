"""The study of the paddle: its thrust (Experiment A), and swims of the robot with four of them (Experiment B)."""

import math
from concurrent.futures import Executor, Future

import numpy as np
import xarray as xr

from nectosome.description import with_values
from nectosome.loads import Spring
from nectosome.model import build
from nectosome.robots import beetle, describe
from nectosome.search import Workers

from ..study import Progress, StudyPart, collected
from . import carried, misprints, rotation, servos, steering, swim, thrust, transfer, trials, truths, water
from .figures import panels
from .swim import SPEEDS, YAWS

__all__ = ["panels", "part"]
_JOINTS = (1, 2, 3)
_MORE = (4, 5)  # joints, at one stroke only
_FREQUENCIES = (0.6, 1.1)  # Hz: that of Fig. 4, and that of the fastest swim
_CYCLES = {f"n{n}_{f}Hz": (n, f) for f in _FREQUENCIES for n in _JOINTS}  # joints, frequency
_RATED = {f"n3_{f}Hz": (3, f) for f in _FREQUENCIES}  # of which the paper reports gain over loss, for one stroke
_MEASURED = 1.1 + 1e-9  # Hz: up to it thrust was measured with one, two and three joints
_WORKERS = 2  # processes
_ROBOTS = 20  # made within tolerances; the paper swam five times with its one robot
_UNPUBLISHED = [f"paddle/table3/{how}" for how in ("cn", "svd", "cn-svd")]  # rows that need the paper's recordings
_LEFT = (5, 15, 30, 45, 55, 65, 70, 73, 75)  # deg: amplitudes of the side that rows less


def part(quick: bool, progress: Progress) -> StudyPart:
    """All rows and figures; `quick` sweeps over coarser grids, and draws only what rows are made of."""
    data = _sweeps(quick, progress)
    with Workers(_WORKERS) as workers:
        done = _parts(quick, data["hinges"], progress, workers.pool)
        shipped = workers.pool.submit(servos.as_shipped)
        better_water = workers.pool.submit(water.numbers, done["table5"].attrs["drag_area"])
        data |= _transfer(quick, progress, workers.pool)
        beside = {**better_water.result(), **shipped.result()}
    runs = {name: done.pop(name) for name in (_RATED if quick else _CYCLES)}
    data |= done
    numbers = {
        **_thrusts(data, runs),
        **_speeds(data),
        **servos.numbers(data["servos"]),
        **carried.numbers(data["carried"]),
        **trials.numbers(data["servo_yaw"]),
        **transfer.numbers(data["transfer"]),
        **rotation.numbers(data["rotation"]),
        **misprints.numbers(),
        **dict.fromkeys(_UNPUBLISHED),
        **beside,
    }
    return StudyPart(numbers, data, runs)


def _sweeps(quick: bool, tell: Progress) -> dict[str, xr.Dataset]:
    """By figure: `strokes` (joints, amplitude, frequency), `joints` (joints, ...), `hinges` (thickness, length)."""
    amplitudes, frequencies = np.arange(30, 76, 15 if quick else 5), _frequencies(quick)
    tell("strokes", 0.0)
    strokes = thrust.over_strokes(_JOINTS, np.radians(amplitudes).tolist(), frequencies)
    tell("joints", 0.15)
    others = thrust.over_strokes((0, *_MORE), [math.radians(75)], [1.1])
    one = strokes.sel(amplitude=others["amplitude"], frequency=others["frequency"])
    tell("hinges", 0.25)
    steps = (4, 9) if quick else (13, 9)
    hinges = thrust.over_hinges(np.linspace(2e-3, 8e-3, steps[0]).tolist(), np.linspace(0.03, 0.15, steps[1]).tolist())
    return {"strokes": strokes, "joints": xr.concat([others, one], "joints").sortby("joints"), "hinges": hinges}


def _frequencies(coarse: bool) -> list[float]:
    return (np.arange(3, 14, 2 if coarse else 1) / 10).tolist()


def _parts(quick: bool, hinges: xr.Dataset, tell: Progress, executor: Executor) -> dict[str, xr.Dataset]:
    """Cycles by name, and by figure `table5`, `servos` (row), `yaw`, `servo_yaw` (row, trial), `carried` (share).

    And not if quick `best` (chosen), `front_power` and `front_stress` (level), `speeds` (joints, amplitude, frequency),
    `steering` (left), `heading` (control, time).
    """
    submit = executor.submit
    drag_area, servo_area = submit(swim.calibrated_drag_area), submit(servos.fitted_drag_area)
    waiting: dict[Future, str] = {
        submit(thrust.cycle, *of): name for name, of in (_RATED if quick else _CYCLES).items()
    }
    if not quick:
        waiting[submit(thrust.best_strokes)] = "best"
        waiting |= {submit(thrust.front, hinges, cost): f"front_{cost}" for cost in thrust.COSTS}
    tell("cycles, designs and swims", 0.3)
    area, robots = drag_area.result(), 1 if quick else _ROBOTS
    table5 = submit(swim.table5, area)
    waiting[submit(trials.trials, YAWS if quick else SPEEDS, area, robots)] = "yaw"
    if not quick:
        one = with_values(swim.with_ideal_drives(beetle(1)), {"A": math.radians(75), "f": 1.1, "drag_area": area})
        waiting[submit(steering.turns, one, np.radians(_LEFT).tolist())] = "steering"
        waiting[submit(steering.compared, one)] = "heading"
        slope = table5.result().attrs["drop_slope"]
        waiting[submit(swim.curves, area, slope, _frequencies(coarse=True))] = "speeds"
    waiting[table5] = "table5"
    own = servo_area.result()
    waiting[submit(servos.swims_on_servos, own)] = "servos"
    waiting[submit(trials.servo_trials, own, robots)] = "servo_yaw"
    waiting[submit(carried.carried, area, own, (0.0, 1.0) if quick else carried.SHARES)] = "carried"
    what, total = "cycles, designs and swims", len(waiting)
    return collected(waiting, lambda count: tell(f"{what}: {count} of {total}", 0.3 + 0.5 * count / total))


def _transfer(quick: bool, tell: Progress, pool: Executor) -> dict[str, xr.Dataset]:
    """`transfer` (case, correction, ratio), `rotation` (truth, by); not if quick `transfer_maps`, `transfer_plans`.

    If quick, one seed, with noise, and without the truth whose robot carries water along, which needs another program.
    """
    tell("synthetic experiments", 0.8)
    simulated = truths.by_coefficient()
    made = truths.truths((*truths.NAMES[: 4 if quick else None], truths.HELD_OUT))
    tell("sim-to-real", 0.85)
    what = (transfer.SCORED, 1, [transfer.NOISE]) if quick else (transfer.METHODS, 5, [transfer.NOISE, 0.0])
    found = {
        "transfer": transfer.compared(simulated, made, *what, pool),
        "rotation": rotation.corrected(simulated, made),
    }
    if not quick:
        found["transfer_maps"] = transfer.mapped(simulated, made.sel(truth="drop"))
        tell("plans of experiments", 0.95)
        found["transfer_plans"] = transfer.planned(simulated, made.sel(truth=["tilt", "drop"]), 2, pool)
    return found


def _speeds(data: dict[str, xr.Dataset]) -> dict[str, float]:
    """Numbers of swims by scorecard row."""
    speed = dict(zip(SPEEDS, data["table5"]["ours"].values.tolist(), strict=True))
    best, fast = (speed[3, math.radians(75), f] for f in (1.1, 1.3))
    rows = {(n, a, f): f"paddle/table5/fp{n}jp/{math.degrees(a):.0f}-{f}/speed" for n, a, f in speed}
    fitted, made = data["table5"].attrs, data["yaw"]
    swims = zip(*(made[name].to_numpy().tolist() for name in ("joints", "amplitude", "frequency")), strict=True)
    yaw = dict(zip(swims, np.degrees(made["yaw_mean"].to_numpy()).mean(axis=1).tolist(), strict=True))
    return (
        {rows[key]: value for key, value in speed.items()}
        | {f"paddle/yaw/{'' if n == 3 else f'fp{n}jp/'}{math.degrees(a):.0f}-{f}": yaw[n, a, f] for n, a, f in YAWS}
        | {
            "paddle/table5/fitted/drag-area": fitted["drag_area"],
            "paddle/table5/fitted/drag-coefficient": fitted["coefficient"],
            "paddle/table5/fitted/cn-at-1.3Hz": swim.drop_factor(1.3, fitted["drop_slope"]),
        }
        | {"paddle/speed-ratio/optimal": best / fast}
    )


def _thrusts(data: dict[str, xr.Dataset], runs: dict[str, xr.Dataset]) -> dict[str, float]:
    """Numbers of single paddles by scorecard row."""
    strokes, by_joints = data["strokes"]["thrust"], data["joints"]["thrust"].squeeze()
    measured = strokes.sel(frequency=strokes["frequency"] <= _MEASURED)
    one, two, three = (measured.sel(joints=n) for n in _JOINTS)
    springs = [a.load for a in build(describe("paddle")).loads if isinstance(a.load, Spring)]
    return (
        {
            "paddle/eq16/k": float(springs[0].stiffness),
            "paddle/fig9/order-share": float(((three > two) & (two > one)).mean()),
            "paddle/rigid/thrust": float(by_joints.sel(joints=0)),
        }
        | {f"paddle/fig9/n{n}/75deg/1.1Hz/thrust": float(by_joints.sel(joints=n)) for n in (*_JOINTS, *_MORE)}
        | {f"paddle/fig9/ratio/{f}Hz": thrust.gain_over_loss(runs[f"n3_{f}Hz"]) for f in _FREQUENCIES}
    )
