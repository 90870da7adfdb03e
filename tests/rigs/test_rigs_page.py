"""What the page on rigs says is so."""

import re
from dataclasses import MISSING, fields
from pathlib import Path

from nectosome.io import load_dataset
from nectosome.io.schema.described import kinds_of
from nectosome.rigs.device_files import DeviceDescription
from nectosome.rigs.devices.serial_line import VERSION, framed
from nectosome.rigs.guards import CommandLimits, Limits, MeasurementLimits
from nectosome.rigs.planned_signals import PlannedKinds, PlannedSignal
from nectosome.rigs.rig_file import load_rig
from nectosome.rigs.run_plan import load_plan

DOCS, EXAMPLES = (Path(__file__).parents[2] / name for name in ("docs", "examples/rigs"))
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
    (tmp_path / "run.csv").write_text('# title: "sine on rig"\ntime [s],tail.angle [rad],late [s]\n0,1,2\n')
    exec(compile(RECOVERING, "rigs.md", "exec"), {})
    assert "killed" in capsys.readouterr().out
    assert load_dataset("run_until_killed.nc").sizes["time"] == 1


def test_its_rig_file_is_the_example(tmp_path):
    block = re.search(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
    assert block is not None
    (tmp_path / "rig.yaml").write_text(block[1])
    told = load_rig(tmp_path / "rig.yaml")
    shipped = load_rig(EXAMPLES / "fishtail_ni.yaml")
    assert (told.limits, told.dt) == (shipped.limits, shipped.dt)
    assert told.written.devices == shipped.written.devices


def test_its_plan_fits_the_bench_that_it_is_for(tmp_path):
    """9 conditions, 45 runs, as the page says; and each kind of signal is in its table."""
    (block,) = re.findall(r'```yaml title="plan.yaml"\n(.*?)```', PAGE, re.DOTALL)
    (tmp_path / "plan.yaml").write_text(block)
    plan = load_plan(tmp_path / "plan.yaml", load_rig(EXAMPLES / "fins_bench.yaml"))
    assert "here 9 conditions, 45 runs" in PAGE and len(plan.runs) == 45
    assert len({run.words for run in plan.runs}) == 9
    table = PAGE[PAGE.index("Signals are") : PAGE.index("All are multiplied")]
    for kind, model in PlannedKinds().kinds(PlannedSignal).items():
        (row,) = (line for line in table.splitlines() if line.startswith(f"| `{kind}`"))
        assert [name for name in model.model_fields if name != "kind" and f"`{name}`" not in row] == []


def test_every_kind_of_device_is_in_its_table():
    """Those of the page, and all of them with their fields in the reference."""
    table = PAGE[PAGE.index("| kind | commands") : PAGE.index("Devices that only measure")]
    rows = [row.split("|")[1] for row in table.splitlines()[2:] if row.startswith("|")]
    named = {kind for row in rows for kind in re.findall(r"`(\w+)`", row)}
    fields_of_kinds = (DOCS / "reference" / "files.md").read_text(encoding="utf-8")
    known = {*kinds_of(DeviceDescription)}
    assert len(named) > 6 and named <= known
    assert {kind for kind in known if f"| `kind` |  | `{kind}` |" not in fields_of_kinds} == set()


def test_it_names_every_limit_with_its_default():
    guards = PAGE[PAGE.index("## Guards") : PAGE.index("## Every way out")]
    known = [*fields(Limits), *fields(CommandLimits), *fields(MeasurementLimits)]
    for field in (one for one in known if one.name not in ("commands", "measurements")):
        assert f"`{field.name}`" in guards
        if field.default not in (MISSING, None):
            row = next(line for line in guards.splitlines() if f"`{field.name}`" in line and line.startswith("|"))
            assert f"{field.default:g}" in row


def test_the_line_of_the_protocol_has_the_right_checksum():
    protocol = PAGE_OF_PROTOCOL.read_text(encoding="utf-8")
    (line,) = re.findall(r"goes as `(.*?)`", protocol)
    assert framed(line.rpartition("*")[0]).decode() == line + "\n"
    assert f"This is version {VERSION}." in protocol
    assert line.startswith(f"{VERSION} ")
