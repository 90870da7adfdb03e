r"""Transfer functions of gain 1, by frequencies and dampings of their poles and by zeros, and their derivatives.

$$ G(s) = (1 + b_1 s + b_2 s^2 + \dots) \prod_k \frac{\omega_k^2}{s^2 + 2 \zeta_k \omega_k s + \omega_k^2} $$

with a factor of a single pole where the order is odd, and fewer zeros than poles (Xiong et al. 2025, eq. 4, of gain 1).
Parameters are $\omega_1, \zeta_1, \omega_2, \dots$ [rad/s, -], then $b_1, b_2, \dots$ [s, s2, ...].
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.linalg import expm
from scipy.signal import lfilter, ss2tf, tf2ss

_ROUNDING = 1e-9  # of a sample

Ratio = tuple[Float[np.ndarray, "m"], Float[np.ndarray, "n"]]  # numbers above and below, highest power first


def _parts(theta: Float[np.ndarray, "n"], order: int) -> list[tuple[Ratio, list[Ratio]]]:
    """Of each factor of the poles: itself, and its relative derivatives by the logarithms of its parameters."""
    parts: list[tuple[Ratio, list[Ratio]]] = []
    for k in range(order // 2):
        w, z = theta[2 * k : 2 * k + 2]
        below = np.array([1.0, 2 * z * w, w**2])
        by = [(np.array([2.0, 2 * z * w, 0.0]), below), (np.array([-2 * z * w, 0.0]), below)]
        parts.append(((np.array([w**2]), below), by))
    if order % 2:
        w = theta[order - 1]
        parts.append(((np.array([w]), np.array([1.0, w])), [(np.array([1.0, 0.0]), np.array([1.0, w]))]))
    return parts


def _poles(theta: Float[np.ndarray, "n"], order: int) -> Ratio:
    """G without zeros."""
    above = below = np.ones(1)
    for (b, a), _ in _parts(theta, order):
        above, below = np.polymul(above, b), np.polymul(below, a)
    return above, below


def ratio_of(theta: Float[np.ndarray, "n"], order: int, zeros: int = 0) -> Ratio:
    """G of the first order + zeros parameters."""
    above, below = _poles(theta, order)
    return np.polymul(above, [*theta[order : order + zeros][::-1], 1.0]), below


def derivatives_of(theta: Float[np.ndarray, "n"], order: int, zeros: int = 0) -> list[Ratio]:
    """dG/d theta: transfer functions too."""
    above, below = ratio_of(theta, order, zeros)
    every = [by for _, derivatives in _parts(theta, order) for by in derivatives]
    poles = [(np.polymul(above, b) / x, np.polymul(below, a)) for x, (b, a) in zip(theta[:order], every, strict=True)]
    gain = _poles(theta, order)[0]
    return poles + [(np.polymul(gain, np.eye(k + 1)[0]), below) for k in range(1, zeros + 1)]


class Filter(NamedTuple):
    """A transfer function for even samples joined by lines: coefficients above and below, and of the first sample.

    m is the order, and one more for an answer between the samples.
    """

    above: Float[np.ndarray, "m+1"]
    below: Float[np.ndarray, "m+1"]
    line: Float[np.ndarray, "m"]  # what a line from 0 up to the first sample would leave behind


def discrete(ratio: Ratio, dt: float, late: float | None = None) -> Filter:
    r"""Filter of a transfer function, for its answer `late` [s] before each sample, less than dt: exact.

    With states z at the samples, lines between inputs x, and $\tau = \Delta t - late$ after a sample, the answer is

    $$ y = C\, (\Phi(\tau) z_k + \Gamma_1(\tau) x_k + \Gamma_2(\tau) (x_{k+1} - x_k)/\Delta t) + D\, x(\tau) $$
    """
    A, B, C, D = tf2ss(np.trim_zeros(ratio[0], "f"), ratio[1])
    n, past = len(A), late or 0.0
    lines = np.zeros((n + 2, n + 2))  # rates of the states, of a line, and of its slope
    lines[:n, :n], lines[:n, n], lines[n, n + 1] = A, B[:, 0], 1.0
    whole, part = expm(lines * dt), expm(lines * (dt - past))
    out, (first, second) = C @ part[:n, :n], (np.ravel(C @ part[:n, n + k]) for k in (0, 1))
    end, begin = whole[:n, n + 1] / dt, whole[:n, n] - whole[:n, n + 1] / dt
    share = second / dt + D[0] * (1 - past / dt), first - second / dt + D[0] * past / dt
    by_end, by_begin = (
        np.ravel(ss2tf(whole[:n, :n], x[:, None], out, d[:, None])[0]) for x, d in zip((end, begin), share, strict=True)
    )
    below, m = np.append(np.poly(whole[:n, :n]), 0.0), n + 1 + (late is not None)
    return Filter((np.append(by_end, 0.0) + np.append(0.0, by_begin))[:m], below[:m], by_end[: m - 1])


def filter_of(
    ratio: Ratio, dt: float, late: float = 0.0
) -> Callable[[Float[np.ndarray, "n *k"]], Float[np.ndarray, "n *k"]]:
    """Answer of a transfer function, from rest and `late` [s], to even samples joined by lines: exact."""
    samples, part = whole_samples(late, dt)
    above, below, line = discrete(ratio, dt, part if late else None)

    def answer(x: Float[np.ndarray, "n *k"]) -> Float[np.ndarray, "n *k"]:
        y: Any = lfilter(above, below, x, axis=0)
        if np.any(x[0]):
            impulse = np.zeros(len(x))  # the filter takes it that a line from 0 led to the first sample too
            impulse[0] = 1.0
            y = y - np.multiply.outer(np.asarray(lfilter(line, below, impulse)), x[0])
        return np.concatenate([np.zeros_like(y[:samples]), y[: len(y) - samples]])

    return answer


def whole_samples(late: float, dt: float) -> tuple[int, float]:
    """Whole samples in a time, and the rest of it [s]."""
    samples = int(late / dt + _ROUNDING)
    return samples, max(late - samples * dt, 0.0)
