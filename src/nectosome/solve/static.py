"""Static equilibrium of a robot: its shape under steady loads that grow from zero to full, with frozen drives."""

from collections.abc import Iterable
from dataclasses import replace
from typing import ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int

from nectosome.core import Constant, Solution, State, Status
from nectosome.core.linear_algebra import generalised_inverse
from nectosome.core.programs.remember import remembered
from nectosome.core.tracers import traced, without_derivatives
from nectosome.io.summary import Summary
from nectosome.loads import JointFriction
from nectosome.mechanism import Robot, Tree
from nectosome.model import RobotLike, robot_of
from nectosome.units import InputError, show_quantity

from .branches import RUNS_ON, Branch, fallen, hangs, loose_directions, settle, stiffnesses, with_states_at_rest
from .equilibrium import changed, no_change, solvable, unbalanced
from .floating import SINKS, Floating, floating, held_adrift, is_adrift, is_neutral, placed
from .results import Run, at_one_time
from .small_motions import Stability, is_stable, small_motion
from .summaries.float_tables import Righting, righting
from .summaries.rest_summary import rest_summary
from .symmetry import near

_MOST_ITERATIONS = 25
_FIRST_STEP, _SMALLEST_STEP = 0.1, 1e-4  # share of the loads
_BALANCED = 1e-10  # largest residual relative to the largest force in it
_CONSISTENT = 0.5  # largest share of a residual that a correction leaves: else no correction takes it away
_STILL = 1e-12  # [rad, m] correction that counts as converged, also if all forces vanish


class Static(Run):
    """Static equilibrium: a Run of one instant. `stats["load"]` is the share of the loads it was followed to."""

    loose: tuple[str, ...] = eqx.field(static=True, kw_only=True)  # coordinates without stiffness, but for one afloat
    lies: Floating | None = eqx.field(default=None, kw_only=True)  # in the water, of a robot that nothing else holds
    stability: Stability | None = eqx.field(static=True, default=None, kw_only=True)  # None if unsolved, or traced
    left: Stability | None = eqx.field(static=True, default=None, kw_only=True)  # of the shape that it fell from
    title: ClassVar[str] = "at rest"

    @property
    def reason(self) -> str:
        """Its status in words, with what small motions do."""
        status = Status(int(self.status))
        return status.reason if self.stability is None else self.stability.says(status)

    @property
    def notes(self) -> list[str]:
        """What is to be known of other shapes at rest."""
        held = self._held_by_friction
        band = [f"dry friction ({', '.join(held)}) is left out: it may hold the robot near this shape."] if held else []
        free = self.loose if Status(int(self.status)) != Status.NO_EQUILIBRIUM else ()
        stays = [f"nothing holds {', '.join(free)}: there it stays where it starts."] if free else []
        rubbing = ", ".join(self._rubbing)
        words = f"friction of {rubbing} is that of tendons drawn in last; over links, let out if the pull is below 0"
        rubs = f"{words}. Those let out from further in hold other shapes: see nectosome simulate."
        return self._other_shapes + band + stays + [rubs] * bool(rubbing)

    @property
    def _held_by_friction(self) -> list[str]:
        """Coordinates with dry friction, of joints and of motors."""
        robot: Robot = self.value.system
        on = [i for g in robot.load_groups.on_joints if isinstance(g.load, JointFriction) for i in g.parts]
        with_motors = (g for g in robot.powered.groups if getattr(g.drive, "motor", None) is not None)
        on += [i for g in with_motors if g.drive.motor.friction is not None for i in g.parts]
        return [robot.tree.coordinate_names[robot.tree.layout[i].v.start] for i in sorted({*on})]

    @property
    def _rubbing(self) -> list[str]:
        """Tendons with friction, in rods and over links."""
        groups = self.value.system.load_groups
        inside = [g for g in groups.in_rods if getattr(g.load, "friction", None) is not None]
        over = [g for g in groups.tendons if g.cord.friction is not None]
        return [name for g in (*inside, *over) for name in g.names]

    @property
    def _other_shapes(self) -> list[str]:
        if self.left is not None:
            words = f"the shape under growing loads is unstable ({self.left}), and the robot falls to one side of it"
            return [f"{words}. Branch first shows that shape, plus and minus show both sides."]
        if self.stability is not None and self.stability.kind == "diverges" and self.lies is None:
            return ["Branch plus and minus show the shapes into which it falls, to either side."]
        return []

    @property
    def why(self) -> str:
        """Why there is no shape at rest, and what to do."""
        if self.lies is not None and not (bool(self.lies.afloat) or is_neutral(self.lies)):
            excess = float(self.lies.net_weight)
            does, more, less = ("sinks", "weight", "buoyancy") if excess > 0 else ("rises", "buoyancy", "weight")
            why = f"it {does}: its {more} exceeds its {less} by {show_quantity(abs(excess), 'force')}"
            return f"{why}, and nothing holds it. Hold it by its joint, make it neutral, or see nectosome steady."
        if turning := self.turning:
            on = f"the crank of {' and of '.join(turning)} turns on: nothing comes to rest"
            return f"{on}. Set its speed to 0 rad/s, or see nectosome periodic."
        if not self.loose:
            share = float(self.stats["load"])
            if share == 0:
                return "no shape at rest found: from its start its loads move it on. See nectosome simulate."
            return f"no shape at rest found: followed up to {share:.0%} of the loads, where it gives way or snaps over."
        parts = list(dict.fromkeys(name.partition(".")[0] for name in self.loose))
        path = f"{'' if parts[0] == 'body' else 'limbs.'}{parts[0]}.joint"
        steady = "nectosome steady"
        if {word.rstrip(",") for text in self.loose for word in text.split()} & {*self._held_by_friction}:
            steady = "nectosome simulate: dry friction may hold it anywhere"
        return (
            f"nothing holds {', '.join(self.loose)}, so that there is no one place of rest. "
            f'Hold it, as with --set "{path}={{kind: fixed}}", or see {steady}.'
        )

    @property
    def turning(self) -> tuple[str, ...]:
        """Loads with a crank that turns at t = 0, by their paths."""
        tree, groups = self.value.system.tree, self.value.system.load_groups.on_bodies
        own = ((g, np.asarray(g.crank_speeds)) for g in groups if g.crank_speeds is not None)
        each = (
            (tree.names[part], name, speed)
            for g, x in own
            for part, name, speed in zip(g.parts, g.names, x, strict=True)
        )
        return tuple(f"{part}.{name}" for part, name, speed in each if speed)

    def righting(self) -> Righting | None:
        """Righting curves of a robot that floats or hangs free; None of one that is held."""
        return None if self.lies is None else righting(self.value.system, self.lies)

    def summary(self, each: bool = False) -> Summary:
        """How it lies, where its parts are, reactions and sums of forces, as the command line prints them."""
        results, curve = self.results(), self.righting()
        floats = None if self.lies is None or curve is None else (self.lies, curve)
        page = rest_summary(self.value.system, results.arrays, results.attributes, floats)
        return replace(page, notes=[*page.notes, *self.notes])


def static(robot: RobotLike, *, settings: Iterable[str] = (), branch: Branch | None = None) -> Static:
    """Static equilibrium of a robot under weight, buoyancy, a current and other steady loads, by `load_stepping`.

    The robot is given by name, path, description or built, with `settings` such as "E=3MPa". Prescribed joints are held
    where they are at t = 0; drives push as they do then, with loops of servos that are continuous. States of loads and
    drives, such as vortices and integrals, are at rest, too. A free robot floats at the surface, or hangs in the water
    if it is neutral, by `floating`; it stays above where it is, and heads there. Where the shape under loads that grow
    from 0 diverges, and where a rod's `start` is bent or a joint starts where its spring is not at ease, a robot that
    is held comes to the shape into which it falls from its start, if there is one; with `branch` it is the first, or
    that on either side of it, `plus` or `minus` (see `branches.Branch`). What loads alone hold, such as a link that
    hangs on a free hinge, has no shape under no loads: it comes to the one into which it falls from its start, by
    `settle`, and stays where it starts along what nothing holds and nothing pushes.
    Status SOLVED; UNSTABLE where small disturbances grow (the equilibrium is handed over all the same; `stability` says
    how); NO_EQUILIBRIUM where there is none: a crank of a load turns on, or no load, spring or rod holds the
    coordinates in `loose` against what pushes them. Derivatives with respect to the robot, forward and reverse, are
    those of the implicit function theorem; a traced robot has its status, the first shape, and no `loose` and
    `stability`.
    Raises InputError for what is no robot, where nothing is free to move, where the water changes with time, and for a
    branch that is not there.
    """
    robot = robot_of(robot, settings)
    if not robot.tree.free_v.size:
        raise InputError("nothing of this robot is free to move: there is no shape to be found.")
    robot = frozen_drives(robot)
    lies, settled = None, False
    if traced(robot) or is_adrift(robot):
        if branch not in (None, "first"):
            raise InputError("a robot that is traced, or that nothing holds, has the first alone.", field="branch")
        if traced(robot):
            return _traced(robot)
        lies = floating(robot)
    if lies is not None and (bool(lies.afloat) or is_neutral(lies)):
        robot = placed(robot, lies)
        found: Solution = remembered(load_stepping_adrift, robot, lies.afloat)
        lies = floating(replace(robot, start=found.value))  # with its joints as they are then
    else:
        found, settled = remembered(own_shape, robot), hangs(robot)
        if int(found.status) == Status.NO_EQUILIBRIUM and found.stats["load"] == 0 and not settled:
            there = remembered(settle, robot, robot.initial())
            settled = int(there.status) == Status.SOLVED
            found = there if settled else found
        lies = lies if int(found.status) == Status.NO_EQUILIBRIUM else None  # it sinks, but for a floor
    status, loose, stability, left = Status(int(found.status)), (), None, None
    if status == Status.SOLVED:
        found, stability, left = fallen(robot, found, branch if lies is None else "first")
        status = status if stability.stable else Status.UNSTABLE
    if status == Status.NO_EQUILIBRIUM or (lies is None and settled):
        loose = loose_directions(robot, small_motion(robot, found.value))
    at_rest = at_one_time(robot, found.value)
    rest = at_rest, status, found.stats, found.residual
    return Static(*rest, loose=loose, lies=lies, stability=stability, left=left)


def _traced(robot: Robot) -> Static:
    """The same of a robot whose numbers are traced."""
    lies, held = None, jnp.asarray(True)
    if is_adrift(robot):
        lies = floating(robot)
        held = lies.afloat | (jnp.abs(lies.net_weight) <= SINKS * lies.weight)
        robot = placed(robot, lies)
    found = remembered(at_rest, robot, None if lies is None else lies.afloat)
    lies = None if lies is None else floating(replace(robot, start=found.value))
    shaky = (found.status == int(Status.SOLVED)) & ~remembered(is_stable, *without_derivatives((robot, found.value)))
    status = jnp.where(shaky, int(Status.UNSTABLE), jnp.where(held, found.status, int(Status.NO_EQUILIBRIUM)))
    return Static(at_one_time(robot, found.value), status, found.stats, found.residual, loose=(), lies=lies)


def at_rest(robot: Robot, afloat: Bool[Array, ""] | None = None) -> Solution:
    r"""`load_stepping` of a robot with `frozen_drives`, with derivatives by its numbers; NaN without an equilibrium.

    One more step of Newton's method, $y - K^{-1} r$ with K held, has the derivatives of the implicit function theorem,
    and no others are carried through the search.
    """
    there = jax.lax.stop_gradient(eqx.filter(robot, eqx.is_array))
    known = eqx.combine(there, robot)
    found = own_shape(known) if afloat is None else load_stepping(known, jax.lax.stop_gradient(afloat))
    q, still = found.value.q, found.value.v
    if afloat is not None:  # where nothing holds it, it goes with its start
        q = q + robot.start.q - known.start.q
    x, n = State(q, still, found.value.z), still.size
    at = jax.lax.stop_gradient(x)
    J = jax.jacfwd(lambda y: unbalanced(known, changed(known, at, y)))(no_change(x))
    K, _, free = solvable(J, jnp.zeros(len(J)), n)
    if afloat is not None:
        K = K.at[:n, :n].add(_held(known, at.q, afloat, K[:n, :n]))
    elif hangs(known):  # what nothing holds goes with its start
        _, V, loose = stiffnesses(with_states_at_rest(K, n)[0])
        stays = V.T @ jnp.where(loose[:, None], V, 0.0)
        K = K.at[:n, :n].add(jnp.maximum(jnp.max(jnp.abs(K)), 1e-30) * stays)
        by = jnp.linalg.pinv(jax.jacfwd(lambda v: robot.advance(known.start.q, v, jnp.ones(())))(still))
        q = robot.advance(q, stays @ by @ (robot.start.q - known.start.q), jnp.ones(()))
        x = replace(x, q=q)
    y = -jnp.linalg.solve(K, jnp.where(free, 0.0, unbalanced(robot, x)))
    x = near(robot, x, jnp.concatenate([y[:n], jnp.zeros(n), y[n:]]))
    return replace(found, value=replace(x, q=jnp.where(found.status == int(Status.SOLVED), x.q, jnp.nan)))


def _held(robot: Robot, q: Array, afloat: Array, K: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """Stiffness of a robot adrift along what has none."""
    loose = held_adrift(robot, q, afloat)
    return jnp.max(jnp.abs(K)) * loose @ loose.T


def frozen_drives(robot: Robot) -> Robot:
    """Robot whose prescribed joints, and signals of servos and motors, stay as at t = 0; loops are continuous.

    Its description stays that of the moving one. Raises InputError where the water changes with time.
    """
    if not robot.water.steady:
        why = "waves and currents that change over time leave nothing at rest."
        raise InputError(f"{why} Leave them out, or see nectosome simulate.", field="water.flows")
    parts = tuple(
        part
        if part.prescribed is None
        else eqx.tree_at(lambda p: p.prescribed, part, Constant(part.prescribed(jnp.zeros(()))[0]))
        for part in robot.tree.parts
    )
    return replace(robot, tree=Tree.of(parts), powered=robot.powered.frozen()).described(robot.description)


def own_shape(robot: Robot) -> Solution:
    """Shape under loads that grow from 0; of a robot that `hangs`, that into which it falls from its start."""
    return settle(robot, robot.initial()) if hangs(robot) else load_stepping(robot)


class _Path(NamedTuple):
    """State of the load stepping."""

    x: tuple[Array, Array]  # coordinates and load states
    load: Array  # fraction of the loads in equilibrium there
    before: tuple[Array, Array]  # those of the step before, for the secant
    load_before: Array
    step: Array
    iterations: Array
    rest: Array  # residual relative to the largest force


@eqx.filter_jit
def load_stepping_adrift(robot: Robot, afloat: Bool[Array, ""]) -> Solution:
    """`load_stepping` of a robot that nothing holds but the water: it stays where it is along what has no stiffness."""
    return load_stepping(robot, afloat)


@eqx.filter_jit
def load_stepping(robot: Robot, afloat: Bool[Array, ""] | None = None) -> Solution:
    """Static state in which elastic and spring forces balance all loads; drives and prescribed joints as at t = 0.

    States of loads and drives are unknowns as coordinates are: their rates are 0. What has a crank that turns is never
    at rest.
    Newton's method at loads that grow from zero to one, with a secant predictor and steps that halve if it fails and
    grow if it succeeds. Forces between two parts count as elastic. The largest residual is at most 1e-10 of the largest
    force in it. Returns a Solution with the State (the last one in equilibrium) and status SOLVED or NO_EQUILIBRIUM;
    `stats` holds the fraction of the loads reached and the Newton iterations. Works under jit and vmap. With `afloat`
    the robot is adrift, at the surface or else under it.
    """
    x, t = robot.initial(), jnp.zeros(())
    zero, (z0, unravel) = jnp.zeros_like(x.v), ravel_pytree(x.z)
    z0, n, m = jnp.asarray(z0, float), zero.size, z0.size

    def balance(x: State, load: Array) -> tuple[Array, Array]:
        """Residual at a fraction of the loads with rates of load states, and the largest force in it."""
        acting = robot.forces(t, x, zero)
        inner = (acting.elastic - acting.joint - acting.paired)[robot.tree.free_v]
        outer = acting.residual[robot.tree.free_v] - inner
        largest = jnp.max(jnp.abs(outer)) if afloat is None else jnp.sum(robot.weight()) * robot.water.gravity
        r = jnp.concatenate([inner + load * outer, ravel_pytree(robot.state_rates(t, x))[0]])
        return r, jnp.maximum(jnp.max(jnp.abs(inner)), load * largest)

    def linearised(q: Array, z: Array, load: Array) -> tuple[Array, Array, Array]:
        """Residual, the largest one relative to the largest force in it, and its derivatives; infinite without rest."""
        here = State(q, zero, unravel(z))

        def at(y: Array) -> tuple[Array, tuple[Array, Array]]:
            r, scale = balance(changed(robot, here, y), load)
            return r, (r, jnp.max(jnp.abs(r[:n])) / jnp.maximum(scale, 1e-30))

        J, (rates, rest) = jax.jacfwd(at, has_aux=True)(no_change(here))
        K, r, free = solvable(J, rates, n)
        rest = jnp.where(jnp.any(free & (jnp.abs(rates) > RUNS_ON)), jnp.inf, rest)
        if afloat is not None:
            K = K.at[:n, :n].add(_held(robot, q, afloat, K[:n, :n]))
        return r, rest, K

    def newton(q: Array, z: Array, load: Array) -> tuple[tuple[Array, Array], Array, Int[Array, ""], Array]:
        """Solution at a load, whether it converged, iterations, and relative residual there."""

        def converged(rest: Array, size: Array, moved: Array) -> Array:
            return ((rest <= _BALANCED) | ((size <= _STILL) & jnp.isfinite(rest))) & (moved <= _BALANCED)

        def going(it):
            _, (_, rest, _), size, moved, k = it
            return ~converged(rest, size, moved) & (k < _MOST_ITERATIONS)

        def correct(it):
            """Forces are traced here and nowhere else: the first correction is none."""
            (q, z), (r, _, K), _, _, k = it
            # with load states units differ, and what nothing holds stays where it is
            dy = -(generalised_inverse(K) @ r if m else jnp.linalg.solve(K, r))
            # equations that contradict each other, of what neither load nor spring holds, have no solution
            size = jnp.maximum(jnp.max(jnp.abs(K), axis=1), 1e-300)
            left, before = (jnp.max(jnp.abs(x) / size) for x in (r + K @ dy, r))
            solved = (left <= _CONSISTENT * before) | (m == 0)
            # at most 0.5 rad (or strain, or m) per correction
            dy = dy * jnp.minimum(1.0, 0.5 / jnp.max(jnp.abs(dy[:n])))
            q, z = robot.advance(q, dy[:n], jnp.ones(())), z + dy[n:]
            moved = jnp.max(jnp.abs(dy[n:]), initial=0.0) / (1 + jnp.max(jnp.abs(z), initial=0.0))
            moved = jnp.where(solved, moved, jnp.inf)
            return (q, z), linearised(q, z, load), jnp.where(k < 0, jnp.inf, jnp.max(jnp.abs(dy[:n]))), moved, k + 1

        first = jnp.zeros(n + m), jnp.asarray(jnp.inf), jnp.eye(n + m)
        start = (q, z), first, jnp.asarray(jnp.inf), jnp.zeros(()), jnp.full((), -1)
        x, (_, rest, _), size, moved, k = jax.lax.while_loop(going, correct, start)
        return x, converged(rest, size, moved), k, rest

    def going(path: _Path) -> Array:
        return (path.load < 1.0) & (path.step > _SMALLEST_STEP)

    def follow(path: _Path) -> _Path:
        load = jnp.minimum(path.load + path.step, 1.0)
        span = path.load - path.load_before
        ahead = jnp.where(span > 0, (load - path.load) / jnp.where(span > 0, span, 1.0), 0.0)
        q, z = (a + ahead * (a - b) for a, b in zip(path.x, path.before, strict=True))
        x, converged, k, rest = newton(q, z, load)
        step = path.step * jnp.where(converged, jnp.where(k < 6, 2.0, 1.0), 0.5)
        reached = _Path(x, load, path.x, path.load, step, path.iterations + k, rest)
        return jax.tree.map(lambda a, b: jnp.where(converged, a, b), reached, path._replace(step=step))

    no, begin = jnp.zeros(()), (x.q, z0)
    start = _Path(begin, no, begin, no, jnp.asarray(_FIRST_STEP), jnp.zeros((), int), jnp.asarray(jnp.nan))
    path = jax.lax.while_loop(going, follow, start)
    q, z = path.x
    solved = (path.load >= 1.0) & jnp.all(jnp.concatenate([jnp.zeros(1), *robot.load_groups.crank_speeds]) == 0)
    return Solution(
        value=State(q, zero, unravel(z)),
        status=jnp.where(solved, int(Status.SOLVED), int(Status.NO_EQUILIBRIUM)),
        stats={"load": path.load, "iterations": path.iterations},
        residual=path.rest,
    )
