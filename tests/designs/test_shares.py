"""Shares of a sweep make the whole, and what is no whole is refused."""

import numpy as np
import pytest
from tests.small_robots import DRIVEN

from nectosome.description import dump_robot, parse_robot, with_values
from nectosome.designs import batches
from nectosome.designs.kept_parts import forget
from nectosome.designs.shares import gather, read_share, sweep_share
from nectosome.designs.sweep import sweep
from nectosome.io.atomic import OwnFolder
from nectosome.io.file_system import entries
from nectosome.units import InputError

GRID = {"f": np.linspace(0.7, 1.3, 20).tolist(), "c": np.linspace(0.22, 0.28, 5).tolist()}  # 4 parts

SINKERS = """
name: sinkers
body: {kind: rigid, shape: point, mass: 1 kg, volume: 1 l, joint: {kind: prismatic, axis: z}, loads: {drag:
    {kind: lumped_drag, drag_area: [0 m2, 0 m2, 0.01 m2]}}}
limbs:
  weight: {repeat: {count: 2, along: [0 m, 0.1 m, 0 m]}, kind: rigid, shape: point, mass: 0.1 kg, volume: 0 m3}
aliases: {area: body.loads.drag.drag_area.2}
"""


@pytest.fixture(scope="module")
def driven():
    return with_values(parse_robot(DRIVEN), {"c": 0.2, "body.joint.torque.offset": 0.01})


@pytest.fixture(scope="module")
def shares(driven, tmp_path_factory):
    """Files of three shares, the first of which has two parts."""
    folder = tmp_path_factory.mktemp("shares")
    files = [folder / f"share-{k}.npz" for k in (1, 2, 3)]
    for k, file in enumerate(files, start=1):
        assert sweep_share(driven, GRID, share=f"{k}/3", file=file)
    return files


def test_shares_make_the_whole(driven, shares):
    whole = sweep(driven, GRID)
    found = gather(reversed(shares))
    assert found.drop_attrs().identical(whole.drop_attrs())
    assert {name: found.attrs[name] for name in ("title", "robot")} == {
        name: whole.attrs[name] for name in ("title", "robot")
    }


def test_shares_of_several_structures_make_the_whole(tmp_path):
    sinkers = tmp_path / "sinkers.yaml"
    sinkers.write_text(SINKERS)
    over = {"limbs.weight.repeat.count": [2, 3], "area": [1e-2, 2e-2]}
    for k in (1, 2, 3):  # more than there is to compute: the last one is empty
        assert sweep_share(sinkers, over, share=f"{k}/3", file=tmp_path / f"{k}.npz")
    found = gather(tmp_path / f"{k}.npz" for k in (1, 2, 3))
    assert found.drop_attrs().identical(sweep(sinkers, over).drop_attrs())
    assert (found["speed"] > 0.1).all()


def test_what_is_no_whole_is_refused(driven, shares, tmp_path):
    one, two, three = shares
    with pytest.raises(InputError, match="1 of 3 shares are missing: 2/3"):
        gather([one, three])
    with pytest.raises(InputError, match=r"share-2\.npz are both share 2/3"):
        gather([one, two, two, three])
    other = tmp_path / "other.npz"
    assert sweep_share(driven, GRID | {"c": [0.25]}, share="3/3", file=other)
    with pytest.raises(InputError, match=r"other\.npz: is of another sweep than .*share-1\.npz: over other values"):
        gather([one, two, other])
    assert sweep_share(with_values(driven, {"c": 0.3}), GRID, share="3/3", file=other)
    with pytest.raises(InputError, match=r"share-1\.npz: of another robot\."):
        gather([one, two, other])
    assert sweep_share(driven, GRID, share="4/4", file=other)
    with pytest.raises(InputError, match=r"is one of 4 shares, and .*share-1\.npz one of 3"):
        gather([one, two, other])
    with pytest.raises(InputError, match="no share is given"):
        gather([])
    two.with_name("cut.npz").write_bytes(two.read_bytes()[:-100])
    with pytest.raises(InputError, match=r"cut\.npz: cannot be read"):
        gather([one, two.with_name("cut.npz"), three])


def test_shares_of_another_device_make_the_whole_among_themselves(driven, shares, tmp_path, monkeypatch):
    """Where more points go together, others are in a share; what joins them may be a processor."""
    whole, files = sweep(driven, GRID), [tmp_path / f"{k}.npz" for k in (1, 2)]
    with monkeypatch.context() as there:
        there.setattr(batches, "side_by_side", lambda on_cpu, count: 64)
        for k, file in enumerate(files, start=1):
            assert sweep_share(driven, GRID, share=f"{k}/2", file=file)
    found = gather(files)
    for name in ("power", "speed", "force"):
        np.testing.assert_allclose(found[name], whole[name], rtol=1e-9, atol=1e-12)
    assert sweep_share(driven, GRID, share="1/2", file=files[0])
    with pytest.raises(InputError, match="on another kind of device"):
        gather(files)


def test_a_robot_file_may_lie_elsewhere(driven, tmp_path, monkeypatch):
    (tmp_path / "arm.yaml").write_text(dump_robot(driven))
    monkeypatch.chdir(tmp_path)
    over = {"f": [1.0, 1.1]}
    assert sweep_share("arm.yaml", over, share="1/2", file="1.npz", samples=33)
    assert sweep_share(str(tmp_path / "arm.yaml"), over, share="2/2", file="2.npz", samples=33)
    assert gather(["1.npz", "2.npz"]).sizes["f"] == 2


def test_a_folder_of_parts_is_of_one_process(driven, tmp_path):
    with OwnFolder(tmp_path / "parts") as lock, pytest.raises(InputError, match="in use by process"):
        assert lock
        sweep(driven, {"f": [1.0]}, folder=tmp_path / "parts")
    sweep(driven, {"f": [1.0]}, folder=tmp_path / "parts")
    with OwnFolder(tmp_path / "parts"):
        forget(tmp_path / "parts")  # another process goes on
    assert len(entries(tmp_path / "parts", "*.npz")) == 1
    forget(tmp_path / "parts")
    assert not (tmp_path / "parts").exists()


def test_a_cancelled_share_writes_nothing_and_goes_on(driven, tmp_path):
    file, parts = tmp_path / "share.npz", tmp_path / "parts"
    given = {"share": "1/2", "file": file, "folder": parts}
    assert not sweep_share(driven, GRID, **given, progress=lambda what, share: False)
    assert not file.exists()
    assert sweep_share(driven, GRID, **given)
    assert file.exists()


@pytest.mark.parametrize("text", ["0/3", "4/3", "1", "a/b", "1/0", "-1/3", "1/3/5", ""])
def test_what_is_no_share_is_told(text):
    with pytest.raises(InputError, match="is no share"):
        read_share(text, "--part")
    assert read_share(" 2/8 ", "--part") == (2, 8)
