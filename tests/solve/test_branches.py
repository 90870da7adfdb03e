"""Shapes of buckled columns against shooting: which one is chosen, by lean, by start and by branch."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from nectosome.core import Status
from nectosome.description import apply_settings, parse_robot
from nectosome.solve import static
from nectosome.units import InputError

LENGTH, RADIUS, LEAN = 0.12, 2e-3, np.radians(0.1)
COLUMN = parse_robot(
    """
name: column
water: {gravity: 9.81 m/s2, density: 1 kg/m3}
limbs:
  column:
    on: world
    kind: rod
    rotation: [0 deg, -89.9 deg, 0 deg]
    section: circle
    radius: 2 mm
    length: 120 mm
    young: 1 MPa
    density: 1100 kg/m3
    damping: 100 Pa s
    strains: {bending_y: 6}
    points: 24
"""
)


def shot(side: int) -> np.ndarray:
    """Tip [m] of the column that bows to a side: E I a'' + w (L - s) sin a = 0 with the angle a from upright."""
    stiff, weight = 1e6 * np.pi / 4 * RADIUS**4, 1099 * 9.81 * np.pi * RADIUS**2

    def along(bent: float):
        def rates(s, y):
            return [y[1], -weight * (LENGTH - s) * np.sin(y[0]) / stiff, np.sin(y[0]), np.cos(y[0])]

        return solve_ivp(rates, (0, LENGTH), [LEAN, bent, 0, 0], rtol=1e-11, atol=1e-13).y[:, -1]

    bent = brentq(lambda x: along(x)[1], side * 5.0, side * 60.0, xtol=1e-12)
    return along(bent)[[2, 3]]


def tip(found) -> np.ndarray:
    return np.asarray(found.to_dataset()["position"])[0, -1][[0, 2]]


def test_a_leaning_column_buckles_the_way_it_leans_and_the_others_are_there():
    """1.33 times as long as it stands: tip at (88.05, -34.41) mm, the other at (-88.08, -34.2) mm; upright diverges."""
    assert shot(1) == pytest.approx([0.08805, -0.03441], abs=1e-5)
    found = static(COLUMN)
    assert int(found.status) == Status.SOLVED
    assert found.stability.kind == "decays"
    assert found.left.kind == "diverges"
    np.testing.assert_allclose(tip(found), shot(1), atol=5e-5)
    sides = {}
    for branch in ("plus", "minus", "first"):
        one = static(COLUMN, branch=branch)
        sides[branch] = tip(one)
        assert int(one.status) == (Status.UNSTABLE if branch == "first" else Status.SOLVED)
    np.testing.assert_allclose(sorted([sides["plus"][0], sides["minus"][0]]), [shot(-1)[0], shot(1)[0]], atol=5e-5)
    np.testing.assert_allclose(sides["first"], [0, LENGTH], atol=2e-4)
    assert "Branch first shows that shape, plus and minus" in found.notes[0]


def test_a_bent_start_chooses_the_side():
    """Against its lean by 3 rad/m, the column falls to that side."""
    for bent, side in ((-3, -1), (3, 1)):
        found = static(apply_settings(COLUMN, [f"limbs.column.start={{bending_y: [{bent} rad/m]}}"]))
        assert int(found.status) == Status.SOLVED
        np.testing.assert_allclose(tip(found), shot(side), atol=5e-5)


def test_an_upright_column_stays_unstable_and_names_the_sides():
    upright = apply_settings(COLUMN, ["limbs.column.rotation=[0 deg, -90 deg, 0 deg]"])
    found = static(upright)
    assert int(found.status) == Status.UNSTABLE
    assert found.stability.kind == "diverges"
    assert "Branch plus and minus" in found.notes[0]


def test_a_branch_that_is_not_there_is_refused():
    short = apply_settings(COLUMN, ["limbs.column.length=80 mm"])
    assert int(static(short).status) == Status.SOLVED
    assert static(short).notes == []
    with pytest.raises(InputError, match="does not diverge") as told:
        static(short, branch="plus")
    assert told.value.field == "branch"
