r"""MuJoCo's coefficients of the water, fitted to what our loads give in the robot's own motion.

MuJoCo takes each geom for an ellipsoid with five coefficients: drag of blunt and of slender bodies, drag of rotation,
lift by circulation (Kutta) and by spin (Magnus). Its generalised force is linear in them,
$\tau = \tau_0 + \sum_k c_k \tau_k$, where $\tau_0$ is that of the ellipsoid's added mass as it turns and of viscosity.
All are asked of MuJoCo itself, at states of a run of ours, and
$\min_{c \ge 0} \sum |(\tau_0 + \sum_k c_k \tau_k - \tau)/s|^2$ with $\tau$ of our loads and s its root mean square
along each velocity.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import State
from nectosome.core.programs.remember import remembered
from nectosome.io.extras import package
from nectosome.mechanism import Robot
from nectosome.solve import SimulationRun

from .body_tree import BodyJoint
from .mjcf import STEP, MuJoCoModel, accelerations, actuated, coordinates

_COEFFICIENTS = 5
_FIRST = 1  # of them in a row of MuJoCo's geom_fluid; 0 switches the model on
_LEAST = 1e-3  # of the largest root mean square: forces below it count less
_MOST_STATES = 60  # of the run
_DAMPING, _ROUNDS = 1e-4, 100  # of the fit: share of a column's size; exchanges of coefficients, of their number


class FluidFit(NamedTuple):
    """Coefficients by geom, and what they come to."""

    coefficients: dict[str, tuple[float, ...]]
    missed: float  # share of the root mean square of tau/s that is not met, prescribed joints apart; NaN without any
    missed_along: float  # likewise of the force on the first body along its mean velocity; NaN where it does not move
    names: tuple[str, ...]  # of the actuators
    control: Float[np.ndarray, "n nu"]  # of them over the run
    time: Float[np.ndarray, "n"]  # [s]
    velocity: Float[np.ndarray, "3"]  # of the first body over the second half of the run [m/s]
    velocity_there: Float[np.ndarray, "3"]  # in MuJoCo; NaN where it lost the motion
    change: float  # of the speed from one half of that to the other, over the speed; 0 where it does not move
    change_there: float

    @property
    def table(self) -> str:
        """The controls over time as text of a CSV file, with headings."""
        heads = ",".join(["time (s)", *self.names])
        rows = (",".join(map(repr, row)) for row in np.column_stack([self.time, self.control]).tolist())
        return "\n".join([heads, *rows, ""])


class _Water(NamedTuple):
    """Numbers of the run, of JAX while it is traced and of NumPy from then on."""

    q: Any  # all coordinates, velocities and accelerations [nq], [nv], [nv]
    v: Any
    a: Any
    carried: Any  # wrenches of added mass on stations, station frame [n, 6]
    wrenches: tuple[Any, ...]  # of each group of loads [k, 6]
    drive: Any  # forces of driven joints [nv]
    position: Any  # of the first station [3], in m


def fit_fluid(model: MuJoCoModel, run: SimulationRun) -> FluidFit:
    """Fit the coefficients of a model's geoms to a run of its robot, put them in, and run the model likewise.

    Raises InputError without the extra `mujoco`.
    """
    mujoco = package("mujoco", "mujoco")
    robot: Robot = run.value.system
    water = jax.tree.map(np.asarray, remembered(_water_of_all, robot, run.value.time, run.value.state))
    time = np.asarray(run.value.time)
    wrench = _of_water(robot, model, water)
    control = np.stack([_control(model, q, drive) for q, drive in zip(water.q, water.drive, strict=True)])
    with _quiet(mujoco):
        coefficients, missed, along = _fitted(mujoco, mujoco.MjModel.from_xml_string(model.text), model, water, wrench)
        model.set_coefficients(coefficients)
        place = _replayed(mujoco, mujoco.MjModel.from_xml_string(model.text), model, water, time, control)
    (velocity, change), (velocity_there, change_there) = (_mean_velocity(time, x) for x in (water.position, place))
    return FluidFit(
        coefficients,
        missed,
        along,
        tuple(joint.name for joint in actuated(model.bodies)),
        control,
        time,
        velocity,
        velocity_there,
        change,
        change_there,
    )


def _mean_velocity(time: Float[np.ndarray, "n"], place: Float[np.ndarray, "n 3"]) -> tuple[np.ndarray, float]:
    """Mean over the second half, and how much the speed changes from one half of that to the other, over the speed."""
    start, middle = len(time) // 2, 3 * len(time) // 4

    def mean(a: int, b: int) -> np.ndarray:
        return (place[b] - place[a]) / (time[b] - time[a])

    velocity = mean(start, -1)
    first, second, whole = map(np.linalg.norm, (mean(start, middle), mean(middle, -1), velocity))
    return velocity, float(abs(second - first) / whole) if whole else 0.0


def _water_of_all(robot: Robot, time: Array, states: State) -> _Water:
    def at(t: Array, x: State) -> _Water:
        free, forces = robot.solved(t, x)
        q, v, a = robot.tree.complete(t, x.q, x.v, free)
        carried = sum((x for x in (forces.reshaping, forces.slamming) if x is not None), forces.fluid)
        drive = robot.driving_forces(t, q, v, x.z, None)
        return _Water(q, v, a, carried, forces.wrenches, drive, forces.shape.position[0])

    return jax.vmap(at)(time, states)


def _of_water(robot: Robot, model: MuJoCoModel, found: _Water) -> Float[np.ndarray, "t n 6"]:
    """Wrenches on stations, station frame, of added mass and of the loads that MuJoCo's water stands for."""
    names, own = robot.tree.names, []
    for group, wrench in zip(robot.load_groups.acting, found.wrenches, strict=True):
        stands = [(names[part], name) in model.fitted for part, name in zip(group.parts, group.names, strict=True)]
        each = np.repeat(stands, [len(here) for here in group.stations_of_each(robot.tree)])
        own.append(wrench * each[:, None])
    return found.carried + (np.asarray(jax.vmap(robot.on_stations)(own)) if own else 0.0)


def _fitted(
    mujoco: Any, compiled: Any, model: MuJoCoModel, found: _Water, water: Float[np.ndarray, "t n 6"]
) -> tuple[dict[str, tuple[float, ...]], float, float]:
    """Coefficients of each geom, and the shares of tau/s and of the force along the way that they miss.

    Without any force of the water in our run there is no share: what MuJoCo's viscosity does to specks is none.
    """
    from scipy.optimize import nnls

    if not model.geoms and not water.any():
        return {}, np.nan, np.nan
    geoms = [compiled.geom(name).id for name in model.geoms]
    data, rows, sums, rates = mujoco.MjData(compiled), [], [], []
    ours = [compiled.body(body.name).id for body in model.bodies]
    of_added = _force_of_added(mujoco, model)
    for k in np.unique(np.linspace(0, len(found.q) - 1, _MOST_STATES).astype(int)):
        data.qpos[:], data.qvel[:] = coordinates(model.bodies, found.q[k], found.v[k])
        rates.append(data.qvel.copy())
        mujoco.mj_fwdPosition(compiled, data)
        given = np.zeros(compiled.nv)
        for body, at in zip(model.bodies, ours, strict=True):
            R, p = data.xmat[at].reshape(3, 3), data.xpos[at]
            for turn, place, wrench in zip(
                body.station_rotation, body.station_position, water[k, body.stations], strict=True
            ):
                moment, force = R @ turn @ wrench[:3], R @ turn @ wrench[3:]
                mujoco.mj_applyFT(compiled, data, force, moment, p + R @ place, at, given)

        given += of_added(data.qpos, data.qvel, accelerations(model.bodies, found.q[k], found.v[k], found.a[k]))
        for body in model.bodies:
            for joint in body.joints:
                if joint.name in model.armature:  # which has the inertia of the water already
                    place = compiled.joint(joint.name).dofadr[0]
                    given[place] += model.armature[joint.name] * (joint.share @ found.a[k, joint.v])

        def met() -> np.ndarray:
            mujoco.mj_fwdVelocity(compiled, data)
            return data.qfrc_fluid.copy()

        compiled.geom_fluid[:, _FIRST : _FIRST + _COEFFICIENTS] = 0.0
        alone = met()
        each = [_of_one(compiled, g, c, met) - alone for g in geoms for c in range(_COEFFICIENTS)]
        rows.append(np.reshape(each, (-1, compiled.nv)).T)
        sums.append(given - alone)
    A, b = np.stack(rows), np.stack(sums)
    scale = np.sqrt((b**2).mean(axis=0))
    scale = np.maximum(scale, _LEAST * scale.max(initial=0.0) + np.finfo(float).tiny)
    scaled, b = A / scale[:, None], b / scale
    A = scaled.reshape(b.size, -1)
    size = np.linalg.norm(A, axis=0)
    known = size > 1e-9 * size.max(initial=0.0)
    c = np.zeros(A.shape[1])
    if known.any():
        n = int(known.sum())
        damped = np.concatenate([A[:, known] / size[known], _DAMPING * np.eye(n)])
        c[known] = nnls(damped, np.concatenate([b.ravel(), np.zeros(n)]), maxiter=_ROUNDS * n)[0] / size[known]
    miss = scaled @ c - b
    # what prescribed joints need does not move the body, but holds the fit: without it the tuna swims backwards
    moving = _velocities(compiled, [x for body in model.bodies for x in body.joints if x.drive != "motion"])
    carrying = _velocities(compiled, model.carrying, 3)
    way = scale[carrying] * np.mean(rates[len(rates) // 2 :], axis=0)[carrying]
    coefficients = {
        name: tuple(map(float, own)) for name, own in zip(model.geoms, c.reshape(-1, _COEFFICIENTS), strict=True)
    }
    return coefficients, _share(miss[:, moving], b[:, moving]), _share(miss[:, carrying] @ way, b[:, carrying] @ way)


def _velocities(compiled: Any, joints: Sequence[BodyJoint], most: int = 6) -> list[int]:
    """Numbers of the velocities of joints in MuJoCo, of each joint the first ones: of a free one the linear ones."""
    firsts = [(compiled.joint(joint.name).dofadr[0], {"free": 6, "ball": 3}.get(joint.kind, 1)) for joint in joints]
    return [first + k for first, n in firsts for k in range(min(n, most))]


def _share(missed: np.ndarray, whole: np.ndarray) -> float:
    """Ratio of the root mean squares; NaN where the whole is 0."""
    size = np.linalg.norm(whole)
    return float(np.linalg.norm(missed) / size) if size else np.nan


def _force_of_added(mujoco: Any, model: MuJoCoModel) -> Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]:
    """Generalised force that bodies of added mass need, of `qpos`, `qvel` and `qacc`: M a + c of them alone."""
    alone = mujoco.MjModel.from_xml_string(model.text)
    others = np.setdiff1d(np.arange(alone.nbody), [alone.body(name).id for name in model.added])
    for numbers in (alone.body_mass, alone.body_inertia):
        numbers[others] = 0.0
    alone.dof_armature[:] = alone.opt.gravity[:] = 0.0
    data = mujoco.MjData(alone)

    def force(qpos: np.ndarray, qvel: np.ndarray, qacc: np.ndarray) -> np.ndarray:
        data.qpos[:], data.qvel[:], data.qacc[:] = qpos, qvel, qacc
        for step in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_comVel):
            step(alone, data)
        out = np.zeros(alone.nv)
        mujoco.mj_rne(alone, data, 1, out)
        return out

    return force


def _of_one(compiled: Any, geom: int, coefficient: int, met: Callable[[], np.ndarray]) -> np.ndarray:
    """Generalised force with one coefficient 1, the others 0."""
    compiled.geom_fluid[geom, _FIRST + coefficient] = 1.0
    out = met()
    compiled.geom_fluid[geom, _FIRST + coefficient] = 0.0
    return out


def _control(model: MuJoCoModel, q: np.ndarray, drive: np.ndarray) -> list[float]:
    """What the actuators are given: the coordinate of a motion, else the force that drives the joint."""
    return [
        float(joint.share @ q[joint.q]) if joint.drive == "motion" else float(drive[joint.v[0]])
        for joint in actuated(model.bodies)
    ]


@contextmanager
def _quiet(mujoco: Any) -> Iterator[None]:
    """Keep MuJoCo from writing its warnings to a file of the working folder."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _replayed(
    mujoco: Any, compiled: Any, model: MuJoCoModel, found: _Water, time: np.ndarray, control: np.ndarray
) -> Float[np.ndarray, "n 3"]:
    """Places of the first station at all times, as MuJoCo moves from the first of our states under our controls."""
    data, first = mujoco.MjData(compiled), model.bodies[0]
    data.qpos[:], data.qvel[:] = coordinates(model.bodies, found.q[0], found.v[0])
    at, places = compiled.body(first.name).id, []
    mujoco.mj_kinematics(compiled, data)
    for k, t in enumerate(time):
        while data.time < t - 0.5 * STEP:
            now = data.time
            data.ctrl[:] = [np.interp(now, time, own) for own in control.T] if control.size else 0.0
            mujoco.mj_step(compiled, data)
            if data.time <= now:  # MuJoCo begins anew where numbers overflow
                return np.full((len(time), 3), np.nan)
        if k:
            mujoco.mj_kinematics(compiled, data)
        places.append(data.xpos[at] + data.xmat[at].reshape(3, 3) @ first.station_position[0])
    return np.array(places)
