"""`nectosome track`: what it writes, and what it says to mistakes."""

import numpy as np
import pytest
from tests.vision.video import scenes

from nectosome.cli.app import main
from nectosome.io import load_dataset
from nectosome.measure import read
from nectosome_studies.track.render import write_clip

SHEET = """\
pixel: 2 mm
origin: [159.5, 159.5]
segments:
  arm: {hue: [205 deg, 245 deg], saturation: [0.45, 1], length: 99 mm}
  first: {hue: [345 deg, 15 deg], saturation: [0.45, 1]}
  second: {hue: [110 deg, 150 deg], saturation: [0.45, 1]}
  third: {hue: [40 deg, 65 deg], saturation: [0.45, 1]}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("track")
    scene = scenes.paddle()
    write_clip(folder / "row.mp4", (scene.frame(k / 15) for k in range(12)), 15, quality=8)
    (folder / "track.yaml").write_text(SHEET)
    (folder / "text.mp4").write_text("no video")
    (folder / "small.yaml").write_text("size: [64, 48]\n" + SHEET)
    (folder / "bad.yaml").write_text(SHEET.replace("2 mm", "2 mn"))
    return folder


def test_all_that_it_writes(folder, capsys):
    names = {"--save": "o.nc", "--overlay": "o.mp4", "--plot": "o.html"}
    options = [part for option, name in names.items() for part in (option, str(folder / name))]
    assert main(["track", str(folder / "row.mp4"), "--config", str(folder / "track.yaml"), *options]) == 0
    out = capsys.readouterr().out
    assert "12 frames" in out
    assert "third" in out
    saved = load_dataset(folder / "o.nc")
    wrong = np.rad2deg(saved["direction"].values - scenes.angles(saved["time"].values))
    assert np.sqrt(np.nanmean(wrong**2)) < 1.5
    assert all((folder / name).stat().st_size > 500 for name in names.values())
    again = ["track", str(folder / "row.mp4"), "--config", str(folder / "track.yaml")]
    assert main([*again, "--overlay", str(folder / "o.mp4")]) == 2
    assert "o.mp4 exists. Give another name, or --force to overwrite it." in capsys.readouterr().err
    assert main([*again, "--save", str(folder / "o.csv")]) == 0
    direction = read(folder / "o.csv")["direction first"].values
    np.testing.assert_allclose(direction, saved["direction"].sel(segment="first"), rtol=1e-15)


def test_proposed_colours_are_printed_as_a_sheet(folder, capsys):
    assert main(["track", str(folder / "row.mp4"), "--propose", "--at", "0.5s"]) == 0
    out = capsys.readouterr().out
    assert "segments:\n  segment1: {hue: [" in out
    assert "size: [320, 320]" in out


MISTAKES = {
    "": "name a video",
    "row.mp4": "--propose prints a start of one",
    "none.mp4 --config track.yaml": "none.mp4: does not exist",
    "text.mp4 --config track.yaml": "it is not a readable video",
    "row.mp4 --config none.yaml": "none.yaml",
    "row.mp4 --config bad.yaml": "bad.yaml, line 1, pixel",
    "row.mp4 --config row.mp4": "row.mp4",
    "row.mp4 --config small.yaml": "320 x 320 pixels, and the sheet is for 64 x 48",
    "row.mp4 row.mp4 --config track.yaml": "segments are tracked in one video, not 2",
    "row.mp4 --config track.yaml --save a.txt": '--save: "a.txt" does not end in .nc or .csv',
    "row.mp4 --config track.yaml --overlay none/a.mp4": "--overlay: cannot write into none",
    "row.mp4 --propose --at 9s": "--at: the video ends at 0.7333 s",
    "row.mp4 --propose --at soon": "--at",
    "row.mp4 --propose --config track.yaml": "--propose: takes a single video",
}


@pytest.mark.parametrize("words", MISTAKES)
def test_mistakes_are_told(folder, words, capsys, monkeypatch):
    monkeypatch.chdir(folder)
    assert main(["track", *words.split()]) == 2
    told = capsys.readouterr()
    assert MISTAKES[words] in told.err
    assert "Traceback" not in told.err
