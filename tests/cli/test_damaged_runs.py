"""Results files that others made or damaged: whatever is odd in them, they are shown or refused in one sentence."""

import json
import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from tests.damaged_results import damaged, damaged_bytes
from tests.rigs.tail import save_tail
from tests.small_robots import BALL, SLIDE
from tests.synthetic_campaign import write_grid

import nectosome as ns
from nectosome.cli.control_side_by_side import comparison_summary
from nectosome.controllers import compare
from nectosome.description import parse_robot
from nectosome.designs.sweep import MEANS, MORE_MEANS, nonzero_means
from nectosome.identification.hysteresis.files import saved_model
from nectosome.identification.sim2real.grids import parameter_of, quantity_of, table_of
from nectosome.io import load_dataset
from nectosome.solve.summaries.run_summary import origin
from nectosome.solve.summaries.run_summary import run_summary as summary
from nectosome.units import InputError
from nectosome.view.loops_side_by_side import signals_side_by_side
from nectosome.view.saved import check_comparison, check_drawable, check_sweep, saved_run
from nectosome.view.sweep import _CAPTIONS, panels

from .answers import contents, faults

_UNREAD = ("q", "v", "a", "support_force", "support_moment", "momentum", "water_momentum", "angular_momentum")


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


def answers(good: xr.Dataset, read: Callable[[xr.Dataset], Any], step: int = 1) -> tuple[int, int]:
    """How many damaged files are refused in a sentence that names the file, and how many are read without warning."""
    refused = taken = 0
    for what, bad in [*damaged(good)][::step]:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                read(bad)
            except InputError as error:
                assert str(error).startswith("bad.nc"), what
                refused += 1
            except Exception as error:
                raise AssertionError(what) from error
            else:
                taken += 1
    return refused, taken


def show_all(dataset: xr.Dataset) -> None:
    """As `show --loads` and `show --json` do: no NaN in the text, and only numbers in JSON."""
    run = saved_run(dataset, "bad.nc")
    found = summary({str(name): x.values for name, x in run.variables.items()}, run.attrs, each=True)
    lines = [str(line) for line in (*found.lines(80), *origin(run.attrs).lines(80))]
    assert not [line for line in lines if re.search(r"\b(nan|inf)\b", line)]
    json.dumps(found.to_json(), allow_nan=False)


@pytest.mark.parametrize("step", [8, pytest.param(1, marks=pytest.mark.slow)])
def test_damaged_runs_are_shown_or_refused(ball_run, step):
    refused, taken = answers(load_dataset(ball_run).drop_vars(_UNREAD).isel(time=slice(None, None, 5)), show_all, step)
    assert (refused > 300 // step, taken > 300 // step) == (True, True)


def test_damaged_sweeps_are_drawn_or_refused(tmp_path):
    (tmp_path / "ball.yaml").write_text(BALL)
    over: Any = {"body.density": [1100.0, 1200.0, 1300.0]}
    swept = ns.sweep(tmp_path / "ball.yaml", over).assign_attrs(seconds=1.0)

    def draw(dataset: xr.Dataset) -> None:
        check_sweep(dataset, "bad.nc")
        assert len(panels(dataset)) == len(nonzero_means(dataset))

    refused, taken = answers(swept, draw, 15)
    assert (refused > 8, taken > 30) == (True, True)


def test_damaged_comparisons_of_controllers_are_shown_or_refused():
    found = compare(
        parse_robot(SLIDE), controllers="pid", command="push=-2..2N", measure="body.position",
        reference="5cm", time=1.0, gains="20,30,10",
    )  # fmt: skip

    def show(dataset: xr.Dataset) -> None:
        check_comparison(dataset, "bad.nc")
        json.dumps(comparison_summary(dataset).to_json(), allow_nan=False)
        signals_side_by_side(dataset)

    refused, taken = answers(found.to_dataset().assign_attrs(seconds=1.0), show, 9)
    assert (refused > 12, taken > 12) == (True, True)


def test_every_mean_of_a_sweep_has_a_caption():
    assert {"force", *MEANS, *MORE_MEANS} == {*_CAPTIONS}


def test_damaged_models_of_an_actuator_are_taken_or_refused(tmp_path):
    save_tail(tmp_path / "tail.nc")

    def take(dataset: xr.Dataset) -> None:
        model = saved_model(dataset, "bad.nc")
        numbers = [*model.theta.values(), *model.slopes, *model.thresholds, model.noise]
        assert model.block() is not None and np.isfinite(numbers).all()

    refused, taken = answers(load_dataset(tmp_path / "tail.nc"), take, 2)
    assert (refused > 50, taken > 20) == (True, True)


def test_damaged_grids_are_taken_or_refused(tmp_path):
    """Those to be corrected, of whatever program; the command puts the name of the file in front."""
    write_grid(tmp_path / "grid.nc")

    def take(dataset: xr.Dataset) -> None:
        try:
            values, peak, _ = quantity_of(dataset, ["force"], "-force.y")
            name, nominal = parameter_of(values, ["A", "f"], "Cn=1", "")
            tables = [table_of(one, name, nominal) for one in (values, peak) if one is not None]
        except InputError as error:
            raise InputError(error.message, file="bad.nc", field=error.field) from None
        assert all(np.isfinite(table.values).all() for table in tables)

    refused, taken = answers(load_dataset(tmp_path / "grid.nc"), take)
    assert (refused > 50, taken > 50) == (True, True)


@pytest.fixture
def files(ball_run, tmp_path) -> list[str]:
    """Damaged files of a run, of each kind some."""
    folder = tmp_path / "files"
    folder.mkdir()
    good = load_dataset(ball_run).drop_vars(_UNREAD)
    some = [*damaged(good)]
    found = dict(damaged_bytes(ball_run.read_bytes()))
    found |= {what: bytes(bad.to_netcdf(engine="h5netcdf")) for what, bad in (*some[::60], *some[-3:])}
    for k, content in enumerate(found.values()):
        (folder / f"bad{k}.nc").write_bytes(content)
    return [f"files/{path.name}" for path in sorted(folder.iterdir())]


@pytest.mark.parametrize("part", [0, *(pytest.param(part, marks=pytest.mark.slow) for part in range(1, 8))])
def test_every_command_that_reads_a_run_says_what_is_wrong_with_it(nectosome, files, tmp_path, part):
    """By the command line: exit code 2, one sentence that names the file, and nothing written; or all is well."""
    before, codes = contents(tmp_path), set[int]()
    for k, name in enumerate(files[part::8]):
        pictures = ("render", name, "--save", "new.png", "--size", "128x128", "--time", "1s")
        for argv in (("show", name), *([("show", name, "--plot", "new.html"), pictures] if k % 4 == 0 else [])):
            answer = nectosome(*argv)
            codes.add(answer.code)
            if answer.code == 0:
                assert answer.err == ""
                for new in ("new.html", "new.png"):
                    Path(new).unlink(missing_ok=True)
            else:
                assert faults(answer.code, answer.err) == [] and name in answer.err and answer.out == "", argv
            assert contents(tmp_path) == before
    assert codes == {0, 2}


def test_a_file_that_is_far_larger_when_it_is_unpacked_is_not_read(nectosome, tmp_path):
    h5netcdf = pytest.importorskip("h5netcdf")
    with h5netcdf.File(tmp_path / "bomb.nc", "w") as file:
        file.dimensions = {"time": 10**9}
        file.create_variable("position", ("time",), float, chunks=(10**6,))
    answer = nectosome("show", "bomb.nc")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err == "bomb.nc: is more than 100 times larger when it is unpacked: it is damaged.\n"


def test_a_model_that_is_damaged_stops_a_rig_before_it_moves(nectosome, tmp_path):
    (tmp_path / "rig.yaml").write_text(
        (Path(__file__).parents[2] / "examples/rigs/fishtail_simulated.yaml").read_text()
    )
    save_tail(tmp_path / "tail.nc")
    load_dataset(tmp_path / "tail.nc").drop_vars("threshold").to_netcdf(tmp_path / "less.nc", engine="h5netcdf")
    argv = ("control", "rig", "--config", "rig.yaml", "--reference", "2mm", "--model", "less.nc", "--save", "run.nc")
    answer = nectosome(*argv)
    assert faults(answer.code, answer.err) == [] and not Path("run.nc").exists()
    assert answer.err.startswith("less.nc: this is not a model that ")
    assert "it has no threshold over parameter" in answer.err
