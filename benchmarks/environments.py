"""Steps a second of the tuna as an environment of Gymnasium, beside its exported model in MuJoCo.

The tail's middle goes to and fro by commands, 0.48 Hz at steps of 20 ms; at steps of half a second at random. Warm,
processor seconds, medians of five runs of 200 steps of one copy, of 40 of 32 copies.

    python -m benchmarks.environments TREE          # the same of the package in TREE/src
"""

import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from .timing import now

_RUNS, _ONE, _MANY, _COPIES = 5, 200, 40, 32
_STEP = 0.02  # s
_OFFSET = 20.0  # deg
_ENVIRONMENT = {
    "robot": "tuna",
    "commands": {"limbs.peduncle.joint.motion.offset": f"{-_OFFSET}..{_OFFSET} deg"},
    "observations": ["velocity.x", "heading", "turn_rate", "middle.angle", "peduncle.angle"],
    "reward": "velocity.x",
    "episode": "100 s",
}
_MEANS = {"observations": ["mean.heading", "mean.turn_rate"], "reward": "-abs(mean.heading)"}


def main() -> None:
    from nectosome.gym import RobotEnv, RobotVectorEnv

    for what, more, step in (
        ("readings, steps of 20 ms", {}, _STEP),
        ("means over the step, 20 ms", _MEANS, _STEP),
        ("readings, steps of 0.5 s", {}, 0.5),
    ):
        options = _ENVIRONMENT | more | {"step": step}
        rng = np.random.default_rng(0)
        swings = np.sin(0.06 * np.arange(_ONE)[:, None, None] + rng.uniform(0, 6, (_COPIES, 1)))
        actions = swings if step == _STEP else rng.uniform(-1, 1, swings.shape)
        one, many = RobotEnv(**options), RobotVectorEnv(num_envs=_COPIES, **options)
        alone = _rate(one, actions[:, 0])
        print(f"  {what}: {alone:.0f} of one copy, {_rate(many, actions[:_MANY]):.0f} of {_COPIES}", flush=True)


def _rate(env, actions: np.ndarray) -> float:
    """Steps of all copies in a second of processor time."""
    rates = []
    for k in range(_RUNS + 1):
        env.reset(seed=0)
        began = now()
        for action in actions:
            env.step(action)
        if k:  # the first run compiles
            rates.append(actions[..., 0].size / (now() - began))
    return statistics.median(rates)


def _mujoco() -> None:
    """The model that `nectosome export` writes."""
    import mujoco

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "tuna.xml"
        export = [sys.executable, "-m", "nectosome", "export", "tuna", str(file), "--to", "mjcf"]
        subprocess.run(export, check=True, capture_output=True)
        model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    pieces = max(round(_STEP / model.opt.timestep), 1)
    rates = []
    for _ in range(_RUNS):
        mujoco.mj_resetData(model, data)
        began = now()
        for k in range(_ONE):
            data.ctrl[:] = 0.1 * np.sin(0.06 * k)
            mujoco.mj_step(model, data, pieces)
        rates.append(_ONE / (now() - began))
    print(f"  MuJoCo {mujoco.__version__}, {pieces} steps in 20 ms: {statistics.median(rates):.0f} of one copy")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        path = {**os.environ, "PYTHONPATH": str(Path(sys.argv[1]) / "src")}
        subprocess.run([sys.executable, "-m", "benchmarks.environments"], env=path, check=True)
    else:
        print("\nsteps a second of an environment of Gymnasium")
        main()
        _mujoco()
