"""Programs on disk: damaged ones are made anew, and a cache that cannot or must not be used is done without."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.rights import ordinary_rights

from nectosome.core.programs.program_files import CompiledPrograms, why_refused
from nectosome.io.atomic import read_kept, write_kept

ROOT = Path(__file__).parents[3]
MADE = """
import contextlib
import equinox as eqx
import jax.numpy as jnp
import nectosome.core.runtime
from nectosome.core.programs.remember import remembered
from nectosome.core.solution import Solution
from tests.rights import ordinary_rights

def twice(x):
    print("traced", flush=True)
    return {"found": (2 * jnp.sin(x), None)}

def show():
    with ordinary_rights():
        print(remembered(twice, jnp.arange(3.0))["found"][0].tolist())
"""
RESULT = "[0.0, 1.682941969615793, 1.8185948536513634]"


@pytest.fixture
def run(tmp_path):
    """Run a remembered function in a process of its own, with a cache; return what it says."""
    (tmp_path / "made.py").write_text(MADE)

    def once(cache: Path) -> tuple[list[str], str]:
        paths = f"{tmp_path}:{ROOT}:{ROOT / 'src'}"
        environment = {**os.environ, "NECTOSOME_CACHE": str(cache), "PYTHONPATH": paths}
        environment.pop("JAX_COMPILATION_CACHE_DIR", None)
        command = [sys.executable, "-c", "import made; made.show()"]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=100, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines(), done.stderr

    return once


def flipped(raw: bytes, bit: int) -> bytes:
    changed = bytearray(raw)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def programs(cache: Path) -> list[Path]:
    return [path for folder in ("traced", "xla") for path in sorted((cache / folder).iterdir())]


def test_a_flipped_bit_in_every_file_is_found_and_all_are_made_anew(run, tmp_path):
    cache = tmp_path / "cache"
    assert run(cache) == (["traced", RESULT], "")
    assert run(cache) == ([RESULT], "")
    sound = {path: path.read_bytes() for path in programs(cache)}
    assert len(sound) >= 2
    for path, raw in sound.items():
        path.write_bytes(flipped(raw, 4 * len(raw)))
    assert run(cache) == (["traced", RESULT], "")
    assert programs(cache) == [*sound]
    assert all(read_kept(path) is not None for path in sound)
    assert run(cache) == ([RESULT], "")


@pytest.mark.parametrize("kind", ["file", "read only"])
def test_a_cache_that_cannot_be_written_is_done_without(run, tmp_path, kind):
    cache = tmp_path / "cache"
    if kind == "file":
        cache.write_text("no folder")
    else:
        cache.mkdir(mode=0o500)
    assert run(cache) == (["traced", RESULT], "")
    assert cache.is_file() or not [*cache.iterdir()]


def test_a_cache_to_which_others_can_write_is_not_used_and_this_is_told(run, tmp_path):
    cache = tmp_path / "cache"
    cache.mkdir()
    cache.chmod(0o777)
    said, warned = run(cache)
    assert said == ["traced", RESULT] and not [*cache.iterdir()]
    assert f"programs are compiled anew and not kept: others can write to {cache}" in warned


def test_every_flipped_bit_and_every_cut_is_found(tmp_path):
    file = tmp_path / "traced" / "program"
    write_kept(file, b"what was traced")
    raw = file.read_bytes()
    assert read_kept(file) == b"what was traced"
    damaged = [flipped(raw, bit) for bit in range(8 * len(raw))] + [raw[:n] for n in range(len(raw))] + [raw + b"x"]
    for one in damaged:
        file.write_bytes(one)
        assert read_kept(file) is None
    write_kept(file, b"made anew")
    assert read_kept(file) == b"made anew"


def test_what_jax_keeps_is_checked_and_written_over(tmp_path):
    kept = CompiledPrograms(str(tmp_path / "xla"))
    assert kept.get("key") is None
    kept.put("key", b"code")
    (tmp_path / "xla" / "key").write_bytes(b"damaged")
    assert kept.get("key") is None
    kept.put("key", b"code again")
    assert kept.get("key") == b"code again"


def test_a_full_disk_leaves_no_file(tmp_path, monkeypatch):
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    write_kept(tmp_path / "traced" / "program", b"x")
    assert [*(tmp_path / "traced").iterdir()] == []


def test_programs_are_on_the_disk_before_they_have_their_name(tmp_path, monkeypatch):
    synced = list[str]()
    monkeypatch.setattr("os.fsync", lambda _: synced.extend(path.name for path in (tmp_path / "traced").iterdir()))
    write_kept(tmp_path / "traced" / "program", b"x")
    assert len(synced) == 1 and synced != ["program"]


def test_a_cache_is_the_users_own_whatever_the_umask(tmp_path):
    before = os.umask(0)
    try:
        write_kept(tmp_path / "cache" / "traced" / "program", b"x")
    finally:
        os.umask(before)
    assert why_refused(tmp_path / "cache") == ""


@pytest.mark.parametrize("inner", ["", "xla", "traced"])
def test_a_cache_of_another_user_or_open_to_others_is_refused(tmp_path, monkeypatch, inner):
    cache = tmp_path / "cache"
    assert why_refused(cache) == ""
    (cache / inner).mkdir(parents=True, mode=0o755)
    assert why_refused(cache) == ""
    for mode in (0o775, 0o757):
        (cache / inner).chmod(mode)
        assert str(cache / inner) in why_refused(cache) and "chmod go-w" in why_refused(cache)
    (cache / inner).chmod(0o755)
    real = cache.stat().st_uid
    monkeypatch.setattr("os.getuid", lambda: 12_345)
    assert ("another user" in why_refused(cache)) == (real != 0)  # root may read and write everywhere anyway


def test_a_cache_that_may_not_be_looked_at_is_no_error(tmp_path):
    (tmp_path / "cache").mkdir(mode=0)
    with ordinary_rights():
        assert read_kept(tmp_path / "cache" / "traced" / "program") is None
        write_kept(tmp_path / "cache" / "traced" / "program", b"x")
    assert [*(tmp_path / "cache").iterdir()] == []
