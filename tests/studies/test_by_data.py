"""Studies without code: rows of a `replay.toml`, figures of a `figures.toml`."""

import numpy as np
import pytest
import xarray as xr
from tests.small_robots import BALL, SLIDE

from nectosome.units import InputError
from nectosome_studies import catalogue, charts, replay, study
from nectosome_studies.evaluate import Names, filled, value_of

ROW = 'quantity = "speed"\nunit = "m/s"\nkind = "prediction"\nsource = "measured"\ntolerance = 1.0\n'


@pytest.fixture
def worm(monkeypatch, tmp_path):
    """Files of a study called `worm`, and how it is found."""
    folder = tmp_path / "worm"
    folder.mkdir()
    for module in (study, replay, catalogue):
        monkeypatch.setattr(module, "FOLDER", tmp_path)

    def made(**files: str):
        (folder / "study.toml").write_text('title = "Worm"\nabout = "It sinks."\nminutes = 0.5\n')
        for name, text in files.items():
            (folder / name.replace("_", ".")).write_text(text)
        (entry,) = catalogue.studies().values()
        return entry, entry.run(False, lambda what, share: None)

    return made


def test_a_study_is_three_files(worm):
    """The ball keeps sqrt(2 (1200 - 1000) V g / (1000 * 1.2e-3)) with V = 4/3 pi 20 mm^3."""
    speed = np.sqrt(2 * 200 * 4 / 3 * np.pi * 0.02**3 * 9.80665 / 1.2)
    entry, done = worm(
        ball_yaml=BALL,
        replay_toml='robot = "ball.yaml"\n[runs.sinks]\ntime = "8 s"\nread = {v = "velocity.z", z = "position.z"}\n',
        printed_toml=f'["worm/speed"]\n{ROW}printed = {speed}\nours = "-sinks.v[-1]"\n',
    )
    (row,) = done.rows
    assert row["ours"] == pytest.approx(speed, rel=1e-3) and row["verdict"] == "match"
    assert (entry.minutes, done.title, done.name) == (0.5, "Worm", "worm")
    (panel,) = done.figures(done.data, done.runs)
    assert [trace.name for trace in panel.figure.data] == ["computed", "computed"]
    assert panel.figure.layout.yaxis.title.text == "v (m/s)"


def test_a_row_that_nothing_computes_is_refused(worm):
    files = {"ball_yaml": BALL, "replay_toml": 'robot = "ball.yaml"\n'}
    with pytest.raises(InputError, match=r"worm/printed\.toml, worm/speed: does not say"):
        worm(printed_toml=f'["worm/speed"]\n{ROW}printed = 1.0\n', **files)


def test_recordings_drive_the_robot_and_are_held_against_it(worm):
    """A force of 1 N that begins slowly holds the slide's spring of 5 N/m at 0.2 m; the sensor reads 1 mm too much."""
    t = np.linspace(0, 20, 201)
    force = np.minimum(t / 10, 1.0)
    place = force / 5 + 1e-3
    rows = "\n".join(f"{a:.3f},{b:.6f},{c:.6f}" for a, b, c in zip(t, force, place, strict=True))
    _, done = worm(
        slide_yaml=SLIDE,
        pull_csv=f"time (s),force (N),place (m)\n{rows}\n",
        campaign_yaml="recordings: [{file: pull.csv}]\n",
        replay_toml='robot = "slide.yaml"\ncampaign = "campaign.yaml"\ndrive = {force = "body.joint.force"}\n'
        'compare = {place = "position.x"}\n',
        printed_toml=f'["worm/off"]\n{ROW}printed = 1.0\nours = "1e3 * (pull.measured_place - pull.place)[-1]"\n',
    )
    assert done.rows[0]["ours"] == pytest.approx(1.0, rel=1e-2)
    (panel,) = done.figures(done.data, done.runs)
    assert [trace.name for trace in panel.figure.data] == ["measured", "computed"]


def test_expressions_name_variables_of_a_dataset_and_functions():
    one = xr.Dataset({"x": ("k", [3.0, 4.0])}, attrs={"most": 4})
    names = Names({"set": one}, one)
    assert value_of("sqrt(sum(x**2))", names) == 5 and value_of("rms(set.x - 3)", names) == pytest.approx(0.5**0.5)
    assert filled("{x.max():.1f} m of {attrs['most']}", names) == "4.0 m of 4"
    with pytest.raises(InputError, match=r'"y \+ 1": there is no y'):
        value_of("y + 1", names)
    with pytest.raises(InputError, match="there is no xx"):
        value_of("set.xx", names)


CHART = {"title": "T", "caption": "", "data": "one", "plots": [{"over": "k", "lines": [{"y": "x"}]}]}


@pytest.fixture
def one():
    return xr.Dataset(
        {"x": (("way", "k"), [[1.0, 2.0], [3.0, np.nan]]), "off": ("way", [0.5, 1.5])},
        {"way": ["up", "down"], "k": [0.0, 1.0]},
    )


def test_a_line_for_each_value_of_a_dimension_or_a_plot(one):
    line = {"y": "x", "each": "way", "name": "{value}", "styles": {"down": {"name": "back", "dash": "dash"}}}
    chart = charts.Chart.model_validate(CHART | {"plots": [{"over": "k", "lines": [line]}]})
    traces = charts.panel(chart, {"one": one}).figure.data
    assert [(trace.name, trace.line.dash, trace.y[0]) for trace in traces] == [("up", "solid", 1), ("back", "dash", 3)]
    chart = charts.Chart.model_validate(CHART | {"facets": {"each": "way", "title": "{value}: {off:.1f}"}})
    figure = charts.panel(chart, {"one": one}).figure
    assert [(trace.xaxis, trace.y[0]) for trace in figure.data] == [("x", 1), ("x2", 3)]
    assert [note.text for note in figure.layout.annotations] == ["up: 0.5", "down: 1.5"]


def test_bands_bars_and_levels(one):
    lines = [
        {"y": "x + 1", "low": "x - 1", "kind": "band", "at": {"way": "up"}},
        {"x": "way", "y": "off", "kind": "bars"},
    ]
    plot = {"over": "k", "y": {"log": True, "ticks": [1, 10]}, "lines": lines, "levels": {"most": "off.max()"}}
    figure = charts.panel(charts.Chart.model_validate(CHART | {"plots": [plot]}), {"one": one}).figure
    assert figure.data[0].y.tolist() == [2, 3, 1, 0] and figure.data[1].y.tolist() == [0.5, 1.5]
    assert figure.layout.shapes[0].y0 == 1.5 and figure.layout.yaxis.tickvals == (1, 10)


def test_figures_without_their_data_are_left_out_and_unknown_keys_refused(worm, one):
    entry, _ = worm(
        figures_toml='[[figures]]\ntitle = "T"\ncaption = ""\ndata = "one"\n'
        '[[figures.plots]]\nlines = [{x = "k", y = "x[0]"}]\n',
        ball_yaml=BALL,
        replay_toml='robot = "ball.yaml"\n',
        printed_toml="",
    )
    assert charts.panels(entry.name, {}) == {}
    assert list(charts.panels(entry.name, {"one": one})) == ["T"]
    with pytest.raises(InputError, match=r"figures\.toml.*colour"):
        study.read_table(charts.Chart, CHART | {"plots": [{"lines": [{"y": "x", "colour": "red"}]}]}, "figures.toml")
