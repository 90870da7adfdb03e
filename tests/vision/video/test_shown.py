"""What people see and hand on: the overlay, the table, and proposed colours."""

import numpy as np
import pytest

from nectosome.io import save_dataset
from nectosome.measure import read
from nectosome.vision.video import Clip, Colour, draw_over, proposal_text, propose, track_segments
from nectosome.vision.video.segments import ColourGroups
from nectosome.vision.video.sheet import load_sheet

from . import scenes
from .conftest import sheet_of


@pytest.fixture(scope="module")
def tracked(rowing):
    return track_segments(rowing[0], sheet_of())


def test_the_overlay_is_the_video_with_marks_near_the_segments(rowing, tracked, tmp_path):
    path = tmp_path / "over.mp4"
    draw_over(rowing[0], sheet_of(), tracked, path, lambda what, share: None)
    before, after = (list(Clip(p).frames()) for p in (rowing[0], path))
    np.testing.assert_allclose([f.time for f in after], [f.time for f in before], atol=2e-3)
    change = np.abs(after[10].image.astype(int) - before[10].image).max(axis=2) > 60
    rows, columns = np.nonzero(change[75:])  # below the text
    ends = scenes.ends(np.array([before[10].time]))[0].reshape(-1, 2) * [500, -500] + 159.5
    assert len(rows) > 100
    assert rows.max() + 75 < ends[:, 1].max() + 15
    assert ends[:, 0].min() - 15 < columns.min()
    assert columns.max() < ends[:, 0].max() + 15


def test_an_overlay_that_fails_leaves_no_file(rowing, tracked, tmp_path):
    path = tmp_path / "over.mp4"

    def stop(what, share):
        if share > 0.3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        draw_over(rowing[0], sheet_of(), tracked, path, stop)
    assert not list(tmp_path.iterdir())


def test_the_table_is_read_back_as_it_was(tracked, tmp_path):
    made = tracked.copy(deep=True)
    made["direction"][3, 1] = np.nan
    path = tmp_path / "t.csv"
    save_dataset(made, path)
    back = read(path)
    np.testing.assert_array_equal(back["time"], made["time"])
    np.testing.assert_array_equal(back["direction first"], made["direction"].sel(segment="first"))
    np.testing.assert_array_equal(back["position arm y"], made["position"].sel(segment="arm", axis="y"))
    assert back["position arm y"].attrs["units"] == "m"
    assert np.isnan(back["direction first"][3])


def test_proposed_colours_find_the_layers(rowing, tmp_path):
    """They are a sheet already, and track like the one that a person wrote."""
    clip = Clip(rowing[0])
    frame = next(clip.frames())
    found = propose(frame.image)
    bits = ColourGroups([one.colour for one in found]).find(frame.image)
    for ends in scenes.ends(np.array([0.0]))[0]:
        u, v = ends.mean(axis=0) * [500, -500] + 159.5
        assert bits[round(v), round(u)] != 0
    path = tmp_path / "track.yaml"
    path.write_text(proposal_text(found, clip, frame.time))
    sheet = load_sheet(path)
    assert len(sheet.segments) == len(found) >= 4


def test_proposed_colours_come_along_the_chain_from_the_left():
    """Four patches on a bow, the largest ones first without that; from the other side it is the same bow."""
    image = np.full((200, 260, 3), 90, np.uint8)
    bow = [((20, 120), 10, (30, 40, 210)), ((80, 60), 14, (200, 60, 20)), ((150, 60), 9, (40, 190, 60))]
    for (u, v), half, colour in [*bow, ((210, 130), 16, (30, 200, 220))]:
        image[v - half : v + half, u - half : u + half] = colour
    for picture in (image, image[:, ::-1]):
        left = [one.middles[0][0] for one in propose(np.ascontiguousarray(picture))]
        assert len(left) == 4 and left == sorted(left)


def test_a_grey_picture_proposes_nothing():
    assert propose(np.full((60, 80, 3), 120, np.uint8)) == []


def test_a_tank_full_of_blue_is_background():
    image = np.full((120, 160, 3), (160, 60, 20), np.uint8)
    image[50:60, 40:80] = (30, 40, 210)
    (one,) = propose(image)
    assert one.pixels == [400]
    assert isinstance(one.colour, Colour)
    assert one.middles[0] == pytest.approx((59.5, 54.5))
