"""A run as an MCAP file, read back by our own reader, and by that of the library: numbers, units, frames, bytes."""

import json
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.small_robots import PENDULUM

from nectosome import measure
from nectosome.cli.app import main
from nectosome.description import parse_robot
from nectosome.export.mcap_file import write_mcap
from nectosome.export.run_table import run_table
from nectosome.io import save_dataset
from nectosome.solve import simulate
from nectosome.units import InputError, unit_to_si

pytestmark = pytest.mark.skipif(find_spec("mcap") is None, reason="the extra mcap is not installed")


@pytest.fixture(scope="module")
def run():
    return simulate(parse_robot(PENDULUM), 0.3, samples=11).to_dataset()


@pytest.fixture(scope="module")
def written(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("mcap") / "arm.mcap"
    write_mcap(run, path)
    return path


@pytest.fixture(scope="module")
def again(written):
    return measure.read(written)


def test_all_numbers_of_the_run_come_back_with_their_units(run, again):
    table = run_table(run)
    assert len(table.columns) > 40
    for heading in table.columns.drop("time (s)"):
        name, _, unit = heading.partition(" (")
        read = again[name.replace(" ", ".") if " " in name else f"{name}.value"]
        factor, si = unit_to_si(unit.removesuffix(")")) if unit else (1.0, "")
        assert read.attrs["units"] == si
        expected = np.where(np.isfinite(table[heading]), table[heading], np.nan)
        np.testing.assert_array_equal(read, factor * expected)


def test_times_are_those_of_the_run_to_a_nanosecond(run, again):
    np.testing.assert_allclose(again["time"], run["time"], rtol=0, atol=0.51e-9)
    assert again.attrs["since"] == "" and json.loads(again.attrs["provenance"])["repairs"] == []


def test_each_part_is_a_frame_that_moves_as_in_the_run(run, again):
    for part in run["part"].values:
        k = int(np.flatnonzero(run["station_part"].values == part)[0])
        place = np.stack([again[f"tf.{part}.translation.{axis}"] for axis in "xyz"], axis=1)
        np.testing.assert_array_equal(place, run["position"].values[:, k])
        turn = np.stack([again[f"tf.{part}.rotation.{axis}"] for axis in "xyzw"], axis=1)
        np.testing.assert_allclose(Rotation.from_quat(turn).as_matrix(), run["rotation"].values[:, k], atol=1e-14)
    assert again["tf.body.translation.x"].attrs["units"] == "m"
    assert np.ptp(run["position"].values[:, 0, 2]) > 0.05


def test_it_is_json_with_schemas_and_units_as_the_library_reads_them(run, written):
    from mcap.reader import make_reader

    with written.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        messages = [*reader.iter_messages()]
        (told,) = reader.iter_metadata()
    of = {channel.topic: (schema, channel) for schema, channel, _ in messages}
    schema, channel = of["/velocity/body"]
    assert (channel.message_encoding, schema.encoding, schema.name) == ("json", "jsonschema", "nectosome.velocity.body")
    assert json.loads(channel.metadata["units"]) == {"x": "m/s", "y": "m/s", "z": "m/s"}
    assert json.loads(schema.data)["properties"]["x"] == {"type": "number", "description": "m/s"}
    assert of["/tf"][0].name == "foxglove.FrameTransforms"
    assert [m.log_time for _, c, m in messages if c.topic == "/energy"] == np.rint(1e9 * run["time"].values).tolist()
    assert told.metadata["robot"] == run.attrs["robot"]


def test_what_is_not_finite_is_null(run, tmp_path):
    broken = run.copy(deep=True)
    broken["velocity"][2, 0, 0] = np.nan
    broken["velocity"][3, 0, 0] = np.inf
    write_mcap(broken, tmp_path / "a.mcap")
    read = measure.read(tmp_path / "a.mcap")["velocity.body.x"].values
    assert np.flatnonzero(np.isnan(read)).tolist() == [2, 3]


def test_the_same_run_gives_the_same_bytes(run, written, tmp_path):
    write_mcap(run, tmp_path / "arm.mcap")
    assert (tmp_path / "arm.mcap").read_bytes() == written.read_bytes()


def test_the_command_writes_it_and_says_what_it_cannot(run, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    save_dataset(run, tmp_path / "arm.nc")
    assert main(["export", "arm.nc", "--to", "mcap"]) == 0
    assert capsys.readouterr().out == "written: arm.mcap\n"
    assert main(["measure", "arm.mcap"]) == 0
    assert "velocity.body.x" in capsys.readouterr().out

    def told(*argv):
        assert main(["export", *argv, "--to", "mcap"]) == 2
        return capsys.readouterr().err

    assert told("tuna").endswith("nectosome simulate ROBOT --save run.nc; mcap is for a run only.\n")
    with pytest.raises(InputError, match="begins at -1 s, and MCAP has no times before 0 s"):
        write_mcap(run.assign_coords(time=run["time"] - 1.0), tmp_path / "b.mcap")
    monkeypatch.setitem(sys.modules, "mcap", None)
    assert told("arm.nc", "--force") == "the package mcap is missing: pip install 'nectosome[mcap]'.\n"
