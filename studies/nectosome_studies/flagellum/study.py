"""The whole study: swimming from rest, the design optimisation, the composite, the weights test, the pool."""

import math
from concurrent.futures import Executor
from itertools import combinations
from typing import Any

import numpy as np
import xarray as xr

from nectosome.description import RobotDescription, apply_settings, get_value, with_values
from nectosome.designs.composite import ratio_of, young_of
from nectosome.model import build
from nectosome.robots import describe, flagella
from nectosome.search import Workers
from nectosome.solve import simulate

from ..study import Progress, StudyPart, collected, printed
from . import optimum, water
from .figures import panels
from .prototype import at_one_speed, on_motor_line, pool_swims, stiffness_test
from .steady_swims import Swimmer, design_task, lateral_share, reaction_over_a_turn

__all__ = ["panels", "part"]

NAME = "flagellum"
_QUANTITIES = {
    "length": "limbs.filament.length",
    "tip_radius": "limbs.filament.tip_radius",
    "bend": "limbs.hook.bend",
    "rate": "limbs.shaft.joint.motion.rate",
    "young": "limbs.filament.young",
}
_OLD = {"length": 0.300, "tip_radius": 2e-3, "bend": 45.0, "rate": 14.4}
_FIG3 = {"length": 0.300, "tip_radius": 1e-3, "bend": 70.0, "rate": 15.0, "young": 8.5e6}
_FREE_RTOL = 1e-3  # of the robot with four flagella, an example that no row depends on
_STARTS, _SEEDS = 20, (1, 2, 3)
_WORKERS = 2  # processes
_SETTLE = 5.0  # s: the slowest mode decays at 1.9 1/s or faster


_Job = tuple[str, RobotDescription, float]  # label, robot, duration [s]


def part(quick: bool, progress: Progress) -> StudyPart:
    """All runs and rows; `quick` keeps the rows, loosens the integration tolerance and searches from fewer starts."""
    book = printed(NAME)
    rtol = 1e-4 if quick else 1e-5
    base = describe("flagellum")

    starts, seeds = (4, (1,)) if quick else (_STARTS, _SEEDS)

    def searching(what: str, share: float) -> None:
        progress(what, 0.6 * share)

    with Workers(_WORKERS) as workers:
        found = optimum.search(design_task(base), starts, seeds, searching, workers.pool)
        best = found.task.robot_at(optimum.best_of(found.start("gradient")).u)
        doubled = apply_settings(_of_order(best, 6), ["limbs.filament.points=20"])
        weights, fine = workers.pool.submit(stiffness_test), workers.pool.submit(_speed_and_torque, doubled)
        better_water = workers.pool.submit(water.numbers)
        runs = _integrate(_jobs(base, book, quick) | _optimum_jobs(found, best), rtol, progress, workers.pool)
        test, (fine_speed, fine_torque), in_water = weights.result(), fine.result(), better_water.result()
    for k in range(1, 6):
        runs[f"row{k}"].attrs["printed_speed"] = book[f"flagellum/table2/row{k}/speed"]["printed"]

    progress("maps, sensitivities, pool", 0.9)
    data = _search_data(found, runs, book, quick)
    tested = _prototype(base, book, test)
    numbers = {
        **_optimum_numbers(found),
        **_numbers(runs),
        "flagellum/optimum/gradient/dynamics-speed": steady_speed(runs["optimum"]),
        "flagellum/optimum/gradient/order6-speed": fine_speed,
        "flagellum/optimum/gradient/order6-torque": fine_torque,
        **tested.numbers,
        **in_water,
    }
    return StudyPart(numbers, data | tested.data, runs)


def _integrate(jobs: dict[str, _Job], rtol: float, progress: Progress, executor: Executor) -> dict[str, xr.Dataset]:
    """All runs from rest, by key; those that take long first."""
    waiting = {}
    for key in sorted(jobs, key=lambda key: key != "flagella4"):
        waiting[executor.submit(_run_from_rest, *jobs[key], _FREE_RTOL if key == "flagella4" else rtol)] = key
    total = len(jobs)
    runs = collected(waiting, lambda n: progress(f"from rest: {n} of {total} runs", 0.6 + 0.3 * n / total))
    return {key: runs[key] for key in jobs}


def _run_from_rest(label: str, description: RobotDescription, duration: float, rtol: float) -> xr.Dataset:
    solution = simulate(build(description), duration, rtol=rtol, atol=rtol * 1e-2)
    run = solution.to_dataset({"time": duration, "rtol": rtol})
    run.attrs["label"] = label
    return run


def _jobs(base: RobotDescription, book: dict[str, Any], quick: bool) -> dict[str, _Job]:
    """Runs from rest of what the paper prints; and, unless quick, of the example with four flagella."""
    jobs: dict[str, _Job] = {}
    for k in range(1, 6):
        entry = book[f"flagellum/table2/row{k}/speed"]
        jobs[f"row{k}"] = (f"Table II, row {k}", printed_design(base, entry["design"]), _SETTLE)
    jobs["old_soft"] = ("old design, silicone", printed_design(base, {**_OLD, "young": 1378.95e3}), _SETTLE)
    jobs["old_rigid"] = ("old design, ABS", printed_design(base, {**_OLD, "young": 1681e6}), _SETTLE)
    for order in range(6):
        jobs[f"order{order}"] = (f"order {order}", _of_order(printed_design(base, _FIG3), order), _SETTLE)
    if not quick:
        jobs["flagella4"] = ("four flagella on one free canister", flagella(4), 1.0)
    return jobs


def _of_order(description: RobotDescription, order: int) -> RobotDescription:
    strains = f"limbs.filament.strains={{torsion: {order}, bending_y: {order}, bending_z: {order}}}"
    return apply_settings(description, [strains])


def _optimum_jobs(found: optimum.DesignSearch, best: RobotDescription) -> dict[str, _Job]:
    """Runs from rest of the best designs, and of what one pattern search had after 1, 5 and 20 iterations (Fig. 4)."""
    on_battery = found.task.robot_at(found.best_on_line("7.4 V").u)
    jobs = {
        "optimum": ("our optimum for 0.5 N m at any speed", best, _SETTLE),
        "on_battery": ("our optimum for the motor at 7.4 V", on_battery, _SETTLE),
    }
    start = found.start("pattern", 1)
    for k in (1, 5, 20):
        if (by_then := start.best_at(k)) is not None:
            jobs[f"iteration{k}"] = (f"pattern search, iteration {k}", found.task.robot_at(by_then.u), 2.5)
    return jobs


def _optimum_numbers(found: optimum.DesignSearch) -> dict[str, float]:
    """Worst over the seeds of each solver's best speed, and means of what it took."""
    out: dict[str, float] = {}
    seeds = list(dict.fromkeys(seed for _, seed in found.results))
    for name in optimum.SOLVERS:
        worst = max((optimum.best_of(found.start(name, seed)) for seed in seeds), key=lambda e: e.objective)
        overall = found.best().objective
        starts = [start for seed in seeds for start in found.results[name, seed].starts]
        near = [start.best is not None and start.best.objective <= 0.99 * overall for start in starts]
        spent = sum(found.seconds[name, seed] for seed in seeds) * _WORKERS
        out |= {
            f"flagellum/optimum/{name}/speed": worst.outputs["speed"],
            f"flagellum/optimum/{name}/torque": worst.outputs["torque"],
            f"flagellum/optimum/{name}/share": sum(near) / len(near),
            f"flagellum/optimum/{name}/seconds": spent / len(starts),
            f"flagellum/optimum/{name}/evaluations": sum(len(s.evaluations) - s.draws for s in starts) / len(starts),
        }
    straight = Swimmer(with_values(found.task.description, {"alpha": 0.0})).swim()
    on_battery = found.best_on_line("7.4 V").outputs
    return out | {
        "flagellum/optimum/gradient/rate": optimum.best_of(found.start("gradient")).outputs["drive_rate"],
        "flagellum/motor-line/speed": found.best_on_line("6 V").outputs["speed"],
        "flagellum/motor-line/7.4V/speed": on_battery["speed"],
        "flagellum/motor-line/7.4V/torque": on_battery["torque"],
        "flagellum/motor-line/7.4V/rate": on_battery["drive_rate"],
        "flagellum/alpha0/speed": straight.speed,
    }


def _speed_and_torque(description: RobotDescription) -> tuple[float, float]:
    return Swimmer(description).swim()[:2]


def _search_data(
    found: optimum.DesignSearch, runs: dict[str, xr.Dataset], book: dict[str, Any], quick: bool
) -> dict[str, xr.Dataset]:
    """What the report draws of the searches."""
    task, best = found.task, found.best()
    printed_best = {
        f"printed_{name}": book[f"flagellum/optimum/gradient/{name}"]["printed"] for name in ("speed", "seconds")
    }
    table2 = []
    for k in range(1, 6):
        run = runs[f"row{k}"]
        design = printed_design(task.description, book[f"flagellum/table2/row{k}/speed"]["design"])
        table2.append((design, steady_speed(run), float(run["reaction"][-1, 0])))
    designs = {
        "old design": task.box.design(printed_design(task.description, {**_OLD, "young": 7.4e6})),
        "Table II, row 1": task.box.design(task.description),
        "ours, motor at 7.4 V": found.best_on_line("7.4 V").u,
        "ours, 0.5 N m": best.u,
    }
    return {
        "starts": optimum.starts_table(found, printed_best),
        "history": optimum.history(found, printed_best["printed_speed"]),
        "best": optimum.best_designs(task, found.results.values(), found.best_on_line("7.4 V"), table2),
        "map": optimum.maps(task, designs, 9 if quick else 21, 0.5),
        "sensitivity": optimum.sensitivity(task, best, "our optimum for 0.5 N m"),
        "trend": optimum.stiffness_trend(task, best, 4 if quick else 9),
    }


def _prototype(base: RobotDescription, book: dict[str, Any], test: xr.Dataset) -> StudyPart:
    """Composite, weights test and pool: numbers by row, and what the report draws."""
    core, shell, target = 17e6, 592e3, 7.4e6
    ratios = np.linspace(0, 1, 101)
    composite = xr.Dataset(
        {"young": (("rule", "beta"), [[young_of(b, core, shell, rule) for b in ratios] for rule in ("EJ", "EJV")])},
        coords={"rule": ["EJ", "EJV"], "beta": ratios},
        attrs={"target": target, "printed_beta": 0.81, "measured": 7.9e6},
    )
    old, new = (printed_design(base, {**design, "young": 7.9e6}) for design in (_OLD, {}))
    speeds = {key: book[f"flagellum/pool/{key}/speed"]["printed"] for key in ("old", "new")}
    pool = pool_swims(old, new, {**speeds, "old_measured": 0.160, "new_measured": 0.311})
    common = {rate: at_one_speed(old, new, speeds["old"], rate)[1] for rate in (11.0, 12.0)}
    turn = reaction_over_a_turn(
        build(base), Swimmer(base).swim().state, float(get_value(base, "omega")), ("hook", "filament")
    )
    numbers: dict[str, float | None] = {
        "flagellum/composite/beta-ej": ratio_of(target, core, shell, "EJ"),
        "flagellum/composite/beta-ejv": ratio_of(target, core, shell, "EJV"),
        "flagellum/composite/E-at-0.81": 1e-6 * young_of(0.81, core, shell, "EJ"),
        "flagellum/static-test/E": 1e-6 * test.attrs["young"],
        "flagellum/pool/old/speed": float(pool["ours"][0]),
        "flagellum/pool/new/speed": float(pool["ours"][1]),
        "flagellum/pool/reaction/lateral": lateral_share(turn),
        "flagellum/motor-line/table2-speed": on_motor_line(base)[1].speed,
        "flagellum/motor-line/7.4V/table2-speed": on_motor_line(base, motor=optimum.ON_BATTERY)[1].speed,
    }
    for rate, swim in common.items():
        numbers[f"flagellum/pool/{rate:g}-rad-s/new/speed"] = swim.speed
        numbers[f"flagellum/pool/{rate:g}-rad-s/new/torque"] = swim.torque
    return StudyPart(numbers, {"composite": composite, "static_test": test, "pool": pool})


def printed_design(base: RobotDescription, design: dict[str, float]) -> RobotDescription:
    """The flagellum with other numbers; `bend` in degrees, all else SI."""
    values = {_QUANTITIES[name]: math.radians(x) if name == "bend" else x for name, x in design.items()}
    return with_values(base, values)


def steady_speed(run: xr.Dataset) -> float:
    """Forward speed [m/s] at the end of a run, forward being -x; raises where it had not settled to 1e-4 of itself."""
    speed = -run["velocity"].sel(part="body", axis="x").values
    last = speed[run["time"].values >= run["time"].values[-1] - 0.5]
    if np.ptp(last) > 1e-4 * np.max(np.abs(last)):
        raise RuntimeError(f"{run.attrs['label']}: still accelerating at {float(run['time'][-1])} s")
    return float(last[-1])


def _numbers(runs: dict[str, xr.Dataset]) -> dict[str, float]:
    """Our numbers by scorecard row."""
    speed = {key: steady_speed(runs[key]) for key in runs if key != "flagella4" and not key.startswith("iteration")}
    table = {k: speed[f"row{k}"] for k in range(1, 6)}
    ordered = [a > b for a, b in combinations(table.values(), 2)]
    gain = {order: speed[f"order{order}"] / speed[f"order{order - 1}"] - 1 for order in (1, 3)}
    return {
        **{f"flagellum/table2/row{k}/speed": x for k, x in table.items()},
        **{f"flagellum/table2/row{k}/torque": float(runs[f"row{k}"]["reaction"][-1, 0]) for k in table},
        "flagellum/table2/order": sum(ordered) / len(ordered),
        **{f"flagellum/fig3/order{order}/speed": speed[f"order{order}"] for order in range(6)},
        **{f"flagellum/fig3/order{order}/increment": 100 * x for order, x in gain.items()},
        "flagellum/rigid/speed": speed["old_rigid"],
        "flagellum/soft/speed": speed["old_soft"],
    }
