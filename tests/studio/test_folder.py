import os
import stat
import sys

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from nectosome.description import load_robot
from nectosome.studio import uploads
from nectosome.studio.folder import WorkFolder, _parts
from nectosome.studio.uploads import harmless, received
from nectosome.units import InputError

posix = pytest.mark.skipif(sys.platform == "win32", reason="links and pipes need rights there")

# Names made of the pieces with which one gets out of a folder, and of any characters at all, half ones too.
PIECES = ["..", ".", "/", "\\", "~", "*", "C:", "CON", "nul.yaml", "%2e%2e", "a.yaml", "b.txt", "runs", "out", "in"]
PIECES += ["pipe", "loop", "dangling.yaml", ".git", "secret"]
PIECES += ["\0", "\n", " ", "\u2215", "\uff0f", "\u202e", "\ud800", "a" * 60]
ANY = st.lists(st.integers(0, sys.maxunicode).map(chr)).map("".join)
quick = settings(deadline=None)
NAMES = st.one_of(ANY, st.lists(st.sampled_from(PIECES), max_size=6).map("".join))


@pytest.fixture(scope="module")
def around(tmp_path_factory):
    """A folder with what should not be reached beside it, and links of all kinds in it."""
    top = tmp_path_factory.mktemp("around").resolve()
    (top / "secret").write_text("secret")
    (top / "work-other").mkdir()
    (top / "work-other" / "secret").write_text("secret")
    root = top / "work"
    for name in ("runs/deep", ".git", "empty.yaml"):
        (root / name).mkdir(parents=True)
    runs = ("runs/c.yaml", "runs/deep/d.yaml", "runs/.e.yaml")
    for name in ("a.yaml", "B.YAML", "b.txt", ".hidden", ".git/config", *runs):
        (root / name).write_text(name)
    if sys.platform != "win32":
        os.mkfifo(root / "pipe")
        for name, to in {
            "out": "..",
            "out.yaml": "../secret",
            "near.yaml": "../work-other/secret",
            "device.yaml": "/dev/null",
            "in": "runs",
            "in.yaml": "runs/c.yaml",
            "loop": "loop",
            "dangling.yaml": "nothing",
            "runs/back.yaml": "../../secret",
            "pipe.yaml": "pipe",
        }.items():
            (root / name).symlink_to(to)
    return WorkFolder(root)


@quick
@given(NAMES)
@example("../secret")
@example("out/secret")
@example("out.yaml")
@example("near.yaml")
@example("../work-other/secret")
@example("/etc/passwd")
@example("in/../../secret")
def test_whatever_the_name_an_existing_file_lies_within(around, name):
    try:
        path = around.existing(name)
    except InputError:
        return
    assert path.is_absolute() and path == path.resolve() and path.is_relative_to(around.root)
    assert stat.S_ISREG(path.lstat().st_mode) and path.read_text() != "secret"


@quick
@given(NAMES)
@example("../new")
@example("out/new")
@example("out.yaml")
@example("dangling")
def test_whatever_the_name_a_target_lies_within(around, name):
    try:
        path = around.target(name, ".yaml")
    except InputError:
        return
    assert path.parent == path.parent.resolve(strict=True) and path.is_relative_to(around.root)
    assert path.suffix.lower() == ".yaml" and not path.is_symlink()
    assert not path.exists()


@quick
@given(NAMES)
@example("a/../../b.yaml")
@example("\ud800" * 300)
@example("\U00020000" * 300 + ".yaml")
@example("COM1.yaml")
@example("..")
@example("")
def test_whatever_the_name_an_upload_gets_a_harmless_one(name):
    safe = harmless(name)
    assert safe and not set(safe) & set('/\\:\0*?"<>|') and safe.isprintable() and not safe.startswith(".")
    assert safe == safe.strip(". ") and len(safe.encode()) <= 255 and _parts(safe) == [safe]


@quick
@given(NAMES)
def test_an_upload_lies_in_a_folder_of_its_own_and_goes_with_it(name):
    with received(name, b"content") as path:
        assert path.read_bytes() == b"content" and list(path.parent.iterdir()) == [path]
        if sys.platform != "win32":
            assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700 and not path.stat().st_mode & 0o111
    assert not path.parent.exists()


def test_an_upload_keeps_what_readers_go_by():
    assert harmless("my fish.yaml") == "my fish.yaml" and harmless("Größe.xlsx") == "Größe.xlsx"
    assert harmless("C:\\data\\Run 3.CSV") == "Run 3.CSV" and harmless("../../.bashrc") == "bashrc"
    assert harmless("nul.nc") == "_nul.nc"


def test_an_upload_is_data_to_its_reader(tmp_path):
    bad = f"!!python/object/apply:os.mkdir ['{tmp_path / 'made'}']".encode()
    with received("bad.yaml", bad) as path, pytest.raises(InputError, match=r"bad\.yaml"):
        load_robot(path)
    assert not (tmp_path / "made").exists()


def test_a_huge_upload_is_refused(monkeypatch):
    monkeypatch.setattr(uploads, "UPLOAD_LIMIT", 1000)
    with received("a.csv", bytes(1000)):
        pass
    with pytest.raises(InputError, match=r"a\.csv"), received("a.csv", bytes(1001)):
        pass


@posix
def test_names_are_those_that_can_be_opened(around):
    assert around.names(".yaml") == ["B.YAML", "a.yaml", "in.yaml", "in/c.yaml", "runs/c.yaml"]
    assert around.names(".yaml", ".txt") == ["B.YAML", "a.yaml", "b.txt", "in.yaml", "in/c.yaml", "runs/c.yaml"]
    assert around.names() == around.names(".yaml", ".txt") and around.names(".nc") == []
    for name in around.names():
        assert around.existing(name).is_file()


def test_a_long_list_is_cut(tmp_path):
    for k in range(310):
        (tmp_path / f"{k:03}.nc").touch()
    assert WorkFolder(tmp_path).names(".nc") == [f"{k:03}.nc" for k in range(300)]


@posix
@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("out.yaml", "leads out"),
        ("near.yaml", "leads out"),
        ("device.yaml", "leads out"),
        ("out/secret", "leads out"),
        ("runs/back.yaml", "leads out"),
        ("../secret", "within the working folder"),
        ("/etc/passwd", "within the working folder"),
        (".git/config", "hidden"),
        ("C:a.yaml", "without"),
        ("runs\\c.yaml", "without"),
        ("a.yaml\0", "printed"),
        ("a.yaml:stream", "without"),
        ("a.yaml.", "end with a dot"),
        ("aux.yaml", "device under Windows"),
        ("a" * 101, "101 characters"),
        ("", "0 characters"),
        ("runs", "a folder"),
        ("pipe", "a pipe or a device"),
        ("pipe.yaml", "a pipe or a device"),
        ("loop", "cannot be opened"),
        ("dangling.yaml", "cannot be opened"),
        ("missing.yaml", "cannot be opened"),
        ("a.yaml/b", "cannot be opened"),
    ],
)
def test_a_refusal_says_why(around, name, why):
    with pytest.raises(InputError, match=why) as refused:
        around.existing(name)
    assert "\0" not in str(refused.value) and str(around.root.parent) not in str(refused.value)


@posix
@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("a.yaml", "there already"),
        ("a", "there already"),
        ("in/c.yaml", "there already"),
        ("empty", "a folder"),
        ("in.yaml", "a link"),
        ("out.yaml", "a link"),
        ("device.yaml", "a link"),
        ("dangling", "a link"),
        ("out/new", "leads out"),
        ("missing/new", "cannot be opened"),
        ("a.yaml/new", "not a folder"),
        ("", "hidden"),
        ("runs/", "hidden"),
        ("a" * 96, "101 characters"),
    ],
)
def test_a_target_is_refused_with_a_reason(around, name, why):
    with pytest.raises(InputError, match=why):
        around.target(name, ".yaml")


@posix
def test_a_target_has_its_suffix_and_links_of_folders_followed(around):
    assert around.target("new", ".yaml") == around.root / "new.yaml"
    assert around.target("new.YAML", ".yaml") == around.root / "new.YAML"
    assert around.target("evil.sh", ".yaml") == around.root / "evil.sh.yaml"
    assert around.target("in/new", ".nc") == around.root / "runs" / "new.nc"


def test_a_working_folder_has_to_be_one(tmp_path):
    (tmp_path / "file").touch()
    for bad in (tmp_path / "missing", tmp_path / "file"):
        with pytest.raises(InputError, match="working folder"):
            WorkFolder(bad)
