"""Foils that flap: the measured wing's data, theory for the lattice and the foil, and how a beat is replayed."""

from dataclasses import replace

import numpy as np
import pytest

from nectosome.units import InputError
from nectosome_studies.vortex.cases import CASES, heaving_and_pitching, long_foil, rectangle, theodorsen_heave, tuna_fin
from nectosome_studies.vortex.flapping import PHASES, harmonic, periodic_curve, rms
from nectosome_studies.vortex.kept import keep, kept
from nectosome_studies.vortex.lattice import lattice
from nectosome_studies.vortex.replay import ATTACHED, replay
from nectosome_studies.vortex.rows import THIRDS
from nectosome_studies.vortex.wing import flap, measured, wing


@pytest.fixture(scope="module")
def flapped():
    return replay(wing())


def test_the_wing_is_the_one_of_the_paper():
    """213 mm by 72 mm at its root; its flap goes up first, as digitised positions do: 2.9, 22.96, -17.34
    deg at the phases 0, 0.25 and 0.75, within what its Fourier series leaves."""
    beat = wing()
    assert beat.planform.x[-1] == 0.213
    assert beat.planform.trailing[0] - beat.planform.leading[0] == pytest.approx(0.072, abs=1e-6)
    assert beat.planform.trailing[-1] - beat.planform.leading[-1] < 0.003
    seen = np.rad2deg(flap(np.array([0.0, 0.25, 0.75])))
    assert seen == pytest.approx([2.94, 22.96, -17.34], abs=3.0)


def test_rectangles_of_the_points_cover_the_wing():
    """Their areas, 24 587 mm2 on both wings, are those of the outline within half a percent."""
    lift = measured().lift
    assert lift.shape == (PHASES, 3)
    assert 2 * wing().planform.area == pytest.approx(0.0245874, rel=5e-3)


def test_measured_lift_is_that_of_its_digitiser():
    """Root mean square of 0.0715 N, 0.3 % below what his script prints with the time in place of the phase's angle."""
    lift = measured().total
    assert rms(lift) == pytest.approx(0.07164, rel=5e-3)
    assert lift[PHASES // 2] > 0.09 > -0.06 > lift[0]  # in the middle of the downstroke, and of the upstroke


def test_the_wing_lifts_in_phase_with_what_was_measured_and_too_much(flapped):
    """Nothing fitted: the phase within 5 deg; the amplitude a third more, and right at the points' places."""
    ours, theirs = harmonic(flapped.total), harmonic(measured().total)
    assert abs(np.angle(ours / theirs)) < np.deg2rad(5.0)
    assert 1.2 < abs(ours / theirs) < 1.4
    assert THIRDS * abs(ours / theirs) == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_bands_of_the_wing_are_one_wing(flapped):
    """Cut in three or not, the same lift, thrust and power: to the quadrature over the span."""
    whole = replay(replace(wing(), bands=()))
    assert flapped.total == pytest.approx(whole.total, abs=0.01 * np.ptp(whole.total))
    assert flapped.thrust.mean() == pytest.approx(whole.thrust.mean(), rel=0.02)
    assert flapped.power.mean() == pytest.approx(whole.power.mean(), rel=0.02)


def test_a_long_foil_heaves_as_theodorsen_says():
    """Within 3 %: of A = 80 the lift slope is 2.5 % less than that of an endless one."""
    beat = long_foil()
    found = harmonic(replay(beat, **ATTACHED).total) / beat.planform.x[-1]
    assert abs(found - theodorsen_heave(beat)) < 0.03 * abs(found)


@pytest.mark.slow
def test_what_a_foil_takes_is_what_it_gives_and_leaves_in_the_wake():
    """Attached, without friction, power is more than thrust times speed, and never negative on the mean."""
    beat = heaving_and_pitching()
    forces = replay(beat, **ATTACHED)
    useful = forces.thrust.mean() * beat.speed
    assert 0 < useful < forces.power.mean()


@pytest.mark.slow
def test_the_mean_force_does_not_depend_on_where_a_beat_begins():
    """Neither does its power: half a beat later is the mirror image."""
    beat = heaving_and_pitching()
    half = replace(beat, heave=-beat.heave, angle=-beat.angle)
    one, other = replay(beat), replay(half)
    assert one.total == pytest.approx(-other.total, abs=1e-6)
    assert one.power == pytest.approx(other.power, abs=1e-6)
    assert np.roll(one.total, PHASES // 2) == pytest.approx(other.total, abs=0.01)


def test_the_tuna_file_holds_a_beat_that_closes():
    beat = tuna_fin()
    for curve in (beat.angle, beat.heave, beat.surge):
        smooth = periodic_curve(curve)
        assert abs(smooth(1.0) - smooth(0.0)) < 1e-12
        assert np.abs(np.diff(curve, append=curve[:1])).max() < 0.08 * np.ptp(curve) + 1e-3
    assert beat.aspect_ratio == pytest.approx(150 / 55)


def test_kept_forces_are_there_for_every_case_and_can_be_kept_again(tmp_path):
    made, forces = kept()
    assert made.startswith("PteraSoftware 5.") and set(forces) == set(CASES)
    keep(tmp_path, made, forces)
    for one in forces.values():
        assert abs(one.strip_lift.sum() - harmonic(one.lift)) < 1e-3 * np.ptp(one.lift)
        assert one.strip_thrust.sum() == pytest.approx(one.thrust.mean(), rel=1e-3, abs=1e-6)
        edges = (0.0, 0.3 * one.ends[-1], one.ends[-1])
        assert abs(one.by_bands(edges).sum() - one.strip_lift.sum()) < 1e-12 + 1e-9 * np.ptp(one.lift)
    text = (tmp_path / "lattice_beats.csv").read_text(encoding="utf-8")
    assert text.startswith("# PteraSoftware") and text.count("\n") == 2 + len(CASES) * PHASES


def test_without_the_package_the_lattice_says_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pterasoftware", None)
    with pytest.raises(InputError, match=r"pip install './nectosome/studies\[vortex\]'"):
        lattice(replace(long_foil(), planform=rectangle(1.0, 0.1)))
