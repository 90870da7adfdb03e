"""Floquet multipliers of a periodic orbit: what a disturbance of the state is multiplied by in each cycle."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from nectosome.core import Mechanical, Status
from nectosome.core.programs.remember import remembered

from .integrate import Settings
from .orbit import Orbit, orbit
from .symmetry import Symmetry

_DRAWS = 16  # of errors of the monodromy
_FINER = 1e-2  # factor of the tolerances where an error leaves it open whether an orbit is stable


class Multipliers(NamedTuple):
    """Floquet multipliers, the largest first, each with its error."""

    values: Complex[np.ndarray, "k"]
    errors: Float[np.ndarray, "k"]

    @property
    def grow(self) -> bool:
        """Whether some disturbance grows."""
        return bool(np.any(np.abs(self.values) - self.errors > 1))

    @property
    def undecided(self) -> bool:
        """Whether none does for sure, and some may within the errors."""
        return not self.grow and bool(np.any(np.abs(self.values) + self.errors > 1))


NO_MULTIPLIERS = Multipliers(np.zeros(0, complex), np.zeros(0))


def cycle_multipliers(
    robot: Mechanical,
    symmetry: Symmetry,
    found: Orbit,
    times: Float[Array, "n"] | np.ndarray,
    settings: Settings,
    exact: bool = True,
) -> Multipliers:
    """Floquet multipliers of an orbit that `orbit` solved with `times` and `settings`, and `multipliers` if `exact`.

    Where they leave open whether it is stable they are those of an exact one, then of that at a hundredth of the
    tolerances.
    """
    known = _of_orbit(symmetry, found)
    finer = eqx.tree_at(lambda s: (s.rtol, s.atol), settings, (_FINER * settings.rtol, _FINER * settings.atol))
    for stricter in (finer,) if exact else (settings, finer):
        if not known.undecided:
            break
        start = jax.tree.map(lambda x: x[0], found.states)
        again = remembered(orbit, robot, symmetry, start, times, stricter, True)
        if int(again.status) in (Status.SOLVED, Status.SETTLED):
            known = _of_orbit(symmetry, again.value)
    return known


def _of_orbit(symmetry: Symmetry, found: Orbit) -> Multipliers:
    return multipliers_of(symmetry, np.asarray(found.monodromy), np.asarray(found.errors))


def multipliers_of(
    symmetry: Symmetry, monodromy: Float[np.ndarray, "m m"], errors: Float[np.ndarray, "m m"]
) -> Multipliers:
    """Floquet multipliers of a monodromy whose numbers have these errors.

    The error of a multiplier is the largest of its changes where all numbers change by their errors, with random signs.
    So those of pairs that are nearly one, with one direction, are as large as they should be. Where those of the
    monodromy are not known, so are these: infinite.
    """
    from scipy.optimize import linear_sum_assignment

    if not np.all(np.isfinite(errors)):
        rough = multipliers_of(symmetry, monodromy, np.zeros_like(errors))
        return rough._replace(errors=np.full(rough.values.size, np.inf))
    values, *others = np.linalg.eigvals(_with_errors(symmetry, monodromy, errors)).astype(complex)
    values = values[np.argsort(-np.abs(values), kind="stable")]
    apart = np.zeros(values.size)
    for other in others:
        distances = np.abs(values[:, None] - other)
        apart = np.maximum(apart, distances[linear_sum_assignment(distances)])
    return Multipliers(values, apart)


def grows(symmetry: Symmetry, found: Orbit) -> Bool[Array, ""]:
    """Whether a disturbance of an orbit grows, also by more than the error; for traced ones."""
    values = jnp.linalg.eigvals(_with_errors(symmetry, found.monodromy, found.errors))
    return jnp.min(jnp.max(jnp.abs(values), axis=1, initial=0.0)) > 1


def _with_errors(symmetry: Symmetry, monodromy: Any, errors: Any) -> Any:
    """A monodromy [m, m] but for what is along the symmetry, and so with random errors, [draws + 1, k, k]."""
    own = _own(symmetry, monodromy)
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (_DRAWS, *monodromy.shape))
    xp = np if isinstance(monodromy, np.ndarray) else jnp
    return own.T @ (monodromy + xp.concatenate([xp.zeros((1, *monodromy.shape)), signs * errors])) @ own


def largest_multiplier(symmetry: Symmetry, monodromy: Float[np.ndarray, "m m"]) -> float:
    """Largest magnitude of the multipliers of a monodromy; 0 without any."""
    own = _own(symmetry, monodromy)
    return float(np.max(np.abs(np.linalg.eigvals(own.T @ monodromy @ own)), initial=0.0))


def _own(symmetry: Symmetry, monodromy: Any) -> Any:
    """Basis [m, k] of displacements that are neither along the symmetry nor, of an unknown period, along the motion.

    With a spin, a turn about the vertical is that of the three rotations to which no gap belongs.
    """
    n, xp = monodromy.shape[0], np if isinstance(monodromy, np.ndarray) else jnp
    left_out = [*symmetry.drift, *([] if symmetry.crank is None else [symmetry.crank]), *([2] if symmetry.spin else [])]
    basis = xp.eye(n)
    if symmetry.spin:
        turned = xp.linalg.svd((monodromy - basis)[:3])[0]
        basis = xp.concatenate([xp.concatenate([turned, xp.zeros((n - 3, 3))]), basis[:, 3:]], axis=1)
    return basis[:, np.setdiff1d(np.arange(n), left_out)]
