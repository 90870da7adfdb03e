import numpy as np
import pytest

from nectosome.papers.flagellum import figures as flagellum
from nectosome.view import series
from nectosome.view.style import LineEnd, dress, label_ends, span

from .conftest import OMEGA, made_up_run


def test_speed_is_forward_and_the_turn_is_that_of_the_drive(run):
    assert series.steady_speed(run) == pytest.approx(0.5)
    assert series.drive_rate(run) == pytest.approx(OMEGA)
    start, end = series.last_turn(run)
    assert (start, end) == pytest.approx((1 - 2 * np.pi / OMEGA, 1))


def test_without_a_drive_the_last_fifth_counts(run):
    passive = run.isel(prescribed=slice(0))
    assert series.last_turn(passive) == pytest.approx((0.8, 1.0))
    assert list(series.powers(passive)) == ["drag"]


def test_thrust_along_the_filament_is_positive_forward(run):
    """A force of 2 N/m along -x gives 2 N/m of thrust, and its sum the load's force on the part."""
    x, forces = flagellum.along_filament(run)
    np.testing.assert_allclose(forces["drag"], np.tile([2.0, 0, 0], (3, 1)), atol=1e-12)
    assert flagellum.total_thrust(run) == pytest.approx(2 * run["station_weight"].values.sum())
    assert len(x) == 3


def test_forces_turn_with_the_station():
    """A force along a section's own y points around the axis or outwards, not along it."""
    run = made_up_run()
    run["position"][:, 1:, 1:] += run["rotation"].values[:, 1:, 1:, 1] * 0.1  # the rod lies 0.1 m along its own y
    run["line_force"] = run["line_force"].copy(data=np.where(np.isnan(run["line_force"]), np.nan, [0, 3.0, 4.0]))
    _, forces = flagellum.along_filament(run)
    np.testing.assert_allclose(forces["drag"], np.tile([0, 3.0, 4.0], (3, 1)), atol=1e-12)


def test_labels_do_not_touch():
    import plotly.graph_objects as go

    fig = dress(go.Figure(go.Scatter(x=[0, 1], y=[0, 1])), 300)
    label_ends(fig, [LineEnd(v, str(v), "#000000") for v in (0.5, 0.501, 0.9, 0.502)], (0, 1), 200)
    places = sorted(200 * a.y for a in fig.layout.annotations)  # pyright: ignore[reportAttributeAccessIssue]
    assert np.min(np.diff(places)) >= 15 - 1e-9


def test_span_ignores_what_is_no_number():
    assert span([np.nan, 1, 3], room=0.5) == (0, 4)
    assert span([np.nan]) == pytest.approx((-0.08, 1.08))
    assert span([2.0, 2.0]) == pytest.approx((1.9, 2.1))
