"""Critical loads: where an equilibrium loses its stability as a quantity grows."""

from collections.abc import Callable, Iterable
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from nectosome.core import State, Status
from nectosome.core.programs.remember import remembered
from nectosome.description import RobotDescription, numeric_paths, resolve, with_values, without_ramps
from nectosome.description.variables import Box, read_variable
from nectosome.mechanism import continuous_loops
from nectosome.model import RobotLike, Template, description_of, instantiate, robot_of, template_of
from nectosome.units import InputError, check_whole, format_quantity, show_quantity

from .branches import settle
from .equilibrium import equilibrium
from .modes import NaturalModes, modes, modes_of
from .small_motions import SmallMotion, linearised
from .static import frozen_drives, static
from .symmetry import Symmetry, find_symmetry

_FAR = 0.2  # [largest coordinate + 1] change of a shape from one value to the next that is no jump
_BEYOND, _FASTER = 0.01, 10.0  # at a limit point growth begins with the root of the distance: of the range, times
Range = str | tuple[float | str, float | str]


class CriticalValue(NamedTuple):
    """Where an equilibrium becomes unstable."""

    path: str
    value: float  # [SI]
    unit: str
    kind: Literal["divergence", "flutter"]  # it buckles or falls away; or it oscillates with a growing amplitude
    frequency: float  # of that oscillation [Hz]; 0 of a divergence
    shape: Complex[np.ndarray, "n"]  # of the motion that grows, by coordinate; the largest is 1
    coordinates: tuple[str, ...]


def critical(
    robot: RobotLike,
    path: str,
    between: Range,
    *,
    settings: Iterable[str] = (),
    about: Literal["static", "steady"] = "static",
    samples: int = 25,
    rtol: float = 1e-6,
) -> CriticalValue:
    """The value of a quantity at which an equilibrium loses its stability, and whether by divergence or by flutter.

    - robot: a name, the path of a robot file, a description or a built robot, with `settings` such as "E=3MPa".
    - path: the quantity, by its path or alias; one alias may be several quantities that grow together.
    - between: a range with a stable equilibrium at one of its ends, `"1..5N"` or `"1N..1kN log"`, or its two
      ends as numbers in SI units or text.
    - about: the static equilibrium, with prescribed joints held, or steady motion; loops of servos are continuous.

    Of `samples` values, from a stable end on, the first unstable one is taken, and the place between it and the one
    before is found to `rtol` of it by bisection on the sign of the leading eigenvalue's real part: of several losses of
    stability between two samples one may be missed. Buckling of a conservative system is a divergence (a real
    eigenvalue passes 0, or the equilibrium ends there, and it snaps over); follower forces and flow may give flutter (a
    pair of complex ones). A shape at rest is that of `static` at the stable end, and followed from there. One that
    leans or starts bent may bend away without a loss of stability: then the value is the limit point from which there
    is an unstable shape beside it, near the critical value of the straight one. Raises InputError for what is no robot,
    an unknown quantity, a range that is none, one without a stable equilibrium at an end, and one that is stable
    throughout.
    """
    description = without_ramps(description_of(robot, settings))
    values = _values(path, between, description, samples)
    paths = tuple(resolve(description, path))
    quantity = numeric_paths(description)[paths[0]]
    template, numbers = template_of(description, paths)
    places = np.array([template.paths.index(one) for one in paths])
    built = robot_of(description)
    rests = about == "static"
    symmetry = find_symmetry(frozen_drives(built) if rests else built)
    if not rests and not symmetry.steady:
        raise InputError(f"{Status.UNSTEADY_DRIVES.reason}.", field="about")

    def followed(value: float, last: _Shape | None) -> _Shape:
        """Equilibrium at a value, from the last one; one at rest lies near it."""
        start = last.state if last and last.state else built.initial()
        if last is None and rests:
            own = static(with_values(description, dict.fromkeys(paths, float(value))))
            if int(own.status) != Status.SOLVED:
                return _Shape(None, None)
            start = own.state
        warm = jnp.asarray(rests or last is not None)
        now = numbers.at[places].set(value)
        motion, state, found = remembered(_linearised_at, template, None if rests else symmetry, now, start, warm)
        far = _FAR * (1 + np.max(np.abs(start.q), initial=0.0))
        if not found or (rests and np.max(np.abs(state.q - start.q), initial=0.0) > far):
            return _Shape(None, None)
        motion = jax.tree.map(np.asarray, motion)
        return _Shape(modes_of(motion, symmetry, built.coordinate_names, description), state)

    def first(value: float, _: _Shape | None) -> _Shape:
        """The shape under growing loads."""
        own = static(with_values(description, dict.fromkeys(paths, float(value))), branch="first")
        return _Shape(modes(own), None) if int(own.status) in (Status.SOLVED, Status.UNSTABLE) else _Shape(None, None)

    ends = " and at ".join(show_quantity(x, quantity.dimension) for x in sorted(values[[0, -1]]))
    begins = [(own, shape) for own in (values, values[::-1]) if (shape := followed(own[0], None)).stable]
    if not begins:
        raise InputError(f"there is no stable equilibrium at {ends}. Choose a range with one at an end.", field=path)
    each = (found for own, shape in begins if (found := _lost(followed, shape, own, rtol)))
    lost = next(each, None)
    if lost is None and rests:
        # a shape that bends away keeps its stability: from a limit point on there is an unstable one beside it
        own, shape = begins[0]
        beside = _lost(first, shape, own, rtol)
        further = first(beside.value + _BEYOND * (own[-1] - beside.value), None) if beside else _Shape(None, None)
        lost = beside if beside and further.growth > _FASTER * beside.beyond.growth > 0 else None
    if lost is None:
        raise InputError(f"the equilibrium is stable at {ends}, and between. Choose a wider range.", field=path)
    before, beyond = lost.before.modes, lost.beyond.modes
    # the mode that grows beyond the critical value; where there is no equilibrium, the one that is slowest before
    leads = beyond or before
    assert leads is not None
    k = int(np.argmax(np.real(leads.eigenvalue)) if beyond is not None else np.argmin(np.abs(leads.eigenvalue)))
    eigenvalue = leads.eigenvalue[k]
    flutters = beyond is not None and abs(np.imag(eigenvalue)) > abs(np.real(eigenvalue))
    kind: Literal["divergence", "flutter"] = "flutter" if flutters else "divergence"
    frequency = abs(np.imag(eigenvalue)) / (2 * np.pi) if flutters else 0.0
    return CriticalValue(path, lost.value, quantity.unit, kind, frequency, leads.shape[k], leads.coordinates)


def _values(path: str, between: Range, description: RobotDescription, samples: int) -> Float[np.ndarray, "samples"]:
    """Values of the range, evenly spread on its scale."""
    check_whole(samples, "samples", 2)
    if not isinstance(between, str):
        dimension = numeric_paths(description)[resolve(description, path)[0]].dimension
        try:
            low, high = (x if isinstance(x, str) else format_quantity(float(x), dimension) for x in between)
        except (TypeError, ValueError):
            raise InputError('give a range LOW..HIGH, as in "1..5N", or its two ends.', field="between") from None
        between = f"{low}..{high}"
    return Box((read_variable(path, between, description),)).values(np.linspace(0.0, 1.0, samples)[:, None])[:, 0]


class _Shape(NamedTuple):
    """An equilibrium: its small motions and state; None without one."""

    modes: NaturalModes | None
    state: State | None

    @property
    def stable(self) -> bool:
        return self.modes is not None and self.modes.stable

    @property
    def growth(self) -> float:
        return 0.0 if self.modes is None else self.modes.stability.growth


class _Loss(NamedTuple):
    """Where stability is lost, with the equilibria before and beyond."""

    value: float
    before: _Shape
    beyond: _Shape


def _lost(
    at: Callable[[float, _Shape | None], _Shape], begins: _Shape, values: Float[np.ndarray, "k"], rtol: float
) -> _Loss | None:
    """Where stability is lost, from a stable equilibrium at the first value on; None where it is not."""
    low, before = values[0], begins
    for target in values[1:]:
        high = target
        while low != target:
            found = at(high, before)
            if found.stable:
                low, before = high, found
                high = target  # a step that was too long from before may not be from here
            elif abs(high - low) <= rtol * max(abs(high), abs(low)):
                return _Loss(0.5 * (low + high), before, found)
            else:
                high = 0.5 * (low + high)
    return None


def _linearised_at(
    template: Template, symmetry: Symmetry | None, numbers: Float[Array, "n"], guess: State, warm: Bool[Array, ""]
) -> tuple[SmallMotion, State, Bool[Array, ""]]:
    """Small motions about the equilibrium from a guess, at rest without a symmetry; its state; whether there is one."""
    robot = continuous_loops(instantiate(template, numbers))
    if symmetry is None:
        robot = frozen_drives(robot)
        found = settle(robot, guess, falls=False)
        state = found.value
    else:
        found = equilibrium(robot, symmetry, guess, warm)
        state = found.value.state
    return linearised(robot, state), state, found.status == int(Status.SOLVED)
