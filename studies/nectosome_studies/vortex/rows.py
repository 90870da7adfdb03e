"""Scorecard rows of a replayed beat: beside what was measured, beside the vortex lattice, beside theory."""

from typing import Any

import numpy as np

from ..study import score
from .cases import theodorsen_heave
from .flapping import BeatForces, FoilBeat, harmonic, rms
from .lattice import LatticeForces
from .wing import measured

THIRDS = float(np.mean(np.sqrt([5.0, 1.0, 0.2]))) / (0.5 * np.pi)
r"""What pressures at 1/6, 1/2 and 5/6 of the chord, each taken for a third, say of the lift of a thin foil: 0.782.

Its pressure goes with $\sqrt{(1 - x)/x}$, whose mean is $\pi/2$."""
_TOLERANCE, _NEAR = 10.0, 5.0  # percent, deg
_Row = tuple[str, str, str, float, float, str]  # name, quantity, unit, ours, theirs, note


def case_rows(
    name: str, title: str, beat: FoilBeat, ours: dict[str, BeatForces], theirs: LatticeForces
) -> list[dict[str, Any]]:
    """All rows of a case: the foil as it ships and the attached one, and the lattice."""
    if name == "long":
        return _scored(name, title, "computed", _beside_theory(beat, ours["attached"], theirs))
    rows = _scored(name, title, "computed", _beside_lattice(beat, ours, theirs))
    if name == "wing":
        return _scored("wing/measured", title, "measured", _beside_measured(ours["foil"], theirs)) + rows
    return rows


def _scored(name: str, title: str, source: str, rows: list[_Row]) -> list[dict[str, Any]]:
    scored = []
    for row, quantity, unit, mine, other, note in rows:
        judged = {"within": _NEAR} if other == 0 else {"tolerance": _TOLERANCE}
        entry = {"quantity": f"{title}: {quantity}", "unit": unit, "kind": "prediction", "source": source} | judged
        entry |= {"source": "computed", "better": "low"} if row == "error" else {}
        if row.startswith("lattice") or row == "lift-at-points":  # the lattice is held against something; found later
            entry["kind"] = "own"
        scored.append(score(f"vortex/{name}/{row}", entry | {"printed": other, "note": note}, mine))
    return scored


def _beside_lattice(beat: FoilBeat, ours: dict[str, BeatForces], theirs: LatticeForces) -> list[_Row]:
    foil, attached = ours["foil"], ours["attached"]
    mine, other = harmonic(foil.total), harmonic(theirs.lift)
    thrust, power = float(theirs.thrust.mean()), float(theirs.power.mean())
    rows = [
        ("lift", "amplitude of lift, beside the lattice", "N", abs(mine), abs(other), ""),
        ("phase", "lift ahead of the lattice's", "deg", _ahead(mine, other), 0.0, ""),
        ("thrust", "mean thrust, beside the lattice", "N", float(foil.thrust.mean()), thrust, _SMOOTH),
        ("thrust-attached", "mean thrust without friction and stall", "N", float(attached.thrust.mean()), thrust, ""),
        ("power", "mean power of heave and turn, beside the lattice", "W", float(foil.power.mean()), power, ""),
    ]
    if not beat.mirrored:
        count, tips = len(theirs.strip_lift), float(np.abs(theirs.strip_lift[[0, -1]]).sum())
        rows.append(("tips", "amplitude of lift of the outermost ninth", "N", 2 / count * abs(mine), tips, _TIPS))
    return rows


def _beside_measured(foil: BeatForces, theirs: LatticeForces) -> list[_Row]:
    seen = measured()
    mine, other, true = harmonic(foil.total), harmonic(theirs.lift), harmonic(seen.total)
    off, lattice_off = rms(foil.total - seen.total), rms(theirs.lift - seen.total)
    rows = [
        ("lift", "amplitude of lift", "N", abs(mine), abs(true), _POINTS),
        ("lift-at-points", "amplitude of lift that its points would show", "N", THIRDS * abs(mine), abs(true), _THIN),
        ("lattice", "amplitude of the lattice's lift", "N", abs(other), abs(true), _POINTS),
        ("phase", "lift ahead of the measured", "deg", _ahead(mine, true), 0.0, ""),
        ("mean", "mean lift", "N", float(foil.total.mean()), float(seen.total.mean()), _FLAT),
        ("error", "root mean square of the error of lift, beside the lattice's", "N", off, lattice_off, ""),
    ]
    bands = zip(("inner", "middle", "outer"), harmonic(foil.lift), harmonic(seen.lift), strict=True)
    return rows + [(band, f"amplitude of lift, {band} third", "N", abs(a), abs(b), "") for band, a, b in bands]


def _beside_theory(beat: FoilBeat, foil: BeatForces, theirs: LatticeForces) -> list[_Row]:
    exact, middle = theodorsen_heave(beat), len(theirs.strip_lift) // 2
    of = {
        "lattice": ("lift in the lattice's middle", theirs.strip_lift[middle] / np.diff(theirs.ends)[middle]),
        "foil": ("lift", harmonic(foil.total) / beat.planform.x[-1]),
    }
    rows: list[_Row] = []
    for which, (what, c) in of.items():
        rows.append((which, f"{what}, amplitude per span", "N/m", abs(c), abs(exact), _THEORY))
        rows.append((f"{which}-phase", f"{what}, ahead of theory", "deg", _ahead(c, exact), 0.0, _THEORY))
    return rows


def _ahead(ours: complex, theirs: complex) -> float:
    """Phase by which a harmonic is ahead of another one [deg]."""
    return float(np.rad2deg(np.angle(ours / theirs)))


_SMOOTH = "The lattice has no friction and does not stall."
_TIPS = "A strip of 18 at each tip; the sections of a foil do not feel each other."
_POINTS = "Measured is the sum of nine pressures by areas, as their digitiser takes it."
_THIN = (
    "0.782 of the lift: the loading of a thin foil, taken at the places of the points. The factor came after the "
    "difference, and the match is one by cancellation: by thirds of the span it leaves -13, -5 and +24 %."
)
_FLAT = "A flat wing along the wind has none; camber and incidence of the wing are not published with the data."
_THEORY = "Theodorsen 1935, of an endless span; here A = 80, reduced frequency 0.4."
