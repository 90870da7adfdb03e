"""How often 95 % intervals hold the truth: 200 draws of noise on simulated recordings of known robots.

A fin on a hinge in water, with white and with correlated noise; the same, its start unknown; the same with a clock that
is late; nine recordings of it, which differ from one another by a few per cent of its numbers; a strip at rest under
weights and pressures; a soft actuator behind a valve that moves in steps, with and without a dead band, another one in
each draw.
The fit and what made the recordings are the same model: what is tested is the statistics.
"""

from collections.abc import Callable, Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from scipy.signal import lfilter

from nectosome import static
from nectosome.description import parse_robot, with_values
from nectosome.drives import Chain, Stiction, evenly, respond, second_order
from nectosome.identification import RobotFit, identify
from nectosome.identification.hysteresis.fit import fit_hysteresis
from nectosome.identification.hysteresis.trials import PressureTrial
from nectosome.model import build
from nectosome.solve import reading, simulate

_DRAWS = 200
_FIN = """
name: fin
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: box
  length: 60 mm
  width: 4 mm
  height: 80 mm
  density: 1100 kg/m3
  joint:
    kind: revolute
    axis: z
    stiffness: 0.05 N m/rad
    damping: 2 mN m s/rad
    torque: {kind: sine, amplitude: 0.02 N m, frequency: 1.1 Hz}
  loads: {drag: {kind: plate_drag, normal: 1.5, start_up: none}, water: {kind: added_mass, normal: 1}}
aliases: {k: body.joint.stiffness, c: body.joint.damping, Cn: body.loads.drag.normal}
"""
_TRUE = {"k": 0.05, "c": 2e-3, "Cn": 1.5}
_SPAN = {"k": "0.02..0.1N m/rad log", "c": "0.5..5mN m s/rad log", "Cn": "0.5..4"}
_BETWEEN, _PUSHES, _REPEATS = np.array([0.03, 0.05, 0.05]), (0.012, 0.02, 0.03), 3  # shares of those, N m, of each
_TIME, _START, _LATE, _ANGLE_NOISE = np.linspace(0.0, 3.0, 151), 0.1, 0.04, 3e-3  # s, rad, s, rad
_CORRELATED, _BEFORE = (0.0, 0.4, 0.6), 200  # coefficients of noise; samples before the recording
_STRIP = """
name: strip
water: {density: 1.2 kg/m3}
body:
  kind: rod
  section: rectangle
  length: 120 mm
  width: 20 mm
  height: 4 mm
  young: 2.6 MPa
  density: 1080 kg/m3
  strains: {bending_y: 2}
  points: 6
  loads:
    hook: {kind: force, force: [0 N, 0 N, 0 N]}
    chamber: {kind: chamber, place: [0 mm, 1 mm], area: 26 mm2, pressure: {kind: constant, value: 0 Pa}}
aliases: {E: body.young, area: body.loads.chamber.area, hook: body.loads.hook.force.2}
"""
_SET = {
    "hook": np.array([0.0, -0.02, 0.0, -0.01, 0.01, 0.03]),  # N
    "body.loads.chamber.pressure.value": np.array([0.0, 0.0, 30e3, 50e3, 20e3, 0.0]),  # Pa
}
_DROOP_NOISE = 0.3e-3  # m
_STUCK = {"dead_band": (0.0, 8e3), "resolution": (1.5e3, 6e3)}  # Pa
_STUCK_NOISE = 5e-5  # m


def main() -> None:
    """Print how often intervals hold the truth, by fit and parameter."""
    print(f"\nshare of {_DRAWS} draws whose 95 % interval holds the truth (90 to 98 % is expected of so many)")
    fin, time = parse_robot(_FIN), _TIME
    moved = with_values(fin, {"body.joint.position": _START})
    angle = _angles(moved, time)
    on_hinge: dict[str, Any] = {"vary": _SPAN, "compare": {"encoder": "body.angle"}, "starts": 1}
    still = _angles(fin, time)
    for phi in _CORRELATED:
        _told(
            f"motion, its noise correlated by {phi:g} from sample to sample",
            lambda noise: identify(fin, [{"time": time, "encoder": still + noise}], **on_hinge),
            (time.size, _ANGLE_NOISE),
            _TRUE,
            phi,
        )
    start = {"body.joint.position": "-20..20deg"}
    _told(
        "motion, its start unknown",
        lambda noise: identify(fin, [{"time": time, "encoder": angle + noise}], **on_hinge, start=start),
        (time.size, _ANGLE_NOISE),
        {**_TRUE, "start": _START},
    )
    earlier = np.maximum(time - _LATE, 0.0)
    late = np.where(time < _LATE, 0.0, np.interp(earlier, *_fine(fin)))
    _told(
        "motion, its clock late",
        lambda noise: identify(fin, [{"time": time, "encoder": late + noise}], **on_hinge, shift="-0.1..0.1s"),
        (time.size, _ANGLE_NOISE),
        {**_TRUE, "shift": _LATE},
    )
    _told(
        f"{len(_PUSHES) * _REPEATS} motions that differ by {', '.join(f'{100 * x:.0f} %' for x in _BETWEEN)}",
        lambda noise: identify(fin, _that_differ(fin, noise), **on_hinge),
        (len(_PUSHES) * _REPEATS * (time.size + len(_TRUE)), 1.0),
        _TRUE,
    )
    strip = parse_robot(_STRIP)
    rows = [dict(zip(_SET, row, strict=True)) for row in zip(*(x.tolist() for x in _SET.values()), strict=True)]
    droop = np.array([reading(static(build(with_values(strip, row))), "body.tip.position.z")[0] for row in rows])
    given = {"time": None, "weight": (_SET["hook"], "N"), "pressure": (_SET["body.loads.chamber.pressure.value"], "Pa")}
    at_rest: dict[str, Any] = {
        "vary": {"E": "1..8MPa log", "area": "10..60mm2"},
        "compare": {"tip": "body.tip.position.z"},
        "drive": {"weight": "hook", "pressure": "body.loads.chamber.pressure"},
        "starts": 1,
    }
    _told(
        "shapes at rest",
        lambda noise: identify(strip, [{**given, "tip": droop + noise}], **at_rest),
        (droop.size, _DROOP_NOISE),
        {"E": 2.6e6, "area": 26e-6},
    )
    _valve()


def _valve() -> None:
    """Print how often intervals of a valve's dead band and resolution hold them: of the latter alone, and of both."""
    time = np.arange(0.0, 4 / 0.75, 5e-3)
    wave = np.minimum(np.floor(0.75 * time), 3)
    pressure = 1e5 * (0.3 + 0.1 * wave) * np.sin(2 * np.pi * (0.75 * time - wave))
    slopes = 1e-7 * np.array([2.9, 4.5, 3.5, 3.4, 3.2, 3.5, 3.7, 3.9, 4.0])  # m/Pa
    soft = evenly(np.append(np.diff(slopes), 0.0), 6e4, slopes[0])
    dynamics = second_order(*(jnp.asarray(x) for x in (1.0, 18.65, 1.008)))
    for names in (("resolution",), ("dead_band", "resolution")):
        held, far = np.zeros(len(names)), 0
        for seed in range(_DRAWS):
            rng = np.random.default_rng(seed)
            truth = {name: float(rng.uniform(*_STUCK[name])) for name in names}
            valve = Stiction(*(jnp.asarray(truth.get(name, 0.0)) for name in _STUCK))
            moved = np.asarray(respond(Chain((valve, soft, dynamics)), pressure, 5e-3))
            recording = PressureTrial("waves", 5e-3, pressure, moved + _STUCK_NOISE * rng.normal(size=time.size))
            found = fit_hysteresis([recording], dead_band="dead_band" in names, resolution=True)
            held += [found.intervals[name].low <= truth[name] <= found.intervals[name].high for name in names]
            far += found.noise > 1.1 * _STUCK_NOISE
        shares = ", ".join(f"{name} {100 * x / _DRAWS:.1f} %" for name, x in zip(names, held, strict=True))
        print(f"  steps of a valve: {shares}; {far} draws whose fit leaves more than the noise", flush=True)


def _angles(robot: Any, time: np.ndarray) -> np.ndarray:
    run = simulate(build(robot), float(time[-1]), samples=time.tolist(), rtol=1e-8, atol=1e-10)
    return np.asarray(run.results().data["q"][1])[:, 0]


def _that_differ(robot: Any, normal: np.ndarray) -> list[dict[str, Any]]:
    """Repeats of motions at three torques, each with numbers and noise of its own, of standard normal numbers."""
    made, path = list[dict[str, Any]](), "body.joint.torque.amplitude"
    for k, row in enumerate(normal.reshape(len(_PUSHES) * _REPEATS, -1)):
        push, shares = _PUSHES[k // _REPEATS], 1 + _BETWEEN * row[: len(_TRUE)]
        own = {name: value * share for (name, value), share in zip(_TRUE.items(), shares.tolist(), strict=True)}
        angle = _angles(with_values(robot, {**own, path: push}), _TIME) + _ANGLE_NOISE * row[len(_TRUE) :]
        made.append({"time": _TIME, "encoder": angle, path: (np.array(push), "N m")})
    return made


def _fine(robot: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times and angles, so many that straight lines between them are 1e-6 rad off at most."""
    time = np.linspace(0.0, float(_TIME[-1]), 6001)
    return time, _angles(robot, time)


def _told(
    what: str,
    fit: Callable[[np.ndarray], RobotFit],
    noise: tuple[int, float],
    truth: Mapping[str, float],
    phi: float = 0.0,
) -> None:
    """Fit all draws of noise, which is autoregressive with the coefficient phi, and print the shares."""
    held, (count, size) = np.zeros(len(truth)), noise
    for seed in range(_DRAWS):
        white = np.random.default_rng(seed).normal(size=count + _BEFORE * (phi > 0))
        found = fit(size * lfilter([np.sqrt(1 - phi**2)], [1.0, -phi], white)[-count:])
        ends = found.identifiability.intervals()
        held += [one.low < x < one.high for one, x in zip(ends, truth.values(), strict=True)]
    shares = ", ".join(f"{name} {100 * x / _DRAWS:.1f} %" for name, x in zip(truth, held, strict=True))
    print(f"  {what}: {shares}", flush=True)


if __name__ == "__main__":
    main()
