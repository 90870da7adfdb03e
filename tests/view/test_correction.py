"""Figures of a correction, of made-up numbers."""

import numpy as np
import pytest
import xarray as xr

from nectosome.view import corrected_grid as correction


def corrected(over, *, errors=True):
    """What `identify.corrected_data` gives, made up."""
    coords = {
        "A": ("A", np.radians([30.0, 45.0, 60.0, 75.0]), {"units": "rad"}),
        "f": ("f", [0.5, 1.1], {"units": "Hz"}),
    }
    coords["L"] = ("L", [0.1, 0.2, 0.3], {"units": "m"})
    shape = [len(coords[name][1]) for name in over]
    force = xr.DataArray(np.arange(1.0, 1 + np.prod(shape)).reshape(shape), dims=over, attrs={"units": "N"})
    error = (0.1 * force if errors else np.nan * force).assign_attrs(units="N")
    there = ("experiment", [1.0, 2.0, 3.0], {"units": "N"})
    at = {
        f"measured_{k}": ("experiment", coords[k][1][[0, 1, 1]] if k == "A" else [coords[k][1][0]] * 3, coords[k][2])
        for k in over
    }
    later = {f"next_{k}": ("next", [coords[k][1][-1]], coords[k][2]) for k in over}
    return xr.Dataset(
        {
            "force": force,
            "force_error": error,
            "simulated": 2 * force,
            "parameter": (0.1 * force).assign_attrs(units=""),
            **dict.fromkeys(("measured", "simulated_there", "predicted"), there),
            **dict.fromkeys(("measured_error", "predicted_error"), there),
            "expected": ("next", [4.0]),
            "expected_error": ("next", [0.5]),
        },
        {k: coords[k] for k in over} | at | later,
        {
            "title": "a <b>",
            "quantity": "force",
            "parameter": "Cn",
            "nominal": 1.0,
            "method": "gp",
        },
    )


def titles(found):
    return [panel.title for panel in correction.panels(found)]


def test_there_are_maps_of_two_conditions_and_a_curve_of_one():
    maps = ["Corrected grid", "What is not known", "The simulator's parameter"]
    assert titles(corrected(["A", "f"])) == [*maps, "Predicted and measured"]
    assert titles(corrected(["A", "f"], errors=False)) == [maps[0], maps[2], "Predicted and measured"]
    assert titles(corrected(["A"])) == ["Corrected curve", "Predicted and measured"]
    assert titles(corrected(["A", "f", "L"])) == ["Predicted and measured"]


@pytest.mark.parametrize("aim", ["highest", "lowest"])
def test_experiments_lie_on_the_map_in_degrees(aim):
    figure = correction.panels(corrected(["A", "f"]), aim)[0].figure
    marks = {trace.name: trace for trace in figure.data if trace.type == "scatter" and trace.showlegend}
    np.testing.assert_allclose(marks["measured"].x, [30, 45, 45])
    np.testing.assert_allclose([marks["next"].x, marks["next"].y], [[75], [1.1]])
    np.testing.assert_allclose([marks[aim].x, marks[aim].y], [[30], [0.5]] if aim == "lowest" else [[75], [1.1]])
    assert figure.layout.xaxis.title.text == "A (deg)"
    assert figure.layout.coloraxis.cmax == 16


def test_bars_and_bands_are_those_of_95_percent():
    curve, scatter = (panel.figure for panel in correction.panels(corrected(["A"])))
    bars = next(trace for trace in scatter.data if trace.error_x.array is not None)
    np.testing.assert_allclose(bars.error_x.array, [1.96, 3.92, 5.88], rtol=2e-5)
    band = next(trace for trace in curve.data if trace.fill == "toself")
    np.testing.assert_allclose(band.y[:4], np.arange(1, 5) * 1.196, rtol=2e-5)


def test_a_page_is_written_with_what_looks_like_tags_kept_harmless(tmp_path):
    correction.show_correction(corrected(["A", "f"]), tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "a &lt;b&gt;" in page
    assert "a <b>" not in page
