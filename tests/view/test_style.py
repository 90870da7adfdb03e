"""Colours of loads and drives: no two alike in a figure, the usual ones the same in all."""

from nectosome.view.style import BLUE, VERMILLION, source_lines

NAMES = ["left.angle", "right.angle", "drag", "muscle", "hull_drag", "push", "pull", "wake", "viscous", "jet"]


def test_no_two_loads_or_drives_look_alike():
    lines = source_lines(NAMES)
    assert len({(line["color"], line["dash"]) for line in lines}) == len(NAMES)
    assert lines[0] == {"color": BLUE, "dash": "solid"}


def test_what_is_in_most_robots_has_the_same_colour_whatever_else_there_is():
    for names in (["drag"], NAMES, NAMES[::-1]):
        assert source_lines(names)[names.index("drag")] == {"color": VERMILLION, "dash": "solid"}
