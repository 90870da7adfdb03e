"""Small motions about equilibria, and the loads at which these lose their stability, against closed forms."""

from math import pi

import numpy as np
import pytest
from tests.small_robots import SLIDE

from nectosome.description import parse_robot, with_values
from nectosome.solve import critical, modes, static
from nectosome.units import InputError

L, R, E, RHO = 0.5, 5e-3, 1e9, 1200.0  # m, m, Pa, kg/m3
EI, MASS = E * pi / 4 * R**4, RHO * pi * R**2  # N m2, kg/m
EULER = pi**2 * EI / (4 * L**2)  # N, of a column clamped at its foot, under a dead load (Euler 1757)
BECK = 20.05 * EI / L**2  # N, of the same under a load that follows its tip (Beck 1952)

COLUMN = f"""
name: column
water: {{gravity: 0 m/s2}}
body:
  kind: rod
  section: circle
  radius: {R} m
  length: {L} m
  young: {E} Pa
  density: {RHO} kg/m3
  strains: {{bending_y: 4}}
  joint: {{kind: fixed}}
  loads: {{push: {{kind: force, force: [-1 N, 0 N, 0 N], frame: FRAME}}}}
aliases: {{P: body.loads.push.force.0}}
"""


@pytest.fixture(scope="module")
def dead():
    return parse_robot(COLUMN.replace("FRAME", "world"))


def test_a_mass_on_a_spring_and_a_damper():
    """w0 = 10 rad/s, z = 0.3: lambda = -z w0 + i w0 sqrt(1 - z^2); above z = 1 both eigenvalues are real."""
    sprung = with_values(parse_robot(SLIDE), {"m": 2.0, "body.joint.stiffness": 200.0, "body.joint.damping": 12.0})
    found = modes(sprung)
    assert found.eigenvalue == pytest.approx([-3 + 1j * np.sqrt(91)], rel=1e-9)
    assert found.frequency == pytest.approx([np.sqrt(91) / (2 * pi)])
    assert found.damping_ratio == pytest.approx([0.3])
    assert found.stable and found.coordinates == ("body.position",) and found.shape == pytest.approx(np.ones((1, 1)))
    heavy = modes(with_values(sprung, {"body.joint.damping": 50.0}))
    assert heavy.eigenvalue == pytest.approx([-5, -20]) and heavy.damping_ratio == pytest.approx([1, 1])


def test_frequencies_of_a_cantilever(dead):
    """w = (1.87510, 4.69409)^2 sqrt(EI/(m L^4)): 1 %; it is slender, so that nothing else counts."""
    found = modes(with_values(dead, {"P": 0.0}))
    exact = np.array([1.87510, 4.69409]) ** 2 * np.sqrt(EI / (MASS * L**4)) / (2 * pi)
    assert found.frequency[:2] == pytest.approx(exact, rel=0.01)
    assert found.damping_ratio[:2] == pytest.approx([0, 0], abs=1e-6)
    data = found.to_dataset()
    assert data.sizes == {"mode": 5, "coordinate": 5, "component": 2}
    assert data["frequency"].attrs["units"] == "Hz" and "column" in data.attrs["robot"]


def test_a_column_buckles_under_eulers_load(dead):
    found = critical(dead, "P", (-0.5 * EULER, -2.0 * EULER)[::-1])
    assert (found.kind, found.frequency, found.unit) == ("divergence", 0.0, "N")
    assert found.value == pytest.approx(-EULER, rel=0.01)
    assert np.abs(found.shape).max() == pytest.approx(1.0)
    beyond = static(with_values(dead, {"P": -1.05 * EULER}))
    assert not modes(beyond).stable and modes(beyond).frequency[0] == 0


def test_becks_column_flutters_and_does_not_buckle():
    found = critical(parse_robot(COLUMN.replace("FRAME", "body")), "P", f"{-1.5 * BECK} N .. {-0.1 * EULER} N")
    assert found.kind == "flutter"
    assert found.value == pytest.approx(-BECK, rel=0.02)
    # at w = 11.02 sqrt(EI/(m L^4)) two modes meet (Beck 1952; Langthjem and Sugiyama 2000)
    assert 2 * pi * found.frequency == pytest.approx(11.02 * np.sqrt(EI / (MASS * L**4)), rel=0.01)


def test_what_has_no_critical_value_is_told(as_users_run, dead):
    with pytest.raises(InputError, match=r"stable at .* and between. Choose a wider range"):
        critical(dead, "P", (-0.5 * EULER, -0.1 * EULER), samples=2)
    with pytest.raises(InputError, match="no stable equilibrium at"):
        critical(dead, "P", (-2 * EULER, -1.5 * EULER), samples=2)
    with pytest.raises(InputError, match=r"give a range LOW..HIGH"):
        critical(dead, "P", (1.0,), samples=2)
    with pytest.raises(InputError, match='there is no quantity called "Q" in column'):
        critical(dead, "Q", "1 N .. 2 N")
    loose = SLIDE.replace("stiffness: 5 N/m, ", "").replace("axis: x", "axis: z")
    loose = loose.replace("water: {gravity: 0 m/s2}", "")
    with pytest.raises(InputError, match=r"no equilibrium found. Nothing holds body.position"):
        modes(parse_robot(loose))
