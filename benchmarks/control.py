"""A minute of the fishtail under its PID at 1 kHz, beside the same loop in numba; what controllers take for a sample.

The latter as an experiment calls them, at 200 Hz, which leaves them 5 ms.
"""

import time

import jax
import jax.numpy as jnp
import numba
import numpy as np

from nectosome.controllers import BlockLoop, wave
from nectosome.drives import Chain, DeadTime, Sensor
from nectosome.rigs.laws import ControllerSteps
from nectosome_studies.fishtail.comparison import DT, LIMITS, actuator, controllers, kept, known_model
from nectosome_studies.fishtail.plant import LARGEST, LIMIT

from .timing import timed

_FINE, _TIME, _REPEATS = 1e-3, 60.0, 9
_SAMPLES = 2000  # of each controller


@numba.njit
def looped(reference, kp, ki, kd, filtering, most, high, direct, thresholds, weights, A, B, D):
    """The same equations, sample by sample: the command acts a sample later, and is held."""
    plays, y = np.zeros(len(thresholds)), np.empty(len(reference))
    x, v, sent, wait, pressure = 0.0, 0.0, 0.0, 0.0, 0.0
    integral, derivative, last = 0.0, 0.0, reference[0]
    for k in range(len(reference)):
        y[k] = D[0] * x + D[1] * v
        error = reference[k] - y[k]
        derivative = (filtering * derivative + kd * (error - last)) / (filtering + 1e-3)
        more = ki * 1e-3 * error
        unlimited = kp * error + integral + more + derivative
        command = min(max(min(max(unlimited, sent - most), sent + most), -high), high)
        if (unlimited - command) * more <= 0:
            integral += more
        sent, last = command, error
        act, wait = wait, command
        after = min(max(min(max(act, -high), high), pressure - most), pressure + most)
        drives = np.empty(2)
        for side in range(2):
            p = pressure if side == 0 else after
            drives[side] = direct * p
            for i in range(len(thresholds)):
                plays[i] = max(p - thresholds[i], min(p + thresholds[i], plays[i]))
                drives[side] += weights[i] * plays[i]
        pressure = after
        step = drives[1] - drives[0]
        x, v = (
            A[0, 0] * x + A[0, 1] * v + B[0, 0] * drives[0] + B[1, 0] * step,
            A[1, 0] * x + A[1, 1] * v + B[0, 1] * drives[0] + B[1, 1] * step,
        )
    return y


def main() -> None:
    reference = wave("sine", _TIME, _FINE, amplitude=6e-3, frequency=0.2)
    pid = kept()["ff-pid"].pid(LIMITS)
    still = Sensor(*(jnp.asarray(x) for x in (0.0, -1.0, 1.0)))
    plant = actuator()
    loop = BlockLoop(Chain((DeadTime(jnp.asarray(_FINE), 1), *plant.blocks[1:])), still, _FINE, 1)
    hysteresis, held = plant.blocks[-2], plant.blocks[-1].sampled(_FINE)
    gains = [float(x) for x in (pid.proportional, pid.integral, pid.derivative, pid.filtering)]
    numbers = [np.asarray(x) for x in (hysteresis.direct, hysteresis.thresholds, hysteresis.weights)]
    numbers += [np.asarray(held.A), np.stack([held.B, held.C]), np.asarray(held.D)]
    regulator = pid.planned(reference, _FINE)
    ours = lambda: jax.block_until_ready(loop.run_regulator(regulator, reference).output)  # noqa: E731
    theirs = lambda: looped(reference, *gains, LIMIT * _FINE, LARGEST, *numbers)  # noqa: E731
    assert np.abs(ours() - theirs()).max() < 1e-12
    times = [(timed(ours)[0], timed(theirs)[0]) for _ in range(_REPEATS)]
    mine, loops = np.median(times, axis=0)
    print("\na minute of the fishtail under PID at 1 kHz")
    print(f"  {1e3 * mine:.1f} ms, numba {1e3 * loops:.1f} ms, ratio {mine / loops:.1f}", flush=True)
    print("what a controller takes for a sample of 5 ms, as a rig calls it")
    reference = wave("sine", 30.0, DT, amplitude=6e-3, frequency=0.2)
    for name, controller in controllers(kept(), known_model()).items():
        law = ControllerSteps(controller.planned(reference, DT))
        law.begin(0.0)
        spent = np.empty(_SAMPLES)
        for k in range(_SAMPLES):
            begun = time.perf_counter()
            law.command(float(reference[k]))
            spent[k] = time.perf_counter() - begun
        median, most = 1e6 * np.median(spent), 1e6 * np.quantile(spent, 0.99)
        print(f"  {name}: median {median:.0f} us, 99 % within {most:.0f} us", flush=True)


if __name__ == "__main__":
    main()
