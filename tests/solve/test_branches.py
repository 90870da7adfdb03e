"""Shapes of buckled columns against shooting: which one is chosen, by lean, by start and by branch."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar

from nectosome.core import Status
from nectosome.description import apply_settings, parse_robot, with_values
from nectosome.identification import identify
from nectosome.solve import critical, simulate, static
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


STIFF, WEIGHT = 1e6 * np.pi / 4 * RADIUS**4, 1099 * 9.81 * np.pi * RADIUS**2  # E I, w
# 1 m long, on a spring of 1 N m/rad that carries 0.204 kg; it leans by 1 deg, and may be pushed at its tip
MAST = """
name: mast
water: {density: 1e-9 kg/m3, gravity: 9.81 m/s2}
body:
  kind: rigid
  shape: cylinder
  length: 1 m
  radius: 10 mm
  mass: 0.3 kg
  volume: 0 m3
  rotation: [0 deg, -89 deg, 0 deg]
  joint: {kind: revolute, axis: y, stiffness: 1 N m/rad, damping: 0.1 N m s/rad}
  loads: {push: {kind: force, force: [0 N, 0 N, 0 N]}}
aliases: {F: body.loads.push.force.0, m: body.mass, k: body.joint.stiffness}
"""


def bowed(bent: float, length: float = LENGTH) -> np.ndarray:
    """Angle from upright, its rate, x and z at the tip: E I a'' + w (L - s) sin a = 0 from a rate at the foot."""

    def rates(s, y):
        return [y[1], -WEIGHT * (length - s) * np.sin(y[0]) / STIFF, np.sin(y[0]), np.cos(y[0])]

    return solve_ivp(rates, (0, length), [LEAN, bent, 0, 0], rtol=1e-11, atol=1e-13).y[:, -1]


def shot(side: int, length: float = LENGTH) -> np.ndarray:
    """Tip [m] of the column that bows to a side."""
    bent = brentq(lambda x: bowed(x, length)[1], side * 5.0, side * 60.0, xtol=1e-12)
    return bowed(bent, length)[[2, 3]]


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
    np.testing.assert_array_equal(static(short, branch="minus").state.q, static(short).state.q)
    with pytest.raises(InputError, match=r"does not diverge.*falls back.*limbs.column.start={bending_y: ") as told:
        static(short, branch="plus")
    assert told.value.field == "branch"


@pytest.mark.parametrize(("lean", "stiffness"), [(3.0, 1.1), (10.0, 0.9), (20.0, 0.7), (20.0, 0.9)])
def test_a_mast_that_leans_far_has_a_second_shape_that_no_growing_load_leads_to(lean: float, stiffness: float):
    """k (a - lean) = m g L/2 sin a on both sides; loads that grow lead to the one that leans on, also from a start."""
    mast = apply_settings(parse_robot(MAST), [f"body.rotation=[0 deg, {lean - 90} deg, 0 deg]"])
    mast, lean = with_values(mast, {"k": stiffness}), np.radians(lean)

    def turned(low: float, high: float) -> float:
        return brentq(lambda a: stiffness * (a - lean) - 0.5 * 0.3 * 9.81 * np.sin(a), low, high, xtol=1e-14) - lean

    on, back = turned(0.9, 3.0), turned(-3.0, -0.9)
    for branch, angle in (("first", on), ("plus", on), ("minus", back)):
        found = static(mast, branch=branch)
        assert int(found.status) == Status.SOLVED
        assert float(found.state.q[0]) == pytest.approx(angle, abs=1e-9)
    for start, angle in ((1.0, on), (-1.5, back)):
        found = static(with_values(mast, {"body.joint.position": start}))
        assert float(found.state.q[0]) == pytest.approx(angle, abs=1e-9)


def test_a_mast_beyond_its_fold_has_one_shape_and_is_told_what_was_tried():
    """1.1 (a - 10 deg) = 1.4715 sin a has one root."""
    mast = apply_settings(parse_robot(MAST), ["body.rotation=[0 deg, -80 deg, 0 deg]", "k=1.1N m/rad"])
    assert float(static(mast, branch="plus").state.q[0]) == pytest.approx(1.335237, abs=1e-6)
    with pytest.raises(InputError, match=r"at 1.34, does not diverge.*at -1.34, falls back.*joint.position=-1.34rad"):
        static(mast, branch="minus")


def test_a_column_that_leans_far_bows_to_both_sides():
    """100 mm, 2 deg: tips at (84.66, 27.59) and (-81.2, 37.92) mm by shooting; no load leads to the second."""
    column = apply_settings(COLUMN, ["limbs.column.rotation=[0 deg, -88 deg, 0 deg]", "limbs.column.length=100 mm"])
    for branch, x, z in (("first", 84.66278, 27.58899), ("minus", 84.66278, 27.58899), ("plus", -81.20153, 37.92041)):
        found = static(column, branch=branch)
        assert int(found.status) == Status.SOLVED
        np.testing.assert_allclose(1e3 * tip(found), [x, z], atol=1e-3)


def test_a_vane_that_leads_falls_to_both_sides_with_the_states_of_its_lift():
    """A foil ahead of its hinge diverges; shapes beside it are where long simulations come to rest, states included."""
    vane = parse_robot(
        "name: vane\nwater: {density: 1000 kg/m3, gravity: 0 m/s2, current: [-1 m/s, 0.02 m/s, 0 m/s]}\n"
        "body: {kind: rigid, shape: box, length: 200 mm, width: 3 mm, height: 60 mm, mass: 0.1 kg, loads: {lift: "
        "{kind: foil, span_along: z, ahead: x, chord: 100 mm, thickness: 4 mm}}, joint: {kind: revolute, axis: z, "
        "stiffness: 0.3 N m/rad, damping: 0.2 N m s/rad}}"
    )
    first = static(vane, branch="first")
    assert int(first.status) == Status.UNSTABLE and first.stability.kind == "diverges"
    for branch, side in (("plus", 1), ("minus", -1)):
        run = simulate(
            with_values(vane, {"body.joint.position": 0.3 * side}),
            60.0,
            samples=2,
            rtol=1e-7,
            atol=1e-9,
            method="implicit",
        )
        rests = static(vane, branch=branch)
        assert int(rests.status) == Status.SOLVED
        assert side * float(rests.state.q[0]) > 1
        np.testing.assert_allclose(rests.state.q, run.value.state.q[-1], atol=1e-6)
    assert float(static(vane).state.q[0]) > 1  # from its start, across the stream's side


def test_a_shape_that_it_fell_into_snaps_over_at_its_limit_point():
    """With the angle a from upright, k (a - 1 deg) = m g L/2 sin a + F L cos a: F has an extreme on each side."""
    mast = parse_robot(MAST)

    def force(a: float) -> float:
        return (a - np.radians(1) - 0.5 * 0.3 * 9.81 * np.sin(a)) / np.cos(a)

    least = minimize_scalar(force, bounds=(0.1, 1.4), method="bounded", options={"xatol": 1e-10}).fun
    most = -minimize_scalar(lambda a: -force(a), bounds=(-1.4, -0.1), method="bounded", options={"xatol": 1e-10}).fun
    for between, value in (("-0.9..0N", least), ("-2..0.5N", most)):  # from the end at which it rests on that side
        found = critical(mast, "F", between, samples=4)
        assert found.kind == "divergence"
        assert found.value == pytest.approx(value, rel=1e-5)
    with pytest.raises(InputError, match="stable at 0 N and at 500 mN, and between"):
        critical(mast, "F", "0..0.5N", samples=3)


def test_shapes_that_a_leaning_mast_falls_into_tell_its_stiffness():
    """k (a - 1 deg) = m g L/2 sin a, on the side to which it leans."""
    mast, lean, masses = parse_robot(MAST), np.radians(1), np.array([0.15, 0.3, 0.5])
    angles = [brentq(lambda a, m=m: 1.1 * (a - lean) - 0.5 * 9.81 * m * np.sin(a), 1.1 * lean, 3.0) for m in masses]
    given = {"time": None, "mass": (masses, "kg"), "x": 0.5 * np.sin(angles), "z": 0.5 * np.cos(angles)}
    compare = {"x": "body.tip.position.x", "z": "body.tip.position.z"}
    found = identify(mast, [given], vary={"k": (0.7, 1.5)}, compare=compare, drive={"mass": "m"}, starts=1)
    assert found.theta[0] == pytest.approx(1.1, rel=1e-6)
    assert not found.warnings


@pytest.mark.slow
def test_a_buckled_column_tells_its_stiffness_and_where_the_straight_one_buckles():
    """E from shapes by shooting; upright it buckles at L^3 = 7.8373 E I/w (Greenhill 1881).

    With its lean, an unstable shape beside it begins at 90.41 mm, where the rate at the tip for all rates at the foot
    towards the other side first comes to 0.
    """
    small = apply_settings(COLUMN, ["limbs.column.strains={bending_y: 5}", "limbs.column.points=14"])
    lengths = np.array([0.105, 0.12])
    x, z = np.transpose([shot(1, length) for length in lengths])
    found = identify(
        small,
        [{"time": None, "length": (lengths, "m"), "x": x, "z": z}],
        vary={"limbs.column.young": "0.6..1.6MPa"},
        compare={"x": "column.tip.position.x", "z": "column.tip.position.z"},
        drive={"length": "limbs.column.length"},
        starts=1,
    )
    assert found.theta[0] == pytest.approx(1e6, rel=1e-3)
    upright = apply_settings(small, ["limbs.column.rotation=[0 deg, -90 deg, 0 deg]"])
    straight = critical(upright, "limbs.column.length", "60..140mm", samples=9)
    assert straight.value == pytest.approx((7.8373 * STIFF / WEIGHT) ** (1 / 3), rel=1e-4)

    def nearest(length: float) -> float:
        return -minimize_scalar(lambda b: -bowed(b, length)[1], bounds=(-8, -0.2), method="bounded").fun

    leaning = critical(small, "limbs.column.length", "60..140mm", samples=9)
    assert leaning.value == pytest.approx(brentq(nearest, 0.09, 0.091), rel=1e-4)


def test_a_column_pinned_by_a_stiff_bushing_bows():
    """Clamped to a slide that 6.66 mN push down, its foot pinned: 1.05 of 20.19 E I/L^2, 26.25 mm down by shooting."""
    column = parse_robot(
        """
name: clamped and pinned
water: {gravity: 0 m/s2, density: 1 kg/m3}
body:
  kind: rigid
  shape: point
  mass: 10 g
  joint: {kind: prismatic, axis: z, position: 200 mm, damping: 0.1 N s/m}
  loads: {push: {kind: force, force: [0 N, 0 N, -6.66 mN]}}
limbs:
  foot: {on: world, kind: rigid, shape: point, mass: 1 g, joint: {kind: fixed}}
  rod: {on: body, kind: rod, rotation: [0 deg, 90 deg, 0 deg], section: circle, radius: 2 mm, length: 200 mm,
    young: 1 MPa, density: 1100 kg/m3, damping: 1 kPa s, strains: {bending_y: 6}, points: 24}
pairs:
  pin: {kind: bushing, between: [rod, foot], at: [tip, root], stiffness: 1 kN/m, damping: 0.1 N s/m}
"""
    )
    for branch in ("plus", "minus"):
        found = static(column, branch=branch)
        assert int(found.status) == Status.SOLVED
        assert 0.2 - float(found.state.q[0]) == pytest.approx(0.026246, rel=3e-3)
