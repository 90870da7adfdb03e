"""Questions to the file system have an answer for every path: rights are those of an ordinary user, root's put down."""

import pytest
from tests.rights import ordinary_rights

from nectosome.io.file_system import check_readable, entries, exists, is_file, is_folder, is_taken, make_folder
from nectosome.units import InputError

LONG, NUL = "n" * 300, "a\0b"


@pytest.fixture
def folder(tmp_path):
    """A folder that may not be entered, one whose names may be read only, a circle of links, and a link to nothing."""
    (tmp_path / "locked").mkdir()
    (tmp_path / "locked" / "file").touch()
    (tmp_path / "names").mkdir()
    (tmp_path / "names" / "file").touch()
    (tmp_path / "circle").symlink_to("circle")
    (tmp_path / "nowhere").symlink_to("gone")
    (tmp_path / "locked").chmod(0)
    (tmp_path / "names").chmod(0o400)
    with ordinary_rights():
        yield tmp_path
    (tmp_path / "locked").chmod(0o700)
    (tmp_path / "names").chmod(0o700)


def test_the_rights_of_root_are_put_down(folder):
    with pytest.raises(PermissionError):
        (folder / "locked" / "file").stat()


@pytest.mark.parametrize(
    ("name", "answers"),
    [
        (".", (True, False, True, True)),
        ("locked", (True, False, True, True)),
        ("locked/file", (False, False, False, False)),
        ("names/file", (False, False, False, False)),
        ("circle", (False, False, False, True)),
        ("nowhere", (False, False, False, True)),
        (LONG, (False, False, False, False)),
        (f"{LONG}/file", (False, False, False, False)),
        (NUL, (False, False, False, False)),
        ("a/" * 3000, (False, False, False, False)),
    ],
)
def test_what_is_not_known_to_be_there_is_not(folder, name, answers):
    path = folder / name
    assert (exists(path), is_file(path), is_folder(path), is_taken(path)) == answers


def test_a_folder_that_may_not_be_read_has_no_entries(folder):
    assert [path.name for path in entries(folder)] == ["circle", "locked", "names", "nowhere"]
    for name in ("locked", "circle", "gone", LONG, NUL):
        assert entries(folder / name) == []
    for pattern in ("locked/*", f"{LONG}/*", "*/**x", "a**", "", NUL):
        assert entries(folder, pattern) == []


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("locked", "Permission denied"),
        ("names", "Permission denied"),
        ("locked/inner", "Permission denied"),
        ("gone", "No such file"),
        ("circle", "symbolic links"),
        (LONG, "too long"),
        (NUL, "null"),
    ],
)
def test_a_folder_that_cannot_be_used_is_told_why(folder, name, why):
    with pytest.raises(InputError, match=why):
        check_readable(folder / name)
    if name not in ("locked", "names", "gone"):
        with pytest.raises(InputError, match=f"cannot make the folder .*({why}|exists)"):
            make_folder(folder / name / "inner")


def test_a_folder_that_cannot_be_made_leaves_none_of_those_that_it_lies_in(folder):
    for name in (f"new/inner/{LONG}", f"new/{NUL}", f"new/inner/{LONG}/x"):
        with pytest.raises(InputError, match="cannot make the folder"):
            make_folder(folder / name)
        assert not exists(folder / "new")
    make_folder(folder / "new" / "inner")
    with pytest.raises(InputError, match="cannot make the folder"):
        make_folder(folder / "new" / "inner" / LONG)
    assert is_folder(folder / "new" / "inner")  # it was there before
