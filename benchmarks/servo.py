"""A rowing paddle on its servo beside the same with an ideal drive: eight seconds of several strokes, in turns."""

import math
import statistics
from functools import partial
from typing import Literal

from jaxtyping import Array

from nectosome import robots
from nectosome.description import RobotDescription, with_values
from nectosome.description.drives import AngularServo
from nectosome.mechanism import Robot
from nectosome.model import build
from nectosome.solve import simulate

from .timing import once

_SECONDS, _ROUNDS = 8.0, 9
_STROKES = ((75, 1.1), (75, 0.6), (30, 1.1), (30, 0.6))  # deg, Hz


def main() -> None:
    """Print processor times and the median of their ratios."""
    ideal = robots.describe("paddle")
    driven = _on_servo(ideal)
    print(f"\n{_SECONDS:g} s of a paddle of three hinges, processor ms: ideal drive, servo, ratio")
    for method in ("implicit", "explicit"):
        every = []
        for degrees, frequency in _STROKES:
            values = {"A": math.radians(degrees), "f": frequency}
            pair = [build(with_values(robot, values)) for robot in (ideal, driven)]
            runs = [partial(_run, robot, method) for robot in pair]
            for run in runs:
                run()
            times = [[once(run)[0] for run in runs] for _ in range(_ROUNDS)]
            medians = [1e3 * statistics.median(column) for column in zip(*times, strict=True)]
            ratio = statistics.median(servo / prescribed for prescribed, servo in times)
            print(f"  {method}, {degrees} deg, {frequency} Hz: {medians[0]:.1f}, {medians[1]:.1f}, {ratio:.2f}")
            every.append(medians)
        ideals, servos = map(sum, zip(*every, strict=True))
        print(f"  {method}, all strokes: {ideals:.1f}, {servos:.1f}, {servos / ideals:.2f}")


def _run(robot: Robot, method: Literal["implicit", "explicit"]) -> Array:
    return simulate(robot, _SECONDS, method=method).value.state.q


def _on_servo(paddle: RobotDescription) -> RobotDescription:
    """With the servo of the paper, the XW540-T140 at 11.1 V, and the assumptions of its study."""
    servo = AngularServo(
        rated_voltage=11.1,
        stall_torque=6.4,
        no_load_speed=67 * math.tau / 60,
        inertia=0.003,
        supply=11.1,
        full_voltage_at=math.radians(12.5),
    )
    return paddle.with_part("arm", joint=paddle.limbs["arm"].joint.model_copy(update={"servo": servo, "limits": None}))


if __name__ == "__main__":
    main()
