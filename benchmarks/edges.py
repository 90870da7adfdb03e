"""Robots at the edges of what a file may say: what comes, a motion or a reason, and how long it takes.

Each is simulated, or its equilibrium found, from the file on, programs compiled anew. What is solved has finite
numbers, and its powers balance; all else has a status with a reason, or a sentence. An edge that takes longer than
`LIMIT` fails.
"""

import sys
import time
from typing import NamedTuple

import numpy as np

from nectosome.core import Status
from nectosome.description import parse_robot
from nectosome.solve import simulate, static
from nectosome.units import InputError

LIMIT = 300.0  # s


class Edge(NamedTuple):
    """A robot at an edge, how long it is simulated [s] (None: its equilibrium), and what comes."""

    robot: str
    time: float | None
    status: Status | str = Status.SOLVED  # or the beginning of what is said of the file


class Answer(NamedTuple):
    """What came: a status or a sentence, whether all numbers are finite, how far powers are off, and the time [s]."""

    status: Status | str
    finite: bool
    unbalanced: float
    seconds: float


_WATER = "drag: {kind: drag, normal: 1.1}, water: {kind: added_mass, normal: 1}"
_STOKES = "drag: {kind: stokes_drag, coefficients: lighthill, wavelength: 1 um}"
_ALL = ("torsion", "bending_y", "bending_z", "extension", "shear_y", "shear_z")


def rod(
    strains: str = "bending_y: 2",
    points: int = 10,
    length: str = "0.5 m",
    radius: str = "10 mm",
    density: str = "1100 kg/m3",
    young: str = "1 MPa",
    loads: str = _WATER,
    gravity: str = "9.80665 m/s2",
    joint: str = "fixed",
) -> str:
    return f"""
name: rod
water: {{gravity: {gravity}}}
body:
  kind: rod
  section: circle
  radius: {radius}
  length: {length}
  young: {young}
  density: {density}
  damping: 100 Pa s
  strains: {{{strains}}}
  points: {points}
  joint: {{kind: {joint}}}
  loads: {{{loads}}}
"""


def _of_each(order: int) -> str:
    return ", ".join(f"{name}: {order}" for name in _ALL)


def chain(parts: int) -> str:
    """Cylinders one behind the other, on hinges with springs."""
    shape = "kind: rigid, shape: cylinder, length: 50 mm, radius: 10 mm, density: 1100 kg/m3"
    joint = "{kind: revolute, axis: y, stiffness: 1 N m/rad, damping: 0.1 N m s/rad}"
    links = [
        f"  link{k}: {{on: {f'link{k - 1}' if k else 'body'}, {shape}, joint: {joint}, loads: {{{_WATER}}}}}"
        for k in range(parts - 1)
    ]
    return "\n".join([f"name: chain\nbody: {{{shape}}}\nlimbs:", *links])


def star(parts: int) -> str:
    """Soft arms around a body, each with its own length."""
    arms = "kind: rod, section: circle, radius: 5 mm, density: 1100 kg/m3, young: 1 MPa, strains: {bending_y: 0}"
    limbs = [f"  arm{k}: {{{arms}, points: 3, length: {100 + k} mm, loads: {{{_WATER}}}}}" for k in range(parts - 1)]
    body = "body: {kind: rigid, shape: box, length: 0.1 m, width: 0.1 m, height: 0.1 m, density: 900 kg/m3}"
    return "\n".join([f"name: star\n{body}\nlimbs:", *limbs])


def propeller(young: str) -> str:
    """A helix behind a free body, at 1000 rpm."""
    return f"""
name: propeller
body:
  kind: rigid
  shape: cylinder
  length: 0.2 m
  radius: 30 mm
  density: 1000 kg/m3
  joint: {{kind: free}}
  loads:
    hull:
      kind: lumped_drag
      drag_area: [10 cm2, 50 cm2, 50 cm2]
      rotational: [1e-5 kg m2, 1e-4 kg m2, 1e-4 kg m2]
limbs:
  shaft:
    at: root
    rotation: [0 deg, 0 deg, 180 deg]
    kind: rigid
    shape: cylinder
    length: 20 mm
    radius: 5 mm
    density: 1000 kg/m3
    joint: {{kind: revolute, axis: x, motion: {{kind: rate, rate: 1000 rpm}}}}
  tail:
    on: shaft
    kind: rod
    section: circle
    length: 0.3 m
    radius: 4 mm
    young: {young}
    density: 1100 kg/m3
    damping: 1000 Pa s
    rest: {{bending_z: [10 rad/m], torsion: [20 rad/m]}}
    strains: {{torsion: 0, bending_y: 2, bending_z: 2}}
    points: 8
    loads: {{{_WATER}}}
"""


def spheres(apart: str) -> str:
    """A free ball whose centre is so far from that of a fixed one, both of 0.1 m."""
    ball = "on: world, kind: rigid, shape: spheroid, length: 0.1 m, radius: 50 mm, density: 1000 kg/m3"
    hit = "kind: contact, stiffness: 1e4 N/m, damping: 10 N s/m, static_friction: 0.5, dynamic_friction: 0.3"
    drag = "drag: {kind: lumped_drag, drag_area: [1 cm2, 1 cm2, 1 cm2]}"
    return f"""
name: spheres
water: {{gravity: 0 m/s2}}
limbs:
  still: {{{ball}}}
  free: {{{ball}, offset: [{apart}, 0 m, 0 m], joint: {{kind: free}}, loads: {{{drag}}}}}
pairs: {{hit: {{{hit}, between: [free, still]}}}}
"""


def slide(stiffness: str = "5 N/m", position: str = "0.1 m", velocity: str = "0 m/s", upper: str = "10 m") -> str:
    """A mass on a spring with a stop."""
    stop = f"{{at: {upper}, stiffness: 1e5 N/m, damping: 10 N s/m, softness: 1 mm}}"
    return f"""
name: slide
water: {{gravity: 0 m/s2}}
body:
  kind: rigid
  shape: point
  mass: 2 kg
  joint: {{kind: prismatic, axis: x, stiffness: {stiffness}, position: {position}, velocity: {velocity}, upper: {stop}}}
"""


_CORNER = """
name: corner
water: {floor: 0 m, walls: [0 m, 1 m]}
body:
  kind: rigid
  shape: point
  mass: 2 kg
  volume: 2 L
  inertia: [1 kg m2, 1 kg m2, 1 kg m2]
  joint: {kind: planar, axis: [0, -1, 0], start: {position: [0.98 m, 0 m, -0.2 m]}}
  loads:
    hull: {kind: wall_contact, reach: 0.1 m, stiffness: 500 N/m, damping: 50 N s/m}
    drag: {kind: lumped_drag, drag_area: [0.1 m2, 0 m2, 0.2 m2]}
    leg:
      kind: leg
      hip: [0 m, 0 m, 0 m]
      crank: 10 mm
      bearing: [0 m, -30 mm]
      length: 50 mm
      speed: 3 rad/s
      stiffness: 200 N/m
      damping_ratio: 0.3
      static_friction: 0.8
      dynamic_friction: 0.6
"""

_FEW = "nothing has inertia along body."
EDGES = {
    "strains of order 8, all six": Edge(rod(_of_each(8), 20), 0.1),
    "strains of order 20, all six": Edge(rod(_of_each(20), 40), 0.05),
    "bending of order 20": Edge(rod("bending_y: 20", 30), 0.2),
    "bending of order 20 at rest": Edge(rod("bending_y: 20", 30), None),
    "bending of order 20 with 10 points": Edge(rod("bending_y: 20", 10), 0.2, f"{_FEW}bending_y."),
    "torsion of order 4 with 4 points": Edge(rod("torsion: 4", 4), 0.2, f"{_FEW}torsion."),
    "40 parts in a chain": Edge(chain(40), 0.5),
    "40 parts in a chain at rest": Edge(chain(40), None),
    "40 parts on a body": Edge(star(40), 0.1),
    "1000 rpm, stiff propeller": Edge(propeller("50 MPa"), 0.5),
    "1000 rpm, soft propeller": Edge(propeller("0.2 MPa"), 0.2),
    "gravity 0": Edge(rod(gravity="0 m/s2"), 0.5),
    "gravity 0, free, at rest": Edge(rod(gravity="0 m/s2", joint="free"), None),
    "gravity, free and heavy, at rest": Edge(rod(joint="free"), None, Status.NO_EQUILIBRIUM),
    "half way into a contact": Edge(spheres("50 mm"), 0.5),
    "centre on centre in a contact": Edge(spheres("0 m"), 0.5),
    "in a wall and under the floor": Edge(_CORNER, 0.5),
    "beyond a stop": Edge(slide(position="0.3 m", upper="0.1 m"), 0.5),
    "0.1 kg/m3": Edge(rod(density="0.1 kg/m3"), 0.2),
    "0.1 kg/m3 without added mass": Edge(rod(density="0.1 kg/m3", loads="drag: {kind: drag, normal: 1.1}"), 0.2),
    "0.1 kg/m3 at rest": Edge(rod(density="0.1 kg/m3"), None),
    "1 um": Edge(rod(length="1 um", radius="50 nm", loads=_STOKES), 0.01),
    "1 um at rest": Edge(rod(length="1 um", radius="50 nm", loads=_STOKES), None),
    "100 m": Edge(rod(length="100 m", radius="1 m"), 5.0),
    "100 m at rest": Edge(rod(length="100 m", radius="1 m"), None),
    "100 m, 10 mm thin, at rest": Edge(rod(length="100 m"), None),
    "1e200 N/m": Edge(slide("1e200 N/m"), 0.1, Status.NOT_FINITE),
    "1e-200 Pa at rest": Edge(rod(young="1e-200 Pa"), None),
    "1e200 m": Edge(rod(length="1e200 m"), 0.1, Status.NOT_FINITE),
}


def answer(edge: Edge) -> Answer:
    """Simulate the robot of an edge, or find its equilibrium."""
    start = time.perf_counter()
    try:
        robot = parse_robot(edge.robot)
        found = static(robot) if edge.time is None else simulate(robot, edge.time, samples=21)
    except InputError as error:
        return Answer(error.message, True, 0.0, time.perf_counter() - start)
    status = Status(int(found.status))
    off, finite = 0.0, False
    if status == Status.SOLVED:
        state = found.value.state
        finite = bool(np.all(np.isfinite(np.asarray(state.q))) and np.all(np.isfinite(np.asarray(state.v))))
        if edge.time is not None:
            off = float(found.to_dataset().power_balance.max())
    return Answer(status, finite, off, time.perf_counter() - start)


def main() -> None:
    failed = []
    for name, edge in EDGES.items():
        status, finite, off, seconds = answer(edge)
        solved = status == Status.SOLVED
        fits = str(status).startswith(edge.status) if isinstance(edge.status, str) else status == edge.status
        if not fits or seconds > LIMIT or (solved and not (finite and off < 1e-9)):
            failed.append(name)
        words = status if isinstance(status, str) else status.name
        balance = f", powers balance to {off:.0e}" if solved and edge.time is not None else ""
        print(f"{name:38} {seconds:5.0f} s  {words[:60]}{balance}", flush=True)
    print(f"{len(EDGES)} edges, {len(failed)} failed{': ' if failed else ''}{', '.join(failed)}")
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
