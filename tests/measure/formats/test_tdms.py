"""LabVIEW's files come back as they were written, with a time of their own; a file that breaks off keeps its rows."""

import struct
from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from nptdms import ChannelObject, TdmsFile, TdmsWriter
from numpy.testing import assert_allclose, assert_array_equal

from nectosome.measure.formats.tdms import open_tdms
from nectosome.units import InputError

from .read import check_refusals, cuts, flipped, flips, growth, read, survived

T = np.arange(40) * 0.01
F = np.sin(T)
WAVE = {"wf_increment": 0.001, "wf_start_offset": 0.0}
CODES = {"f8": 10, "f4": 9, "i2": 2, "u1": 5, "i4": 3}


@pytest.fixture
def write(tmp_path):
    def write(*segments, name="a.tdms"):
        with TdmsWriter(tmp_path / name) as file:
            for segment in segments:
                file.write_segment([ChannelObject(*channel) for channel in segment])
        return tmp_path / name

    return write


def segment(channels: dict[str, np.ndarray], chunks: int = 1, big: bool = False, interleaved: bool = False) -> bytes:
    """A segment of the group "log" by the format's description, its channels in so many equal chunks."""
    order, toc = (">" if big else "<"), 2 | 4 | 8 | (64 if big else 0) | (32 if interleaved else 0)

    def text(words: str) -> bytes:
        return struct.pack(order + "I", len(words)) + words.encode()

    meta = struct.pack(order + "I", len(channels))
    for name, values in channels.items():
        index = struct.pack(order + "IIIQ", 20, CODES[values.dtype.str[1:]], 1, len(values) // chunks)
        meta += text(f"/'log'/'{name}'") + index + struct.pack(order + "I", 0)
    arrays = [values.astype(values.dtype.newbyteorder(order)) for values in channels.values()]
    if interleaved:
        raw = np.hstack([a.view("u1").reshape(len(a), -1) for a in arrays]).tobytes()
    else:
        parts = product(range(chunks), arrays)
        raw = b"".join(a[len(a) // chunks * i : len(a) // chunks * (i + 1)].tobytes() for i, a in parts)
    lead = b"TDSm" + struct.pack("<i", toc) + struct.pack(order + "iQQ", 4713, len(meta) + len(raw), len(meta))
    return lead + meta + raw


@pytest.mark.parametrize("dtype", ["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "?"])
def test_channels_of_any_type_come_back(write, dtype):
    x = (np.arange(40) % 7).astype(dtype)
    contents = read(open_tdms, write(*([("log", "x", x[a:b]), ("log", "F", F[a:b])] for a, b in ((0, 7), (7, 40)))))
    assert contents.names == ["x", "F"]
    assert_array_equal(contents.values, np.transpose([x.astype(float), F]))
    assert_array_equal(contents.rows, np.arange(1, 41))
    assert contents.repairs == []


@given(
    runs=st.lists(
        st.tuples(st.integers(1, 6), st.integers(1, 5), st.booleans(), st.booleans()), min_size=1, max_size=5
    ),
    rows=st.integers(1, 12),
)
def test_any_layout_reads_as_it_was_written(tmp_path_factory, runs, rows):
    """Whatever chunks, order of bytes and interleaving each segment has."""
    path = tmp_path_factory.mktemp("tdms") / "a.tdms"
    counts = [values * chunks for values, chunks, _, _ in runs]
    a, b, c = (np.arange(sum(counts)) * k for k in (1.5, -2.0, 1.0))
    columns = {"a": a, "b": b.astype("f4"), "c": c.astype("i2")}
    ends = np.cumsum(counts)
    assume(ends[-1] > 1)  # a single value is no column
    path.write_bytes(
        b"".join(
            segment({name: x[end - n : end] for name, x in columns.items()}, chunks, big, interleaved)
            for end, n, (_, chunks, big, interleaved) in zip(ends, counts, runs, strict=True)
        )
    )
    contents = read(open_tdms, path, rows=rows)
    assert_array_equal(contents.values, np.transpose([a, b, c]))
    with TdmsFile.open(path) as file:
        assert_array_equal(file["log"]["b"][:], contents["b"])


def test_the_time_is_made_of_the_waveform(write):
    later = {"wf_start_offset": 2.0, "wf_increment": 0.5}
    contents = read(open_tdms, write([("log", "F", F, later | {"unit_string": "N"}), ("log", "x", F, {"unit": "mm"})]))
    assert contents.names == ["time", "F", "x"]
    assert contents.units == ["s", "N", "mm"]
    assert_array_equal(contents["time"], 2 + 0.5 * np.arange(40))
    assert contents.found == ("time: from wf_increment = 0.5 and wf_start_offset = 2",)


def test_a_spectrum_runs_along_its_frequency(write):
    wave = WAVE | {"wf_xname": "Frequency", "wf_xunit_string": "Hz"}
    contents = read(open_tdms, write([("log", "F", F, wave)]))
    assert (contents.names, contents.units) == (["Frequency", "F"], ["Hz", ""])


@pytest.mark.parametrize("name", ["Time", "time (s)", "t", "Zeit"])
def test_a_channel_that_is_the_time_makes_another_one_needless(write, name):
    contents = read(open_tdms, write([("log", "F", F, WAVE), ("log", name, T)]))
    assert contents.names == [name.removesuffix(" (s)"), "F"]
    assert_array_equal(contents.values, np.transpose([T, F]))


def test_timestamps_become_seconds_since_the_first(write):
    stamps = np.datetime64("2024-05-01T12:00:00.250", "us") + np.arange(40) * np.timedelta64(1500, "us")
    contents = read(open_tdms, write([("log", "F", F), ("log", "stamp", stamps)]))
    assert contents.names == ["stamp", "F"]
    assert contents.units == ["s", ""]
    assert_allclose(contents["stamp"], 0.0015 * np.arange(40), rtol=0, atol=1e-12)
    assert contents.found == ("stamp: seconds since 2024-05-01T12:00:00.250000 UTC",)


def test_scaled_channels_are_in_the_unit_of_the_sensor(write):
    scale = {
        "NI_Number_Of_Scales": 1,
        "NI_Scaling_Status": "unscaled",
        "NI_Scale[0]_Scale_Type": "Linear",
        "NI_Scale[0]_Linear_Slope": 0.5,
        "NI_Scale[0]_Linear_Y_Intercept": -1.0,
        "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
        "NI_UnitDescription": "Volts",
    }
    contents = read(open_tdms, write([("log", "V", np.arange(40, dtype="i2"), scale)]))
    assert_array_equal(contents["V"], 0.5 * np.arange(40) - 1)
    assert contents.units == ["Volts"]


def test_raw_data_of_daqmx_are_taken_apart_by_nptdms(tmp_path):
    """Two channels of 16 bits in one raw buffer, with scales 0 (raw) and 1 (linear), after npTDMS's description."""
    count = 6

    def text(words: bytes) -> bytes:
        return struct.pack("<I", len(words)) + words

    def channel(name: bytes, offset: int) -> bytes:
        scaler = struct.pack("<IIIII", 3, 0, offset, 0, 0)
        index = struct.pack("<IIIQ", 0x1269, 0xFFFFFFFF, 1, count) + struct.pack("<I", 1) + scaler
        widths = struct.pack("<II", 1, 4)
        properties = [
            (b"NI_Number_Of_Scales", 7, struct.pack("<I", 2)),
            (b"NI_Scaling_Status", 0x20, text(b"unscaled")),
            (b"NI_Scale[1]_Scale_Type", 0x20, text(b"Linear")),
            (b"NI_Scale[1]_Linear_Slope", 10, struct.pack("<d", 0.25)),
            (b"NI_Scale[1]_Linear_Y_Intercept", 10, struct.pack("<d", 1.0)),
            (b"NI_Scale[1]_Linear_Input_Source", 7, struct.pack("<I", 0)),
        ]
        told = b"".join(text(key) + struct.pack("<I", kind) + value for key, kind, value in properties)
        return text(b"/'log'/'" + name + b"'") + index + widths + struct.pack("<I", len(properties)) + told

    meta = struct.pack("<I", 2) + channel(b"a", 0) + channel(b"b", 2)
    raw = np.arange(2 * count, dtype="<i2").tobytes()
    lead = b"TDSm" + struct.pack("<iiQQ", 2 | 4 | 8 | 128, 4713, len(meta) + len(raw), len(meta))
    (tmp_path / "a.tdms").write_bytes((lead + meta + raw) * 2)
    contents = read(open_tdms, tmp_path / "a.tdms", rows=4)
    raw_values = np.tile(np.arange(2 * count).reshape(count, 2), (2, 1))
    assert_array_equal(contents.values, 0.25 * raw_values + 1)


def test_groups_and_clocks_are_not_chosen_between(write):
    path = write([("calm", "F", F), ("rough", "F", F[:9])])
    with pytest.raises(
        InputError, match=r'holds several tables: calm/F \(40 rows\); rough/F \(9 rows\).*table: "calm"'
    ):
        read(open_tdms, path)
    contents = read(open_tdms, path, table="rough")
    assert_array_equal(contents["F"], F[:9])
    assert contents.found == ("left out: calm/F (40 rows)",)
    with pytest.raises(InputError, match='Did you mean "rough"'):
        read(open_tdms, path, table="rogh")

    path = write([("log", "F", F, WAVE), ("log", "p", F[:30], WAVE)])
    with pytest.raises(
        InputError, match=r"log/F \(40 rows, every 0.001 s\); log/time, log/p \(30 rows, every 0.001 s\)"
    ):
        read(open_tdms, path)
    path = write([("log", "F", F, WAVE), ("log", "p", F, WAVE | {"wf_increment": 0.01}), ("log", "n", ["a", "b"])])
    with pytest.raises(InputError, match=r'every 0.001 s\); log/time, log/p \(40 rows, every 0.01 s\).*table: "log/F"'):
        read(open_tdms, path)
    contents = read(open_tdms, path, table="log/p")
    assert_array_equal(contents["time"], 0.01 * np.arange(40))
    assert "left out: log/n (text)" in contents.found


def test_a_later_start_is_another_clock_and_jitter_is_none(write):
    start = np.datetime64("2024-05-01T12:00:00", "us")
    at = [WAVE | {"wf_start_time": start + np.timedelta64(us, "us")} for us in (0, 300, 250_000)]
    assert read(open_tdms, write([("log", "F", F, at[0]), ("log", "p", F, at[1])])).names == ["time", "F", "p"]
    with pytest.raises(InputError, match=r"every 0.001 s from 0.25\)"):
        read(open_tdms, write([("log", "F", F, at[0]), ("log", "p", F, at[2])]))


def test_a_file_that_breaks_off_keeps_its_whole_rows(write, tmp_path):
    parts = ((0, 10), (10, 20), (20, 40))
    raw = write(*([("log", "t", T[a:b]), ("log", "F", F[a:b])] for a, b in parts)).read_bytes()
    kept = set()
    for cut in cuts(raw):
        contents = survived(open_tdms, tmp_path / "cut.tdms", cut)
        if contents is not None:
            n = len(contents.rows)
            kept.add(n)
            assert_array_equal(contents.values, np.transpose([T, F])[:n])
            at_a_segments_end = len(cut) == raw.find(b"TDSm", len(cut))
            assert at_a_segments_end or f"{n} whole rows are kept" in contents.repairs[0]
    assert {10, 20} < kept


def test_what_labview_left_open_is_read_to_its_end(write):
    path = write([("log", "t", T[:10]), ("log", "F", F[:10])], [("log", "t", T[10:]), ("log", "F", F[10:])])
    raw = bytearray(path.read_bytes())
    second = raw.rindex(b"TDSm")
    raw[second + 12 : second + 20] = b"\xff" * 8  # the length that is written when all else is
    path.write_bytes(raw)
    contents = read(open_tdms, path)
    assert_array_equal(contents.values, np.transpose([T, F]))
    assert contents.repairs == [
        "the file ends within a segment, as if LabVIEW had been stopped; 40 whole rows are kept."
    ]


def test_a_stale_index_beside_the_file_does_no_harm(write, tmp_path):
    path = write([("log", "F", F)])
    (tmp_path / "a.tdms_index").write_bytes(b"TDSh of another file")
    assert_array_equal(read(open_tdms, path)["F"], F)


def test_what_is_no_table_is_told(write, tmp_path):
    files = {
        "empty.tdms": (b"", "is empty"),
        "text.tdms": (b"t,F\n0,1\n", "this is not a LabVIEW file .* but a text file"),
        "a.tdms_index": (b"TDSh....", "the index of a LabVIEW file. Open the .tdms file beside it"),
        "noise.tdms": (b"TDSm" + bytes(range(100)), "cut off"),
    }
    check_refusals(open_tdms, tmp_path, files)
    with pytest.raises(InputError, match=r"holds no columns of numbers\. Inside: log/n \(text\); log/e \(empty\)"):
        read(open_tdms, write([("log", "n", ["a", "b"]), ("log", "e", np.zeros(0))]))


@given(places=flips)
def test_damage_is_refused_or_leaves_a_table(tmp_path_factory, places):
    raw = segment({"t": T, "F": F}, chunks=4) + segment({"t": T, "F": F}, interleaved=True)
    survived(open_tdms, tmp_path_factory.mktemp("tdms") / "a.tdms", flipped(raw, places))


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["many segments", "one chunk", "interleaved"])
def test_a_file_of_200_MB_is_read_in_a_fraction_of_it(tmp_path, layout):
    """At most 32 MB are read at once, and there are a few copies of a piece of 6.4 MB while it is made."""
    rows = 3_200_000
    values = np.random.default_rng(0).normal(size=rows)
    path = tmp_path / "a.tdms"
    step = 20_000 if layout == "many segments" else rows
    with path.open("wb") as file:
        for i in range(0, rows, step):
            part = {f"c{k}": values[i : i + step] for k in range(8)}
            file.write(segment(part, interleaved=layout == "interleaved"))
    assert path.stat().st_size > 200e6
    assert growth(open_tdms, path) < 100
