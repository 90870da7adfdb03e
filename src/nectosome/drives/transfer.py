"""Transfer functions of any order, discretised exactly for inputs that are linear within samples."""

import jax.numpy as jnp
from jax.scipy.linalg import expm
from jaxtyping import Array, ArrayLike, Float

from nectosome.core import Block, Line, Stepper


class TransferFunction(Block):
    r"""$$ G(s) = \frac{\sum_k b_k s^k}{\sum_k a_k s^k} $$ as a block, with the highest power first.

    The degree of the numerator is at most that of the denominator; leading zeros lower it. It starts at rest.
    """

    numerator: Float[Array, "m+1"]  # b_m .. b_0
    denominator: Float[Array, "n+1"]  # a_n .. a_0

    def __check_init__(self):
        m, n = self.numerator.shape[0], self.denominator.shape[0]
        if not 1 <= m <= n or n < 2:
            raise ValueError(
                f"a transfer function of {m} over {n} coefficients: the denominator needs 2 or more, and as many as "
                "the numerator."
            )

    def sampled(self, dt: Float[ArrayLike, ""]) -> Stepper:
        r"""Matrices for samples of dt [s]: x1 = A x0 + B u_begin + C (u_end - u_begin), exact for linear inputs.

        They are blocks of one matrix exponential (Van Loan 1978). States are scaled by powers of
        $\sigma = |a_0/a_n|^{1/n}$, since powers of s differ by many orders of magnitude.
        """
        n = self.denominator.shape[0] - 1
        ratio = jnp.abs(self.denominator[-1] / self.denominator[0])
        sigma = jnp.where(ratio > 0, jnp.where(ratio > 0, ratio, 1.0) ** (1 / n), 1.0)
        scale = sigma ** jnp.arange(n, -1, -1)  # s = sigma s'
        a = self.denominator * scale / (self.denominator[0] * scale[0])
        b = jnp.concatenate([jnp.zeros(n + 1 - self.numerator.shape[0]), self.numerator])
        b = b * scale / (self.denominator[0] * scale[0])
        rates = jnp.zeros((n + 2, n + 2)).at[jnp.arange(n - 1), jnp.arange(1, n)].set(1.0)
        rates = rates.at[n - 1, :n].set(-a[:0:-1]).at[n - 1, n].set(1.0)
        step = expm((rates * (sigma * dt)).at[n, n + 1].set(1.0))
        return _Discrete(step[:n, :n], step[:n, n], step[:n, n + 1], (b - b[0] * a)[:0:-1], b[0])


class _Discrete(Stepper):
    """x1 = A x0 + B u_begin + C (u_end - u_begin), y = D x + E u."""

    A: Float[Array, "n n"]
    B: Float[Array, "n"]
    C: Float[Array, "n"]
    D: Float[Array, "n"]
    E: Float[Array, ""]

    def initial(self) -> Float[Array, "n"]:
        """State at rest."""
        return jnp.zeros_like(self.B)

    def step(self, state: Float[Array, "n"], u: Line) -> tuple[Float[Array, "n"], Line]:
        """State and output at the end of a sample."""
        after = jnp.sum(self.A * state, axis=1) + self.B * u.begin + self.C * (u.end - u.begin)
        begin, end = (jnp.sum(self.D * x) + self.E * at for x, at in ((state, u.begin), (after, u.end)))
        return after, Line(begin, end)


def second_order(gain: Array, frequency: Array, damping: Array) -> TransferFunction:
    r"""$$ G = K \frac{\omega_n^2}{s^2 + 2 \zeta \omega_n s + \omega_n^2} $$ of gain K, omega_n [rad/s] and zeta."""
    w2 = frequency**2
    return TransferFunction(jnp.stack([gain * w2]), jnp.stack([jnp.ones_like(w2), 2 * damping * frequency, w2]))
