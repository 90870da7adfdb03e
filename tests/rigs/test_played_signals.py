"""Signals of a plan against their formulas, and what they do before they begin and after they end."""

import math
from pathlib import Path

import numpy as np
import pytest

from nectosome.rigs.played_signals import (
    PlayedChirp,
    PlayedFile,
    PlayedMultisine,
    PlayedSine,
    PlayedStep,
    Playing,
    crest_phases,
)
from nectosome.units import InputError

PLAYING = Playing("rad", 4.0, Path())


def played(kind, t, playing=PLAYING, **fields):
    values = {name: value[0] if isinstance(value, list) else value for name, value in fields.items()}
    signal = kind.model_validate({"kind": kind.model_fields["kind"].annotation.__args__[0], **fields})
    defaults = {name: x[0] if isinstance(x := getattr(signal, name), tuple) else x for name in kind.model_fields}
    return signal.wave(defaults | values, playing)(np.asarray(t, float))


def test_a_step_is_its_height_and_a_sine_its_formula():
    t = np.linspace(-1, 5, 13)
    np.testing.assert_allclose(played(PlayedStep, t, height="30 deg"), math.pi / 6, rtol=1e-15)
    found = played(PlayedSine, t, amplitude="20 deg", frequency=0.7, offset="-5 deg", phase=0.3)
    np.testing.assert_allclose(
        found, math.radians(20) * np.sin(2 * math.pi * 0.7 * t + 0.3) - math.radians(5), atol=1e-15
    )


def test_a_chirp_goes_from_its_first_to_its_last_frequency_and_keeps_them_outside():
    """Turns are the integral of 0.5 Hz (2/0.5)^(t/T) within."""
    t = np.linspace(-1, 5, 6001)
    found = played(PlayedChirp, t, amplitude="1 rad", frequency=0.5, to=2.0)
    turns = np.where(t < 0, 0.5 * t, 0.5 * np.expm1(np.log(4) * np.clip(t, 0, 4) / 4) * 4 / np.log(4))
    turns = turns + 2.0 * np.maximum(t - 4, 0)
    np.testing.assert_allclose(found, np.sin(2 * math.pi * turns), atol=1e-9)


def test_a_multisine_has_its_lines_alone_all_of_one_size_and_its_peak():
    """32 lines from 0.25 to 8 Hz over one period of 4 s: the spectrum has these and no others."""
    t = np.arange(4000) / 1000
    found = played(PlayedMultisine, t, amplitude="10 deg", frequency=0.25, to=8.0)
    sizes = np.abs(np.fft.rfft(found)) / 2000
    assert sizes[1:33] == pytest.approx(sizes[1], rel=1e-9)
    assert np.abs(sizes[[0, *range(33, len(sizes))]]).max() < 1e-12
    assert np.abs(found).max() == pytest.approx(math.radians(10), rel=2e-3)
    np.testing.assert_allclose(
        played(PlayedMultisine, t + 4, amplitude="10 deg", frequency=0.25, to=8.0), found, atol=1e-9
    )


def test_its_crest_factor_is_low_and_its_phases_are_those_of_its_seed():
    """All phases alike give sqrt(2 n) = 8; random ones about 3; the best of 200 draws are below 2.3."""
    phases = crest_phases(32, 1)
    t = np.arange(2048) / 2048
    found = sum(np.cos(2 * math.pi * k * t + phase) for k, phase in enumerate(phases, start=1))
    assert np.abs(found).max() / np.sqrt(np.mean(found**2)) < 2.3
    np.testing.assert_array_equal(phases, crest_phases(32, 1))
    assert not np.array_equal(phases, crest_phases(32, 2))


def test_a_recorded_column_is_played_in_its_unit_and_stays_at_its_ends(tmp_path):
    (tmp_path / "run.csv").write_text("t (s),angle (deg)\n10,0\n11,90\n12,45\n")
    playing = Playing("rad", 2.0, tmp_path)
    found = played(PlayedFile, [-1, 0, 0.5, 1, 2, 3], playing, file="run.csv", factor=[2.0])
    np.testing.assert_allclose(found, np.radians([0, 0, 90, 180, 90, 90]), atol=1e-12)


def test_another_unit_is_refused_with_its_field():
    with pytest.raises(InputError, match="is in m, and rad is needed") as told:
        played(PlayedSine, [0.0], amplitude="2 mm", frequency=1.0)
    assert told.value.field == "amplitude"
