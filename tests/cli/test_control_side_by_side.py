"""`control ROBOT --controller pid,mpc`: the table and the page of several controllers, exit codes, what is refused."""

import json

import pytest
from tests.small_robots import SLIDE

from nectosome.io import load_dataset

from .answers import check_wrong

SINE = ("--reference", "sine", "--amplitude", "5cm", "--frequency", "0.4Hz")
GAINS = ("--gains", "20,30,10")
ASKED = ("control", "slide.yaml", "--command", "push=-2..2N", "--measure", "body.position")


@pytest.fixture
def slide(tmp_path):
    (tmp_path / "slide.yaml").write_text(SLIDE)


def test_controllers_are_compared_in_a_table_a_page_and_a_file(nectosome, slide, tmp_path):
    """Gains of 20 N/m are 0.2 N/cm, the unit of the amplitude."""
    files = ("--save", "both.nc", "--plot", "both.html")
    answer = nectosome(*ASKED, *SINE, "--gains", "0.2,0.3,0.1", "--controller", "pid,mpc", *files)
    assert (answer.code, answer.err) == (0, "")
    title, _, head, pid, mpc, *others = answer.out.splitlines()
    assert title == "slide: body.position by push, 2 controllers, 5 s"
    assert head.split() == ["controller", "outcome", "rms", "error", "largest", "effort", "change", "at", "limits"]
    assert pid.split()[:2] == ["pid", "tracks"] and mpc.split()[:2] == ["mpc", "tracks"]
    assert "least rms error of those that track: mpc" in others and others[-1] == "written: both.nc, both.html"
    assert answer.out.count(title) == 1
    data = load_dataset("both.nc")
    assert pid.split()[2] == f"{100 * float(data['rms_error'][0]):.4g}"
    page = (tmp_path / "both.html").read_text()
    assert "2 controllers" in page and "pid, rms error" in page and "body.position (" in page
    shown = nectosome("show", "both.nc", "--plot", "again.html")
    assert (shown.code, shown.err) == (0, "")
    assert (tmp_path / "again.html").read_text() == page
    said, _, _, again, *_ = shown.out.splitlines()
    assert said == title and again.split()[:2] == ["pid", "tracks"]
    assert float(again.split()[2]) == pytest.approx(float(pid.split()[2]) / 100, rel=1e-3)
    assert "least rms error of those that track: mpc" in shown.out
    loads = nectosome("show", "both.nc", "--loads")
    assert (loads.code, loads.err) == (2, "--loads: is for a saved run, and this is a comparison of controllers.\n")
    assert nectosome("render", "both.nc", "--save", "a.png").err.endswith("`nectosome show` draws it.\n")


def test_one_that_is_refused_has_a_row_and_the_exit_code_is_that_of_the_best(nectosome, slide):
    """A constant reference has no frequency for a scheduled PID."""
    step = (*ASKED, "--reference", "10cm", "--time", "4s", "--controller", "scheduled,pid", "--json")
    answer = nectosome(*step)
    found = json.loads(answer.out)
    assert (answer.code, found["error"]) == (0, None)
    refused, pid = found["tables"]["controllers"].values()
    assert (pid["outcome"], pid["cause"]) == ("tracks", "")
    assert refused["outcome"] == "refused" and refused["cause"].startswith("a reference that is constant has no")
    assert refused["rms_error"]["value"] is None and pid["rms_error"]["unit"] == "m"
    assert any(note.startswith("scheduled, refused: a reference that is constant") for note in found["notes"])


def test_the_exit_code_is_1_where_none_tracks(nectosome, slide):
    """10 mN hold a spring of 5 N/m at 2 mm."""
    weak = ("--command", "push=-0.01..0.01N", *ASKED[4:])
    answer = nectosome(*ASKED[:2], *weak, *SINE, "--gains", "1,1,0", "--controller", "pid,ff-pid")
    assert answer.code == 1
    assert answer.err == "slide: none of pid, ff-pid tracks.\n"
    assert "pid: tracks poorly: body.position is off by" in answer.out


def test_nothing_is_written_where_all_are_refused(nectosome, slide, tmp_path):
    """A push along x does not move it along y, so that it has no linear model. One sentence is said of both."""
    along_y = ("--measure", "position.y", "--reference", "10cm", "--time", "2s", "--gains", "1,1,1")
    answer = nectosome(*ASKED[:4], *along_y, "--controller", "ff-pid,mpc", "--save", "both.nc")
    assert (answer.code, answer.err) == (1, "slide: none of ff-pid, mpc tracks; nothing is written.\n")
    assert answer.out.count("ff-pid, mpc, refused: a linear model explains 0 % of what push does to") == 1
    assert not (tmp_path / "both.nc").exists()


def test_a_cancelled_comparison_writes_nothing(nectosome, slide, tmp_path, monkeypatch):
    def interrupted(compute, update):
        return compute(lambda what, share: not what.startswith("mpc"))

    monkeypatch.setattr("nectosome.cli.control_side_by_side.cancellable", interrupted)
    answer = nectosome(*ASKED, *SINE, "--gains", "0.2,0.3,0.1", "--controller", "pid,mpc", "--save", "both.nc")
    assert (answer.code, answer.out, answer.err) == (130, "", "cancelled at mpc: nothing is written.\n")
    assert not (tmp_path / "both.nc").exists()


def test_mistakes_are_told_and_nothing_is_written(nectosome, slide, tmp_path):
    check_wrong(
        nectosome,
        [
            (*ASKED, *SINE, "--controller", "pid,mpcc"),
            (*ASKED, *SINE, "--controller", "pid,pid"),
            (*ASKED, *SINE, "--controller", "pid,"),
            (*ASKED, *SINE, "--controller", "pid,scheduled", *GAINS),
            (*ASKED, *SINE, "--controller", "pid,mpc", "--rounds", "3"),
            (*ASKED, *SINE, "--controller", "pid,mpc", "--rig", "simulated"),
            (*ASKED, *SINE, "--controller", "pid,mpc", "--plot", "both.png"),
        ],
        tmp_path,
    )


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (("pid,mpcc",), '--controller: "mpcc" is not known: pid, scheduled, ff-pid, ilc, mpc. Did you mean "mpc"?'),
        (("pid,pid",), '--controller: "pid" stands twice. Each of pid, scheduled, ff-pid, ilc, mpc may be there once.'),
        (("pid,mpc", "--rig", "simulated"), "--rig: takes one --controller at a time. Compare them without it first."),
        (("pid,scheduled", *GAINS), "--gains: are rows by frequency for scheduled, and one row for the others."),
    ],
)
def test_a_mistake_is_told_with_its_way_out(nectosome, slide, argv, message):
    answer = nectosome(*ASKED, *SINE, "--controller", *argv)
    assert answer.code == 2
    assert answer.err.startswith(message)
