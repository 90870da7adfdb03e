"""Whatever name the page sends, it opens and writes inside the working folder or gets a sentence."""

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nectosome.io import InputError
from nectosome.view.studio.folder import Folder, received


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "secret.yaml").write_text("outside")
    root = tmp_path / "work"
    (root / "runs" / "deep" / "deeper").mkdir(parents=True)
    (root / ".hidden").mkdir()
    for name in ("a.yaml", "runs/b.nc", "runs/deep/c.nc", "runs/deep/deeper/d.nc", ".hidden/e.nc", ".f.nc"):
        (root / name).write_text(name)
    (root / "out.yaml").symlink_to(tmp_path / "secret.yaml")
    (root / "away").symlink_to(tmp_path)
    (root / "inner.yaml").symlink_to(root / "a.yaml")
    os.mkfifo(root / "pipe.nc")
    return Folder(root)


def test_names_are_those_of_files_inside(folder):
    assert folder.names(".yaml") == ["a.yaml", "inner.yaml"]
    assert folder.names(".nc") == ["runs/b.nc", "runs/deep/c.nc"]
    assert folder.names(".nc", ".yaml") == ["a.yaml", "inner.yaml", "runs/b.nc", "runs/deep/c.nc"]


def test_files_inside_are_opened_and_new_ones_are_written_there(folder):
    assert folder.existing("runs/b.nc").read_text() == "runs/b.nc"
    assert folder.target("new", ".yaml") == folder.root / "new.yaml"
    assert folder.target("runs/new.nc", ".nc") == folder.root / "runs" / "new.nc"
    with pytest.raises(InputError, match="there already"):
        folder.target("a", ".yaml")
    with pytest.raises(InputError, match="no such file"):
        folder.existing("b.nc")
    with pytest.raises(InputError, match="its folder is not there"):
        folder.target("none/new", ".nc")


OUT = (
    "../secret.yaml",
    "runs/../../secret.yaml",
    "/etc/passwd",
    "//etc/passwd",
    "..\\secret.yaml",
    "C:\\secret.yaml",
    "C:secret.yaml",
    "out.yaml",
    "away/secret.yaml",
    "away/new.yaml",
    ".hidden/e.nc",
    "a.yaml\0.nc",
    "a\n.yaml",
    "",
    ".",
    "..",
    "runs/",
    "runs",
    "./a.yaml",
    "pipe.nc",
    "NUL.yaml",
    "com1.nc",
    "a.yaml:stream",
    "x" * 101 + ".yaml",
    "~/secret.yaml/..",
    "a .",
)


@pytest.mark.parametrize("name", OUT)
def test_nothing_else_is_opened(folder, name):
    with pytest.raises(InputError):
        folder.existing(name)


@pytest.mark.parametrize("name", [name for name in OUT if name not in ("pipe.nc", "runs", "out.yaml")])
def test_nor_written(folder, name):
    with pytest.raises(InputError):
        folder.target(name, Path(name).suffix if name.strip(".") else ".yaml")


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=300)
@given(st.text(st.sampled_from("ab./\\~:% \0\n" + "é"), max_size=20) | st.text(max_size=30))
def test_whatever_the_name_it_stays_inside(folder, name):
    for find in (folder.existing, lambda name: folder.target(name, ".yaml")):
        try:
            path = find(name)
        except InputError:
            continue
        assert path.resolve().is_relative_to(folder.root)
        assert path != folder.root


@pytest.mark.parametrize("name", ["swim.nc", "../../swim.nc", "/etc/swim.nc", "C:\\runs\\swim.nc"])
def test_what_is_sent_lies_alone_under_its_last_name_and_is_gone_after(name):
    with received(name, b"data") as path:
        assert path.name == "swim.nc"
        assert path.read_bytes() == b"data"
        assert [*path.parent.iterdir()] == [path]
    assert not path.parent.exists()
    for bad in ("..", "", ".bashrc", "a\0b"):
        with pytest.raises(InputError), received(bad, b""):
            pass
