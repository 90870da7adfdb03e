r"""Stability of a steady motion: eigenvalues of the equations linearised about it.

With displacements $\delta$ along the velocities, $\dot\delta = \delta v - [v, \delta]$ for a joint that rotates freely,
and $M \dot{\delta v} = -R_\delta \delta - R_v \delta v$; directions of symmetry are left out.
"""

from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Complex, Float

from nectosome.core import State, Status
from nectosome.core.programs.remember import remembered
from nectosome.core.se3 import bracket, cross
from nectosome.mechanism import Free, Joint, Robot, Spherical

from .symmetry import Symmetry, near

_ROUNDING = 1e-14  # [norm of the matrix] what computing it and its eigenvalues leaves, relative
_HIDDEN = 1e-10  # [sum of magnitudes] the same of a growth by the damping alone
_APART = 1e-15  # [norm of the matrix] change of it that keeps eigenvectors of eigenvalues that are the same apart
_DRIFTS = 1e-6  # [1/s, and slowest other eigenvalue] below which one that is rounding is 0
_SINGULAR = 1e-7  # [largest] rows, columns and singular values below which a matrix is singular
_SCALINGS, _LEAST = 12, 1e-3  # until rows and columns are of one size; [norm of the stiffness] least

Values = Complex[np.ndarray, "k"]


class Stability(NamedTuple):
    """The small motion about an equilibrium that grows fastest, or decays slowest; marginal: neither, but rounding."""

    kind: Literal["diverges", "flutters", "marginal", "decays"]
    growth: float  # [1/s], negative where it decays
    frequency: float  # [Hz], 0 without oscillation

    @classmethod
    def of(cls, values: Values) -> "Stability":
        """Of the eigenvalues of `spectrum`; those of what drifts, 0, count only beside none that decays."""
        moving = values[values != 0]
        if not moving.size:
            return cls("marginal", 0.0, 0.0)
        lead = moving[np.lexsort((np.abs(moving), -np.real(moving)))[0]]
        growth, turn = float(np.real(lead)), abs(float(np.imag(lead)))
        rising: Literal["diverges", "flutters"] = "flutters" if turn > growth else "diverges"
        return cls(rising if growth > 0 else "decays" if growth < 0 else "marginal", growth, turn / (2 * np.pi))

    @property
    def stable(self) -> bool:
        """Whether nothing grows."""
        return self.kind in ("marginal", "decays")

    def __str__(self) -> str:
        turning = f" at {self.frequency:.3g} Hz" if self.frequency else ""
        return {
            "diverges": f"diverges, grows by {self.growth:.3g} 1/s",
            "flutters": f"flutters{turning}, grows by {self.growth:.3g} 1/s",
            "marginal": f"marginal, a motion{turning} neither grows nor decays",
            "decays": f"stable, decays by {-self.growth:.3g} 1/s or faster",
        }[self.kind]

    def says(self, status: Status) -> str:
        """Reason of a status, SOLVED or UNSTABLE, with what the motion does."""
        return f"{status.reason.partition(':')[0]}: {self}"


class SmallMotion(NamedTuple):
    """A linear motion of displacements, velocities and load states about a steady one."""

    jacobian: Float[Array, "m m"]  # of rates of displacements, of unbalanced forces, of rates of load states
    mass: Float[Array, "n n"]

    @property
    def stability(self) -> Stability:
        """Whether it grows; what may drift for ever neither grows nor decays."""
        return Stability.of(spectrum(jax.tree.map(np.asarray, self))[0])


def spectrum(motion: SmallMotion, drift: tuple[int, ...] = (), xp: Any = np) -> tuple[Any, Any]:
    r"""Eigenvalues [1/s] and their displacements [n, k], without those that `drift`; traced, with jax.numpy.

    The real part of an eigenvalue is one of three. It is that of the matrix A where it exceeds $10^{-14} \|A\|
    \|x\| \|y\| / |y^H x|$, the change by rounding, with the right and left eigenvectors x and y (Golub and Van Loan
    2013, 7.2), in coordinates in which the mass is 1 and the norm of the stiffness is that of its root, squared;
    and $|y|^H E |x| / |y^H x|$, where E has the rounding of each entry before it was divided by the mass, which is
    large beside a small inertia. Below that, it is the effect of first order $\mathrm{Re}\, y^H D x / y^H x$ of A's
    block D of velocities on themselves: of a damping however small. Where eigenvalues are the same it is that in
    the basis in which it is diagonal. Else it is 0. An eigenvalue that is rounding itself, as of a heavy tip on a
    light rod, is that of the inverse of A, over 1; 0 where A is singular, too, or by a millionth of 1/s or of the
    others.
    """
    n, m = motion.mass.shape[0], motion.jacobian.shape[0]
    keep = np.setdiff1d(np.arange(m), drift)
    if keep.size == 0:
        return xp.zeros(0, complex), xp.zeros((n, 0), complex)
    at, states = keep[keep < n], m - 2 * n
    k = at.size
    (P, back_p), (R, back_v) = (_root(M, xp) for M in (motion.mass[np.ix_(at, at)], motion.mass))
    B = motion.jacobian[np.ix_(keep, keep)]
    size = lambda x: xp.sqrt((x**2).sum())  # noqa: E731
    stiff, viscous = (
        size(back_v.T @ B[k : k + n, here] @ back) for here, back in ((np.s_[:k], back_p), (np.s_[k : k + n], back_v))
    )
    rate = xp.where(stiff > 0, xp.sqrt(stiff), xp.where(viscous > 0, viscous, 1.0))
    ahead = _diagonal([P * rate, -back_v.T, xp.eye(states)], xp)
    back = _diagonal([back_p / rate, back_v, xp.eye(states)], xp)
    error = np.finfo(float).eps * abs(ahead) @ abs(B) @ abs(back)
    B, scale, of_states = ahead @ B @ back, xp.ones(keep.size), np.arange(keep.size) >= k + n
    for _ in range(_SCALINGS if states else 0):
        others = (B * (1 - xp.eye(keep.size))) ** 2
        rows, columns = (xp.maximum(others.sum(axis=i), (_LEAST * rate) ** 2) for i in (1, 0))
        by = xp.where(of_states, (rows / columns) ** 0.125, 1.0)
        B, scale = B * by / by[:, None], scale * by
    change = np.random.default_rng(0).normal(size=B.shape) / keep.size
    X = xp.linalg.eig(B + _APART * size(B) * change)[1].astype(complex)
    Y = xp.linalg.inv(X)
    values = (Y * (B @ X).T).sum(axis=1) / (Y * X.T).sum(axis=1)
    condition = xp.sqrt((abs(X) ** 2).sum(axis=0) * (abs(Y) ** 2).sum(axis=1))
    error = error * scale / scale[:, None]
    own = (abs(Y) * (error @ abs(X)).T).sum(axis=1) / abs((Y * X.T).sum(axis=1))
    rounding = xp.maximum(_ROUNDING * size(B) * condition, own)
    real, turning = (xp.where(abs(x) > rounding, x, 0.0) for x in (values.real, values.imag))
    lost = (real == 0) & (turning == 0)
    ends = _diagonal([P * rate, R, xp.eye(states)], xp), _diagonal([back_p / rate, -R.T, xp.eye(states)], xp)
    inverse = ends[0] @ _inverse(motion.jacobian[np.ix_(keep, keep)], xp) @ ends[1]
    slow, shown = _slow(inverse * scale / scale[:, None], X, Y, lost, change, xp)
    slowest = xp.where(lost, xp.inf, abs(values)).min()
    floor = _DRIFTS * xp.where(xp.isfinite(slowest), xp.maximum(slowest, 1.0), 1.0)
    slow = xp.where(lost & (abs(slow) > floor), slow, 0.0)
    real, turning, X = real + slow.real, turning + slow.imag, xp.where(slow != 0, shown, X)
    hidden = (real == 0) & (turning != 0) & ~lost
    moving = (keep >= n) & (keep < 2 * n)
    D = xp.where(moving[:, None] & moving, B, 0.0)
    alike = (abs(values[:, None] - values) <= rounding[:, None] + rounding) & hidden[:, None] & hidden
    damping = xp.where(alike, Y @ D @ X, 0.0)
    largest = xp.maximum(abs(damping).max(), np.finfo(float).tiny)
    # eigenvalues that are not the same are kept apart by the diagonal, those that are not hidden by any other one
    together = (alike @ turning) / xp.maximum(alike.sum(axis=1), 1) / xp.maximum(abs(turning).max(), 1e-300)
    apart = xp.where(hidden, 1j * together, -1 - np.arange(keep.size) / keep.size)
    growth, turned = xp.linalg.eig(xp.diag(apart) + 0.1 * damping / largest)
    share = abs(turned) ** 2
    by_damping = xp.where(share.T @ hidden > 0.5, growth.real * 10 * largest, 0.0)
    least = share.T @ xp.where(hidden, _HIDDEN * (abs(Y) * (abs(D) @ abs(X)).T).sum(axis=1), 0.0)
    real = share.T @ real + xp.where(abs(by_damping) > least, by_damping, 0.0)
    shapes = (back @ (scale[:, None] * (X @ turned)))[:k]
    return real + 1j * (share.T @ turning), xp.eye(n)[:, at] @ shapes


def _slow(inverse: Any, near: Any, Y: Any, lost: Any, change: Any, xp: Any) -> tuple[Any, Any]:
    """Eigenvalues and right eigenvectors of the matrix with this inverse, in place of the `lost` ones.

    They are those that have the largest shares in all lost ones, of which `near` and Y are right and left vectors.
    """
    size = xp.sqrt((inverse**2).sum())
    values, X = xp.linalg.eig(inverse + _APART * size * change)
    left = xp.linalg.inv(X)
    least = _ROUNDING * size * xp.sqrt((abs(left) ** 2).sum(axis=1))
    real, imag = (xp.where(abs(x) > least, x, 0.0) for x in (values.real, values.imag))
    slow = xp.where(abs(values) > least, (real - 1j * imag) / xp.maximum(abs(values) ** 2, 1e-300), 0.0)
    share = xp.where(lost[:, None], (Y @ X) * (left @ near).T, 0.0).sum(axis=0).real
    at = xp.argsort(-share)[xp.maximum(xp.cumsum(lost) - 1, 0)]
    return slow[at], X[:, at]


def _inverse(J: Any, xp: Any) -> Any:
    """Inverse of a matrix, in units in which its rows and columns are of one size; of what is singular there, 0."""
    ahead = back = xp.ones(len(J))
    for _ in range(_SCALINGS):
        size = abs(J) * ahead[:, None] * back
        rows, columns = (xp.sqrt(size.max(axis=i)) for i in (1, 0))
        least = _SINGULAR * xp.where(rows.max() > 0, rows.max(), 1.0)  # of a matrix of zeros, too
        ahead, back = ahead / xp.maximum(rows, least), back / xp.maximum(columns, least)
    left, sizes, right = xp.linalg.svd(J * ahead[:, None] * back)
    there = sizes > _SINGULAR * sizes[0]
    inverse = (right.T * xp.where(there, 1 / xp.where(there, sizes, 1.0), 0.0)) @ left.T
    return inverse * back[:, None] * ahead


def _root(M: Any, xp: Any) -> tuple[Any, Any]:
    """R with R^T R = M, and its inverse; what has no mass gets one at rounding level."""
    own = xp.diagonal(M)
    scale = xp.sqrt(xp.where(own > 0, own, 1.0))
    values, vectors = xp.linalg.eigh(M / scale[:, None] / scale)
    root = xp.sqrt(xp.maximum(values, np.finfo(float).eps))
    return root[:, None] * vectors.T * scale, vectors / root / scale[:, None]


def _diagonal(blocks: list[Any], xp: Any) -> Any:
    """Matrix of these square blocks along its diagonal."""
    size = [len(block) for block in blocks]
    return xp.concatenate(
        [
            xp.concatenate([block if i == j else xp.zeros((size[i], width)) for j, width in enumerate(size)], axis=1)
            for i, block in enumerate(blocks)
        ]
    )


def eigenvalues(motion: SmallMotion, symmetry: Symmetry) -> Values:
    """Eigenvalues [1/s] about a steady state, those that grow fastest first, without that of a free heading."""
    values, _ = spectrum(motion, symmetry.drift)
    if symmetry.spin:  # the heading is free too, but no coordinate of its own
        values = np.delete(values, np.argmin(np.abs(values)))
    return values[np.argsort(-np.real(values), kind="stable")]


def is_stable(robot: Robot, x: State, symmetry: Symmetry | None = None) -> Bool[Array, ""]:
    """Whether no eigenvalue about the steady state x grows, traced, without derivatives."""
    drift = () if symmetry is None else symmetry.drift
    return jnp.max(jnp.real(spectrum(linearised(robot, x), drift, jnp)[0]), initial=0.0) <= 0


def small_motion(robot: Robot, x: State) -> SmallMotion:
    """About a steady state, in NumPy."""
    return jax.tree.map(np.asarray, remembered(linearised, robot, x))


def linearised(robot: Robot, x: State) -> SmallMotion:
    """Small motion about a steady state."""
    n, zero = x.v.shape[0], jnp.zeros(())
    m = ravel_pytree((x.v, x.v, x.z))[0].size

    def rates(change: Array) -> Array:
        """Rates of displacements, unbalanced forces, and rates of load states; then there are accelerations."""
        displaced, v = change[:n], change[n : 2 * n]
        for start, joint in _rotating_joints(robot):
            here = slice(start, start + joint.nv)
            turn = cross if joint.nv == 3 else bracket
            v = v.at[here].add(-turn(x.v[here], displaced[here]))
        moved = near(robot, x, change[:m])
        return jnp.concatenate(
            [v, robot.residual(zero, moved, change[m:]), ravel_pytree(robot.state_rates(zero, moved))[0]]
        )

    J = jax.jacfwd(rates)(jnp.zeros(m + n))
    return SmallMotion(J[:, :m], J[n : 2 * n, m:])


def _rotating_joints(robot: Robot) -> list[tuple[int, type[Joint]]]:
    """Unknown joints with velocities in a rotating frame, and the index of their first velocity."""
    out, start = [], 0
    for part in robot.tree.structure:
        free = 0 if part.prescribed else part.joint.nv
        if free and issubclass(part.joint, Free | Spherical):
            out.append((start, part.joint))
        start += free + part.own - len(part.prescribed_strains)
    return out
