"""The fishtail: what Table 1 says with a0 and a2 exchanged, eq. 1, and the study on fewer recordings."""

import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.drives import Chain, TransferFunction, inverse, respond
from nectosome.identification.fits.errors import range_errors
from nectosome_studies.fishtail import fit, plant
from nectosome_studies.fishtail.figures import panels
from nectosome_studies.study import printed


def gain_at(block, frequency):
    """Displacement by pressure under a slow or fast sine, once it has settled, against that of 0.001 Hz."""
    phase = 2 * np.pi * np.arange(6 * 400 + 1) / 400
    y = np.asarray(respond(block, plant.LARGEST * np.sin(phase), 1 / (400 * frequency)))
    return np.ptp(y[-401:])


def test_table_1_makes_sense_once_two_of_its_numbers_are_exchanged():
    """18.65 rad/s, damping 1.008, -3 dB at 1.9 Hz; as printed it follows nothing at the frequencies of the paper."""
    assert pytest.approx(18.650, abs=1e-3) == plant.FREQUENCY
    assert pytest.approx(1.008, abs=1e-3) == plant.DAMPING
    right, slow = plant.plant(), TransferFunction(jnp.array(plant.A[:1]), jnp.array(plant.A[::-1]))
    wrong = Chain((plant.hysteresis(), slow))
    assert gain_at(right, 1.9) / gain_at(right, 1e-3) == pytest.approx(np.sqrt(0.5), abs=0.02)
    assert gain_at(wrong, 1.9) / gain_at(right, 1e-3) < 0.005
    assert gain_at(slow, 0.0054) / gain_at(slow, 1e-5) == pytest.approx(np.sqrt(0.5), abs=0.02)
    moving = plant.B0 * plant.WEIGHTS[:-1].sum()
    assert moving / plant.A[2] == pytest.approx(40.361, abs=1e-3)  # mm/bar
    assert moving / plant.A[0] == pytest.approx(14.0e3, rel=5e-3)  # with a0 as printed


def test_its_hysteresis_has_an_inverse():
    p = plant.waves(0.5, 0.01)
    hysteresis = plant.hysteresis()
    back = respond(inverse(hysteresis), respond(hysteresis, p, 0.01), 0.01)
    np.testing.assert_allclose(back, p, atol=1e-9 * plant.LARGEST)


def test_waves_are_those_of_equation_1():
    """Four periods of 0.3 to 0.6 bar, each from 0 to 0."""
    p = plant.waves(0.5, 0.001)
    assert len(p) == 8001
    peaks = [np.abs(p[2000 * j : 2000 * (j + 1)]).max() / plant.BAR for j in range(4)]
    np.testing.assert_allclose(peaks, [0.3, 0.4, 0.5, 0.6], rtol=1e-6)
    np.testing.assert_allclose(p[::2000], 0, atol=1e-9 * plant.LARGEST)


def test_errors_are_shares_of_the_range():
    """Eqs. 7 and 8, with the magnitude that eq. 8 lacks."""
    assert range_errors(np.array([1.0, -1.0]), np.array([0.0, 2.0])) == pytest.approx((100 * np.sqrt(5) / 2, 150.0))


def test_loops_grow_from_the_area_of_their_plays(monkeypatch):
    """At 1 mHz the dynamics add next to nothing; at 3 Hz they are an ellipse, pi/4 of its box."""
    monkeypatch.setattr(fit, "_AREAS", np.array([1e-3, 0.1, 1.0, 3.0]))
    found = fit.areas()["area"].values
    assert np.all(np.diff(found) > 0)
    p = plant.LARGEST * np.sin(np.linspace(0, 4 * np.pi, 8001))
    y = np.asarray(respond(plant.hysteresis(), p, 1.0))[4000:]
    still = -np.trapezoid(y, p[4000:]) / (np.ptp(p) * np.ptp(y))
    assert found[0] == pytest.approx(still, rel=0.05)
    assert found[-1] == pytest.approx(np.pi / 4, rel=0.02)


@pytest.fixture(scope="module")
def made():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fit, "TRAIN", (0.75, 1.5))
        patch.setattr(fit, "STARTS", 3)
        patch.setattr(fit, "_AREAS", np.array([0.5, 1.0]))
        return fit.part(False, lambda what, share: None)


@pytest.mark.slow
def test_the_study_gets_back_what_made_its_recordings(made):
    """With the valve's limit fitted; what it leaves is the noise, 0.05 mm, in percent of some 42 mm."""
    numbers = made.numbers
    assert numbers["fishtail/table1/omega_n"] == pytest.approx(plant.FREQUENCY, rel=2e-3)
    assert numbers["fishtail/table1/zeta"] == pytest.approx(plant.DAMPING, rel=5e-3)
    assert numbers["fishtail/table1/gain"] == pytest.approx(
        printed("fishtail")["fishtail/table1/gain"]["printed"], rel=5e-3
    )
    assert numbers["fishtail/identify/starts"] == 100
    assert numbers["fishtail/table1/c10"] == 0
    for name in ("train", "val08", "val09"):
        assert 0.11 < numbers[f"fishtail/identify/valve/{name}/e_rmsp"] < 0.13
        assert numbers[f"fishtail/identify/{name}/e_rmsp"] > 3 * numbers[f"fishtail/identify/valve/{name}/e_rmsp"]


@pytest.mark.slow
def test_the_study_has_all_rows_and_figures(made):
    rows = {row for row in printed("fishtail") if not row.startswith("fishtail/tracking/")}
    assert set(made.numbers) == rows
    drawn = panels(made.data)
    assert drawn[0].title == "Loops of displacement over pressure"
    assert "11" in drawn[-1].caption
