"""Coefficients of the Runge-Kutta methods."""

from typing import NamedTuple

import numpy as np


class Tableau(NamedTuple):
    """Butcher tableau whose last stage is the solution; `error` has the stage weights of the embedded error."""

    order: int
    A: np.ndarray  # [s, s]
    c: np.ndarray  # [s]
    error: np.ndarray  # [s]


def _matrix(rows: list[list[float]]) -> np.ndarray:
    s = len(rows)
    return np.array([row + [0.0] * (s - len(row)) for row in rows])


GAMMA = 0.25
_B = [82889 / 524892, 0.0, 15625 / 83664, 69875 / 102672, -2260 / 8211, GAMMA]
_EMBEDDED = [
    4586570599 / 29645900160,
    0.0,
    178811875 / 945068544,
    814220225 / 1159782912,
    -3700637 / 11593932,
    61727 / 225920,
]

# Kennedy, Carpenter (2003), ARK4(3)6L[2]SA, the implicit part: L-stable, stiffly accurate, first stage explicit.
ESDIRK4 = Tableau(
    order=4,
    A=_matrix(
        [
            [0.0],
            [GAMMA, GAMMA],
            [8611 / 62500, -1743 / 31250, GAMMA],
            [5012029 / 34652500, -654441 / 2922500, 174375 / 388108, GAMMA],
            [15267082809 / 155376265600, -71443401 / 120774400, 730878875 / 902184768, 2285395 / 8070912, GAMMA],
            _B,
        ]
    ),
    c=np.array([0.0, 0.5, 83 / 250, 31 / 50, 17 / 20, 1.0]),
    error=np.array(_B) - np.array(_EMBEDDED),
)

_TSIT_B = [
    0.09646076681806523,
    0.01,
    0.4798896504144996,
    1.379008574103742,
    -3.290069515436081,
    2.324710524099774,
    0.0,
]

# Tsitouras (2011), order 5(4), first same as last.
TSIT5 = Tableau(
    order=5,
    A=_matrix(
        [
            [0.0],
            [0.161],
            [-0.008480655492356989, 0.335480655492357],
            [2.8971530571054935, -6.359448489975075, 4.3622954328695815],
            [5.325864828439257, -11.748883564062828, 7.4955393428898365, -0.09249506636175525],
            [5.86145544294642, -12.92096931784711, 8.159367898576159, -0.071584973281401, -0.028269050394068383],
            _TSIT_B,
        ]
    ),
    c=np.array([0.0, 0.161, 0.327, 0.9, 0.9800255409045097, 1.0, 1.0]),
    error=np.array(
        [
            0.0017800110522257773,
            0.0008164344596567463,
            -0.007880878010261994,
            0.1447110071732629,
            -0.5823571654525552,
            0.45808210592918686,
            -0.015151515151515152,
        ]
    ),
)
