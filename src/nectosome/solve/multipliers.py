"""Floquet multipliers of a periodic orbit: what a disturbance of the state is multiplied by in each cycle."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Mechanical, Status
from nectosome.core.programs.remember import remembered

from .integrate import Settings
from .orbit import Orbit, orbit
from .symmetry import Symmetry

STABLE = 1 + 1e-6  # largest magnitude of a stable motion's multipliers, with an error of differences
_UNSURE = 1e-3  # distance of multipliers from 1 below which they are those of a cycle at the last tolerance


def cycle_multipliers(
    robot: Mechanical, symmetry: Symmetry, found: Orbit, times: Float[Array, "n"] | np.ndarray, settings: Settings
) -> np.ndarray:
    """Floquet multipliers of an orbit that `orbit` solved with `times` and `settings`, the largest first.

    Where one is near 1 they are those of a cycle at the last tolerance.
    """
    values = multipliers_of(symmetry, np.asarray(found.monodromy))
    if np.any(np.abs(np.abs(values) - 1) < _UNSURE):
        start = jax.tree.map(lambda x: x[0], found.states)
        again = remembered(orbit, robot, symmetry, start, times, settings, 2)
        if int(again.status) in (Status.SOLVED, Status.SETTLED):
            return multipliers_of(symmetry, np.asarray(again.value.monodromy))
    return values


def multipliers_of(symmetry: Symmetry, monodromy: np.ndarray) -> np.ndarray:
    """Floquet multipliers of a monodromy, the largest first."""
    values = eigenvalues(symmetry, monodromy).astype(complex)
    return values[np.argsort(-np.abs(values), kind="stable")]


def eigenvalues(symmetry: Symmetry, monodromy: Any) -> Any:
    """Eigenvalues of a monodromy [m, m], of NumPy or JAX, but those along the symmetry."""
    own = _own(symmetry, monodromy)
    xp = np if isinstance(monodromy, np.ndarray) else jnp
    return xp.linalg.eigvals(own.T @ monodromy @ own)


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
