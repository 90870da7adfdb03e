"""Fits of the fishtail to six recordings of 39 206 samples from random starts; a minute of its model at 1 kHz.

The latter beside the same loop in numba.
"""

import jax
import numba
import numpy as np

from nectosome.drives import respond
from nectosome.identification.hysteresis.fit import HysteresisModel, fit_hysteresis
from nectosome_studies.fishtail.levenberg import identify_as_printed
from nectosome_studies.fishtail.plant import LARGEST, RECORDED_DT, TRAIN, plant, recorded

from .timing import timed

_STARTS, _SAMPLES, _REPEATS = 20, 60_000, 5


@numba.njit
def looped(u, direct, thresholds, weights, A, B, C, D):
    """The same equations, sample by sample; the two states as scalars, since small matrix products cost more here."""
    plays, y = np.zeros(len(thresholds)), np.empty(len(u))
    x, v, before = 0.0, 0.0, 0.0
    for k in range(len(u)):
        now = direct * u[k]
        for i in range(len(thresholds)):
            plays[i] = max(u[k] - thresholds[i], min(u[k] + thresholds[i], plays[i]))
            now += weights[i] * plays[i]
        if k:
            step = now - before
            x, v = (
                A[0, 0] * x + A[0, 1] * v + B[0] * before + C[0] * step,
                A[1, 0] * x + A[1, 1] * v + B[1] * before + C[1] * step,
            )
        y[k] = D[0] * x + D[1] * v
        before = now
    return y


def main() -> None:
    trials = [recorded(f, limit=False) for f in TRAIN]
    model = HysteresisModel(tuple(trials))
    starts = model.ranges.values(np.random.default_rng(0).uniform(0.05, 0.95, size=(_STARTS, 2)))
    fit_hysteresis(trials)
    print(f"\nfits of a fishtail from {_STARTS} random starts, 39 206 samples")
    methods = {
        "variable projection": lambda start: fit_hysteresis(trials, start=start),
        "Levenberg-Marquardt as printed": lambda start: identify_as_printed(model, start),
    }
    for method, fit in methods.items():
        found = [timed(lambda start=start, fit=fit: fit(start)) for start in starts]
        walls, ends = [wall for wall, _, _ in found], [one.noise for *_, one in found]
        same = sum(abs(end / min(ends) - 1) < 1e-6 for end in ends)
        times = f"median {np.median(walls):.2f} s, longest {max(walls):.2f} s"
        print(f"  {method}: {times}; {same} of {_STARTS} to the same optimum")
    u = LARGEST * np.sin(2 * np.pi * 0.5 * RECORDED_DT * np.arange(_SAMPLES))
    chain = plant()
    hysteresis, held = chain.blocks[0], chain.blocks[1].sampled(RECORDED_DT)
    numbers = [np.asarray(x) for x in (hysteresis.direct, hysteresis.thresholds, hysteresis.weights)]
    numbers += [np.asarray(x) for x in (held.A, held.B, held.C, held.D)]
    ours = lambda: jax.block_until_ready(respond(chain, u, RECORDED_DT))  # noqa: E731
    theirs = lambda: looped(u, *numbers)  # noqa: E731
    assert np.abs(ours() - theirs()).max() < 1e-12
    mine, loop = (np.median([timed(run)[0] for _ in range(_REPEATS)]) for run in (ours, theirs))
    print(f"  60 s at 1 kHz: {1e3 * mine:.0f} ms, numba {1e3 * loop:.1f} ms, ratio {mine / loop:.1f}", flush=True)


if __name__ == "__main__":
    main()
