"""Files of motion capture and pose estimation need no sheet: names with body, marker and axis, times, units."""

import json

import numpy as np
import pytest

from nectosome.io.schema.validate import validate_as
from nectosome.measure import Sheet, read
from nectosome.measure.formats import text as text_blocks
from nectosome.units import InputError

N = 12


def recorded(folder, text, name="a.csv", **sheet):
    (folder / name).write_text(text)
    return read(folder / name, validate_as(Sheet, sheet, "sheet"))


def rows(*columns, delimiter=","):
    return "".join(delimiter.join(map(str, row)) + "\n" for row in zip(*columns, strict=True))


def head(*lines, delimiter=","):
    return "".join(delimiter.join(line) + "\n" for line in lines)


K, Q = range(N), [k / 100 for k in range(N)]


@pytest.mark.parametrize(("unit", "factor"), [("Meters", 1.0), ("Millimeters", 1e-3), ("Centimeters", 1e-2)])
@pytest.mark.parametrize(("turns", "rotation"), [("Quaternion", 1.0), ("XYZ", np.pi / 180)])
def test_motive(tmp_path, unit, factor, turns, rotation):
    """Two bodies and a marker at 120 Hz; an ID that a computer gave is no part of a name."""
    about = (
        f"Format Version,1.23,Take Name,swim,Export Frame Rate,120,Rotation Type,{turns},Length Units,{unit},X,Y\n\n"
    )
    kinds = ["Rotation", "Rotation", "Position", "Mean Marker Error", "Position", "Position"]
    lines = [
        ["", "Type", *["Rigid Body"] * 5, "Marker"],
        ["", "Name", *["fish"] * 4, "boat", "fish:nose"],
        ["", "ID", *["A1"] * 4, "F00DBABE12345678", "1:22"],
        ["", "Parent", *[""] * 5, "fish"],
        ["", "", *kinds],
        ["Frame", "Time (Seconds)", "X", "Y", "Z", "", "X", "X"],
    ]
    times = [f"{k / 120:.6f}" for k in K]
    run = recorded(tmp_path, about + head(*lines) + rows(K, times, Q, Q, Q, Q, Q, Q))
    names = ["fish A1 rotation x", "fish A1 rotation y", "fish A1 position z", "fish A1 mean marker error"]
    assert list(run.data_vars) == ["Frame", *names, "boat position x", "fish:nose 1:22 position x"]
    np.testing.assert_allclose(run["time"], np.arange(N) / 120, atol=1e-6)
    np.testing.assert_allclose(run["fish A1 position z"], factor * np.array(Q), rtol=1e-14)
    np.testing.assert_allclose(run["fish A1 mean marker error"], factor * np.array(Q), rtol=1e-14)
    np.testing.assert_allclose(run["fish A1 rotation x"], rotation * np.array(Q), rtol=1e-14)
    assert run["fish A1 rotation x"].attrs["units"] == ("" if turns == "Quaternion" else "rad")
    assert json.loads(run.attrs["provenance"])["warnings"] == []


DEVICES = head(
    ["Devices"],
    ["1000"],
    ["", "", "Plate - Force", "", "", "Cell"],
    ["Frame", "Sub Frame", "Fx", "Fy", "Fz", "V"],
    ["", "", "N", "N", "N", "V"],
) + rows([k // 10 + 1 for k in range(10 * N)], [k % 10 for k in range(10 * N)], *[[k / 8 for k in range(10 * N)]] * 4)
TRAJECTORIES = head(
    ["Trajectories"],
    ["100"],
    ["", "", "fish:nose", "", "", "fish:tail", "", ""],
    ["Frame", "Sub Frame", "X", "Y", "Z", "X", "Y", "Z"],
    ["", "", *["mm"] * 6],
) + rows([k + 5 + (k > 3) for k in K], [0] * N, Q, Q, Q, Q, [""] * N, Q)


@pytest.mark.parametrize("text", [f"{DEVICES}\n{TRAJECTORIES}", f"{TRAJECTORIES}\n{DEVICES}", TRAJECTORIES])
@pytest.mark.parametrize("block", [1 << 20, 200])
def test_vicon(tmp_path, monkeypatch, text, block):
    """The time is that of the frames, of which one is missing; blocks of a few rows end in either section."""
    monkeypatch.setattr(text_blocks, "BLOCK", block)
    run = recorded(tmp_path, text)
    names = [f"fish:{part} {axis}" for part in ("nose", "tail") for axis in "xyz"]
    assert list(run.data_vars) == ["Sub Frame", *names]
    np.testing.assert_allclose(run["time"], [(k + (k > 3)) / 100 for k in K], atol=1e-14)
    np.testing.assert_allclose(run["fish:tail z"], 1e-3 * np.array(Q), rtol=1e-14)
    assert np.isnan(run["fish:tail y"]).all()
    if "Devices" not in text:
        return
    assert any("left out: the section Devices" in said for said in json.loads(run.attrs["provenance"])["found"])
    run = recorded(tmp_path, text, file={"table": "Devices"})
    assert list(run.data_vars)[2:] == ["Plate - Force Fx", "Plate - Force Fy", "Plate - Force Fz", "Cell V"]
    np.testing.assert_allclose(run["time"], np.arange(10 * N) / 1000, rtol=1e-14)
    np.testing.assert_array_equal(run["Cell V"], np.arange(10 * N) / 8)
    assert run["Cell V"].attrs["units"] == "V"


def test_vicon_damaged(tmp_path):
    with pytest.raises(InputError, match=r'there is no section "Joints".* Known: Devices, Trajectories'):
        recorded(tmp_path, f"{DEVICES}\n{TRAJECTORIES}", file={"table": "Joints"})
    with pytest.raises(InputError, match="a rate in Hz is expected below Trajectories"):
        recorded(tmp_path, TRAJECTORIES.replace("\n100\n", "\nfast\n"))
    with pytest.raises(InputError, match="this section of Vicon's has no rows"):
        recorded(tmp_path, "Trajectories\n100\n")
    with pytest.raises(InputError, match="9 columns by the head of Vicon, and the rows have 8 cells"):
        recorded(tmp_path, TRAJECTORIES.replace("Y,Z\n", "Y,Z,W\n"))


@pytest.mark.parametrize("columns", [[], ["Frame"], ["Frame", "Time"]])
@pytest.mark.parametrize("named", [True, False])
def test_qualisys(tmp_path, columns, named):
    about = [["NO_OF_FRAMES", "12"], ["FREQUENCY", "100"], ["TIME_STAMP", "2024-03-14, 13:57:53.5", "91283.4"]]
    about += [["DATA_INCLUDED", "3D"], ["MARKER_NAMES", "nose", "tail"]]
    about += [[*columns, *(f"{part} {axis}" for part in ("nose", "tail") for axis in "XYZ")]] * named
    cells = {"Frame": [k + 1 for k in K], "Time": Q}
    text = head(*about, delimiter="\t") + rows(*(cells[c] for c in columns), *[Q] * 6, delimiter="\t")
    run = recorded(tmp_path, text, "a.tsv")
    assert [name for name in run.data_vars if name != "Frame"] == [f"{p} {a}" for p in ("nose", "tail") for a in "xyz"]
    np.testing.assert_allclose(run["time"], np.arange(N) / 100, atol=1e-14)
    np.testing.assert_allclose(run["tail z"], 1e-3 * np.array(Q), rtol=1e-14)
    assert run["tail z"].attrs["units"] == "m"


def test_qualisys_of_bodies(tmp_path):
    axes = ["X", "Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{k}]" for k in range(9))]
    about = [["NO_OF_FRAMES", "12"], ["FREQUENCY", "50"], ["DATA_INCLUDED", "6D"], ["BODY_NAMES", "fish"]]
    run = recorded(tmp_path, head(*about, axes, delimiter="\t") + rows(*[Q] * 16, delimiter="\t"), "a.tsv")
    np.testing.assert_allclose(run["time"], np.arange(N) / 50, rtol=1e-14)
    np.testing.assert_allclose(run["fish yaw"], np.deg2rad(Q), rtol=1e-14)
    np.testing.assert_allclose(run["fish x"], 1e-3 * np.array(Q), rtol=1e-14)


def test_deeplabcut(tmp_path):
    parts = ["nose"] * 3 + ["tail"] * 3
    lines = [["scorer", *["net"] * 6], ["bodyparts", *parts], ["coords", *["x", "y", "likelihood"] * 2]]
    run = recorded(tmp_path, head(*lines) + rows(K, *[Q] * 6))
    names = [f"{part} {axis}" for part in ("nose", "tail") for axis in ("x", "y", "likelihood")]
    assert list(run.data_vars) == ["frame", *names]
    animals = ["individuals", "a", "a", "a", "b", "b", "b"]
    lines[1:] = [animals, ["bodyparts", *["nose"] * 6], lines[2]]
    run = recorded(tmp_path, head(*lines) + rows(K, *[Q] * 6), time={"rate": "30 Hz"})
    assert list(run.data_vars)[1::3] == ["a nose x", "b nose x"]
    one = [["scorer", "net", "net"], ["bodyparts", "nose", "nose"], ["coords", "x", "y"]]
    assert list(recorded(tmp_path, head(*one) + rows(K, Q, Q)).data_vars) == ["frame", "nose x", "nose y"]


def test_tracker(tmp_path):
    run = recorded(tmp_path, head(["mass A", "", "", "mass B", "", ""], ["t", "x", "y"] * 2) + rows(Q, Q, Q, Q, Q, Q))
    assert list(run.data_vars) == ["mass A x", "mass A y", "mass B t", "mass B x", "mass B y"]
    np.testing.assert_array_equal(run["time"], Q)
    run = recorded(tmp_path, "mass A\n" + head(["t", "x", "y"]) + rows(Q, Q, Q))
    assert list(run.data_vars) == ["x", "y"]


def test_what_pandas_writes_of_names_in_levels(tmp_path):
    lines = [["", "nose", "nose", "tail", "tail"], ["", "x", "y", "x", "y"], ["sample", "", "", "", ""]]
    run = recorded(tmp_path, head(*lines) + rows(K, *[Q] * 4))
    assert list(run.data_vars) == ["sample", "nose x", "nose y", "tail x", "tail y"]


def test_names_over_two_rows_with_units_below(tmp_path):
    lines = [["", "force", "", "torque", ""], ["t", "x", "y", "x", "y"], ["s", "N", "N", "mN m", "mN m"]]
    run = recorded(tmp_path, head(*lines) + rows(Q, *[Q] * 4))
    assert list(run.data_vars) == ["force x", "force y", "torque x", "torque y"]
    assert run["torque y"].attrs["units"] == "N m"


def test_topics_of_ros_keep_their_names(tmp_path):
    run = recorded(tmp_path, head(["__time", "/imu/accel/x"]) + rows([1_650_000_000 + q for q in Q], Q))
    assert list(run.data_vars) == ["imu.accel.x"]
    run = recorded(
        tmp_path, head(["%time", "field.data"]) + rows([1_650_000_000_000_000_000 + 10**7 * k for k in K], K)
    )
    np.testing.assert_allclose(run["time"], Q, atol=5e-7)
    assert list(run.data_vars) == ["field.data"]
