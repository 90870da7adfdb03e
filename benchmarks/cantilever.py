"""One second of a tapered cantilever that falls from level: error of the tip against time, beside two other codes.

On one core. Errors are root mean squares over 101 moments, against the finest run of the same model: inextensible
rods (ours, SoRoMoX) against ours; PyElastica's, which shears and stretches, against its own, extrapolated.
"""

import statistics
from importlib.metadata import version

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
    fine, ours = _inextensible("undamped", 0.0)
    _inextensible(f"Kelvin-Voigt damping {_VISCOSITY:.0f} Pa s", _VISCOSITY)
    _shearing(fine, ours)


def _inextensible(damping: str, viscosity: float) -> tuple[np.ndarray, list[Row]]:
    """Ours beside SoRoMoX; our finest run, and our rows."""
    fine = nectosome(*_FINEST, viscosity, method="explicit")()[0]
    _header(f"{damping}, inextensible")
    ours, theirs = (
        [
            _row(f"{name}, order {o}, {p} points, rtol {r:.0e}", code(o, p, r, viscosity), fine)
            for o, p, r in _RESOLUTIONS
        ]
        for name, code in (("nectosome", nectosome), ("SoRoMoX", soromox))
    )
    _compare("SoRoMoX", ours, theirs)
    return fine, ours


def _shearing(fine: np.ndarray, ours: list[Row]) -> None:
    """Ours with shear and extension beside PyElastica, which has no Kelvin-Voigt damping."""
    coarse, finest = pyelastica(*_FINER)()[0], pyelastica(*_FINEST_ELEMENTS)()[0]
    limit = finest + (finest - coarse) / 3
    _header("undamped, with shear and extension")
    theirs = [_row(f"PyElastica, {n} elements, step {h:.1e} s", pyelastica(n, h), limit) for n, h in _PYELASTICA]
    shearing = nectosome(*_FINEST_SHEARING, strains=COSSERAT)()[0]
    same = [
        _row(f"nectosome, order {o}, {p} points, rtol {r:.0e}", nectosome(o, p, r, strains=COSSERAT), shearing)
        for o, p, r in _RESOLUTIONS
    ]
    print(f"  finest runs of both, with shear and extension: {_off(limit, shearing):.3f} mm apart;")
    print(f"  shear and extension themselves move the tip by {_off(fine, shearing):.2f} mm")
    _compare("PyElastica", same, theirs, "nectosome with shear and extension")
    _compare("PyElastica", ours, theirs, "nectosome inextensible")


def _header(what: str) -> None:
    print(f"\n  {what:48s}   error     time    first run   a step")


def _row(name: str, run: Run, reference: np.ndarray) -> Row:
    """Time a run and print its row."""
    began = now()
    tip, steps = run()
    first = now() - began
    times = []
    for _ in range(3):
        began = now()
        run()
        times.append(now() - began)
    row = Row(_off(tip, reference), statistics.median(times))
    each = f"{1e6 * row.seconds / steps:6.0f} us x {steps}" if steps else ""
    print(f"  {name:48s} {row.error:7.4f} mm {1e3 * row.seconds:7.0f} ms {first:7.1f} s   {each}", flush=True)
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
