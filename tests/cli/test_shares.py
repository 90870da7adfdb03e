"""`--part` and `gather`: what they print and write, and what they refuse; `--cluster` without a cluster."""

import pytest
from tests.small_robots import BALL, DRIVEN

from nectosome.description import dump_robot, parse_robot, with_values
from nectosome.io import load_dataset

from .answers import check_wrong

ARM = dump_robot(with_values(parse_robot(DRIVEN), {"I": 1e-3, "k": 0.06, "c": 0.01, "M": 0.02, "f": 2.0}))
OVER = ("--over", "M=10..30:10mN m", "--over", "f=1..2:0.05Hz")
DESIGN = ("design", "ball.yaml", "--vary", "body.density=1100..1300kg/m3", "--forward", "-z", "--starts", "3")


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.yaml").write_text(ARM)
    return "arm.yaml"


def test_shares_of_a_sweep_are_joined(nectosome, arm, tmp_path):
    assert nectosome("sweep", arm, *OVER, "--save", "whole.nc").code == 0
    for k in (1, 2):
        answer = nectosome("sweep", arm, *OVER, "--part", f"{k}/2", "--save", f"share-{k}.npz")
        assert (answer.code, answer.out) == (0, f"written: share-{k}.npz\n"), answer.err
    (tmp_path / arm).unlink()  # a share knows its robot
    answer = nectosome("gather", "share-2.npz", "share-1.npz", "--save", "grid.nc")
    assert answer.code == 0, answer.err
    assert "63 points: 63 SOLVED" in answer.out
    found, whole = load_dataset("grid.nc"), load_dataset("whole.nc")
    assert found.drop_attrs().identical(whole.drop_attrs())
    assert sorted(file.name for file in tmp_path.iterdir()) == ["grid.nc", "share-1.npz", "share-2.npz", "whole.nc"]


@pytest.mark.usefixtures("one_process")
def test_shares_of_a_design_are_joined(nectosome, tmp_path):
    (tmp_path / "ball.yaml").write_text(BALL)
    for k in (1, 2):
        answer = nectosome(*DESIGN, "--part", f"{k}/2", "--out", f"share-{k}")
        assert answer.code == 0, answer.err
    answer = nectosome("gather", "share-1", "share-2", "--out", "all")
    assert (answer.code, answer.err) == (0, "all: 3 starts. The design's command with --out all shows them.\n")
    joined, whole = (nectosome(*DESIGN, "--out", out) for out in ("all", "whole"))
    assert joined.code == whole.code == 0
    assert joined.out.splitlines()[:5] == whole.out.splitlines()[:5]
    assert load_dataset("all/evaluations.nc")["u"].identical(load_dataset("whole/evaluations.nc")["u"])


def test_wrong_shares_are_answered_in_a_sentence(nectosome, arm, tmp_path):
    (tmp_path / "ball.yaml").write_text(BALL)
    (tmp_path / "folder").mkdir()
    assert nectosome("sweep", arm, *OVER, "--part", "1/2", "--save", "share.npz").code == 0
    cases = [
        ("sweep", arm, *OVER, "--part", "3/2", "--save", "new.npz"),
        ("sweep", arm, *OVER, "--part", "half", "--save", "new.npz"),
        ("sweep", arm, *OVER, "--part", "1/2"),
        ("sweep", arm, *OVER, "--part", "1/2", "--save", "new.nc"),
        ("sweep", arm, *OVER, "--part", "1/2", "--save", "share.npz"),
        ("sweep", arm, *OVER, "--part", "1/2", "--save", "new.npz", "--plot", "new.html"),
        (*DESIGN, "--part", "1/2"),
        (*DESIGN, "--part", "0/2", "--out", "run"),
        ("gather",),
        ("gather", "share.npz"),
        ("gather", "share.npz", "share.npz"),
        ("gather", "nothing.npz"),
        ("gather", "arm.yaml"),
        ("gather", "share.npz", "--out", "new"),
        ("gather", "folder"),
        ("gather", "folder", "--out", "new"),
        ("sweep", arm, *OVER, "--cluster", "nowhere"),
        ("sweep", arm, *OVER, "--cluster", arm),
        (*DESIGN, "--cluster", "carrier://pigeon"),
    ]
    check_wrong(nectosome, cases, tmp_path)
