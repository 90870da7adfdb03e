"""A policy of four numbers learns to hold the tuna on a heading, and is held against the PID that `control` finds."""

import time
from pathlib import Path

import cma
import numpy as np

import nectosome as ns
from nectosome.gym import RobotVectorEnv

BEAT = 2 / 3  # s
TAIL = "limbs.peduncle.joint.motion.offset"  # to where the tail beats on the mean
RANGE = "-20..20 deg"
TURNS, STEPS = 6, 24  # headings that each policy is tried on, and beats of each
POLICIES, GENERATIONS = 8, 40

# the task: after each beat, the mean heading over it, how fast that turns, and where the tail is
task = {
    "commands": {TAIL: RANGE},
    "observations": ["mean.heading", "goal.heading", "mean.turn_rate", f"command.{TAIL}"],
    "reward": "-abs(mean.heading - goal.heading)",
    "goals": {"heading": "-60..60 deg"},
    "step": BEAT,
    "episode": STEPS * BEAT,
}


def action(policy: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """The policy: linear in error, turn rate and the last command, for many copies at once."""
    heading, goal, turning, tail = np.moveaxis(seen, -1, 0)
    features = np.stack([goal - heading, turning, tail, np.ones_like(tail)], axis=-1)
    return np.sum(policy * features, axis=-1, keepdims=True)


def errors(env: RobotVectorEnv, policies: np.ndarray, seeds: list[int]) -> np.ndarray:
    """For each policy and each heading: mean error over an episode, error after its last beat, the heading [rad]."""
    seen, _ = env.reset(seed=seeds * len(policies))
    each, goals = np.repeat(policies, len(seeds), axis=0), seen[:, 1]
    total, reward = np.zeros(len(each)), np.zeros(len(each))
    for _ in range(STEPS):
        seen, reward, terminated, _, _ = env.step(action(each, seen))
        if terminated.any():
            raise RuntimeError("a motion could not be computed.")
        total -= reward
    of_all = np.stack([total / STEPS, -reward, goals], axis=-1)
    return np.moveaxis(of_all.reshape(len(policies), len(seeds), 3), -1, 1)


# learn: each generation of policies is tried on the same headings, drawn anew for the next one
began = time.perf_counter()
env = RobotVectorEnv("tuna", num_envs=POLICIES * TURNS, **task)
search = cma.CMAEvolutionStrategy(np.zeros(4), 0.5, {"popsize": POLICIES, "seed": 1, "verbose": -9})
tests = list(range(10_000, 10_000 + TURNS))  # headings that are never learned from
unseen = RobotVectorEnv("tuna", num_envs=TURNS, **task)
rows = ["generation,seconds,best (deg),median (deg),unseen (deg)"]
for k in range(GENERATIONS):
    policies = search.ask()
    found = errors(env, np.array(policies), [1000 * (k + 1) + i for i in range(TURNS)])[:, 0].mean(axis=1)
    search.tell(policies, found.tolist())
    test = errors(unseen, search.mean[None], tests)[0, 0].mean()
    of_all = np.degrees([found.min(), np.median(found), test])
    rows.append(",".join(f"{x:.4f}" for x in (k + 1, time.perf_counter() - began, *of_all)))
    if k % 5 == 4:
        print(f"generation {k + 1:2d}: error {of_all[2]:6.2f} deg on headings not learned from")

# compare: the PID that `control` finds on the model, on the same headings, by the same measure; then both on a tuna
# whose middle joint is 3 deg off, which neither has seen
loop = {"command": f"{TAIL}={RANGE}", "measure": "heading", "mean": True, "time": STEPS * BEAT}
found = ns.control("tuna", reference="30 deg", **loop)
gains = found.task.gains_text(found.law.gains)
print(f"policy: {np.array2string(search.mean, precision=3)}; PID: {gains} deg/deg, deg/(deg s), deg s/deg")
names = ["middle joint off by (deg),heading (deg),policy (deg),PID (deg),policy at the end (deg),PID at the end (deg)"]
for off in (0, 3):
    settings = [f"limbs.middle.joint.motion.offset={off} deg"]
    other = RobotVectorEnv("tuna", num_envs=TURNS, settings=settings, **task)
    of_policies = errors(other, search.mean[None], tests)[0]
    for of_policy, last, goal in zip(*of_policies, strict=True):
        record = ns.control("tuna", reference=f"{np.degrees(goal)} deg", gains=gains, settings=settings, **loop).record
        of_pid = np.abs(record.output[4::4][:STEPS] - goal)  # the mean over each beat: the PID has four samples in one
        row = off, *np.degrees([goal, of_policy, of_pid.mean(), last, of_pid[-1]])
        names.append(",".join(f"{x:.4f}" for x in row))
print("\n".join(names))

# save
Path("out").mkdir(exist_ok=True)
Path("out/learn_heading.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
Path("out/learn_heading_compared.csv").write_text("\n".join(names) + "\n", encoding="utf-8")
