"""Gaits of a walking robot: their features, and many walks side by side, for rows of numbers in its description."""

from collections.abc import Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import nullcontext
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Mechanical, State
from nectosome.core.programs.remember import remembered, runs_long
from nectosome.core.side_by_side import side_by_side
from nectosome.description import RobotDescription, resolve
from nectosome.loads import Leg
from nectosome.mechanism import Robot, from_rest, in_plane, moves_in_plane
from nectosome.model.build import Template, build, instantiate, template_of
from nectosome.search.executors.spread import spread
from nectosome.solve import fixed_step
from nectosome.units import InputError

FEATURES = ("amplitude", "frequency", "speed", "height")
UNITS = ("m", "Hz", "m/s", "m")
_FALL = 100.0  # least discrepancy of a robot that falls
_SOONER = 5.0  # for each second that it falls sooner
_FEW, _MANY = 8, 25  # walks in a batch on a processor: small generations fill few, large ones go quicker with many
_THREADS = 2
_UPRIGHT = 0.5  # cosine of the angle by which a fallen robot tilts
_LONGEST = 3600.0  # s
_THIN = 10  # steps from one kept sample to the next


class Gait(NamedTuple):
    """Features of the motion of a body that walks."""

    amplitude: Float[Array, "*batch"]  # of the height, from its lowest to its highest value [m]
    frequency: Float[Array, "*batch"]  # of the height [Hz], 0 where it does not come back to its mean
    speed: Float[Array, "*batch"]  # mean speed along x [m/s]
    height: Float[Array, "*batch"]  # mean height [m]


def gait_of(x: Float[Array, "n"], z: Float[Array, "n"], step: Float[Array, ""]) -> Gait:
    """Features of positions x and z [m], sampled every `step` [s]; the frequency by upward crossings of z's mean."""
    mean = jnp.mean(z)
    below, above = z[:-1] - mean, z[1:] - mean
    up = (below < 0) & (above >= 0)
    when = jnp.arange(z.shape[0] - 1) - below / jnp.where(up, above - below, 1.0)
    first, last = jnp.min(jnp.where(up, when, jnp.inf)), jnp.max(jnp.where(up, when, -jnp.inf))
    turns = jnp.sum(up) - 1
    frequency = jnp.where(turns > 0, turns / (jnp.where(turns > 0, last - first, 1.0) * step), 0.0)
    return Gait(jnp.max(z) - jnp.min(z), frequency, (x[-1] - x[0]) / ((x.shape[0] - 1) * step), mean)


def discrepancy(
    found: Float[np.ndarray, "*batch 4"],
    target: Float[np.ndarray, "4"],
    fell: Float[np.ndarray, "*batch"],
    seconds: float,
) -> Float[np.ndarray, "*batch"]:
    r"""Sum of the squares of $(f^* - f)/f^*$ over the features, and for a robot that fell at t a penalty.

    $100 + 5 (t_e - t)$, rounded up, of the `seconds` $t_e$ that it was to walk; `fell` is inf where it did not
    (Giorgio-Serchi et al. 2017, section 4.3, eq. 13).
    """
    off = np.sum(((target - found) / target) ** 2, axis=-1)
    stands = np.isinf(fell)
    return np.where(stands, off, np.ceil(_FALL + _SOONER * (seconds - np.where(stands, seconds, fell))))


class Walked(NamedTuple):
    """Results of walks; the window is the last part of each."""

    gait: Float[np.ndarray, "m 4"]  # features in the window, as `Gait` has them
    fell: Float[np.ndarray, "m"]  # when [s]; inf where it did not
    duty: Float[np.ndarray, "m legs"]  # share of the window that each foot is on the ground
    series: Float[np.ndarray, "m n 3"]  # place along x [m] since the window began, height [m], tilt [rad]


class _Steps(eqx.Module):
    """How long to walk, and which numbers change from walk to walk."""

    windows: int = eqx.field(static=True)
    window: int = eqx.field(static=True)  # steps of each
    flat: bool = eqx.field(static=True)
    places: tuple[tuple[int, ...], ...] = eqx.field(static=True)  # of each column among the numbers
    step: Float[Array, ""]


class Walks:
    """Walks of a robot whose numbers at `paths` (or aliases) are given row by row.

    - seconds: of each walk, a whole number of windows [s]; the gait is that of the last one.
    - step [s]: of the classical Runge-Kutta method.
    - executor: where batches of walks are computed; in threads of this process unless given. Their widths, and so the
      numbers, do not depend on it.

    It has fallen when its body tilts by more than 60 degrees or is under the floor. Raises InputError for a robot
    without legs or floor, for unknown names and those that stand for the same number, and where windows do not fit. A
    call raises LostError where the executor ends before.
    """

    def __init__(
        self,
        description: RobotDescription,
        paths: Sequence[str],
        *,
        seconds: float = 25.0,
        window: float = 5.0,
        step: float = 1e-3,
        executor: Executor | None = None,
    ):
        walks = any(load.kind == "leg" for limb in description.parts.values() for load in limb.loads.values())
        if description.water.floor is None or not walks:
            words = f"{description.name} has no legs that step on a floor, so it has no gait."
            raise InputError(words, field="robot")
        if not 0 < seconds <= _LONGEST:
            words = f'"{seconds:g} s" is out of range: it must be more than 0 s and at most {_LONGEST:g} s.'
            raise InputError(words, field="seconds")
        windows = round(seconds / window) if window > 0 else 0
        if windows < 1 or abs(windows * window - seconds) > 1e-9 * seconds:
            raise InputError(f"is {window:g} s; the {seconds:g} s of a walk must be so many of them.", field="window")
        if abs(round(window / step) * step - window) > 1e-9 * window:
            raise InputError(f"is {window:g} s; it must be a whole number of steps of {step:g} s.", field="window")
        groups = [resolve(description, path) for path in paths]
        taken: dict[str, str] = {}
        for name, group in zip(paths, groups, strict=True):
            for path in group:
                if path in taken:
                    raise InputError(f"is given twice: {taken[path]} stands for it too.", field=name)
                taken[path] = name
        self.seconds, self.window, self.step = seconds, window, step
        self._executor = executor
        template, self._numbers = template_of(description, tuple(path for group in groups for path in group))
        self._template = template
        places = tuple(tuple(template.paths.index(path) for path in group) for group in groups)
        flat = moves_in_plane(build(description))
        self._how = _Steps(windows, round(window / step), flat, places, jnp.asarray(step))

    def __call__(self, rows: Float[np.ndarray, "m k"]) -> Walked:
        """Walk with each row of numbers."""
        m = len(rows)
        width = side_by_side(_MANY if m >= _THREADS * _MANY else _FEW, m)
        padded = np.concatenate([rows, np.repeat(rows[-1:], -m % width, axis=0)])
        batches = np.split(padded, len(padded) // width)
        calls = ((k, _solved, (self._template, self._how, self._numbers, batch)) for k, batch in enumerate(batches))
        with nullcontext(self._executor) if self._executor else ThreadPoolExecutor(_THREADS) as through:
            found = dict(spread(through, calls, lambda: True))
        parts = (found[k] for k in range(len(batches)))
        return Walked(*(np.concatenate(each)[:m] for each in zip(*parts, strict=True)))


def _solved(template: Template, how: _Steps, numbers: Array, rows: Float[np.ndarray, "w k"]) -> tuple[np.ndarray, ...]:
    """A batch, in a worker."""
    return tuple(np.asarray(x) for x in remembered(_batch, template, how, numbers, jnp.asarray(rows)))


@runs_long
def _batch(
    template: Template, how: _Steps, numbers: Float[Array, "n"], rows: Float[Array, "w k"]
) -> tuple[Array, Array, Array, Array]:
    """Fields of `Walked`, one walk for each row; numbers that do not change are shared by all."""
    return jax.vmap(lambda row: _walked(template, how, numbers, row))(rows)


def _walked(template: Template, how: _Steps, numbers: Array, row: Array) -> tuple[Array, Array, Array, Array]:
    own = [numbers[i] for i in range(len(template.paths))]
    for k, places in enumerate(how.places):
        for i in places:
            own[i] = row[k]
    robot = instantiate(template, own)
    system: Mechanical = in_plane(robot) if how.flat else robot
    length = how.window * how.step
    times = jnp.arange(how.window + 1) * how.step

    def one(carry: tuple[State, Array, _Seen], k: Array) -> tuple[tuple[State, Array, _Seen], None]:
        x, fell, last = carry
        t = k * length
        begun = jax.tree.map(lambda a: a[-1:], last)
        x, kept = fixed_step(system, t, x, how.step, how.window, keep=lambda x: _seen(robot, x))
        seen = jax.tree.map(lambda a, b: jnp.concatenate([a, b]), begun, kept)
        sooner = t + jnp.min(jnp.where(seen.fallen, times, jnp.inf))
        return (x, jnp.minimum(fell, sooner), seen), None

    start = from_rest(robot, jnp.zeros(()), robot.initial()).state
    begun = jax.tree.map(lambda a: jnp.broadcast_to(a, (how.window + 1, *a.shape)), _seen(robot, start))
    carry = start, jnp.asarray(jnp.inf), begun
    (_, fell, seen), _ = jax.lax.scan(one, carry, jnp.arange(how.windows, dtype=float))
    gait = gait_of(seen.place[:, 0], seen.place[:, 1], how.step)
    series = jnp.stack([seen.place[:, 0] - seen.place[0, 0], seen.place[:, 1], seen.tilt], axis=-1)[::_THIN]
    return jnp.stack(gait), fell, jnp.mean(seen.on_ground, axis=0), series


class _Seen(NamedTuple):
    """Record of each step."""

    place: Array  # of the body along x and z [m]
    tilt: Array  # [rad]
    on_ground: Array  # 1 for each foot that is
    fallen: Array  # whether it tilts too far, lies under the floor, or is at NaN


def _seen(robot: Robot, x: State) -> _Seen:
    q, v, _ = robot.tree.complete(jnp.zeros(()), x.q, x.v)
    shape = robot.tree.shape(q)
    floor, feet = robot.water.floor, []
    assert floor is not None
    loads = robot.loads
    for i, z in robot.states_by_load(q, v, x.z).items():
        attached = loads[i]
        if isinstance(attached.load, Leg):
            (ahead, above), _, _ = attached.load.foot(attached.load.turning(z)[0])
            hip, station = attached.load.hip, robot.tree.layout[attached.part].stations.start
            up, foot = shape.rotation[station, 2], (hip[0] + ahead, hip[1], hip[2] + above)
            height = shape.position[station, 2] + sum(up[i] * foot[i] for i in range(3))
            feet.append(height < floor)
    R, p = shape.rotation[0], shape.position[0]
    fallen = ~((R[2, 2] > _UPRIGHT) & (p[2] > floor))
    return _Seen(jnp.stack([p[0], p[2]]), jnp.arctan2(R[2, 0], R[2, 2]), jnp.stack(feet).astype(float), fallen)
