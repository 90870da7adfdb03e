"""The same jet held still and swimming free: its thrust, and the drag that is identified with the held one's thrust.

Section 5 of the paper suspects, with a reference to another robot, that thrust measured on the held robot is up to 30 %
less than that of the swimming one, whose change of shape helps, and that drag identified with it is some 50 % too
small. Here both are computed, for a synthetic chamber (`recordings.chamber`), over two unknowns: the share of the added
mass that changes with the bell's volume, and whether the water that fills the chamber comes from still water or from
the wake. What the changing shape gives it takes back: the momentum m v is after a settled turn what it was before. What
remains is the ram drag rho Q v of the water that is taken in, which acts the other way.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Float
from scipy.interpolate import CubicSpline

from nectosome.core import CrankState
from nectosome.description import ConstantSignal, Coordinate, RobotDescription, drive_period, get_value
from nectosome.description.drives import MotorDrive
from nectosome.description.joints import FixedJoint, PrismaticJoint, RevoluteJoint
from nectosome.description.parts import Rigid
from nectosome.identification.fits.linear import Regressors, Trial, output_error
from nectosome.loads import Jet, Pulse
from nectosome.mechanism import Robot
from nectosome.model import bind, build
from nectosome.robots import describe
from nectosome.solve import Run, Trajectory, simulate

from ..study import Progress, StudyPart

MASS, ADDED, DRAG = 0.755, 2.768, 5.094  # kg, kg, kg/m (section 4.2)
SHARES = (0.02, 0.1, 0.2, 0.4, 0.6, 0.8, 0.95)  # of the added mass outside the chamber
WAKES = (0.0, 1.0)
NOISE, RECORDED = 5e-3, 20.0  # of the synthetic speed recordings [m/s, s]
ARM, LOAD_CELL = 0.3, 2e5  # of the shaft from its pivot [m], stiffness [N/m]: assumptions
# assumptions; the rated voltage is that of a motor that loses nothing in its gear
SHEET = {"rated_voltage": 1.25, "stall_torque": 0.1, "no_load_speed": 12.5, "stall_current": 1.0, "inertia": 1e-3}
MOTOR = MotorDrive.model_validate({**SHEET, "voltage": {"kind": "constant", "value": 1.25}})
MOTOR_START = 11.0  # speed [rad/s]
_SAMPLES = 241  # of a turn
_TURNS, _SETTLED = 8, 150  # turns of the motor, and of the crank until a swim has settled


def held(description: RobotDescription) -> RobotDescription:
    """The robot held still."""
    motion = ConstantSignal[Coordinate](kind="constant", value=0.0)
    return description.with_part("body", joint=PrismaticJoint(kind="prismatic", axis=(1.0, 0.0, 0.0), motion=motion))


def on_pivot(description: RobotDescription) -> RobotDescription:
    """The robot on a shaft that turns about a pivot above, held by a load cell as far from it (Fig. 7)."""
    inertia = (MASS + ADDED) * ARM**2
    stiffness = LOAD_CELL * ARM**2
    damping = 0.1 * np.sqrt(stiffness * inertia)  # a twentieth of what stops it from ringing
    hinge = RevoluteJoint(kind="revolute", axis=(0.0, 1.0, 0.0), stiffness=stiffness, damping=damping)
    shaft = Rigid(kind="rigid", shape="point", mass=1e-3, joint=hinge)
    robot = description.parts["body"].model_copy(
        update={"on": "body", "offset": (0.0, 0.0, -ARM), "joint": FixedJoint(kind="fixed")}
    )
    return description.model_copy(update={"body": shaft, "limbs": {"robot": robot}, "aliases": {}})


def with_motor(description: RobotDescription) -> RobotDescription:
    """The robot whose crank a motor turns."""
    loads = description.parts["body"].loads
    jet = loads["jet"].model_copy(update={"crank": None, "turned_by": "wheel"})
    hinge = RevoluteJoint(kind="revolute", axis=(0.0, 1.0, 0.0), velocity=MOTOR_START, motor=MOTOR)
    limbs = {"wheel": Rigid(kind="rigid", shape="point", mass=0.0, volume=0.0, joint=hinge)}
    turned = description.with_part("body", loads=loads | {"jet": jet})
    return turned.model_copy(update={"limbs": limbs, "aliases": {}})


def jet_of(robot: Robot) -> Jet:
    """The robot's jet."""
    return next(a.load for a in robot.loads if isinstance(a.load, Jet))


def pulses(robot: Robot, time: Float[Array, "n"], z: Any, along: Float[Array, "n"]) -> Pulse:
    """Chamber and crank of a robot's jet at times, states of the crank, and speeds."""
    jet = jet_of(robot)
    return jax.jit(jax.vmap(lambda t, z, v: jet.pulse(t, z, v, robot.water)))(time, z, along)


def compared() -> xr.Dataset:
    """Thrust held and free, and drag identified with the former, over share and wake; a motor's turns, held.

    In SI units. `thrust` (wake, share, angle): what jet and change of shape give the free robot over a settled turn;
    `held` (angle) what they give the held one and `rig` what the load cell on the pivot reads. `ratio` is the mean of
    `held` over that of what the free robot's drag takes, which is the mean of its jet: the momentum of what it carries
    along has no mean rate. `pulse` is the sum of `held` over that of `thrust` while water is expelled. `drag`,
    `drag_se` and `mass` are found from a synthetic recording of the free speed with noise of 5 mm/s. `motor_*`
    (instant): the held robot with a motor.
    """
    description = describe("poseidrone_jet")
    robot = build(description)
    full = float(robot.water.density * jnp.max(jet_of(robot).volume))
    outside = ADDED - full
    own = get_value(description, "bell") * full / outside
    shares = np.array(sorted((own, *SHARES)))
    period = drive_period(description)
    time = np.linspace(0.0, period, _SAMPLES)
    still = pulses(robot, jnp.asarray(time), (), jnp.zeros(_SAMPLES))
    given, out = np.asarray(still.thrust), np.asarray(still.outflow) > 0
    cell = last_turn(build(on_pivot(description)), period, _TURNS).value.state

    to_robot = jax.jit(bind(description, ("body.loads.jet.bell", "body.loads.water.mass.0", "body.loads.jet.wake"))[1])
    regressors = surge(robot)
    rows = []
    for wake in WAKES:
        for share in shares:
            free = to_robot(jnp.array([share * outside / full, (1 - share) * outside, wake]))
            run = last_turn(free, period, _SETTLED)
            force = run.to_dataset()["load_force"].sel(part="body", axis="x")
            push = force.sel(load="jet").values
            thrust = push + force.sel(load="shape_change").values
            speed = np.asarray(run.value.state.v)[:, 0]
            ratio = np.mean(given[:-1]) / np.mean(push[:-1]), np.sum(given[out]) / np.sum(thrust[out])
            rows.append((speed, thrust, *ratio, *identified(time, speed, regressors)))
    over = ("wake", "share")
    found = zip(*rows, strict=True)
    speed, thrust, *numbers_ = (np.reshape(x, (len(WAKES), len(shares), *np.shape(x[0]))) for x in found)
    names = {"ratio": "1", "pulse": "1", "mass": "kg", "drag": "kg/m", "drag_se": "kg/m"}
    return xr.Dataset(
        {
            "held": ("angle", given, {"units": "N"}),
            "rig": ("angle", -LOAD_CELL * ARM * np.asarray(cell.q)[:, 0], {"units": "N"}),
            "speed": ((*over, "angle"), speed, {"units": "m/s"}),
            "thrust": ((*over, "angle"), thrust, {"units": "N"}),
            **{name: (over, x, {"units": unit}) for (name, unit), x in zip(names.items(), numbers_, strict=True)},
            **motor_turns(description),
        },
        {
            "angle": ("angle", np.asarray(still.angle), {"units": "rad"}),
            "share": ("share", shares, {"units": "1"}),
            "wake": ("wake", np.array(WAKES), {"units": "1"}),
        },
        {"own_share": own, "noise": NOISE, "drag": DRAG, "mass": MASS + ADDED, "period": period},
    )


def last_turn(robot: Robot, period: float, turns: int) -> Run:
    """The last of some turns of the crank, from rest; steps leave 1e-5 of the ram drag to the change of momentum."""
    times = np.append(0.0, period * (turns - 1 + np.linspace(0.0, 1.0, _SAMPLES)))
    run = simulate(robot, times[-1], samples=times.tolist(), rtol=1e-9, atol=1e-12)
    last = jax.tree.map(lambda x: x[1:], (run.value.time, run.value.state))
    return Run(Trajectory(robot, *last), run.status, run.stats, run.residual)


def surge(robot: Robot) -> Regressors:
    """Regressors of v' = alpha v|v| + gamma tau (eq. 2), with the thrust of the held robot."""
    jet = jet_of(robot)

    def regressors(t: Array, v: Array) -> Array:
        return jnp.stack([v * jnp.abs(v), jet.pulse(t, (), jnp.zeros(()), robot.water).thrust])

    return regressors


def identified(
    time: Float[np.ndarray, "n"], speed: Float[np.ndarray, "n"], regressors: Regressors
) -> tuple[float, float, float]:
    """Mass [kg], drag and its standard error [kg/m] from a synthetic recording of a settled turn's speed, repeated."""
    recorded = np.arange(0.0, RECORDED, 0.01)
    cycle = CubicSpline(time, np.append(speed[:-1], speed[0]), bc_type="periodic")
    noisy = cycle(recorded % time[-1]) + NOISE * np.random.default_rng(0).normal(size=recorded.size)
    start = np.array([-DRAG, 1.0]) / (MASS + ADDED)
    found = output_error([Trial(recorded, noisy, regressors)], start)
    mass, drag = (found.of(lambda p, k=k: jnp.stack([1 / p[1], -p[0] / p[1]])[k]) for k in (0, 1))
    return float(mass.values[0]), float(drag.values[0]), float(drag.errors[0])


def motor_turns(description: RobotDescription) -> dict[str, tuple]:
    """Angle, speed, current, thrust and volume over some turns of a motor that drives a held robot (Fig. 8)."""
    robot = build(with_motor(held(description)))
    run = simulate(robot, _TURNS * drive_period(description), samples=_TURNS * _SAMPLES, rtol=1e-7, atol=1e-9)
    time, state = run.value.time, run.value.state
    now = pulses(robot, time, CrankState(state.q[:, 0], state.v[:, 0], ()), jnp.zeros_like(time))
    data = {
        "time": (time, "s"),
        "angle": (now.angle, "rad"),
        "speed": (now.speed, "rad/s"),
        "current": (run.to_dataset()["current"].values[:, 0], "A"),
        "thrust": (now.thrust, "N"),
        "volume": (now.volume, "m3"),
    }
    return {f"motor_{name}": ("instant", np.asarray(x), {"units": unit}) for name, (x, unit) in data.items()}


def numbers(found: xr.Dataset) -> dict[str, float | None]:
    """Scorecard numbers, of the robot file's own share; water that is taken in is still, or moves along (`wake`)."""
    still, wake = (found.sel(share=found.attrs["own_share"], wake=x) for x in WAKES)
    given = float(found["held"][:-1].mean())
    gained = (MASS + ADDED) * float(still["speed"][-1] - still["speed"][0]) / found.attrs["period"]
    return {
        "poseidrone/static-free/thrust-ratio": float(still["ratio"]),
        "poseidrone/static-free/wake/thrust-ratio": float(wake["ratio"]),
        "poseidrone/static-free/hull-drag": given / float(still["ratio"]),
        "poseidrone/static-free/ram-drag": given * (1 - 1 / float(still["ratio"])),
        "poseidrone/static-free/momentum": gained,
        "poseidrone/static-free/pulse-ratio": float(still["pulse"]),
        "poseidrone/static-free/lambda-error": 100 * (float(still["drag"]) / DRAG - 1),
        "poseidrone/static-free/wake/lambda-error": 100 * (float(wake["drag"]) / DRAG - 1),
    }


def part(quick: bool, progress: Progress) -> StudyPart:
    """Held and free, for the study."""
    progress("held and free", 0.0)
    found = compared()
    return StudyPart(numbers(found), {"static_free": found})
