"""Critical loads: where an equilibrium loses its stability as a quantity grows."""

from collections.abc import Iterable
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from nectosome.core import State, Status
from nectosome.core.programs.remember import remembered
from nectosome.description import RobotDescription, numeric_paths, resolve, without_ramps
from nectosome.description.variables import Box, read_variable
from nectosome.mechanism import continuous_loops
from nectosome.model import RobotLike, Template, description_of, instantiate, robot_of, template_of
from nectosome.units import InputError, check_whole, format_quantity, show_quantity

from .equilibrium import equilibrium
from .modes import NaturalModes, modes_of
from .small_motions import SmallMotion, linearised
from .static import frozen_drives, load_stepping
from .symmetry import Symmetry, find_symmetry

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

    Of `samples` values, from the stable end on, the first unstable one is taken, and the place between it and the one
    before is found to `rtol` of it by bisection on the sign of the leading eigenvalue's real part: of several losses of
    stability between two samples one may be missed. Buckling of a conservative system is a divergence (a real
    eigenvalue passes 0, or the equilibrium ends there); follower forces and flow may give flutter (a pair of complex
    ones). Raises InputError for what is no robot, an unknown quantity, a range that is none, one without a stable
    equilibrium at an end, and one that is stable throughout.
    """
    description = without_ramps(description_of(robot, settings))
    values = _values(path, between, description, samples)
    paths = tuple(resolve(description, path))
    quantity = numeric_paths(description)[paths[0]]
    template, numbers = template_of(description, paths)
    places = np.array([template.paths.index(one) for one in paths])
    built = robot_of(description)
    symmetry = find_symmetry(frozen_drives(built) if about == "static" else built)
    if about == "steady" and not symmetry.steady:
        raise InputError(f"{Status.UNSTEADY_DRIVES.reason}.", field="about")
    guess, warm = built.initial(), jnp.asarray(False)

    def at(value: float) -> NaturalModes | None:
        """Small motions at a value; None where there is no equilibrium."""
        nonlocal guess, warm
        now = numbers.at[places].set(value)
        start = () if about == "static" else (guess, warm)
        motion, state, found = remembered(_linearised_at, template, symmetry, now, *start)
        guess, warm = (state, jnp.asarray(True)) if found else (guess, warm)
        motion = jax.tree.map(np.asarray, motion)
        return modes_of(motion, symmetry, built.coordinate_names, description) if found else None

    def stable(found: NaturalModes | None) -> bool:
        return found is not None and found.stable

    before = at(values[0])
    if not stable(before):
        values = values[::-1]
        before = at(values[0])
    ends = " and at ".join(show_quantity(x, quantity.dimension) for x in sorted(values[[0, -1]]))
    if not stable(before):
        raise InputError(f"there is no stable equilibrium at {ends}. Choose a range with one at an end.", field=path)
    low = high = values[0]
    for high in values[1:]:
        beyond = at(high)
        if not stable(beyond):
            break
        low, before = high, beyond
    else:
        raise InputError(f"the equilibrium is stable at {ends}, and between. Choose a wider range.", field=path)
    while abs(high - low) > rtol * max(abs(high), abs(low)):
        middle = 0.5 * (low + high)
        found = at(middle)
        if stable(found):
            low, before = middle, found
        else:
            high, beyond = middle, found
    # the mode that grows beyond the critical value; where there is no equilibrium, the one that is slowest before
    leads = beyond or before
    assert leads is not None
    k = int(np.argmax(np.real(leads.eigenvalue)) if beyond is not None else np.argmin(np.abs(leads.eigenvalue)))
    eigenvalue = leads.eigenvalue[k]
    flutters = beyond is not None and abs(np.imag(eigenvalue)) > abs(np.real(eigenvalue))
    kind: Literal["divergence", "flutter"] = "flutter" if flutters else "divergence"
    frequency = abs(np.imag(eigenvalue)) / (2 * np.pi) if flutters else 0.0
    return CriticalValue(path, 0.5 * (low + high), quantity.unit, kind, frequency, leads.shape[k], leads.coordinates)


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


def _linearised_at(
    template: Template, symmetry: Symmetry, numbers: Float[Array, "n"], *start: Any
) -> tuple[SmallMotion, State, Bool[Array, ""]]:
    """Small motions about an equilibrium, its state, and whether there is one.

    Of steady motion from a `start`, a guess and whether it is warm; of static equilibrium without one.
    """
    robot = continuous_loops(instantiate(template, numbers))
    if start:
        found = equilibrium(robot, symmetry, *start)
        state = found.value.state
    else:
        robot = frozen_drives(robot)
        found = load_stepping(robot)
        state = found.value
    return linearised(robot, state), state, found.status == int(Status.SOLVED)
