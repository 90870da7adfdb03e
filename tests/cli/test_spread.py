"""`--spread`: what it prints, saves and refuses."""

import json

import pytest
from tests.designs.test_uncertain_runs import SPEED, STATED

from nectosome.io import load_dataset

from .answers import check_wrong


@pytest.fixture
def sinking(tmp_path):
    (tmp_path / "sinking.yaml").write_text(STATED)
    return "sinking.yaml"


def test_every_number_has_an_interval_and_what_makes_it_wide(nectosome, sinking, tmp_path):
    argv = ("steady", sinking, "--spread", "--draws", "10", "--save", "draws.nc", "--plot", "page.html")
    answer = nectosome(*argv, "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    speed = found["tables"]["body"]["velocity, size"]
    assert speed["value"]["value"] == pytest.approx(SPEED, rel=1e-6)
    assert speed["low"]["value"] < SPEED < speed["high"]["value"]
    assert found["tables"]["sources"]["area"]["range"] == "-16.7 to +20 %"
    assert sorted(file.name for file in tmp_path.iterdir()) == ["draws.nc", "page.html", "sinking.yaml"]
    saved = load_dataset(tmp_path / "draws.nc")
    assert saved.sizes["draw"] == 11
    assert "<h3>What makes them wide</h3>" in (tmp_path / "page.html").read_text()


def test_the_text_fits_80_columns(nectosome, sinking):
    answer = nectosome("steady", sinking, "--spread", "--draws", "10")
    assert "sinking: steady motion, 80 % intervals" in answer.out
    assert "area makes 100 % of the variance" in answer.out
    assert max(map(len, answer.out.splitlines())) <= 80


def test_a_sweep_has_intervals_at_its_ends(nectosome, sinking):
    answer = nectosome("sweep", sinking, "--over", "body.mass=2,3kg", "--spread", "--draws", "8", "--json")
    assert answer.code == 0, answer.err
    rows = json.loads(answer.out)["tables"]["intervals"]
    low, value, high = (rows["speed.lowest"][key]["value"] for key in ("low", "value", "high"))
    assert low < value < high
    assert value == pytest.approx(SPEED, rel=1e-4)


def test_the_best_design_has_intervals_too(nectosome, sinking):
    argv = ("design", sinking, "--vary", "body.mass=2..3kg", "--minimise", "speed", "--forward", "-z", "--starts", "1")
    answer = nectosome(*argv, "--spread", "--draws", "8", "--json")
    assert answer.code == 0, answer.err
    (part,) = json.loads(answer.out)["parts"]
    speed = part["tables"]["body"]["velocity, size"]
    assert speed["value"]["value"] == pytest.approx(SPEED, rel=1e-3)
    assert speed["low"]["value"] < SPEED < speed["high"]["value"]


def test_what_goes_with_spread_is_refused_without_it(nectosome, sinking, tmp_path):
    (tmp_path / "bad.yaml").write_text(STATED.replace("+- 20 %", "+- 20 mm"))
    (tmp_path / "known.yaml").write_text(STATED.split("  loads:")[0])
    cases = (
        ("steady", sinking, "--draws", "10"),
        ("steady", sinking, "--spread", "--draws", "2"),
        ("steady", sinking, "--spread", "--draws", "many"),
        ("periodic", sinking, "--cluster", "tcp://127.0.0.1:1"),
        ("simulate", sinking, "--mission", "none.yaml", "--spread"),
        ("sweep", sinking, "--over", "body.mass=2,3kg", "--spread", "--part", "1/2", "--save", "share.npz"),
        ("steady", "bad.yaml", "--spread"),
        ("design", sinking, "--mission", "none.yaml", "--spread"),
        ("steady", "known.yaml", "--spread"),
        ("steady", sinking, "--set", "area=0.01 m2 +- 0 m2"),
    )
    check_wrong(nectosome, cases, tmp_path)
