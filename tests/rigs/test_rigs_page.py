"""What the page on rigs says is so."""

import re
from dataclasses import MISSING, fields
from pathlib import Path

from nectosome.io import load_dataset
from nectosome.rigs import Limits
from nectosome.rigs.files import load_rig
from nectosome.rigs.log import COLUMNS
from nectosome.rigs.serial_motor import VERSION, framed

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "how-to" / "rigs.md").read_text(encoding="utf-8")
PAGE_OF_PROTOCOL = DOCS / "reference" / "serial-protocol.md"
RECOVERING, OWN = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


def test_its_own_rig_runs_and_prints_what_it_says(tmp_path, monkeypatch, capsys):
    said = re.search(r"It prints `(.*?)`", PAGE)
    assert said is not None
    monkeypatch.chdir(tmp_path)
    exec(compile(OWN, "rigs.md", "exec"), {})
    assert capsys.readouterr().out.strip() == said[1]


def test_a_journal_is_recovered_as_it_says(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    head = ",".join(f"{name} [s]" for name in COLUMNS)
    (tmp_path / "run.csv").write_text(f'# title: "sine on rig"\n{head}\n0,1,2,3,4\n')
    exec(compile(RECOVERING, "rigs.md", "exec"), {})
    assert "killed" in capsys.readouterr().out
    assert load_dataset("run_until_killed.nc").sizes["time"] == 1


def test_its_rig_file_is_the_example(tmp_path):
    block = re.search(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
    assert block is not None
    (tmp_path / "rig.yaml").write_text(block[1])
    told = load_rig(tmp_path / "rig.yaml")
    shipped = load_rig(Path(__file__).parents[2] / "examples" / "rigs" / "fishtail_ni.yaml")
    assert (told.limits, told.dt) == (shipped.limits, shipped.dt)
    assert vars(told.rig) == vars(shipped.rig)


def test_it_names_every_limit_with_its_default():
    guards = PAGE[PAGE.index("## Guards") : PAGE.index("## Every way out")]
    for field in fields(Limits):
        assert f"`{field.name}`" in guards
        if field.default is not MISSING:
            row = next(line for line in guards.splitlines() if f"`{field.name}`" in line and line.startswith("|"))
            assert f"{field.default:g}" in row


def test_the_line_of_the_protocol_has_the_right_checksum():
    protocol = PAGE_OF_PROTOCOL.read_text(encoding="utf-8")
    (line,) = re.findall(r"goes as `(.*?)`", protocol)
    assert framed(line.rpartition("*")[0]).decode() == line + "\n"
    assert f"This is version {VERSION}." in protocol
    assert line.startswith(f"{VERSION} ")
