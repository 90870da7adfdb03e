"""Checkpoints come back as they were; a damaged one is never taken for a good one."""

import io
import json

import numpy as np
import pytest

from nectosome.io import load_checkpoint, provenance, save_checkpoint
from nectosome.io.checkpoint import FORMAT
from nectosome.units import InputError

ARRAYS = {
    "population": np.arange(12.0).reshape(3, 4),
    "file": np.array([np.nan, np.inf, -0.0]),
    "head": np.array(3, dtype=np.int8),
    "names/a": np.array(["x", "yz"]),
    "none": np.zeros((0, 2), dtype=np.float32),
    "column": np.asfortranarray(np.arange(6).reshape(2, 3)),
}
META = {"generation": 3, "history": [1.5, 2e-300], "status": None, "name": "schön", "nested": {"a": [True]}}


@pytest.fixture
def file(tmp_path):
    save_checkpoint(tmp_path / "state.npz", ARRAYS, META)
    return tmp_path / "state.npz"


def test_a_checkpoint_comes_back_exactly(file):
    arrays, meta = load_checkpoint(file)
    assert meta == META
    assert list(arrays) == list(ARRAYS)
    for name, array in ARRAYS.items():
        assert arrays[name].dtype == array.dtype
        assert arrays[name].shape == array.shape
        assert arrays[name].tobytes() == array.tobytes()


def test_damage_anywhere_is_found_or_harmless(file):
    raw = file.read_bytes()
    good = {name: array.tobytes() for name, array in ARRAYS.items()}
    found = 0
    for n in range(0, len(raw), 5):
        file.write_bytes(raw[:n] + bytes([raw[n] ^ 0x41]) + raw[n + 1 :])
        try:
            arrays, meta = load_checkpoint(file)
        except InputError as error:
            assert "checkpoint" in str(error)
            found += 1
        else:
            assert {name: array.tobytes() for name, array in arrays.items()} == good
            assert meta == META
    assert found > 50
    for n in range(0, len(raw), 50):
        file.write_bytes(raw[:n])
        with pytest.raises(InputError, match="this is not a checkpoint, or it is incomplete"):
            load_checkpoint(file)


def test_another_version_is_told(file):
    with np.load(file) as old:
        content = dict(old)
    head = json.loads(str(content["head"])) | {"format": FORMAT + 1}
    buffer = io.BytesIO()
    np.savez(buffer, **(content | {"head": np.array(json.dumps(head))}))
    file.write_bytes(buffer.getvalue())
    with pytest.raises(InputError, match="another version of nectosome"):
        load_checkpoint(file)


def test_what_cannot_be_kept_is_refused(tmp_path):
    with pytest.raises(TypeError):
        save_checkpoint(tmp_path / "a", {"x": np.array([object()])}, {})
    with pytest.raises(TypeError):
        save_checkpoint(tmp_path / "a", {}, {"x": object()})
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(InputError, match="No such file or directory"):
        load_checkpoint(tmp_path / "a")


def test_provenance_says_where_a_result_comes_from():
    record = provenance({"omega": 14.4})
    assert record["settings"] == {"omega": 14.4}
    assert record["packages"]["numpy"] == np.__version__
    assert record["time"].endswith("+00:00")
    assert record["processors"] >= 1
    assert json.loads(json.dumps(record)) == record
