"""Whether intervals hold what others measured: 80 % intervals of predicted robots beside measured numbers.

    python -m benchmarks.intervals all

Each case is a robot as its study describes it, drawn as `--spread` does it: coefficients, moduli and losses by the
ranges of their kind, and what a study identified by the intervals that it found. Robots of which it is said how they
were built are built anew for each draw. Nothing is fitted to a row. `docs/evidence/intervals.csv` has a row for each
measured number, with the ends of the draws alone, and whether it depends on the water: then what its models leave out
comes on top (`widened`). It is written anew for the cases that run. Printed: each row with its whole interval, and by
how much models of the water must be off so that four fifths of the numbers are held, of each robot by the others.
"""

import csv
import math
import sys
from collections.abc import Callable, Mapping
from itertools import count
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from nectosome.core import Status
from nectosome.description import RobotDescription, apply_settings, parse_robot, with_values
from nectosome.designs.prediction_intervals import HIGH, LEFT_OUT, LOW, depend, shares_of, widened
from nectosome.designs.uncertain_runs import drawn_places, draws_of, with_left_open
from nectosome.io.schema.structure import changed
from nectosome.model import build
from nectosome.robots import beetle, describe
from nectosome.solve import periodic, reading, simulate, static
from nectosome_studies.catshark import midline
from nectosome_studies.paddle.servos import mean_speed
from nectosome_studies.paddle.swim import SPEEDS, YAWS, on_a_slide
from nectosome_studies.paddle.trials import trial
from nectosome_studies.rexeel import recordings, swim
from nectosome_studies.softlimb import beam, limb
from nectosome_studies.softlimb.recordings import LOADS, RELEASES
from nectosome_studies.softlimb.ringing import ringing
from nectosome_studies.undulation import swims
from nectosome_studies.vortex import wing
from nectosome_studies.vortex.flapping import BeatForces, harmonic
from nectosome_studies.vortex.replay import forces, rig

FILE = Path(__file__).parents[1] / "docs" / "evidence" / "intervals.csv"
DRAWS, SEED = 40, 1
_COLUMNS = ("case", "robot", "quantity", "at", "measured", "value", "low", "high", "unit", "water", "beyond")
_BEYOND = {
    "catshark": "swims faster than the wave along its body, which no elongated-body theory has",
    "1.3 Hz": "above 1.1 Hz the real robot slows down for a reason that is not known",
    "0.3 Hz": "the printed frequency is likely a misprint",
    "mean lift": "camber and incidence of the wing are not published",
}
_ROBOTS: dict[str, str] = dict.fromkeys(["rowing1", "rowing3", "yaw1", "yaw3"], "rowing robots")  # cases of one robot
_FASTER = 2.0  # lengths/s of the flume, from which on most catsharks swim faster than their wave


class Case(NamedTuple):
    """A robot and what is predicted of it: value by (quantity, condition), and the same as measured."""

    robot: str
    description: RobotDescription
    predicted: Callable[[RobotDescription], Mapping[tuple[str, str], float]]
    measured: Mapping[tuple[str, str], float]
    units: Mapping[str, str]


def rexeel() -> Case:
    """Swims of 4 s by the commanded angles of the motors, at four amplitudes."""
    quantities = {"distance from rest": "m", "speed": "m/s", "peak-to-peak yaw": "rad"}

    def numbers(moved: swim.Motion) -> dict[str, float]:
        return dict(zip(quantities, (float(np.mean(x)) for x in moved), strict=True))

    def predicted(robot: RobotDescription) -> dict[tuple[str, str], float]:
        found = {}
        for amplitude in recordings.AMPLITUDES:
            one = swim.swim(robot, recordings.commanded(amplitude, swim.SAMPLES))
            moved = numbers(swim.motion(*swim.at_frames(one.track)))
            found |= {(name, f"{amplitude} deg"): x for name, x in moved.items()}
        return found

    measured = {}
    for amplitude in recordings.AMPLITUDES:
        theirs = recordings.recorded(amplitude)
        moved = numbers(swim.motion(theirs.time, theirs.x, theirs.y, theirs.yaw))
        measured |= {(name, f"{amplitude} deg"): x for name, x in moved.items()}
    return Case("eel robot of rigid links on servos (RExEel)", describe("rexeel"), predicted, measured, quantities)


def catshark() -> Case:
    """Median speeds of catsharks at each speed of the flume, by their beats as measured."""
    table = midline.table(None)
    length = midline.wavelengths(table)["points"]

    def predicted(description: RobotDescription) -> dict[tuple[str, str], float]:
        robot = build(description)
        body = robot.tree.parts[0].body
        waves = midline.waves(body.nq - 1, table.frequency, table.head, table.tail, length, 2)
        scale = float(robot.water.density) * (float(body.length) / table.length) ** 2
        return by_class(swims(robot, waves, midline.VISCOSITY * scale).speed)

    def by_class(speed: np.ndarray) -> dict[tuple[str, str], float]:
        each = {k: speed[table.speed_class == k] for k in sorted({*table.speed_class.tolist()})}
        return {("speed", f"{k:g} lengths/s"): float(np.median(x)) for k, x in each.items()}

    units = {"speed": "L/s"}
    return Case("catshark, beat as measured", describe("catshark"), predicted, by_class(table.speed), units)


def rowing(joints: int) -> Case:
    """Mean speeds over ten seconds from rest of the robot that ships, on its servos, in the strokes of Table 5."""
    robot = with_values(on_a_slide(beetle(joints)), {"Cn": 4.0})
    strokes = [(a, f) for n, a, f in SPEEDS if n == joints]

    def at(amplitude: float, frequency: float) -> tuple[str, str]:
        return "speed", f"{math.degrees(amplitude):.0f} deg, {frequency:g} Hz"

    def predicted(description: RobotDescription) -> dict[tuple[str, str], float]:
        found = {}
        for a, f in strokes:
            run = simulate(build(with_values(description, {"A": a, "f": f})), 10.0, samples=201, rtol=1e-5)
            found[at(a, f)] = mean_speed(run.to_dataset()) if int(run.status) == Status.SOLVED else math.nan
        return found

    measured = {at(a, f): speed for (n, a, f), speed in SPEEDS.items() if n == joints}
    name = f"rowing robot, {joints} passive joint{'s' * (joints > 1)} a paddle"
    return Case(name, robot, predicted, measured, {"speed": "m/s"})


def rowing_yaw(joints: int) -> Case:
    """Mean size of the yaw over ten seconds from rest, of robots as they may have been made, in strokes of Table 5."""
    strokes = [(a, f) for n, a, f in YAWS if n == joints]
    seeds = count()

    def at(amplitude: float, frequency: float) -> tuple[str, str]:
        return "yaw", f"{math.degrees(amplitude):.0f} deg, {frequency:g} Hz"

    def predicted(description: RobotDescription) -> dict[tuple[str, str], float]:
        seed = next(seeds)
        return {at(a, f): trial(with_values(description, {"A": a, "f": f}), seed)["yaw_mean"] for a, f in strokes}

    measured = {at(a, f): math.radians(yaw) for (n, a, f), yaw in YAWS.items() if n == joints}
    name = f"rowing robot, {joints} passive joint{'s' * (joints > 1)} a paddle"
    return Case(name, beetle(joints), predicted, measured, {"yaw": "rad"})


def silicone_beam() -> Case:
    """A release under own weight and two with a load, by modulus and viscosity identified from another release."""
    found = beam.identified()
    units = {"frequency": "Hz", "damping ratio": "", "sag at rest": "m"}
    held_out = {"gravity_b": "own weight"} | {name: f"with {1000 * load:.0f} g" for name, load in LOADS.items()}

    def predicted(description: RobotDescription) -> dict[tuple[str, str], float]:
        out = {}
        for name, at in held_out.items():
            robot = apply_settings(description, [f"weight={LOADS[name]} kg"] if name in LOADS else [])
            times = np.arange(round(100 * RELEASES[name])) / 100
            swung = simulate(robot, float(times[-1]), samples=times.tolist())
            there = times >= 0.1
            rang = ringing(times[there], np.asarray(reading(swung, "weight.position.z"))[there])
            sag = float(reading(static(robot), "weight.position.z")[-1])
            each = dict(zip(units, (rang.frequency, rang.damping_ratio, -sag), strict=True))
            out |= {(quantity, at): x for quantity, x in each.items()}
        return out

    measured = {}
    for name, at in held_out.items():
        each = (found.measured[name].frequency, found.measured[name].damping_ratio, -found.releases[name].rest)
        measured |= {(quantity, at): float(x) for quantity, x in zip(units, each, strict=True)}
    return Case("clamped silicone beam in air", found.found.robot, predicted, measured, units)


def foam_limb() -> Case:
    """Mean and range of the angle in three recordings, by viscosity, gain, drag and slack found from two others."""
    found = limb.identified()
    fit, units = found.held[found.loose], {"mean angle": "rad", "range of the angle": "rad"}
    slack = limb.SLACKS[found.loose]
    held_out = {name: limb.compared_frames(name, found.recordings[name], slack) for name in limb.HELD_OUT}

    def predicted(description: RobotDescription) -> dict[tuple[str, str], float]:
        out = {}
        for name, frames in held_out.items():
            out |= of_angle(name, limb.simulated_angle(description, frames))
        return out

    def of_angle(name: str, angle: np.ndarray) -> dict[tuple[str, str], float]:
        each = zip(units, (float(angle.mean()), float(np.ptp(angle))), strict=True)
        return {(quantity, name): x for quantity, x in each}

    measured = {}
    for name, frames in held_out.items():
        measured |= of_angle(name, limb.while_pulled(frames["angle"].values))
    return Case("foam limb with a tendon, command of its drive", fit.robot, predicted, measured, units)


def flapping_wing() -> Case:
    """Lift of a wing in a wind tunnel: its first harmonic, by thirds of the span too, and its mean."""
    beat, seen = wing.wing(), wing.measured()

    def numbers(forces: BeatForces) -> dict[tuple[str, str], float]:
        out = {("lift", "amplitude"): abs(harmonic(forces.total)), ("lift", "mean lift"): float(forces.total.mean())}
        bands = zip(("inner", "middle", "outer"), np.abs(harmonic(forces.lift)).tolist(), strict=True)
        return out | {("lift", f"amplitude, {band} third"): x for band, x in bands}

    return Case(
        "flapping wing in a wind tunnel",
        rig(beat),
        lambda description: numbers(forces(description, beat)),
        numbers(seen),
        {"lift": "N"},
    )


_TOWED = parse_robot("""
name: towed foil
water: {gravity: 0 m/s2, current: [-0.4 m/s, 0 m/s, 0 m/s]}
body:
  kind: rigid
  shape: box
  length: 100 mm
  width: 12 mm
  height: 600 mm
  mass: 1 mg
  joint:
    kind: planar
    axis: z
    motion:
      y: {kind: sine, amplitude: 75 mm, frequency: 1 Hz, phase: 90 deg}
      angle: {kind: sine, amplitude: 10 deg, frequency: 1 Hz, phase: 180 deg}
  loads:
    foil: {kind: foil, span_along: z, ahead: x, chord: 100 mm, leading_edge: [-16.667 mm, -16.667 mm], thickness: 12 mm}
""")  # the joint is at the box's end: the leading edge lies a third of the chord ahead of it
_POINTS = {
    0.202: (0.228, 0.689),
    0.250: (0.311, 0.641),
    0.303: (0.394, 0.600),
    0.350: (0.477, 0.586),
    0.402: (0.588, 0.552),
}  # Schouveiler et al. 2005, 15 deg at most, as digitised by Pan et al. 2012: St; thrust over rho U^2 S/2, efficiency


def _pitch(steepest: float) -> float:
    """Amplitude of a pitch [rad] by which the largest angle to a path of this slope is 15 deg."""
    cosine = np.cos(np.linspace(0, np.pi / 2, 200))

    def beyond(pitch: float) -> float:
        return float(np.max(np.arctan(steepest * cosine) - pitch * cosine) - np.radians(15.0))

    return float(np.asarray(brentq(beyond, 0.0, np.arctan(steepest))))


def towed_foil() -> Case:
    """A NACA 0012 that heaves by three quarters of its chord and pitches about a third of it."""
    U, area = 0.4, 0.06

    def predicted(description: RobotDescription) -> dict[tuple[str, str], float]:
        out = {}
        for strouhal in _POINTS:
            frequency = strouhal * U / 0.15
            w = 2 * np.pi * frequency
            pitch = _pitch(0.075 * w / U)
            moves = "body.joint.motion."
            values = {f"{moves}{name}.frequency": frequency for name in ("y", "angle")}
            found = periodic(with_values(description, {**values, f"{moves}angle.amplitude": pitch})).to_dataset()
            reaction, power = np.asarray(found["reaction"])[:-1], np.asarray(found["reaction_power"])[:-1].sum(axis=1)
            turned = np.exp(-1j * pitch * np.sin(w * np.asarray(found["time"])[:-1]))  # forces are along the foil
            thrust = -float(np.mean(((reaction[:, 0] + 1j * reaction[:, 1]) * turned).real))
            taken = float(power.mean())
            at = f"St {strouhal:g}"
            out |= {("thrust", at): 2 * thrust / (1000 * U**2 * area), ("efficiency", at): thrust * U / taken}
        return out

    measured = {("thrust", f"St {st:g}"): c for st, (c, _) in _POINTS.items()}
    measured |= {("efficiency", f"St {st:g}"): eta for st, (_, eta) in _POINTS.items()}
    return Case("towed flapping foil, 15 deg", _TOWED, predicted, measured, {"thrust": "", "efficiency": ""})


CASES = {
    "rexeel": rexeel,
    "catshark": catshark,
    "rowing3": lambda: rowing(3),
    "rowing1": lambda: rowing(1),
    "yaw3": lambda: rowing_yaw(3),
    "yaw1": lambda: rowing_yaw(1),
    "beam": silicone_beam,
    "limb": foam_limb,
    "wing": flapping_wing,
    "foil": towed_foil,
}


def rows_of(name: str) -> list[dict[str, str]]:
    """Rows of a case: measured, the value of the file, and the interval."""
    case = CASES[name]()
    description = with_left_open(case.description)
    sources, correlations, places = drawn_places(description, DRAWS, SEED)
    draws = draws_of(description, DRAWS, SEED)
    each = [case.predicted(changed(description, values)) for values in draws]
    of_water = np.array([source.of_water for source in sources])
    out = []
    for (quantity, at), theirs in case.measured.items():
        column = np.array([one[quantity, at] for one in each])
        low, high = np.nanquantile(column[1:], [LOW, HIGH], method="median_unbiased")
        shares, _ = shares_of(places[1:], column[1:, None], correlations)
        wet = low < high and bool(depend(shares, of_water)[0])
        numbers = zip(_COLUMNS[4:8], (theirs, column[0], low, high), strict=True)
        beyond = next((why for end, why in _BEYOND.items() if at.endswith(end)), "")
        if name == "catshark" and float(at.split()[0]) >= _FASTER:
            beyond = _BEYOND[name]
        row = {
            "beyond": beyond,
            "water": "yes" if wet else "no",
            "case": name,
            "robot": case.robot,
            "quantity": quantity,
            "at": at,
            "unit": case.units[quantity],
        }
        out.append(row | {key: f"{x:.5g}" for key, x in numbers})
    return out


def main(names: list[str]) -> None:
    """Run cases, all by the word all, and print what the file holds then."""
    kept = dict[str, list[dict[str, str]]]()
    if FILE.exists():
        with FILE.open(encoding="utf-8") as file:
            for row in csv.DictReader(file):
                kept.setdefault(row["case"], []).append(row)
    for name in names:
        kept[name] = rows_of(name)
        with FILE.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, _COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(row for case in CASES for row in kept.get(case, []))
    rows = [row for own in kept.values() for row in own]
    for row in rows:
        low, high = ends_of([row], LEFT_OUT).ravel()
        words = "held" if holds([row], LEFT_OUT).all() else "missed"
        print(*(row[key] for key in _COLUMNS[1:6]), f"{low:.4g} to {high:.4g}", words, row["beyond"], sep=", ")
    counted = [row for row in rows if row["water"] == "yes" and not row["beyond"]]
    print(f"\nleft out, so that four fifths of {len(counted)} numbers are held: {asked(counted):.2f}")
    total = 0
    for robot in dict.fromkeys(_ROBOTS.get(row["case"], row["case"]) for row in counted):
        own, others = (
            [r for r in counted if (_ROBOTS.get(r["case"], r["case"]) == robot) == is_own] for is_own in (True, False)
        )
        share = asked(others)
        held = int(holds(own, share).sum())
        total += held
        print(f"{robot}, by the others {share:.2f}: {held} of {len(own)} held")
    print(f"each robot by the others: {total} of {len(counted)} held")


def ends_of(rows: list[dict[str, str]], left_out: float) -> np.ndarray:
    """Ends of the intervals of rows [2, n] with what models of the water leave out."""
    ends = np.array([[float(row["low"]), float(row["high"])] for row in rows]).T
    return np.where([row["water"] == "yes" for row in rows], widened(ends, left_out), ends)


def holds(rows: list[dict[str, str]], left_out: float) -> np.ndarray:
    """Which intervals hold the measured number."""
    low, high = ends_of(rows, left_out)
    measured = np.array([float(row["measured"]) for row in rows])
    return (low <= measured) & (measured <= high)


def asked(rows: list[dict[str, str]]) -> float:
    """The least that must be left out so that intervals of rows hold as many measured numbers as they say."""
    shares = np.arange(0.0, 1.01, 0.01)
    enough = [share for share in shares if holds(rows, share).mean() >= HIGH - LOW]
    return float(enough[0]) if enough else math.nan


if __name__ == "__main__":
    main([*CASES] if sys.argv[1:] == ["all"] else sys.argv[1:])
