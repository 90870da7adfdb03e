"""A run as a file of rerun.io, read back by rerun's own reader: times, numbers and poses are those of the run."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader
from scipy.spatial.transform import Rotation
from tests.small_robots import PENDULUM, SLIDE

from nectosome.cli.app import main
from nectosome.description import parse_robot
from nectosome.export.rerun_file import write_rerun
from nectosome.export.run_table import run_table
from nectosome.io import save_dataset
from nectosome.solve import simulate

SWINGING = PENDULUM.replace("gravity: 9.81 m/s2", "gravity: 9.81 m/s2, surface: 0.5 m, floor: -2 m, walls: [-3 m, 4 m]")
SWINGING += """
limbs:
  tail:
    kind: rod
    section: circle
    radius: 5 mm
    length: 100 mm
    young: 2 MPa
    density: 1100 kg/m3
    points: 3
    strains: {bending_y: 0}
    at: tip
"""


@pytest.fixture(scope="module")
def run():
    return simulate(parse_robot(SWINGING), 0.3, samples=11).to_dataset()


@pytest.fixture(scope="module")
def saved(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("rerun") / "arm.nc"
    save_dataset(run, path)
    return path


@pytest.fixture(scope="module")
def columns(run, tmp_path_factory):
    """Values by entity and component; lists of as many as there are times, or the one that is kept."""
    path = tmp_path_factory.mktemp("rerun") / "arm.rrd"
    write_rerun(run, path)
    found = {}
    for chunk in RrdReader(path).stream().to_chunks():
        batch = chunk.to_record_batch()
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            times = chunk.timeline_names == ["time"]
            found[chunk.entity_path, name] = (
                column if name == "time" else column.to_pylist() if times else column[0].as_py()
            )
    return found


def test_all_numbers_of_the_run_are_in_it_bit_by_bit(run, columns):
    table, seen = run_table(run), []
    for (entity, component), names in columns.items():
        if component == "SeriesLines:names":
            values = np.array(columns[entity, "Scalars:scalars"])
            assert values.shape == (11, len(names))
            np.testing.assert_array_equal(values, table[names].to_numpy())
            seen += names
    assert sorted(seen) == sorted(table.columns)
    assert "velocity body x (m/s)" in columns["/numbers/velocity/body", "SeriesLines:names"]


def test_times_are_those_of_the_run(run, columns):
    timelines = [column for (_, component), column in columns.items() if component == "time"]
    assert len(timelines) > 20
    for column in timelines:
        seconds = 1e-9 * column.cast("int64").to_numpy()
        np.testing.assert_allclose(seconds, run["time"], rtol=0, atol=0.51e-9)
    np.testing.assert_array_equal(np.ravel(columns["/numbers/time", "Scalars:scalars"]), run["time"])


def test_a_part_moves_as_in_the_run(run, columns):
    """Place in 32 bits, and rotation to their rounding, of the station that the part's frame sits at."""
    for part in ("body", "tail"):
        k = int(np.flatnonzero(run["station_part"].values == part)[0])
        place = np.array(columns[f"/world/robot/{part}", "Transform3D:translation"])[:, 0]
        np.testing.assert_array_equal(place, run["position"].values[:, k].astype(np.float32))
        turn = np.array(columns[f"/world/robot/{part}", "Transform3D:quaternion"])[:, 0]
        np.testing.assert_allclose(Rotation.from_quat(turn).as_matrix(), run["rotation"].values[:, k], atol=3e-7)
    assert np.ptp(run["position"].values[:, 0, 2]) > 0.05


def test_a_box_has_its_corners_and_outward_normals(columns):
    vertices, normals = (np.array(columns["/world/robot/body", f"Mesh3D:vertex_{what}"]) for what in
                         ("positions", "normals"))  # fmt: skip
    np.testing.assert_allclose(vertices.max(axis=0) - vertices.min(axis=0), [1.0, 0.02, 0.1], rtol=1e-6)
    seen = np.abs(normals).max(axis=1) > 0  # some triangles of the ends have no area
    assert seen.mean() > 0.9
    np.testing.assert_allclose(np.abs(normals[seen]).max(axis=1), 1.0, rtol=1e-6)
    assert (np.einsum("ij,ij->i", normals, vertices - vertices.mean(axis=0))[seen] > 0).all()


def test_a_rod_bends_as_in_the_run(run, columns):
    """Stations lie between the middles of two slices each, but for what a chord is off its arc."""
    poses = columns["/world/robot/tail", "InstancePoses3D:translations"]
    own, bent = np.flatnonzero(run["station_part"].values == "tail"), []
    long = np.diff(run["station_x"].values[own])
    share = (long[:-1] / (long[:-1] + long[1:]))[:, None]
    for k, slices in enumerate(poses):
        R, axis = run["rotation"].values[k, own[0]], run["position"].values[k, own]
        middles = np.array(slices) @ R.T + axis[0]
        between = (1 - share) * middles[2:-1:3] + share * middles[3::3]
        np.testing.assert_allclose(between, axis[1:-1], atol=2e-4)
        bent.append(np.linalg.norm(axis[-1] - axis[0] - 0.1 * R[:, 0]))
    assert max(bent) > 5e-3


def test_what_is_around_is_where_the_water_has_it(columns):
    for name, axis, at in (("surface", 2, 0.5), ("floor", 2, -2.0), ("wall_low", 0, -3.0), ("wall_high", 0, 4.0)):
        corners = np.array(columns[f"/world/around/{name}", "Mesh3D:vertex_positions"])
        np.testing.assert_array_equal(corners[:, axis], at)
        assert np.ptp(corners, axis=0).min() == 0 and (np.sort(np.ptp(corners, axis=0))[1:] > 5).all()
    assert columns["/world", "ViewCoordinates:xyz"] == [[3, 5, 1]]  # right, forward, up


def test_it_opens_with_the_robot_beside_plots(run, tmp_path):
    write_rerun(run, tmp_path / "arm.rrd")
    reader = RrdReader(tmp_path / "arm.rrd")
    assert len(reader.recordings()) == len(reader.blueprints()) == 1
    chunks = reader.stream(store=reader.blueprints()[0]).to_chunks()
    text = "".join(str(chunk.to_record_batch().to_pylist()) for chunk in chunks)
    assert "/world/here" in text and "numbers/velocity/body" in text and "numbers/energy" in text


def test_the_camera_follows_the_body(run, columns):
    place = np.array(columns["/world/here", "Transform3D:translation"])[:, 0]
    np.testing.assert_array_equal(place, run["position"].values[:, 0].astype(np.float32))


def test_a_robot_of_points_is_written(tmp_path):
    run = simulate(parse_robot(SLIDE), 0.1, samples=3).to_dataset()
    write_rerun(run, tmp_path / "slide.rrd")
    assert len(RrdReader(tmp_path / "slide.rrd").recordings()) == 1


def test_nothing_else_is_written(saved, tmp_path):
    home, folder = tmp_path / "home", tmp_path / "here"
    home.mkdir()
    folder.mkdir()
    code = f"from nectosome.cli.app import main; raise SystemExit(main(['export', {str(saved)!r}, '--to', 'rrd']))"
    environment = {"HOME": str(home), "PYTHONPATH": ":".join(sys.path), "FORCE_RERUN_ANALYTICS": "1"}
    subprocess.run([sys.executable, "-c", code], cwd=folder, env=environment, check=True, timeout=120)
    assert [path.name for path in folder.iterdir()] == ["arm.rrd"]
    assert [*home.rglob("*")] == []


def test_nothing_is_overwritten_unasked(saved, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("arm.rrd").write_text("mine")
    argv = ["export", str(saved), "--to", "rrd"]
    assert main(argv) == 2
    assert capsys.readouterr().err == "FILE: arm.rrd exists. Give another name, or --force to overwrite it.\n"
    assert Path("arm.rrd").read_text() == "mine"
    assert main([*argv, "--force"]) == 0
    assert capsys.readouterr().out == "written: arm.rrd\n"
    assert RrdReader("arm.rrd").recordings()[0].application_id == "nectosome"


def test_what_cannot_be_written_is_a_sentence(run, saved, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def told(*argv):
        assert main(["export", *argv, "--to", "rrd"]) == 2
        return capsys.readouterr().err

    assert told("tuna") == (
        "tuna: is no saved run. Save one: nectosome simulate ROBOT --save run.nc; rrd is for a run only.\n"
    )
    assert told(str(saved), "--set", "body.mass=2kg").startswith("--set: is for a robot: a run is what it was.")
    save_dataset(run.drop_vars("position"), "torn.nc")
    assert told("torn.nc").startswith("torn.nc: ")
    monkeypatch.setenv("RERUN", "off")
    assert told(str(saved)) == "the environment variable RERUN switches rerun off: unset it.\n"
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert told(str(saved)) == "the package rerun is missing: pip install 'nectosome[rerun]'.\n"
    assert [path.name for path in tmp_path.iterdir()] == ["torn.nc"]
