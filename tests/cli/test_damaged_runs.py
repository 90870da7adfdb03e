"""Runs that others made or damaged: whatever is missing or odd in them, commands draw them or say why in a sentence."""

import numpy as np
import pytest

from nectosome.io import load_dataset
from nectosome.units import InputError
from nectosome.view.saved import check_drawable, saved_run


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("position", 1e308, "beyond"),
        ("station_x", 1e308, "beyond"),
        ("half_width", -1e12, "beyond"),
        ("rotation", -1.0, "determinant"),
        ("rotation", 0.0, "determinant"),
        ("rotation", 1e308, "beyond"),
        ("position", np.nan, "not finite"),
    ],
)
def test_places_that_cannot_be_drawn_are_refused(ball_run, name, value, words):
    run = saved_run(load_dataset(ball_run), "run.nc")
    check_drawable(run, "run.nc")
    variable = run[name].copy(data=np.full(run[name].shape, value))
    changed = run.assign_coords({name: variable}) if name in run.coords else run.assign({name: variable})
    with pytest.raises(InputError, match=rf"^run\.nc: its {name} .*{words}"):
        check_drawable(changed, "run.nc")
