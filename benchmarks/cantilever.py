"""One second of a tapered cantilever that falls from level: error of the tip against time, beside two other codes.

On one core. Errors are root mean squares over 101 times, against the finest run of the same model: inextensible
rods (ours, SoRoMoX) against ours; PyElastica's, which shears and stretches, against its own, extrapolated.
SoRoMoX runs on JAX too: in a process of its own, so that JAX is set up for each as its users have it.
"""

import statistics
from concurrent.futures import Executor, ProcessPoolExecutor
from importlib.metadata import version
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np

from .peers import COSSERAT, Run, nectosome, pyelastica, soromox
from .timing import Row, now, time_at

_VISCOSITY = 3000.0  # Pa s
_ERRORS = (1.0, 0.3, 0.1, 0.03)  # mm, at which times are compared
# strain order, Gauss points, rtol: errors of space and of time
_RESOLUTIONS = ((1, 5, 1e-2), (2, 5, 1e-2), (3, 7, 1e-2), (3, 7, 3e-3), (4, 8, 3e-3), (4, 8, 1e-3))
_FINEST, _FINEST_SHEARING = (5, 10, 1e-6), (5, 10, 1e-5)
# elements, and a step [s] just below the largest stable one
_PYELASTICA = ((10, 1e-4), (20, 1e-4), (40, 6.7e-5), (80, 3.3e-5))
_FINER, _FINEST_ELEMENTS = (80, 1.6e-5), (160, 1.6e-5)


def main() -> None:
    codes = ", ".join(f"{name} {version(name)}" for name in ("nectosome", "soromox", "pyelastica"))
    print(f"\ntapered cantilever, 1 s from level, float64, one core: {codes}")
    print("  nectosome: implicit, adaptive; SoRoMoX: Tsit5, adaptive; PyElastica: position Verlet; medians of 3")
    with ProcessPoolExecutor(1, get_context("spawn"), _in_double_precision) as apart:
        apart.submit(int).result()  # it is there before nectosome sets JAX up here
        fine, ours = _inextensible("undamped", 0.0, apart)
        _inextensible(f"Kelvin-Voigt damping {_VISCOSITY:.0f} Pa s", _VISCOSITY, apart)
    _shearing(fine, ours)


def _in_double_precision() -> None:
    import jax

    jax.config.update("jax_enable_x64", True)


def _inextensible(damping: str, viscosity: float, apart: Executor) -> tuple[np.ndarray, list[Row]]:
    """Ours beside SoRoMoX; our finest run, and our rows."""
    fine = nectosome(*_FINEST, viscosity, method="explicit")()[0]
    _header(f"{damping}, inextensible")
    names = [f"order {o}, {p} points, rtol {r:.0e}" for o, p, r in _RESOLUTIONS]
    ours = [
        _row(f"nectosome, {name}", _timed(nectosome(*of, viscosity)), fine)
        for name, of in zip(names, _RESOLUTIONS, strict=True)
    ]
    theirs = [
        _row(f"SoRoMoX, {name}", apart.submit(_soromox, *of, viscosity).result(), fine)
        for name, of in zip(names, _RESOLUTIONS, strict=True)
    ]
    _compare("SoRoMoX", ours, theirs)
    return fine, ours


def _soromox(order: int, points: int, rtol: float, viscosity: float) -> "_Timed":
    return _timed(soromox(order, points, rtol, viscosity))


def _shearing(fine: np.ndarray, ours: list[Row]) -> None:
    """Ours with shear and extension beside PyElastica, which has no Kelvin-Voigt damping."""
    coarse, finest = pyelastica(*_FINER)()[0], pyelastica(*_FINEST_ELEMENTS)()[0]
    limit = finest + (finest - coarse) / 3
    _header("undamped, with shear and extension")
    theirs = [
        _row(f"PyElastica, {n} elements, step {h:.1e} s", _timed(pyelastica(n, h)), limit) for n, h in _PYELASTICA
    ]
    shearing = nectosome(*_FINEST_SHEARING, strains=COSSERAT)()[0]
    same = [
        _row(f"nectosome, order {o}, {p} points, rtol {r:.0e}", _timed(nectosome(o, p, r, strains=COSSERAT)), shearing)
        for o, p, r in _RESOLUTIONS
    ]
    print(f"  finest runs of both, with shear and extension: {_off(limit, shearing):.3f} mm apart;")
    print(f"  shear and extension themselves move the tip by {_off(fine, shearing):.2f} mm")
    _compare("PyElastica", same, theirs, "nectosome with shear and extension")
    _compare("PyElastica", ours, theirs, "nectosome inextensible")


def _header(what: str) -> None:
    print(f"\n  {what:48s}   error     time    first run   a step")


class _Timed(NamedTuple):
    """What a run gives, and the times it takes [s]: at first, with compilation, and then."""

    tip: np.ndarray
    steps: int
    first: float
    seconds: float


def _timed(run: Run) -> _Timed:
    began = now()
    tip, steps = run()
    first = now() - began
    times = []
    for _ in range(3):
        began = now()
        run()
        times.append(now() - began)
    return _Timed(tip, steps, first, statistics.median(times))


def _row(name: str, run: _Timed, reference: np.ndarray) -> Row:
    """Print the row of a run."""
    row = Row(_off(run.tip, reference), run.seconds)
    each = f"{1e6 * row.seconds / run.steps:6.0f} us x {run.steps}" if run.steps else ""
    print(f"  {name:48s} {row.error:7.4f} mm {1e3 * row.seconds:7.0f} ms {run.first:7.1f} s   {each}", flush=True)
    return row


def _off(a: np.ndarray, b: np.ndarray) -> float:
    """Root mean square distance [mm]."""
    return 1e3 * float(np.sqrt(np.mean(np.sum((a - b) ** 2, axis=1))))


def _compare(name: str, ours: list[Row], theirs: list[Row], us: str = "nectosome") -> None:
    """Ratio of times at equal errors, interpolated between logarithms."""
    for error in _ERRORS:
        a, b = time_at(error, ours), time_at(error, theirs)
        if np.isfinite(a) and np.isfinite(b):
            word = f"{max(a / b, b / a):.1f} x {'faster' if a < b else 'slower'}"
            print(f"  at {error} mm {us} takes {1e3 * a:.0f} ms, {name} {1e3 * b:.0f} ms: {word}")


if __name__ == "__main__":
    main()
