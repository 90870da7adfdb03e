"""Wrong recordings, sheets and campaigns for `nectosome measure`: exit code 2, one sentence, no file left behind."""

import os

import numpy as np
import pytest
from tests.measure.formats.write import FORMATS

from .answers import check_wrong

GOOD = "t [s];F [N];note\n" + "".join(f"{k / 10};{k % 7};{k}\n" for k in range(30))
SHEET = "time: {column: t, unit: s}\ncolumns:\n  F: {unit: N}\n"
CAMPAIGN = "columns: {F: {unit: N}}\nrecordings:\n  - {file: good.csv, conditions: {f: 1 Hz}}\n"


def wrong_texts() -> dict[str, bytes]:
    """Recordings as text, by name."""
    good = GOOD.encode()
    lines = GOOD.splitlines(keepends=True)
    files = {
        "empty": b"",
        "blank": b"\n\n  \n",
        "head": lines[0].encode(),
        "prose": b"To whom it may concern,\nhello.\n",
    }
    files |= {"binary": bytes(range(256)) * 9, "zeros": bytes(500), "nul": good[:200] + b"\0" + good[200:]}
    files |= {
        "utf16cut": GOOD.encode("utf-16")[:201],
    }
    files["word"] = GOOD.replace("1.5;1;", "1.5;one;").encode()
    files["comma"] = GOOD.replace("1.5;1;", "1,5;1;").encode()
    files["wide"] = GOOD.replace("1.5;1;", "1.5;1;2;").encode()
    files["narrow"] = GOOD.replace("1.5;1;15", "1.5;1").encode()
    files["names"] = GOOD.replace(";note", "").encode()
    files["back"] = GOOD.replace("1.5;1;", "1.3;1;").encode()
    files["twice"] = GOOD.replace("1.5;1;", "1.4;1;").encode()
    files["untimed"] = GOOD.replace("1.5;1;", ";1;").encode()
    files["infinite"] = GOOD.replace("1.5;1;", "inf;1;").encode()
    files["unit"] = GOOD.replace("[s]", "[kg]").encode()
    files["quote"] = GOOD.replace("1.5;1;", '1.5;"1;').encode()
    files["html"] = b"<!doctype html><html><body><p>404</p></body></html>\n"
    files["json"] = b'{"t": [1, 2, 3], "F": [4, 5, 6]}\n'
    files["onlytime"] = b"t\n1\n2\n3\n"
    return {f"bad/{name}.csv": content for name, content in files.items()}


def wrong_sheets() -> dict[str, str]:
    """Sheets, by name."""
    texts = ["", "3", "- 1", "columns", "columns: 3", "columns: {F: {unit: N}", "clumns: {}", "time: {}"]
    texts += ["time: {column: t, unit: kg}", "time: {column: t, unit: sec ond}", "time: {column: nobody, unit: s}"]
    texts += [
        "time: {rate: 0 Hz}",
        "time: {rate: -3 Hz}",
        "time: {rate: nan Hz}",
        "time: {rate: 3}",
        "time: {rate: 3 N}",
    ]
    texts += ["time: {column: t, rate: 3 Hz}", "time: {column: t, unit: s, repair: mend}", "time: {column: 0, unit: s}"]
    values = ("4", "-1", "0", "1.5", "true", "[1]", "{column: 99}", "{column: Force}", "{unit: Nn}")
    values += ("{sign: 0}", "{sign: 2}", "{sign: true}", "{gain: 0}", "{gain: nan N/V}", "{gain: 3 N/V}", "{gain: }")
    values += ("{zero: 3 V}", "{zero: inf N}", "{zero: x}", "{range: 3 N}", "{range: [3 N]}", "{range: [3 N, 1 N]}")
    values += ("{range: [1 V, 3 V]}", "{range: [a, b]}", "{ragne: [1 N, 3 N]}", "{unit: 3}", "{about: [}")
    texts += [f"columns:\n  F: {value}" for value in values]
    texts += [f"conditions: {value}" for value in ("3", "{f: fast}", "{f: nan}", "{f: 1 Hzz}", "{f: }", "[1 Hz]")]
    options = ("encoding: utf-9", "encoding: 3", "delimiter: xx", "delimiter: 3", "decimal: ;", "header: -1")
    options += ("header: 99", "header: many", "table: Sheet2", "heder: 1", "")
    texts += [f"file: {{{option}}}" if option else "file: 3" for option in options]
    texts += ["!!python/object/apply:os.system ['true']", "about: &a [*a]", "columns: {F: 2, F: 3}", "\tcolumns: {}"]
    return {f"sheets/{k:03d}.yaml": text for k, text in enumerate(texts)}


def wrong_campaigns() -> dict[str, str]:
    """Campaigns, by name."""
    items = ("", "[]", "3", "[3]", "[{}]", "[{file: nowhere.csv}]", "[{file: '*.nothing'}]", "[{file: ../good.csv}]")
    items += (
        "[{file: /etc/passwd}]",
        "[{file: good.csv}, {file: good.csv}]",
        "[{file: good.csv, f: 3}]",
        "[{file: .}]",
    )
    items += ("[{file: good.csv, conditions: 3}]", "[{file: good.csv, conditions: {f: fast}}]", "[{file: 'bad\\0'}]")
    items += ("[{conditions: {f: 1 Hz}}]", "[{file: ''}]", "[{file: '**'}]", "[{file: [good.csv]}]")
    texts = [f"recordings: {item}" for item in items]
    return {f"campaign{k:02d}.yaml": text for k, text in enumerate(texts)}


SHEETS = wrong_sheets()


def cases() -> list[tuple[str, ...]]:
    """Command lines that are wrong."""
    found: list[tuple[str, ...]] = [("measure",), ("measure", ""), ("measure", "."), ("measure", "nowhere.csv")]
    found += [("measure", name) for name in ("folder", "folder.csv", "bad\0.csv", "pipe.csv/x", "x" * 5000, "locked/x")]
    found += [("measure", "good.xls"), ("measure", "good.ods"), ("measure", "good.mf4"), ("measure", "good.tdms_index")]
    found += [("measure", name) for name in wrong_texts()]
    found += [("measure", "good.csv", "nowhere.csv"), ("measure", "good.csv", "bad/word.csv")]
    found += [("measure", "good.csv", "--config", name) for name in SHEETS]
    found += [
        ("measure", "--campaign", name) for name in (*wrong_campaigns(), "good.csv", "nowhere.yaml", "folder", "")
    ]
    found += [("measure", "good.csv", "--config", name) for name in ("", "nowhere.yaml", "folder", "bad/binary.csv")]
    pages = ("", ".", "page", "page.nc", "folder.html", "nowhere/page.html", "/proc/page.html", "bad\0.html")
    found += [("measure", "good.csv", "--plot", page) for page in pages]
    runs = ("", ".", "run", "run.html", "folder.nc", "nowhere/run.nc", "/proc/run.nc", "a" * 300, "/dev/full")
    found += [("measure", "good.csv", "--save", run) for run in runs]
    found += [
        ("measure", "good.csv", "again.csv", "--save", "run.nc"),
        ("measure", "good.csv", "--config"),
        ("measure", "good.csv", "--sheet", "sheets/000.yaml"),
    ]
    found += [("measure", "--config", "sheets/000.yaml"), ("measure", "good.csv", "--campaign", "campaign00.yaml")]
    found += [("measure", "good.csv", "--save", "again.csv")]
    found += [("measure", "good.csv", option) for option in ("--plot", "--save", "--csv", "--set=3", "--plot=")]
    for name, (file, _, _) in FORMATS.items():
        ending = file.partition(".")[2]
        stem = name.replace(" ", "_")
        found += [("measure", f"{damage}/{stem}.{ending}") for damage in ("zeros", "empty")]
        if ending not in ("csv", "tsv", "txt"):  # half a text is one that broke off
            found += [("measure", f"{damage}/{stem}.{ending}") for damage in ("half", "head", "text")]
            found.append(("measure", f"whole/{stem}.csv"))
    return found


CASES = cases()


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A folder with good recordings and everything damaged."""
    folder = tmp_path_factory.mktemp("bench")
    for name in ("bad", "sheets", "folder", "folder.csv", "folder.html", "folder.nc", "locked"):
        (folder / name).mkdir()
    for name in ("good.csv", "again.csv", "good.xls", "good.ods", "good.mf4"):
        (folder / name).write_text(GOOD)
    (folder / "good.tdms_index").write_bytes(b"TDSh" + bytes(100))
    os.mkfifo(folder / "pipe.csv")
    for name, content in wrong_texts().items():
        (folder / name).write_bytes(content)
    for name, text in {**SHEETS, **wrong_campaigns()}.items():
        (folder / name).write_text(text + "\n")
    table = {"t": 0.1 * np.arange(200), "F": np.sin(np.arange(200.0))}
    damages = {
        "half": lambda raw: raw[: len(raw) // 2],
        "head": lambda raw: bytes(520) + raw[520:],
        "zeros": lambda raw: bytes(len(raw)),
        "empty": lambda raw: b"",
        "text": lambda raw: GOOD.encode(),
    }
    for damage in (*damages, "whole"):
        (folder / damage).mkdir()
    for name, (file, _, write) in FORMATS.items():
        ending, stem = file.partition(".")[2], name.replace(" ", "_")
        write(folder / "whole" / f"{stem}.{ending}", table)
        raw = (folder / "whole" / f"{stem}.{ending}").read_bytes()
        (folder / "whole" / f"{stem}.csv").write_bytes(raw)
        for damage, act in damages.items():
            (folder / damage / f"{stem}.{ending}").write_bytes(act(raw))
    return folder


def test_there_are_hundreds_of_cases():
    assert len(set(CASES)) > 200


@pytest.mark.parametrize("part", range(2))
def test_wrong_measurements_are_answered_with_one_sentence_and_exit_code_2(nectosome, bench, monkeypatch, part):
    monkeypatch.chdir(bench)
    check_wrong(nectosome, CASES[part::2], bench)


def test_a_recording_of_one_row_is_told_to_have_one(nectosome, tmp_path):
    """Two times make a step; one has none."""
    for rows, said in ((1, "1 row, at 0 s\n"), (2, "2 rows, 0 to 0.1 s, every 0.1 s\n")):
        file = tmp_path / f"few{rows}.csv"
        file.write_text("".join(GOOD.splitlines(keepends=True)[: rows + 1]))
        answer = nectosome("measure", str(file))
        assert (answer.code, answer.err) == (0, "")
        assert said in answer.out
        assert "nan" not in answer.out
