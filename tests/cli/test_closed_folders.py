"""Commands and folders that may not be entered, names of 300 characters, links in a circle: one sentence, code 2.

Rights are those of an ordinary user: those of root are put down where tests run as root.
"""

import pytest
from tests.rights import ordinary_rights
from tests.small_robots import BALL

from .answers import check_wrong

LONG = "n" * 300
COLUMNS = "columns: {f: {column: f, unit: N}}\nrecordings:\n- {file: %s}\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "ball.yaml").write_text(BALL)
    (tmp_path / "circle").symlink_to("circle")
    (tmp_path / "locked").mkdir()
    for name in ("locked/in.yaml", "shut.yaml"):
        (tmp_path / name).write_text(BALL)
        (tmp_path / name).chmod(0)
    files = (f"{LONG}.csv", "locked/a.csv", "'locked/*.csv'", "circle/a.csv", f"'{LONG}*.csv'", "'a**.csv'", '"a\\0b"')
    for k, file in enumerate(files):
        (tmp_path / f"campaign_{k}.yaml").write_text(COLUMNS % file)
    (tmp_path / "locked").chmod(0)
    with ordinary_rights():
        yield tmp_path
    (tmp_path / "locked").chmod(0o700)


def files(suffix: str) -> list[str]:
    """Names of files that cannot be, or not be read; the last one is a folder's."""
    names = ("locked/in", "locked/gone", "locked/inner/x", LONG, f"gone/{LONG}", "circle/x", "shut", "a\0b")
    return [f"{name}{suffix}" for name in names] + [LONG]


def cases() -> list[tuple[str, ...]]:
    found: list[tuple[str, ...]] = []
    for name in files(".yaml"):
        found += [(command, name) for command in ("show", "check", "simulate", "steady", "design", "measure")]
        found += [("new", name), ("new", f"{name}.urdf"), ("studio", name, "--no-browser")]
        found += [("schema", "robot", "--save", name), ("simulate", "ball.yaml", "--mission", name)]
        found += [("identify", kind, "--campaign", name) for kind in ("hysteresis", "surge")]
        found += [("control", "rig", "--config", name, "--reference", "1mm"), ("track", "x.mp4", "--config", name)]
        found += [] if name == "shut.yaml" else [("new", "flagellum", name, "--force")]
    for name in files(".nc"):
        found += [("show", name), ("measure", name)]
        found += [] if name == "shut.nc" else [("simulate", "ball.yaml", "--save", name)]
    for name in ("locked", "locked/inner", LONG, "circle", "ball.yaml", "ball.yaml/inner", "a\0b"):
        found += [("studio", "ball.yaml", "--folder", name), ("tutorial", "servo", name), ("measure", name)]
        found += [("design", "ball.yaml", "--vary", "body.mass=1..2kg", "--out", name)]
        found += [("reproduce", "flagellum", "--out", name), ("new", "flagellum", f"{name}/x.yaml")]
        found += [("simulate", "ball.yaml", "--plot", f"{name}/x.html")]
    for k in range(7):
        found += [
            ("measure", "--config", f"campaign_{k}.yaml"),
            ("identify", "surge", "--campaign", f"campaign_{k}.yaml"),
        ]
        found += [("identify", "hysteresis", "--campaign", f"campaign_{k}.yaml")]
    return found


def test_what_may_not_be_entered_is_told_in_a_sentence(nectosome, folder):
    check_wrong(nectosome, cases(), folder)
