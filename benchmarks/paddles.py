"""A rowing paddle without stops by nectosome and by MuJoCo: hinges with springs, point masses, each code's own drag.

Both give the angles of the hinges [k, hinges] (or [robots, k, hinges]) at `TIMES`, in degrees.
In MuJoCo the servo is an oscillator far too heavy to feel the paddle, so that its own integrator makes the sine.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Literal

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco.rollout import Rollout

from nectosome.core.programs.remember import remembered, runs_long
from nectosome.description import RobotDescription, resolve
from nectosome.mechanism import in_plane
from nectosome.model import Template, build, instantiate, template_of
from nectosome.robots import describe
from nectosome.solve import simulate
from nectosome.solve.integrate import Settings, begin, integrate

SECONDS = 8.0
SAMPLE = 0.1  # s
TIMES = np.linspace(0.0, SECONDS, round(SECONDS / SAMPLE) + 1)
ARM, WIDTH, THICKNESS, LENGTH, MASS, DENSITY = 0.105, 0.040, 0.002, 0.105, 0.030, 1000.0  # of the shipped paddle
STIFFNESS = np.pi * 0.85**2 * 2e6 * (WIDTH * 0.006**3 / 12) / 0.105  # N m/rad
HEAVY = 1e6  # kg m2, of the oscillator; torques of the paddle move it by 1e-5 degrees

Run = Callable[[], np.ndarray]


def described(hinges: int) -> RobotDescription:
    """The shipped paddle with so many segments and no stops."""
    whole = describe("paddle", [f"N={hinges}"])

    def free(part):
        return part.model_copy(update={"joint": part.joint.model_copy(update={"lower": None})})

    return whole.model_copy(update={"limbs": {name: free(part) for name, part in whole.limbs.items()}})


def one_here(hinges: int, method: Literal["explicit", "implicit"], rtol: float) -> Run:
    """One paddle at 75 deg and 1.1 Hz."""
    robot = build(described(hinges))

    def run() -> np.ndarray:
        made = simulate(robot, SECONDS, samples=TIMES.size, method=method, rtol=rtol, atol=1e-2 * rtol)
        return np.rad2deg(np.asarray(made.value.state.q))

    return run


def some_here(hinges: int, grid: np.ndarray, rtol: float, lanes: int, threads: int) -> Run:
    """Paddles with amplitudes [rad] and frequencies [Hz] of the grid [n, 2], so many side by side in each thread."""
    description = described(hinges)
    paths = [*resolve(description, "A"), *resolve(description, "f")]
    template, base = template_of(description, tuple(paths))
    numbers = np.tile(np.asarray(base), (len(grid), 1))
    numbers[:, [template.paths.index(path) for path in paths]] = grid
    order = np.argsort(grid[:, 1], kind="stable")  # robots of like frequencies take like steps
    spans = [order[k : k + lanes] for k in range(0, len(order), lanes)]
    times = jnp.asarray(TIMES[1:])

    def part(span: np.ndarray) -> np.ndarray:
        padded = np.resize(span, lanes)  # one program for all
        return np.asarray(remembered(_side_by_side, template, jnp.asarray(numbers[padded]), times, jnp.asarray(rtol)))

    def run() -> np.ndarray:
        out = np.zeros((len(grid), TIMES.size, hinges))
        with ThreadPoolExecutor(threads) as pool:
            for span, angles in zip(spans, pool.map(part, spans), strict=True):
                out[span, 1:] = angles[: span.size]
        return np.rad2deg(out)

    return run


@runs_long
def _side_by_side(template: Template, numbers: jax.Array, times: jax.Array, rtol: jax.Array) -> jax.Array:
    """Angles of the hinges [robots, k, hinges]."""
    settings = Settings("explicit", rtol, 1e-2 * rtol, jnp.asarray(1_000_000))

    def one(numbers: jax.Array) -> jax.Array:
        robot = instantiate(template, numbers)
        start = begin(jnp.asarray(0.0), robot.initial(), settings, jnp.asarray(1e-3))
        return integrate(in_plane(robot), start, times, settings)[1].q

    return jax.vmap(one)(numbers)


def one_there(hinges: int, integrator: str, pieces: int) -> Run:
    """The same one by MuJoCo."""
    run = some_there(hinges, np.array([[np.radians(75.0), 1.1]]), integrator, pieces, 1)
    return lambda: run()[0]


def some_there(hinges: int, grid: np.ndarray, integrator: str, pieces: int, threads: int) -> Run:
    """Paddles of the grid [n, 2] by MuJoCo, so many steps to a sample: its rollout, which runs without Python."""
    models = [mujoco.MjModel.from_xml_string(_xml(hinges, f, integrator, SAMPLE / pieces)) for _, f in grid]
    start = np.zeros((len(grid), 1 + 2 * models[0].nv))
    start[:, 1 + models[0].nq] = 2 * np.pi * grid[:, 0] * grid[:, 1]
    data = [mujoco.MjData(models[0]) for _ in range(threads)]
    rollout = Rollout(nthread=threads if threads > 1 else 0)

    def run() -> np.ndarray:
        states = np.asarray(rollout.rollout(models, data, start, nstep=pieces * (TIMES.size - 1))[0])
        angles = states[:, pieces - 1 :: pieces, 2 : 2 + hinges]
        return np.rad2deg(np.concatenate([np.zeros_like(angles[:, :1]), angles], axis=1))

    return run


def _xml(hinges: int, frequency: float, integrator: str, step: float) -> str:
    """MuJoCo's paddle. All that it does not need (constraints, contacts, gravity) is switched off."""
    l, m = LENGTH / hinges, MASS / hinges
    spring = HEAVY * (2 * np.pi * frequency) ** 2
    chain = ""
    for k in range(hinges):
        chain += f"""<body pos="{l if k else ARM} 0 0"><joint axis="0 0 1" stiffness="{STIFFNESS}"/>
            <inertial pos="{l} 0 0" mass="{m}" diaginertia="1e-12 1e-12 1e-12"/>
            <geom type="box" pos="{l / 2} 0 0" size="{l / 2} {THICKNESS / 2} {WIDTH / 2}" fluidshape="ellipsoid"/>"""
    return f"""<mujoco><option timestep="{step}" integrator="{integrator}" density="{DENSITY}" viscosity="0">
        <flag constraint="disable" contact="disable" gravity="disable" actuation="disable" sensor="disable"/></option>
        <default><geom contype="0" conaffinity="0"/></default>
        <worldbody><body><joint axis="0 0 1" armature="{HEAVY}" stiffness="{spring}"/>
        <inertial pos="{ARM} 0 0" mass="0.016" diaginertia="1e-12 1e-12 1e-12"/>
        {chain}{"</body>" * hinges}</body></worldbody></mujoco>"""
