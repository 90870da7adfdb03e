"""`correct` on a synthetic campaign: what it prints and writes, and what it refuses."""

import json
import re
import sys
from contextlib import nullcontext

import numpy as np
import pytest
from tests.afar import Afar
from tests.small_robots import DRIVEN
from tests.synthetic_campaign import CN, PLAN, A, grid, mean, write_campaign, write_grid

from nectosome.description import dump_robot, parse_robot, with_values
from nectosome.io import load_dataset, save_dataset
from nectosome.search.executors.cluster import cluster

from .answers import check_wrong
from .test_sweep import ARM

GIVEN = ("correct", "--sim", "grid.nc", "--campaign", "lab/campaign.yaml")
ASKED = (*GIVEN, "--quantity=-force.y", "--parameter", "Cn=1")


@pytest.fixture
def lab(tmp_path):
    write_grid(tmp_path / "grid.nc")
    return write_campaign(tmp_path / "lab")


def test_a_corrected_grid_is_near_the_truth(nectosome, lab, tmp_path):
    """Half of the grid is measured, with a scatter of 2 %: it is within 5 %, and 1 % on the mean (15 % before)."""
    answer = nectosome(*ASKED, "--save", "corrected.nc", "--plot", "corrected.html", "--next", "2")
    assert (answer.code, answer.err) == (0, "")
    found = load_dataset(tmp_path / "corrected.nc")
    truth = mean(found["A"], found["f"])
    off, before = (abs(found[name] / truth - 1) for name in ("force", "simulated"))
    assert float(before.mean()) > 0.15
    assert float(off.mean()) < 0.01
    assert float(off.max()) < 0.05
    inside = abs(found["force"] - truth) < 1.96 * found["force_error"]
    assert float(inside.mean()) >= 0.9
    np.testing.assert_allclose(found["parameter"], 0.8, atol=0.05)
    assert found["force"].attrs["units"] == "N"
    assert found.attrs["estimated_from"] == "peaks"
    assert json.loads(found.attrs["provenance"])["settings"]["method"] == "cn-gp"
    np.testing.assert_allclose(found["measured_A"], [A[i] for i, _ in PLAN])
    np.testing.assert_allclose(found["measured"], mean(found["measured_A"], found["measured_f"]), rtol=0.08)
    assert found.sizes["next"] == 2
    made = {(round(float(x), 6), float(y)) for x, y in zip(found["measured_A"], found["measured_f"], strict=True)}
    assert not made & {(round(float(x), 6), float(y)) for x, y in zip(found["next_A"], found["next_f"], strict=True)}

    for words in ("24 recordings", "10 conditions, 10 of them repeated", "simulator as it was", "A=60 deg, f=1.3 Hz"):
        assert words in answer.out
    rows = json.loads(nectosome(*ASKED, "--json").out)["tables"]["errors"]
    named = ("simulator as it was", "corrected (cn-gp), by the others", "noise alone")
    errors = [rows[name]["mean"]["value"] for name in named]
    assert errors[0] > 0.15 > 0.03 > max(errors[1:])
    assert f"simulator as it was {100 * errors[0]:.4g} " in " ".join(answer.out.split())
    page = (tmp_path / "corrected.html").read_text()
    for words in ("Corrected grid", "What is not known", "Predicted and measured", "A (deg)"):
        assert words in page


def test_without_an_axis_of_a_parameter_only_the_rest_is_corrected(nectosome, lab, tmp_path):
    """The grid is in other units too, and has one row only."""
    known = grid(("A", "f"))[["force"]].expand_dims(N=[3])
    degrees = known.assign_coords(A=("A", np.degrees(A), {"units": "deg"}))
    save_dataset(degrees.assign(force=(1e3 * degrees["force"]).assign_attrs(units="mN")), tmp_path / "grid.nc")
    answer = nectosome(*GIVEN, "--quantity", "-force.y", "--aim", "lowest", "--next", "1", "--save", "c.nc")
    assert (answer.code, answer.err) == (0, "")
    found = load_dataset(tmp_path / "c.nc")
    assert found.attrs["method"] == "gp"
    assert np.isnan(found["parameter"]).all()
    np.testing.assert_allclose(found["force"], mean(found["A"], found["f"]), rtol=0.05)
    assert "lowest on the grid" in answer.out
    assert "A=20 deg, f=0.4 Hz" in answer.out


def test_one_condition_gives_a_curve_and_an_odd_experiment_is_told(nectosome, tmp_path):
    write_grid(tmp_path / "grid.nc", over=("f", "Cn"))
    file = write_campaign(tmp_path / "lab", [(2, j) for j in range(4)], scatter=0.01)
    file.write_text(file.read_text().replace("A: 40 deg, ", ""))
    for odd in (tmp_path / "lab").glob("run_2_2_*.csv"):
        rows = np.loadtxt(odd, delimiter=",", skiprows=1) * [1, 3]
        np.savetxt(odd, rows, delimiter=",", header="t,F", comments="")
    answer = nectosome(*ASKED, "--plot", "corrected.html", "--method", "gp")
    assert (answer.code, answer.err) == (0, "")
    assert "measure again: f=1 Hz" in answer.out
    assert "Corrected curve" in (tmp_path / "corrected.html").read_text()


def test_the_robot_of_a_sweep_tells_the_nominal_parameter(nectosome, lab, tmp_path):
    """The arm's stiffness is 0.06 N m/rad; here it stands for the parameter of the formula."""
    renamed = grid().rename(Cn="body.joint.stiffness")
    stiffness = ("body.joint.stiffness", 0.06 * np.array(CN), {"units": "N m/rad"})
    save_dataset(renamed.assign_coords({stiffness[0]: stiffness}).assign_attrs(robot=ARM), tmp_path / "grid.nc")
    answer = nectosome(*GIVEN, "--quantity=-force.y", "--method", "cn-svd", "--next", "1")
    assert (answer.code, answer.err) == (0, "")
    assert re.search(
        r"stiffness: 0\.04[78]\d+ to 0\.04[78]\d+ N m/rad where measured, estimated from peaks; 0\.06 in",
        " ".join(answer.out.split()),
    )
    assert "cn-svd tells no intervals" in answer.out


SIMULATED = dump_robot(with_values(parse_robot(DRIVEN), {"I": 1.0, "k": 40.0, "c": 5.0, "M": 0.5, "f": 1.0}))


def test_a_robot_file_is_simulated_and_corrected_at_once(nectosome, tmp_path, monkeypatch):
    """An oscillator: its power is known in closed form, at 40 N m/rad in the file and 32 N m/rad on the bench.

    A cluster is lost with two of three parts of the sweep done; the same command goes on to the same numbers.
    """
    (tmp_path / "lab").mkdir()
    (tmp_path / "driven.yaml").write_text(SIMULATED)
    lines = ["columns: {power: {column: P, unit: W}}", "time: {column: t, unit: s}", "recordings:"]

    def power(M, f, k):
        w = 2 * np.pi * f
        return 0.5 * 5 * abs(w * M / (k - w**2 + 5j * w)) ** 2

    measured = [(0.3, 0.5), (0.3, 1.0), (0.5, 0.5), (0.5, 0.75), (0.5, 1.25), (0.5, 1.5), (0.7, 0.75), (0.7, 1.25)]
    for k, (M, f) in enumerate(measured):
        t = np.arange(200) / (40 * f)
        P = 2 * power(M, f, 32.0) * np.sin(2 * np.pi * f * t) ** 2
        np.savetxt(tmp_path / "lab" / f"{k}.csv", np.transpose([t, P]), delimiter=",", header="t,P", comments="")
        lines.append(f"  - {{file: {k}.csv, conditions: {{M: {M} N m, f: {f} Hz}}}}")
    (tmp_path / "lab" / "campaign.yaml").write_text("\n".join(lines) + "\n")
    robot = ("correct", "driven.yaml", "--campaign", "lab/campaign.yaml", "--quantity", "power", "--next", "1")
    over = ("--over", "M=0.3..0.7:0.2N m", "--over", "f=0.5..1.5:0.25Hz", "--over", "k=25,30,35,40,50N m/rad")
    check_wrong(
        nectosome, [(*robot, *over[:1]), robot, (*robot, "--sim", "grid.nc"), (*robot, "--over", "q=1,2N")], tmp_path
    )

    answer = nectosome(*robot, *over)
    assert (answer.code, answer.err) == (0, "")
    assert not [file for file in tmp_path.iterdir() if file.suffix in (".nc", ".html")]  # nothing unasked
    answer = nectosome(*robot, *over, "--save", "corrected.nc")
    assert (answer.code, answer.err) == (0, "")
    assert "power of driven.yaml, corrected with campaign.yaml" in answer.out
    found = load_dataset(tmp_path / "corrected.nc")
    truth = power(found["M"], found["f"], 32.0)
    assert float(abs(found["simulated"] / power(found["M"], found["f"], 40.0) - 1).max()) < 2e-3
    assert float(abs(found["power"] / truth - 1).mean()) < 0.03 < float(abs(found["simulated"] / truth - 1).mean())
    assert not (tmp_path / "corrected.parts").exists()

    monkeypatch.setattr(sys.modules[cluster.__module__], "cluster", lambda _: nullcontext(executor))
    asked = (*robot, *over, "--save", "there.nc", "--cluster", "tcp://far:1")
    with Afar(most=2) as executor:
        lost = nectosome(*asked)
    said = "the connection to the scheduler was lost. The same command goes on from what is in there.parts.\n"
    assert (lost.code, lost.err) == (1, said)
    with Afar() as executor:
        assert nectosome(*asked).code == 0
    assert executor.calls == 1
    assert load_dataset(tmp_path / "there.nc").drop_attrs().identical(found.drop_attrs())


def test_wrong_corrections_are_answered_in_a_sentence(nectosome, tmp_path):
    write_grid(tmp_path / "grid.nc")
    text = write_campaign(tmp_path / "lab", PLAN[:4]).read_text()
    changed = {
        "wrong_unit": ("A: 20 deg", "A: 20 mm"),
        "frequency_in_deg": ("f: 0.4 Hz", "f: 20 deg"),
        "no_frequency": (", f: 0.4 Hz", ""),
        "unknown": ("A: 20 deg", "A: 20 deg, depth: 0.3 m"),
        "outside": ("A: 20 deg", "A: 10 deg"),
        "unit_of_column": ("unit: N", "unit: mm"),
        "sign": ("unit: N", "unit: N, sign: -1"),
        "column": ("force: {column: F", "thrust: {column: F"),
        "missing": ("run_0_0_0.csv", "run_9.csv"),
        "cut": ("run_0_0_0.csv", "cut.csv"),
        "short": ("run_0_0_0.csv", "short.csv"),
    }
    for name, (old, new) in changed.items():
        assert old in text
        (tmp_path / "lab" / f"{name}.yaml").write_text(text.replace(old, new))
    few = [line for line in text.splitlines() if "recordings" in line or "column" in line or "run_0" in line]
    (tmp_path / "lab" / "few.yaml").write_text("\n".join([*few[:4]]))
    run = (tmp_path / "lab" / "run_0_0_0.csv").read_text()
    (tmp_path / "lab" / "short.csv").write_text("\n".join(run.splitlines()[:30]))
    (tmp_path / "lab" / "cut.csv").write_text(run[:5])
    whole = (tmp_path / "grid.nc").read_bytes()
    (tmp_path / "half.nc").write_bytes(whole[: len(whole) // 2])
    save_dataset(grid().where(grid()["f"] > 0.5), tmp_path / "unsolved.nc")
    save_dataset(grid(("A", "f")), tmp_path / "plain.nc")
    cases = [(*GIVEN[:4], f"lab/{name}.yaml", *ASKED[5:]) for name in (*changed, "few", "nothing")]
    cases += [(*GIVEN[:2], name, *ASKED[3:]) for name in ("nothing.nc", "half.nc", "unsolved.nc", "lab/campaign.yaml")]
    cases += [(*ASKED, *more) for more in (("--next", x) for x in ("0", "-1", "many", "1.5"))]
    cases += [(*ASKED, *more) for more in (("--method", "cn-gpp"), ("--aim", "best"), ("--lowpass", "10"))]
    cases += [(*ASKED, "--lowpass", x) for x in ("-1Hz", "10m", "1kHz")]
    cases += [(*ASKED, "--save", x) for x in ("c.txt", "nowhere/c.nc", "lab.nc/c.nc")]
    cases += [(*ASKED, "--plot", x) for x in ("c.nc", "nowhere/c.html")]
    cases += [(*GIVEN, "--parameter", "Cn=1"), GIVEN, GIVEN[:3], ("correct",), (*GIVEN, "--quantity", "force.y")]
    names = ("force", "force.q", "power.x", "thrust.y", "-", "", "-force.y.z", "status")
    cases += [(*GIVEN, "--parameter", "Cn=1", f"--quantity={name}") for name in names]
    parameters = ("Cn=3", "Cn=0.5", "Cn=", "Cn", "Cn=1 N", "Cn=one", "K=1", "", "A=40deg")
    cases += [(*GIVEN, "--quantity=-force.y", "--parameter", x) for x in parameters]
    cases += [("correct", "--sim", "plain.nc", *ASKED[3:]), (*ASKED, "--cluster", "tcp://127.0.0.1:1")]
    cases += [("correct", "--sim", "plain.nc", *GIVEN[3:], "--quantity=-force.y", "--method", "cn-svd")]
    check_wrong(nectosome, cases, tmp_path)


def test_what_was_left_out_is_told(nectosome, lab, tmp_path):
    """A repeat that is ten times as large as the others, and a gap."""
    for name, factor, kept in (("run_0_0_1.csv", 10, range(200)), ("run_1_2_0.csv", 1, [*range(90), *range(100, 200)])):
        file = tmp_path / "lab" / name
        rows = np.loadtxt(file, delimiter=",", skiprows=1)[kept] * [1, factor]
        np.savetxt(file, rows, delimiter=",", header="t,F", comments="")
    answer = nectosome(*ASKED, "--next", "1")
    assert answer.code == 0
    assert "run_0_0_1.csv: left out, far from the other repeats" in answer.out
    assert "run_1_2_0.csv: time: a gap of 0.275 s before row 92" in answer.out
    assert "run_1_2_0.csv: 1 of 5 cycles left out, which are not wholly there" in answer.out


def test_mistakes_name_the_file_and_the_way_out(nectosome, lab, tmp_path):
    lab.write_text(lab.read_text().replace("f: 0.4 Hz", "f: 20 deg"))
    answer = nectosome(*ASKED)
    assert answer.err == "run_0_0_0.csv, f: is in rad, what is simulated in Hz: not of one kind.\n"
    answer = nectosome(*GIVEN, "--quantity=force")
    assert "Write force.x or force.y." in answer.err
