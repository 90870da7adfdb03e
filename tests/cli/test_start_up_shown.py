"""Show tells which plates have a start-up, and why, where their file leaves it open."""

import json
from pathlib import Path

import pytest
from tests.description.test_left_open import chain


@pytest.mark.parametrize(
    ("hinges", "field", "told"),
    [
        (1, "", ("yes", "fewer than 3 hinges")),
        (3, "", ("none", "3 hinges or more, or a rod")),
        (1, ", start_up: none", None),
        (1, ", start_up: {}", None),
    ],
)
def test_show_tells_what_was_decided_and_why(nectosome, hinges: int, field: str, told: tuple[str, str] | None):
    """Where the file does not say it; what a plate has stands with its load in any case."""
    Path("robot.yaml").write_text(chain(hinges, field))
    answer = nectosome("show", "robot.yaml", "--json")
    rows = [row for row in json.loads(answer.out)["tables"]["assumed"] if row["what"] == "start-up"]
    assert [(row["value"], row["source"]) for row in rows] == ([] if told is None else [told])
    steady = "none" in field or (told is not None and told[0] == "none")
    assert ("start up none" in nectosome("show", "robot.yaml").out) == steady
