import re
from html import escape

import numpy as np
import plotly.graph_objects as go
import pytest
from tests.made_up_runs import made_up_run, unpacked
from tests.studies import made_up_designs as made_up

from nectosome.view.style import dress
from nectosome_studies.flagellum import figures as flagellum
from nectosome_studies.flagellum import figures_landscape as landscape
from nectosome_studies.flagellum import figures_prototype as prototype
from nectosome_studies.flagellum import figures_search as search
from nectosome_studies.flagellum.axes import LineEnd, label_ends, log_ticks
from nectosome_studies.report import write_figures, write_report

FIGURES = list(made_up.everything())


def traces(panel, **match):
    """Traces of a figure whose attributes are these."""
    found = [t for t in panel.figure.data if all(getattr(t, key) == value for key, value in match.items())]
    assert found
    return found


def nowhere(dataset):
    """The same dataset where nothing was found."""
    return dataset.map(lambda v: v * np.nan if v.dtype.kind == "f" else v, keep_attrs=True)


def test_without_data_there_are_no_panels():
    assert flagellum.panels({}, {}) == []
    assert flagellum.panels({"unknown": made_up.pool()}, {"row2": made_up_run()}) == []


@pytest.mark.parametrize("name", FIGURES)
def test_each_dataset_gets_its_figure(name, study, tmp_path):
    study.data = {name: made_up.everything()[name]}
    write_figures([study], tmp_path)
    assert len(list(tmp_path.glob("*.html"))) == 7 + (2 if name == "map" else 1)  # seven of the runs
    assert (tmp_path / "worm-8.html").stat().st_size < 3e5


def test_the_report_draws_data_after_runs(study, tmp_path):
    study.data = made_up.everything()
    study.runs |= {f"iteration{k}": made_up_run() for k in (1, 5, 20)} | {"optimum": made_up_run(0.7)}
    write_report([study], tmp_path)
    page = (tmp_path / "worm.html").read_text(encoding="utf-8")
    page = page[page.index("</script>\n</head>") :]
    assert page.count("<figure>") == page.count("<figcaption>") == 7 + 2 + len(FIGURES) + 1  # two maps
    heads = [page.index(f"<h3>{escape(p.title)}</h3>") for p in flagellum.panels(study.data, study.runs)]
    assert heads == sorted(heads)
    assert page.index("<h3>Four flagella on one canister") < page.index("<h3>The optimum beside the old design")
    assert "Sensitivity of the optimum &lt;new&gt;" in page and "Table &lt;II&gt;" in page
    assert "<new>" not in page and "<II>" not in page


@pytest.mark.parametrize("name", FIGURES)
def test_where_nothing_was_found_the_figure_is_empty(name, tmp_path, study):
    study.runs, study.data = {}, {name: nowhere(made_up.everything()[name])}
    write_figures([study], tmp_path)
    assert (tmp_path / "worm-1.html").exists()


@pytest.mark.parametrize("name", FIGURES)
def test_attributes_may_be_absent(name):
    for panel in flagellum.panels({name: made_up.everything()[name].drop_attrs()}, {}):
        assert "nan" not in panel.caption


def test_starts_are_sorted_and_failures_count():
    starts = made_up.starts()
    panel = search.starts_panel(starts)
    (line,) = traces(panel, name="pattern", showlegend=None)
    speed = starts["speed"].sel(solver="pattern").values
    assert line.y[0] == line.y[1] == np.nanmax(speed) and np.all(np.diff(line.y) <= 0)
    np.testing.assert_allclose(np.sort(line.y[1:]), np.sort(speed[np.isfinite(speed)]))
    assert line.x[-1] == pytest.approx(100 * 34 / 36)
    (dots,) = [t for t in traces(panel, name="gradient", mode="markers") if len(t.x) == 36]
    np.testing.assert_allclose(dots.x, starts["seconds"].sel(solver="gradient").values.ravel())
    assert "pattern: 34 of 36 starts succeeded" in panel.caption
    assert traces(panel, name="paper")[0].x == (19440.0,)


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.25, "0.25 s"), (19.24, "19.2 s"), (100, "1.67 min"), (19440, "5.4 h"), (np.nan, "-")]
)
def test_durations(seconds, text):
    assert search.duration(seconds) == text


def test_history_marks_the_iterations_of_fig_4():
    history = made_up.history()
    panel = search.history_panel(history)
    lines = traces(panel, name="gradient", mode="lines")
    for line, x in zip(lines, (history["iteration"], history["evaluations"].sel(solver="gradient")), strict=True):
        kept = np.isfinite(x.values)
        np.testing.assert_array_equal(line.x, x.values[kept])
        np.testing.assert_array_equal(line.y, history["speed"].sel(solver="gradient").values[kept])
    assert traces(panel, name="gradient", mode="markers")[0].x.tolist() == [1, 5, 20]
    assert traces(panel, name="evolution", mode="markers")[0].x.tolist() == [5, 20]  # none was feasible at 1


def test_the_map_is_white_at_zero_and_true_to_its_data():
    chart = made_up.chart()
    panel = landscape.map_panel(chart)
    axis = panel.figure.layout.coloraxis
    assert axis.cmin == -axis.cmax == pytest.approx(-np.nanmax(np.abs(chart["speed"].values)))
    assert axis.colorscale[3] == (0.5, "#ffffff")
    for i, heat in enumerate(traces(panel, type="heatmap")):
        np.testing.assert_array_equal(heat.z, chart["speed"].isel(design=i).values.T)
        assert len(heat.x) == 19 and len(heat.y) == 23
        assert np.all((heat.y[:-1] < 1e-6 * chart["young"].values) & (1e-6 * chart["young"].values < heat.y[1:]))
    limits = [t for t in traces(panel, type="contour") if t.contours.start == 0.5]
    np.testing.assert_array_equal(limits[1].z, chart["torque"].isel(design=1).values.T)
    (star,) = [t for t in traces(panel, type="scatter") if t.x[0] == 15.1]
    assert star.y[0] == pytest.approx(6.2)


def test_the_map_does_not_mind_the_order_of_dimensions():
    one, other = (
        landscape.map_panel(c) for c in (made_up.chart(), made_up.chart().transpose("young", "omega", "design"))
    )
    for a, b in zip(one.figure.data, other.figure.data, strict=True):
        np.testing.assert_array_equal(a.x, b.x)


@pytest.mark.parametrize("designs", [1, 5])
def test_the_map_takes_any_number_of_designs(designs):
    chart = made_up.chart().isel(design=[0, 1, 2, 0, 1][:designs])
    assert len(traces(landscape.map_panel(chart), type="heatmap")) == designs


def test_the_strongest_variable_is_on_top():
    panel = landscape.sensitivity_panel(made_up.sensitivity())
    speed, torque = traces(panel, type="bar")
    assert speed.y[-1] == "motor speed" and speed.x[-1] == 0.94 and torque.x[-1] == 1.83
    assert speed.text == ("+0.002 %", "+0.05 %", "-0.12 %", "+0.31 %", "+0.94 %")
    assert torque.text[0] == ""


def test_trends_are_in_degrees_millimetres_and_megapascals():
    trend = made_up.trend()
    panel = landscape.trend_panel(trend)
    (young, speed), (tip, _) = traces(panel, name="alpha"), traces(panel, name="tip_radius")
    np.testing.assert_allclose(young.x, np.linspace(20, 70, 8))
    np.testing.assert_allclose(tip.x, np.linspace(1, 8, 8))
    np.testing.assert_allclose(young.y, 1e-6 * trend["young"].values[0])
    np.testing.assert_allclose(speed.y, trend["speed"].values[0])


def test_the_table_of_best_designs_has_its_units():
    text = search.best_panel(made_up.best()).figure
    assert isinstance(text, str)
    row = text.split("<tr>")[2]
    cells = ["700.0", "5.65", "42.30", "14.40", "7.40", "0.790", "0.500"]
    assert [c for c in cells if f">{c}</td>" not in row] == []
    assert text.count('<td class="number">-</td>') == 5 and "nan" not in text


def test_the_best_designs_tell_which_of_them_the_motor_drives():
    best = made_up.best().assign(above_motor_line=("rank", [1e-8, *[0.27] * 4, *[-0.01] * 5]))
    caption = search.best_panel(best).caption
    assert "4 of these 10 designs need more torque than it has at 7.4 V." in caption
    assert "at 22 rad/s, where its motor has no torque at 6 V" in caption


def test_the_composite_marks_the_ratios_of_the_wanted_modulus():
    """0.803 and 0.869 for 7.4 MPa of Ninjaflex and Dragon Skin: the roots of both rules, by hand."""
    panel = prototype.composite_panel(made_up.composite())
    rings = traces(panel, mode="markers")
    assert [r.x[0] for r in rings] == pytest.approx([0.8026, 0.8692], abs=2e-4)
    assert [r.y[0] for r in rings] == pytest.approx([7.4, 7.4])


def test_the_weights_test_says_what_is_synthetic():
    test = made_up.static_test()
    panel = prototype.static_test_panel(test)
    assert "synthetic" in panel.title and "Synthetic" in panel.caption
    line, dots = traces(panel, name="weight high, 0.1 N")
    np.testing.assert_allclose(line.x, 1e3 * test["fitted"].sel(case="high", axis="x"))
    np.testing.assert_allclose(dots.y, 1e3 * test["measured"].sel(case="high", axis="z"))
    (estimate,) = traces(panel, name="estimate")
    assert estimate.error_y.array[0] == pytest.approx(0.26) and estimate.error_y.arrayminus[0] == pytest.approx(0.24)
    test.attrs["synthetic"] = "no"
    assert "ynthetic" not in "".join(prototype.static_test_panel(test)[:2])


def test_the_pool_names_calibration_and_prediction():
    ours = traces(prototype.pool_panel(made_up.pool()), name="ours, simulated")[0]
    assert ours.x == ("old design<br>(calibration)", "optimal design<br>(prediction)")
    assert ours.y[0] == 0.160 and ours.text == ("0.160", "")


def test_text_of_a_dataset_is_no_markup():
    panel = landscape.map_panel(made_up.chart())
    assert "optimum &lt;new&gt;" in [a.text for a in panel.figure.layout.annotations]


def test_the_optimum_stands_beside_what_was_run():
    runs = {"old_soft": made_up_run(0.3), "optimum": made_up_run(0.7)}
    (panel,) = flagellum.panels({}, runs)
    shown = unpacked(panel.figure.recordings[""])
    assert b"old design: 0.300 m/s" in shown and b"for 0.5 N m at any speed: 0.700 m/s" in shown
    assert {int(k) for k in re.findall(rb"/world/(\d)-filament", shown)} == {0, 1}
    assert flagellum.panels({}, {"optimum": made_up_run()}) == []
    (panel,) = flagellum.panels({}, {f"iteration{k}": made_up_run() for k in (1, 5, 20)})
    assert panel.title == "Designs of one search"


def test_the_torque_map_shows_torques_by_their_exponent():
    chart = made_up.everything()["map"]
    panel = landscape.torque_panel(chart)
    torque = chart["torque"].transpose("design", "young", "omega").values
    heat = [trace for trace in panel.figure.data if trace.type == "heatmap"]
    for shown, wanted in zip(heat, torque, strict=True):
        positive = wanted > 0
        np.testing.assert_allclose(10.0 ** np.asarray(shown.z)[positive], wanted[positive])
        assert np.all(np.isnan(np.asarray(shown.z, dtype=float)[~positive]))


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
    fig = dress(go.Figure(go.Scatter(x=[0, 1], y=[0, 1])), 300)
    label_ends(fig, [LineEnd(v, str(v), "#000000") for v in (0.5, 0.501, 0.9, 0.502)], (0, 1), 200)
    places = sorted(200 * a.y for a in fig.layout.annotations)  # pyright: ignore[reportAttributeAccessIssue]
    assert np.min(np.diff(places)) >= 15 - 1e-9


def test_logarithmic_ticks_are_few():
    assert log_ticks([np.nan, 0.0]) == {}
    for high in (2, 30, 1200, 1e6):
        shown = [t for t in log_ticks([1, high])["tickvals"] if 1 <= t <= high]
        assert 2 <= len(shown) <= 10
