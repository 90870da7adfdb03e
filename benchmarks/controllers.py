"""How well each controller makes robots follow a reference that begins and ends at rest; all of it is simulated.

Gains and models are found, as without options. Rms error of the last round, in percent of the reference's amplitude.
"""

import time
from typing import NamedTuple

import numpy as np

from nectosome.controllers import control, controllers, eased, wave
from nectosome.description import parse_robot
from nectosome.model.inputs import RobotLike
from nectosome.units import InputError

NAMES = [*controllers()]
_DIVER = parse_robot("""
name: diver
body:
  kind: rigid
  shape: spheroid
  length: 30 cm
  radius: 4 cm
  density: 1000 kg/m3
  loads:
    drag: {kind: lumped_drag, drag_area: [6 cm2, 200 cm2, 200 cm2]}
    water: {kind: spheroid_added_mass}
  joint: {kind: prismatic, axis: z, force: {kind: constant, value: 0 N}}
aliases: {thrust: body.joint.force.value}
""")


class Case(NamedTuple):
    """A robot, what is commanded and measured, and its reference: a sine that swells and dies away."""

    about: str
    robot: RobotLike
    options: dict[str, str | bool]
    amplitude: float  # [SI]
    frequency: float  # [Hz]
    rate: float  # [Hz]
    noise: float  # [SI]


CASES = (
    Case("eel, heading by bias, 20 deg at 0.1 Hz", "eel", {"command": "bias=-8..8 mN m", "measure": "heading",
         "mean": True}, np.radians(20), 0.1, 8.0, np.radians(0.2)),
    Case("fish, heading by bias, 10 deg at 0.02 Hz", "fish", {"command": "bias=-0.3..0.3 bar", "measure": "heading",
         "mean": True}, np.radians(10), 0.02, 4.0, np.radians(0.2)),
    Case("diver, height by thrust, 0.3 m at 0.1 Hz", _DIVER, {"command": "thrust=-5..5 N",
         "measure": "position.z"}, 0.3, 0.1, 10.0, 2e-3),
)  # fmt: skip


def main() -> None:
    print(f"\n| | {' | '.join(NAMES)} |\n|---|{'---:|' * len(NAMES)}")
    for case in CASES:
        begun = time.process_time()
        seconds = 4 / case.frequency
        reference = eased(
            wave("sine", seconds, 1 / case.rate, amplitude=case.amplitude, frequency=case.frequency),
            seconds / 4,
            1 / case.rate,
        )
        cells = [_error(case, name, reference) for name in NAMES]
        print(f"| {case.about} | {' | '.join(cells)} |", flush=True)
        print(f"({time.process_time() - begun:.0f} s of processor time)", flush=True)


def _error(case: Case, controller: str, reference: np.ndarray) -> str:
    try:
        result = control(
            case.robot, **case.options, reference=reference, rate=case.rate, noise=case.noise, controller=controller
        )  # fmt: skip
    except InputError as error:
        return error.message
    return f"{100 * result.errors[-1] / case.amplitude:.2g} %"


if __name__ == "__main__":
    main()
