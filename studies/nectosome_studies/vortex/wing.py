r"""The flapping wing of Yeo, Atkins and Shyy in a wind tunnel: its planform, its motion and the pressures on it.

D. Yeo, E. M. Atkins, W. Shyy, "Experimental and Analytical Pressure Characterization of a Rigid Flapping Wing for
Ornithopter Development" (AIAA 2011). Two rigid wings of 213 mm with a chord of 72 mm flap about their roots at 3.3 Hz
in wind of 2.9 m/s, chords along the wind. Differences of pressure between the two sides were measured at nine points
of one wing. C. Urban digitised the figures (repository camUrban/PteraSoftware, folder validation; MIT, `wing.LICENSE`):
`wing_pressures.csv` has his pressures in inches of water over the beat, `wing_planform.csv` every few points of his
outline in mm, from the trailing edge of the root. Positive pressures push up.

The lift is what he makes of them: each pressure acts on a rectangle, the wing leans by its flap angle $\phi$, and both
wings carry the same, $L = 2 \cos\phi \sum_j p_j A_j$. Pressures have no inertia of the wing in them. He puts the time
in periods where $\cos\phi$ wants an angle; that is put right here, and changes the root mean square by 0.3 %.
"""

from importlib.resources import files

import numpy as np
import pandas as pd
from jaxtyping import Float

from .flapping import PHASES, BeatForces, FoilBeat, Planform, periodic_curve

_INCH = 248.84  # of water [Pa]
_SPAN = 0.213  # [m]
_FOURIER = ((4.10e-5, 0.3793), (-0.0322, -1.95e-6), (-8.90e-7, -0.0035), (0.00046, -3.60e-6))  # cosines, sines [rad]
_MEAN = 0.0354  # [rad]
# rectangles of the points [m2], from the front to the rear of three bands of the span
_AREAS = {
    "inner": 3 * (0.072 * 0.024,),
    "middle": 3 * (0.07 * 0.02112,),
    "outer": (0.071 * 0.015, 0.06565 * 0.015, 0.04165 * 0.015),
}
_BANDS = (0.0, 0.072, 0.142, _SPAN)  # [m]


def flap(phase: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
    """Angle of the flap [rad] over the phase (0 to 1), tips up: the authors' Fourier series."""
    turn = 2 * np.pi * np.asarray(phase)
    waves = [a * np.cos(k * turn) + b * np.sin(k * turn) for k, (a, b) in enumerate(_FOURIER, start=1)]
    return _MEAN + np.sum(waves, axis=0)


def wing() -> FoilBeat:
    """Shape and motion; air of 1.225 kg/m3 in place of the water, of 1.81e-5 Pa s."""
    outline = pd.read_csv(_file("wing_planform.csv"))
    front, rear = (
        outline.loc[outline["edge"] == edge, ["x_mm", "y_mm"]].to_numpy() for edge in ("leading", "trailing")
    )
    x = np.linspace(0.0, _SPAN, 72)
    edges = [1e-3 * (front[0, 1] - np.interp(1e3 * x, *edge.T)) for edge in (front, rear[::-1])]
    still = np.zeros(PHASES)
    angle = flap(np.arange(PHASES) / PHASES)
    return FoilBeat(
        Planform(x, *edges), 2.9, 3.3, "flap", angle, still, still, 1.225, 1.81e-5, mirrored=True, bands=_BANDS
    )


def measured() -> BeatForces:
    """Lift by bands; thrust and power were not measured."""
    pressures = pd.read_csv(_file("wing_pressures.csv"))
    forces = [
        _INCH * (pressures[[f"{band}_{row}" for row in ("front", "middle", "rear")]].to_numpy() @ np.array(areas))
        for band, areas in _AREAS.items()
    ]
    lift = 2 * np.cos(flap(pressures["phase"].to_numpy()))[:, None] * np.stack(forces, axis=1)
    phase, nothing = np.arange(PHASES) / PHASES, np.full(PHASES, np.nan)
    return BeatForces(np.stack([periodic_curve(one)(phase) for one in lift.T], axis=1), nothing, nothing)


def _file(name: str):
    return files("nectosome_studies").joinpath("vortex", name).open(encoding="utf-8")
