"""`foil` beside discrete vortices in plane flow: a plate that heaves and pitches, from towing to mooring.

Thrust and power are means over a cycle, the normal force a root of its mean square; they are over rho V^2 c/2 and
rho V^3 c/2 with the chord c and the root mean square V of the speed of the plate's middle. k = omega c/2U is the
reduced frequency, St = 2 h f/U the Strouhal number of the heave h. Pitch follows the path of the heave with half of its
largest angle, or there is none. The edge ahead holds the suction of 15 deg, the stall of `foil`.

Then the vortices beside a foil that was measured: Schouveiler, Hover and Triantafyllou (2005), a heave of 0.75 chords,
pitch about a third of the chord, an angle of attack of 15 deg at most; points as digitised by Pan et al. (2012).
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from benchmarks.discrete_vortices import Motion, run
from nectosome.description import parse_robot, with_values
from nectosome.solve import periodic

STALL, RHO, CYCLES, STEPS = np.radians(15.0), 1000.0, 5, 120  # steps a cycle

PLATE = parse_robot("""
name: plate
water: {gravity: 0 m/s2, current: [-1 m/s, 0 m/s, 0 m/s]}
body:
  kind: rigid
  shape: box
  length: 1 m
  width: 1 mm
  height: 1 m
  mass: 1 mg
  joint:
    kind: planar
    axis: z
    motion:
      x: {kind: constant, value: 0 m}
      y: {kind: sine, amplitude: 0.5 m, frequency: 0.5 Hz, phase: 90 deg}
      angle: {kind: sine, amplitude: 10 deg, frequency: 0.5 Hz, phase: 180 deg}
  loads:
    foil:
      {kind: foil, span_along: z, ahead: x, chord: 1 m, leading_edge: [0 m, 0 m], sections: 1, aspect_ratio: 1e6,
       profile_drag: 0, stall: 15 deg}
""")  # the joint is at the box's end, half a chord behind its centre: there the foil has its middle

MEASURED = {
    0.202: (0.228, 0.689),
    0.303: (0.394, 0.600),
    0.402: (0.588, 0.552),
}  # St: thrust over rho U^2 c/2, efficiency


class Case(NamedTuple):
    """Speed ahead [chords/s], heave [chords], pitch [rad] along the path, frequency [Hz]."""

    speed: float
    heave: float
    pitch: float
    frequency: float

    @property
    def scale(self) -> float:
        """Root mean square of the speed of the plate's middle."""
        return float(np.sqrt(self.speed**2 + 0.5 * (2 * np.pi * self.frequency * self.heave) ** 2))


class Means(NamedTuple):
    """Coefficients of thrust, of the power that the motion takes, and of the normal force."""

    thrust: float
    power: float
    normal: float


def cases() -> list[Case]:
    """From k = 0.1 to 5 and to mooring, heaves of a quarter of a chord to two."""
    out = []
    for heave in (0.25, 0.75, 2.0):
        for k in (0.1, 0.3, 1.0, 5.0, np.inf):
            speed, frequency = (0.0, 0.25) if np.isinf(k) else (1.0, k / np.pi)
            path = np.arctan2(2 * np.pi * frequency * heave, speed)
            out += [Case(speed, heave, pitch, frequency) for pitch in (0.0, 0.5 * path)]
    return out


def by_foil(case: Case) -> Means:
    """As `periodic` has it: a prescribed joint gives a plate without mass, in its axes, minus the water's force."""
    moves = "body.joint.motion."
    values = {f"{moves}y.amplitude": case.heave, f"{moves}angle.amplitude": case.pitch}
    values |= {f"{moves}{name}.frequency": case.frequency for name in ("y", "angle")}
    found = periodic(with_values(PLATE, values | {"water.current.0": -case.speed})).to_dataset().squeeze()
    t, force = np.asarray(found["time"]), -np.asarray(found["reaction"])
    power = np.asarray(found["reaction_power"])
    turn = np.exp(1j * np.array([_motion(case).angle(x) for x in t]))
    return _means(case, t, (force[:, 0] + 1j * force[:, 1]) * turn, power.sum(axis=1))


def by_vortices(case: Case) -> Means:
    """The last two of a few cycles from an impulsive start."""
    motion = _motion(case)
    step = 1 / case.frequency / STEPS
    found = run(motion, 0.5, STALL, step, CYCLES * STEPS, case.scale, RHO)
    last = slice(-2 * STEPS, None)
    return _means(case, found.time[last], found.force[last], case.speed * found.force[last].real - found.power[last])


def towed(strouhal: float) -> tuple[float, float]:
    """Thrust over rho U^2 c/2, and efficiency, of the measured foil by vortices."""
    heave, way = 0.75, np.linspace(0.0, 0.25, 200)
    frequency = strouhal / (2 * heave)
    w, cosine = 2 * np.pi * frequency, np.cos(2 * np.pi * way)

    def beyond(pitch: float) -> float:
        return np.max(np.arctan(heave * w * cosine) - pitch * cosine) - np.radians(15.0)

    pitch = brentq(beyond, 0.0, np.arctan(heave * w))

    def turned(t: float) -> float:
        return float(pitch * np.cos(w * t))

    def middle(t: float) -> complex:
        return complex(t, heave * np.sin(w * t)) - np.exp(1j * turned(t)) / 6

    found = run(Motion(middle, turned), 0.5, STALL, 1 / frequency / STEPS, CYCLES * STEPS, 1.0, RHO)
    last = slice(-2 * STEPS, None)
    thrust = found.force[last].real.mean()
    return thrust / (0.5 * RHO), thrust / (thrust - found.power[last].mean())


def _motion(case: Case) -> Motion:
    w = 2 * np.pi * case.frequency
    return Motion(
        lambda t: complex(case.speed * t, case.heave * np.cos(w * t)), lambda t: -float(case.pitch * np.sin(w * t))
    )


def _means(case: Case, t: np.ndarray, force: np.ndarray, power: np.ndarray) -> Means:
    """Of forces [N/m] and of the power into the plate beside what tows it [W/m]."""
    angle, V = np.array([_motion(case).angle(x) for x in t]), case.scale
    normal = (force * np.exp(-1j * angle)).imag
    over = 0.5 * RHO * V**2
    return Means(_mean(t, force.real) / over, _mean(t, power) / (over * V), float(np.sqrt(_mean(t, normal**2))) / over)


def _mean(t: np.ndarray, values: np.ndarray) -> float:
    return float(np.trapezoid(values, t) / (t[-1] - t[0]))


def main() -> None:
    print("| h/c | pitch, deg | k | St | thrust | | power | | normal force | |")
    print("|---" * 10 + "|", flush=True)
    for case in cases():
        k, st = (np.inf, np.inf)
        if case.speed:
            k, st = np.pi * case.frequency / case.speed, 2 * case.heave * case.frequency / case.speed
        foil, vortices = by_foil(case), by_vortices(case)
        pairs = " | ".join(f"{a:.2f} | {b:.2f}" for a, b in zip(foil, vortices, strict=True))
        print(f"| {case.heave:g} | {np.degrees(case.pitch):.0f} | {k:g} | {st:.2g} | {pairs} |", flush=True)
    for strouhal, measured in MEASURED.items():
        pairs = ", ".join(f"{a:.3f} for {b:g}" for a, b in zip(towed(strouhal), measured, strict=True))
        print(f"St {strouhal}: thrust and efficiency of vortices, for those measured: {pairs}")


if __name__ == "__main__":
    main()
