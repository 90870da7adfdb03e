"""What a fit costs: three unknowns of a soft fin, 7 s at 80 Hz, beside an earlier commit in the same run.

    python -m benchmarks.identify 6eaa0876

The fin is driven by the angle of its servo; force and tip are compared, with noise, and the fit's model has a tenth
more added mass than the fin, as models do. The angle is given as it was, and in a servo's ticks of 0.088 deg; 27
recordings are fitted together. Processor seconds of whole fits in processes of their own: the first with an empty
cache, then medians of three with a full one.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from .compile import earlier

BEFORE = "b48da053"
_HERE = Path(__file__).parents[1]
_TURNS = 3
_FIN = """
name: fin
water: {gravity: 0 m/s2}
body: {kind: rigid, shape: point, mass: 0.3 kg}
limbs:
  fin:
    kind: rod
    section: rectangle
    rotation: [0 deg, 0 deg, 180 deg]
    length: 120 mm
    width: 8 mm
    height: 60 mm
    young: 0.8 MPa
    damping: 2 kPa s
    density: 1070 kg/m3
    strains: {bending_z: 3}
    points: 10
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 25 deg, frequency: 1 Hz}}
    loads: {drag: {kind: drag, normal: 2}, water: {kind: added_mass, normal: 1}}
aliases: {E: limbs.fin.young, eta: limbs.fin.damping, Cn: limbs.fin.loads.drag.normal, Ca: limbs.fin.loads.water.normal}
"""
_TRUE = {"E": 1.14e6, "eta": 3e3, "Cn": 1.75, "Ca": 0.9}
_VARY = {"E": "0.3..3MPa log", "eta": "0.5..10kPa s log", "Cn": "0.5..4"}
_COMPARE = {"force": "force.y", "tip": "fin.tip.position.y"}
_NOISE = {"force": 4e-3, "tip": 3e-4}  # N, m
_TIME = np.arange(0.0, 7.0, 1 / 80)
_TICK = 2 * np.pi / 4096
_CASES = "smooth", "ticks", "27 runs"
_PATH = "limbs.fin.joint.motion"


def main(commit: str = BEFORE) -> None:
    """Print processor seconds of fits, and what they found, by tree and case."""
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "data.json"
        _python(_HERE, Path(folder) / "cache", "make", str(data))
        before = earlier(Path(folder) / "before", commit)
        trees = {"now": _HERE} | ({commit: before} if before else {})
        for case in _CASES:
            print(f"\n{case}")
            for label, tree in trees.items():
                cache = Path(folder) / f"cache-{label}"
                runs = [_python(tree, cache, "fit", str(data), case) for _ in range(_TURNS + 1)]
                warm = median(one["seconds"] for one in runs[1:])
                found = ", ".join(f"{name} {x:.5g}" for name, x in runs[-1]["found"].items())
                print(f"  {label}: {runs[0]['seconds']:.0f} s, then {warm:.1f} s; {found}", flush=True)


def _made() -> dict[str, Any]:
    """Recordings of 27 runs, by arrays."""
    from nectosome import build, simulate
    from nectosome.description import Samples, parse_robot, resolve, with_recordings, with_values
    from nectosome.solve import reading

    fin = parse_robot(_FIN)
    fin = with_values(fin, {resolve(fin, name)[0]: x for name, x in _TRUE.items()})
    runs = []
    speeds = (0, 1, 2), (3, 4, 5), (6, 7, 8)
    for k, (degrees, speed) in enumerate((a, s) for own in speeds for a in (15, 25, 35) for s in own):
        rng, ramp = np.random.default_rng(k), np.clip(_TIME, 0.0, 1.0)
        angle = np.radians(degrees) * ramp**2 * (3 - 2 * ramp) * np.sin(2 * np.pi * (1 + 0.1 * speed) * _TIME)
        robot = build(with_recordings(fin, {_PATH: Samples(_TIME.tolist(), angle.tolist(), "rad")}))
        run = simulate(robot, float(_TIME[-1]), samples=_TIME.tolist(), rtol=1e-7, atol=1e-9)
        read = {column: np.asarray(reading(run, name)) for column, name in _COMPARE.items()}
        noisy = {column: (x + _NOISE[column] * rng.normal(size=x.size)).tolist() for column, x in read.items()}
        runs.append({"time": _TIME.tolist(), "angle": angle.tolist(), **noisy})
    return {"runs": runs}


def _fitted(runs: list[dict[str, list[float]]], case: str) -> dict[str, float]:
    from nectosome.description import parse_robot
    from nectosome.identification import identify

    one = runs if case == "27 runs" else [runs[4]]
    arrays = [{name: np.array(x) for name, x in run.items()} for run in one]
    if case == "ticks":
        arrays = [{**run, "angle": _TICK * np.round(run["angle"] / _TICK)} for run in arrays]
    units = {"time": "s", "angle": "rad", "force": "N", "tip": "m"}
    recordings = [{name: (x, units[name]) for name, x in run.items()} for run in arrays]
    fit = identify(parse_robot(_FIN), recordings, vary=_VARY, compare=_COMPARE, drive={"angle": _PATH})
    return dict(zip(_VARY, map(float, fit.theta), strict=True))


def _python(tree: Path, cache: Path, *words: str) -> Any:
    """What this file prints last, run with the package of a tree."""
    environment = {**os.environ, "PYTHONPATH": str(tree / "src"), "NECTOSOME_CACHE": str(cache)}
    command = [sys.executable, "-m", "benchmarks.identify", *words]
    done = subprocess.run(command, env=environment, cwd=_HERE, stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def _child(what: str, data: str, case: str = "") -> None:
    if what == "make":
        made = _made()
        Path(data).write_text(json.dumps(made))
        print(json.dumps(len(made["runs"])))
        return
    found = _fitted(json.loads(Path(data).read_text())["runs"], case)
    spent = resource.getrusage(resource.RUSAGE_SELF)
    print(json.dumps({"seconds": spent.ru_utime + spent.ru_stime, "found": found}))


if __name__ == "__main__":
    if sys.argv[1:2] in (["make"], ["fit"]):
        _child(*sys.argv[1:])
    else:
        main(*sys.argv[1:])
