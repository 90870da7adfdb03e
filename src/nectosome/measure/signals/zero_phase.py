"""A Butterworth low-pass that runs forwards and backwards: no delay at any frequency."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.signal import butter, sosfiltfilt, zpk2sos

from .noise import Weights


@dataclass(frozen=True)
class ZeroPhase:
    """Low-pass of samples `step` [s] apart, with amplitude 1/sqrt(2) at `cutoff` [Hz] after both passes of `order`.

    $$ |H| = \\left[ 1 + (\\sqrt 2 - 1) \\left( \\frac{\\tan \\pi f h}{\\tan \\pi f_c h} \\right)^{2 n} \\right]^{-1} $$

    A single pass has its own cutoff higher by that much (Winter, Biomechanics and Motor Control of Human Movement,
    ch. 3). Beyond its ends a signal goes on turned about its end point, 2 x_0 - x_j, so that the first and last
    sample stay as they are.
    """

    cutoff: float  # [Hz], below 1 / (2 step)
    order: int  # of each pass
    step: float  # [s]

    @cached_property
    def _zpk(self) -> Any:
        wanted = np.tan(np.pi * self.cutoff * self.step)
        own = np.arctan(wanted / (np.sqrt(2) - 1) ** (0.5 / self.order)) / np.pi  # of one pass, in cycles a sample
        return butter(self.order, 2 * own, output="zpk")

    @cached_property
    def _sos(self) -> Float[np.ndarray, "sections 6"]:
        return np.asarray(zpk2sos(*self._zpk))

    @property
    def reach(self) -> int:
        """Samples after which the answer to an impulse has died down to a thousandth; a signal must be longer."""
        return int(np.ceil(np.log(1e-3) / np.log(np.max(np.abs(self._zpk[1])))))

    def __call__(self, values: Float[np.ndarray, "*batch n"]) -> Float[np.ndarray, "*batch n"]:
        """Filter along the last axis."""
        rise = np.linspace(0.0, 1.0, values.shape[-1])
        line = values[..., :1] * (1 - rise) + values[..., -1:] * rise  # stays as it is, and would take long to settle
        return line + sosfiltfilt(self._sos, values - line, axis=-1, padtype="odd", padlen=self.reach)

    @cached_property
    def weights(self) -> Weights:
        """Weights of the samples, cut off where they have died down."""
        m = self.reach
        impulse = np.zeros(4 * m + 1)
        impulse[2 * m] = 1.0
        kernel = sosfiltfilt(self._sos, impulse, padlen=0)[m : 3 * m + 1]
        h = np.concatenate([kernel[m:], np.zeros(2 * m)])  # h_0, h_1, ...
        tail = 2 * np.cumsum(h[::-1])[::-1]  # 2 (h_i + h_{i+1} + ...)

        def first(i: int) -> Float[np.ndarray, "k"]:
            j = np.arange(i + m + 1)
            row = h[np.abs(i - j)] - h[i + j]
            row[0] = h[i] + tail[i + 1]
            return row

        return Weights(kernel, first)
