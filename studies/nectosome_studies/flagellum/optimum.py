"""The design optimisation (section III): many starts with three solvers, and what the best design is like."""

import time
from collections.abc import Iterable
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from nectosome.description import RobotDescription, get_value
from nectosome.designs import Limit, MotionDesign, MotorLine
from nectosome.search import CmaEs, Evaluation, Gradient, Optimiser, Pattern, Result, Start, minimise, multistart

from ..study import Progress

SOLVERS: dict[str, Optimiser] = {
    "gradient": Gradient(objective_tolerance=0),  # to the optimality conditions
    "pattern": Pattern(smallest_mesh=1e-4, evaluations=200),
    "evolution": CmaEs(evaluations=150),
}
MOTOR = MotorLine(0.89, 22.0)  # N m at a standstill, rad/s without load, at 6 V
ON_BATTERY = MotorLine(0.89 * 7.4 / 6, 22.0 * 7.4 / 6)  # at the battery's 7.4 V
LINES = {"6 V": MOTOR, "7.4 V": ON_BATTERY}


@dataclass(frozen=True)
class DesignSearch:
    """Results by (solver, seed), and the wall time of each [s]."""

    task: MotionDesign
    results: dict[tuple[str, int], Result]
    seconds: dict[tuple[str, int], float]
    on_line: dict[str, Result]  # within each of the motor's lines, gradient, first seed

    def start(self, solver: str, seed: int | None = None) -> Start:
        """Best start of a solver, with one seed or all."""
        found = [s for (name, k), r in self.results.items() if name == solver and seed in (None, k) for s in r.best()]
        return min(found, key=lambda start: best_of(start).objective)

    def best(self) -> Evaluation:
        """Best evaluation of all."""
        return min((best_of(self.start(name)) for name in SOLVERS), key=lambda e: e.objective)

    def best_on_line(self, voltage: str) -> Evaluation:
        """Best evaluation within the motor's line at this voltage."""
        return best_of(self.on_line[voltage].best()[0])


def best_of(start: Start) -> Evaluation:
    """Best evaluation of a start. Raises RuntimeError where there is none."""
    if start.best is None:
        raise RuntimeError("no start has found a design that keeps all limits")
    return start.best


def search(task: MotionDesign, starts: int, seeds: tuple[int, ...], tell: Progress, executor: Executor) -> DesignSearch:
    """Run every solver from as many starts with each seed."""
    results, seconds = {}, {}
    rounds = [(name, seed) for name in SOLVERS for seed in seeds]
    total = len(rounds) + len(LINES)
    for i, (name, seed) in enumerate(rounds):
        began = time.perf_counter()

        def progress(
            done: int, best: Evaluation | None, _: int, share: float, i: int = i, name: str = name, seed: int = seed
        ) -> None:
            fastest = "" if best is None else f", best {best.outputs['speed']:.3f} m/s"
            tell(f"{name}, seed {seed}: {done} of {starts} starts{fastest}", (i + share) / total)

        results[name, seed] = multistart(task, SOLVERS[name], starts, seed, executor=executor, progress=progress)
        seconds[name, seed] = time.perf_counter() - began
    on_line = {}
    for i, (voltage, line) in enumerate(LINES.items(), start=len(rounds)):
        tell(f"within the motor's line at {voltage}", i / total)
        limited = replace(task, constraints=(line,))
        on_line[voltage] = multistart(limited, SOLVERS["gradient"], max(2, starts // 3), seeds[0], executor=executor)
    return DesignSearch(task, results, seconds, on_line)


def starts_table(search: DesignSearch, printed: dict[str, float]) -> xr.Dataset:
    """Best of every start."""
    units = {"speed": "m/s", "torque": "N m", "seconds": "s", "evaluations": "1", "rejected": "1"}
    solvers, seeds = (list(dict.fromkeys(names)) for names in zip(*search.results, strict=True))
    count = max(len(r.starts) for r in search.results.values())
    table = np.full((len(units), len(solvers), len(seeds), count), np.nan)
    for (name, seed), result in search.results.items():
        for start in result.starts:
            best = (np.nan, np.nan) if start.best is None else [start.best.outputs[k] for k in ("speed", "torque")]
            work = start.seconds, len(start.evaluations) - start.draws, sum(start.rejected.values())
            table[:, solvers.index(name), seeds.index(seed), start.number] = *best, *work
    return xr.Dataset(
        {name: (("solver", "seed", "start"), x, {"units": units[name]}) for name, x in zip(units, table, strict=True)},
        coords={"solver": solvers, "seed": seeds},
        attrs=printed,
    )


def history(search: DesignSearch, printed_speed: float) -> xr.Dataset:
    """Best so far after each iteration of each solver's best start."""
    chosen = {name: search.start(name) for name in SOLVERS}
    most = max(len(start.marks) for start in chosen.values()) + 1
    speed, evaluations = np.full((len(chosen), most), np.nan), np.full((len(chosen), most), np.nan)
    for i, start in enumerate(chosen.values()):
        for k in range(len(start.marks) + 1):
            best = start.best_at(k)
            speed[i, k] = np.nan if best is None else best.outputs["speed"]
            evaluations[i, k] = start.marks[k - 1] - start.draws if k else 0
    return xr.Dataset(
        {
            "speed": (("solver", "iteration"), speed, {"units": "m/s"}),
            "evaluations": (("solver", "iteration"), evaluations),
        },
        coords={"solver": list(chosen), "iteration": np.arange(most)},
        attrs={"printed_speed": printed_speed},
    )


def best_designs(
    task: MotionDesign,
    results: Iterable[Result],
    on_battery: Evaluation,
    table2: list[tuple[RobotDescription, float, float]],
) -> xr.Dataset:
    """The best design that the motor drives at 7.4 V, our five best with 0.5 N m, those of Table II with speed, torque.

    `above_motor_line` is the torque above that of the motor's line at 7.4 V, as a share of its torque at a standstill.
    """
    rows = []

    def add(source: str, e: Evaluation) -> None:
        rows.append((source, *task.box.values(e.u), e.outputs["speed"], e.outputs["torque"]))

    add("ours, motor at 7.4 V", on_battery)
    starts = [s for r in results for s in r.best(5)]
    apart: list[Evaluation] = []
    for e in sorted((s.best for s in starts if s.best is not None), key=lambda e: e.objective):
        if len(apart) < 5 and all(np.abs(e.u - o.u).max() >= 0.01 for o in apart):
            apart.append(e)
    for e in apart:
        add("ours, 0.5 N m", e)
    for description, speed, torque in table2:
        rows.append(("Table II", *(float(get_value(description, v.name)) for v in task.variables), speed, torque))
    names = ("source", *task.names, "speed", "torque")
    columns = {name: ("rank", np.array([row[i] for row in rows])) for i, name in enumerate(names)}
    excess = [ON_BATTERY.excess({"torque": row[-1], "drive_rate": row[1 + task.names.index("omega")]}) for row in rows]
    columns["above_motor_line"] = ("rank", np.array(excess))
    return xr.Dataset(columns)


def sensitivity(task: MotionDesign, best: Evaluation, label: str) -> xr.Dataset:
    """Percent change of speed and torque at a design for 1 percent more of each variable."""
    evaluate = task.prepare()
    e = evaluate(best.u, True, best.memory)
    width = task.box.ends[:, 1] - task.box.ends[:, 0]
    x = task.box.values(best.u)
    along = np.where(task.box.log, 1.0, x) / width  # du for a relative change of x
    limit = task.constraints[0]
    if e.gradient is None or e.jacobian is None or not isinstance(limit, Limit):
        raise RuntimeError(f"{label}: no derivatives at the best design: {e.reason}")
    speed = -e.gradient * along / e.outputs["speed"]
    torque = e.jacobian[0] * limit.value * along / e.outputs["torque"]
    return xr.Dataset(
        {"percent": (("variable", "output"), np.stack([speed, torque], axis=1))},
        coords={"variable": list(task.names), "output": ["speed", "torque"]},
        attrs={"label": label},
    )


def stiffness_trend(task: MotionDesign, best: Evaluation, points: int) -> xr.Dataset:
    """Best Young's modulus and speed with hook angle or tip radius held, all else free; from the best design."""
    spans = {"alpha": np.radians(np.linspace(15, 75, points)), "tip_radius": np.linspace(2e-3, 10e-3, points)}
    value, young, speed = (np.full((2, points), np.nan) for _ in range(3))
    for i, (name, values) in enumerate(spans.items()):
        k = task.names.index(name)
        for j, x in enumerate(values):
            held = replace(task.variables[k], lower=float(x), upper=float(x))
            there = replace(task, variables=(*task.variables[:k], held, *task.variables[k + 1 :]))
            value[i, j] = x
            found = minimise(there, Gradient(objective_tolerance=0, evaluations=60), best.u).best
            if found is not None:
                young[i, j] = there.box.values(found.u)[task.names.index("E")]
                speed[i, j] = found.outputs["speed"]
    dims = ("fixed", "point")
    return xr.Dataset(
        {"value": (dims, value), "young": (dims, young, {"units": "Pa"}), "speed": (dims, speed, {"units": "m/s"})},
        coords={"fixed": list(spans)},
    )


def maps(task: MotionDesign, designs: dict[str, np.ndarray], points: int, limit: float) -> xr.Dataset:
    """Speed and torque over motor speed and Young's modulus, the rest as in each design u."""
    evaluate = task.prepare()
    k_rate, k_young = task.names.index("omega"), task.names.index("E")
    grid = np.linspace(0, 1, points)
    speed, torque = (np.full((len(designs), points, points), np.nan) for _ in range(2))
    for i, u in enumerate(designs.values()):
        for j, rate in enumerate(grid):
            memory = None
            for k in range(points - 1, -1, -1):  # from stiff to soft, each from the one before
                at = u.copy()
                at[k_rate], at[k_young] = rate, grid[k]
                e = evaluate(at, False, memory)
                if e.solved:
                    memory = e.memory
                    speed[i, j, k], torque[i, j, k] = e.outputs["speed"], e.outputs["torque"]
    axes = np.array([task.box.values(np.full(len(task.names), x)) for x in grid])
    here = np.array([task.box.values(u) for u in designs.values()])
    dims = ("design", "omega", "young")
    return xr.Dataset(
        {"speed": (dims, speed, {"units": "m/s"}), "torque": (dims, torque, {"units": "N m"})},
        coords={
            "design": list(designs),
            "omega": axes[:, k_rate],
            "young": axes[:, k_young],
            "here_omega": ("design", here[:, k_rate]),
            "here_young": ("design", here[:, k_young]),
        },
        attrs={"torque_limit": limit},
    )
