"""Saved runs and sweeps: variables and attributes gone, renamed, of other kinds or sizes, not finite; damaged bytes."""

import random
import tempfile
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import xarray as xr
from tests.made_up_runs import made_up_run
from tests.small_robots import BALL

from nectosome.cli import main
from nectosome.io import load_dataset, save_dataset

from .attempt import Attack, commanded, streams, warm_up
from .damage import ESCAPES, FOREIGN, LONG, MARKUP, damaged_bytes

_COMMANDS = (("show", "it.nc", "--plot", "page.html"), ("show", "it.nc"), ("measure", "it.nc"))
_SWEEP = ("--over", "body.density=1100,1200,1300kg/m3", "--over", "body.radius=18mm,20mm")


def saved_runs(rng: random.Random, count: int) -> Iterator[Attack]:
    """Runs of a robot and of none, and a sweep: each is shown, shown as a page, and measured."""
    with tempfile.TemporaryDirectory() as folder:
        files = _files(Path(folder))
        raws = {name: path.read_bytes() for name, path in files.items()}
        warm_up(commanded(_COMMANDS[0], {"it.nc": raws[name]}, (), makes=("page.html",)) for name in ("run", "made_up"))
        for k in range(count):
            name = [*files][k % len(files)]
            if rng.random() < 0.1:
                about, raw = "foreign", rng.choice(FOREIGN)
            elif rng.random() < 0.3:
                about, raw = damaged_bytes(raws[name], rng)
            else:
                about, raw = _changed(files[name], rng, Path(folder) / "changed.nc")
            attempt = commanded(_COMMANDS[k // 3 % 3], {"it.nc": raw}, ("it.nc",), makes=("page.html",))
            yield Attack(f"{name}: {about}", attempt)


def bare_run(**attributes: str) -> xr.Dataset:
    """A run of no robot that can be shown, with these attributes."""
    run = made_up_run(**{"robot": "{}", "status_reason": "solved"} | attributes)
    return run.assign_coords(load=["drive"])


def _files(folder: Path) -> dict[str, Path]:
    """Good runs and a good sweep."""
    (folder / "ball.yaml").write_text(BALL)
    argv = [
        ["simulate", str(folder / "ball.yaml"), "--time", "2s", "--samples", "21", "--save", str(folder / "run.nc")],
        ["sweep", str(folder / "ball.yaml"), *_SWEEP, "--save", str(folder / "sweep.nc")],
    ]
    for words in argv:
        with streams() as said:
            code = main(words)
        if code:
            raise AssertionError(said)
    save_dataset(bare_run(), folder / "made_up.nc")
    return {name: folder / f"{name}.nc" for name in ("run", "made_up", "sweep")}


def _changed(file: Path, rng: random.Random, target: Path) -> tuple[str, bytes]:
    """What was changed in a file, and its bytes."""
    data = load_dataset(file)
    name = rng.choice([*map(str, data.variables)])
    values = data[name]
    how = rng.randrange(9)
    hostile = rng.choice((*MARKUP, *ESCAPES, *LONG, "", 3, 1e308, np.nan, np.array([1.0, np.nan]), "{", "[" * 5000))
    if isinstance(hostile, str):
        hostile = hostile.replace("\0", "")
    if how == 0:
        about, data = f"{name} gone", data.drop_vars(name)
    elif how == 1:
        key = rng.choice([*map(str, data.attrs)])
        about, data = f"attribute {key}: {str(hostile)[:40]!r}", data.assign_attrs({key: hostile})
    elif how == 2:
        key = rng.choice([*map(str, data.attrs)])
        about, data = f"attribute {key} gone", data.assign_attrs({k: v for k, v in data.attrs.items() if k != key})
        data.attrs.pop(key, None)
    elif how == 3:
        about, data = f"{name} is called otherwise", data.rename({name: f"{str(hostile)[:200]}x".replace("/", "_")})
    elif how == 4:
        dim = rng.choice([*map(str, data.sizes)])
        n = rng.choice((0, 1))
        about, data = f"{n} of {dim}", data.isel({dim: slice(0, n)})
    elif how == 5:
        about = f"{name} as text"
        data = (
            data.assign_coords({name: values.astype(str)})
            if name in data.coords
            else data.assign({name: values.astype(str)})
        )
    else:
        fill = rng.choice((np.nan, np.inf, -1e308, 0.0, 1e12))
        where = np.random.default_rng(rng.randrange(2**32)).random(values.shape) < rng.choice((0.01, 0.5, 1.0))
        if values.dtype.kind in "fi":
            about, changed = f"{fill} in {name}", values.copy(data=np.where(where, fill, values.values.astype(float)))
        else:
            about, changed = (
                f"hostile names in {name}",
                values.copy(data=np.where(where, str(hostile)[:500], values.values.astype(object))),
            )
        data = data.assign_coords({name: changed}) if name in data.coords else data.assign({name: changed})
    target.unlink(missing_ok=True)
    save_dataset(data, target)
    if rng.random() < 0.1:
        with h5py.File(target, "r+") as stored:
            key = rng.choice([*stored])
            del stored[key]
            stored[key] = rng.choice((h5py.SoftLink("/gone"), h5py.ExternalLink("/etc/passwd", "/x")))
            about = f"{key} is a link"
    return about, target.read_bytes()
