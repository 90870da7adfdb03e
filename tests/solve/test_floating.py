"""How bodies float: boxes in closed form, angles of loll, what sinks, levers when heeled."""

import numpy as np
import pytest
from tests.geometry import closed_surfaces as made

from nectosome.core import Status
from nectosome.solve import floating, righting_arms
from nectosome.solve.floating import _derivatives, _raised
from nectosome.units import InputError

L, B, H, T = 2.0, 0.8, 0.5, 0.2  # a barge and its draught
BARGE = made.box(L, B, H)
MASS = 1000 * L * B * T
KEEL = -H / 2


def xyz(*numbers):
    return np.array(numbers, float)


def metacentric(draught, breadth, height_of_mass):
    """KB + BM - KG."""
    return draught / 2 + breadth**2 / (12 * draught) - height_of_mass


def test_a_barge_on_even_keel():
    found = floating(BARGE, MASS, xyz(0, 0, KEEL + 0.15))
    assert found.status == Status.SOLVED and not found.why
    assert found.draught == pytest.approx(T, rel=1e-12)
    assert (found.trim, found.heel) == pytest.approx((0, 0), abs=1e-9)
    assert found.buoyancy == pytest.approx([0, 0, KEEL + T / 2], abs=1e-10)
    assert found.waterplane == pytest.approx(L * B, rel=1e-12)
    expected = metacentric(T, B, 0.15), metacentric(T, L, 0.15)
    assert found.metacentric_heights == pytest.approx(expected, rel=1e-9)


def test_denser_water_lifts_it():
    assert floating(BARGE, MASS, xyz(0, 0, 0), 1025.0).draught == pytest.approx(T / 1.025, rel=1e-12)


@pytest.mark.parametrize("side", [-1, 1])
def test_a_weight_to_one_side_heels_it_there(side):
    """Wall-sided: (GM + BM tan^2 / 2) tan = e for a centre of mass e to the side; to port is a heel below 0."""
    kg, e = 0.15, 0.03
    found = floating(BARGE, MASS, xyz(0, side * e, KEEL + kg))
    t = np.tan(found.heel)
    gm, bm = metacentric(T, B, kg), B**2 / (12 * T)
    assert (gm + 0.5 * bm * t**2) * t == pytest.approx(-side * e, rel=1e-8)
    assert found.trim == pytest.approx(0, abs=1e-9) and found.volume == pytest.approx(L * B * T, rel=1e-9)


def test_a_weight_ahead_puts_the_bow_down():
    kg, e = 0.15, 0.05
    found = floating(BARGE, MASS, xyz(e, 0, KEEL + kg))
    t = np.tan(found.trim)
    assert (metacentric(T, L, kg) + 0.5 * L**2 / (12 * T) * t**2) * t == pytest.approx(-e, rel=1e-8)
    assert found.heel == pytest.approx(0, abs=1e-9)


def test_a_top_heavy_barge_lolls():
    """tan^2 = -2 GM / BM, to either side; upright it is unstable."""
    bm = B**2 / (12 * T)
    kg = T / 2 + bm + 0.004
    found = floating(BARGE, MASS, xyz(0, 0, KEEL + kg))
    assert found.status == Status.SOLVED
    assert np.tan(found.heel) ** 2 == pytest.approx(2 * 0.004 / bm, rel=1e-6)
    assert found.metacentric_heights[0] > 0


def test_a_square_log_of_half_the_density_floats_on_its_edge():
    found = floating(made.box(3, 0.2, 0.2), 1000 * 3 * 0.04 / 2, xyz(0, 0, 0))
    assert np.abs(found.up) == pytest.approx([0, np.sqrt(0.5), np.sqrt(0.5)], abs=1e-7)
    assert found.draught == pytest.approx(0.2 / np.sqrt(2), rel=1e-9)


def test_a_bottle_with_its_weight_at_the_end_stands_on_it():
    found = floating(made.cylinder(1.0, 0.1), 15.0, xyz(0, 0, -0.45), up=xyz(0.9, 0, 0.1))
    assert found.up == pytest.approx([0, 0, 1], abs=1e-8)
    section = 24 * np.sin(2 * np.pi / 48) * 0.1**2
    assert found.draught == pytest.approx(15.0 / 1000 / section, rel=1e-9)


def test_a_ball_has_no_metacentric_height():
    """But for its triangles: 1280 of them make it roll a little."""
    ball = made.spheroid(1, 1, 3)
    found = floating(ball, 500 * ball.solid.size, xyz(0, 0, 0))
    assert found.status == Status.SOLVED and found.draught == pytest.approx(1, abs=6e-3)
    assert found.metacentric_heights == pytest.approx((0, 0), abs=1e-3)


@pytest.mark.parametrize("mass", [1000 * L * B * H, 2000.0])
def test_what_sinks_has_no_place_of_rest_and_says_so(mass):
    found = floating(BARGE, mass, xyz(0, 0, 0))
    assert found.status == Status.NO_EQUILIBRIUM
    assert found.why.startswith(f"it sinks: its mass, {mass:g} kg, is not below") and "800 kg" in found.why


@pytest.mark.parametrize(("mass", "density"), [(0.0, 1000.0), (-1.0, 1000.0), (1.0, 0.0), (np.nan, 1000.0)])
def test_masses_and_densities_above_0(mass, density):
    with pytest.raises(InputError, match="both must be above 0"):
        floating(BARGE, mass, xyz(0, 0, 0), density)


def test_righting_arms_of_a_wall_sided_barge():
    """GZ = sin (GM + BM tan^2 / 2) until its deck or its bottom comes to the water; odd in the heel."""
    kg, bm = 0.15, B**2 / (12 * T)
    heels = np.radians([-20, -5, 0, 1, 5, 10, 20, 25])
    assert np.tan(heels.max()) < 2 * T / B
    expected = np.sin(heels) * (metacentric(T, B, kg) + 0.5 * bm * np.tan(heels) ** 2)
    assert righting_arms(BARGE, MASS, xyz(0, 0, KEEL + kg), heels) == pytest.approx(expected, abs=1e-11)


def test_upside_down_a_barge_is_a_barge():
    arm = righting_arms(BARGE, MASS, xyz(0, 0, 0.05), [np.pi + 0.1])
    assert arm == pytest.approx(righting_arms(BARGE, MASS, xyz(0, 0, -0.05), [0.1]), abs=1e-10)


def test_righting_arms_of_what_sinks():
    with pytest.raises(InputError, match="sinks"):
        righting_arms(BARGE, 2000.0, xyz(0, 0, 0), [0.1])


def test_the_derivatives_are_those_of_the_energy():
    surface, centre, volume = made.spheroid(2, 0.7, 2), np.array([0.1, -0.05, -0.1]), 1.3
    up, depth, h = np.array([0.36, 0.48, 0.8]), 0.1, 1e-4
    force, stiffness, axes = _derivatives(surface, depth, up, centre, volume)

    def energy(step):
        tilt = step[1:] @ axes
        angle = np.linalg.norm(tilt)
        turned = np.cos(angle) * up + (np.sin(angle) / angle if angle else 1.0) * tilt
        raised = float(_raised(surface.vertices, surface.faces, depth + step[0], turned))
        return raised + volume * (centre @ turned - depth - step[0])

    way = np.array([0.3, 0.7, -0.5])
    ahead, here, back = (energy(sign * h * way) for sign in (1, 0, -1))
    assert force @ way == pytest.approx((ahead - back) / (2 * h), rel=1e-6)
    assert way @ stiffness @ way == pytest.approx((ahead - 2 * here + back) / h**2, rel=1e-5)
