"""Files of all kinds: their schemas explain every field, and a file of another kind is refused."""

import json
from functools import cache
from pathlib import Path
from typing import Any, get_args

import pytest

from nectosome.cli.schema import model_of, schema_text
from nectosome.io.schema.editor import explained
from nectosome.io.schema.kinds import KINDS, kind_of_file
from nectosome.io.schema.structure import models_in, slot
from nectosome.io.yaml_text import read_yaml

from .answers import faults
from .conftest import BALL
from .json_schema import marked

ROOT = Path(__file__).parents[2]
FILES = sorted(path for room in ("src", "examples", "benchmarks") for path in (ROOT / room).rglob("*.yaml"))
MISSION = "modes: [{name: a, until: 1 s}]\n"
PROBLEM = "vary: {body.density: 1100..1300 kg/m3}\n"
SHEET = "columns: {F: 2}\n"
CAMPAIGN = "recordings: [{file: run.csv}]\n"
RIG = "kind: simulated\ndt: 5 ms\nlimits: {}\n"
VIDEO = "segments: {a: {}}\n"
GAITS = "trials: [{}]\n"


@cache
def _schema(kind: str) -> dict[str, Any]:
    return json.loads(schema_text(kind))


def top_fields(kind: str) -> set[str]:
    """Fields of the file itself."""
    first = slot(model_of(kind))
    return {name for model in (get_args(first.hint) or (first.hint,)) for name in model.model_fields}


@pytest.mark.parametrize("kind", KINDS)
def test_every_field_is_explained_where_it_stands(kind):
    """A kind is explained where it is chosen, by the docstring of each class."""
    fields = [(model, name) for model in models_in(model_of(kind)) for name in model.model_fields if name != "kind"]
    assert [(model.__name__, name) for model, name in fields if not explained(model, name)] == []
    assert [m.__name__ for m in models_in(model_of(kind)) if not m.__doc__] == []


def test_a_schema_has_words_unit_range_default_and_examples_of_a_field():
    rod = _schema("robot")["$defs"]["Rod"]["properties"]
    young, poisson = rod["young"], rod["poisson"]
    assert young["description"] == "Young's modulus of the material.\n\nPressure [Pa], more than 0 Pa."
    assert young["examples"] == ["7.4 MPa", "7.4e6 Pa"]
    plain, with_spread = poisson["anyOf"]
    assert (plain["minimum"], plain["maximum"], poisson["default"]) == (0, 0.5, 0.5)
    assert with_spread == {"type": "string", "pattern": r"\+-|±"}
    assert rod["damping"]["default"] == "0 Pa s"


def test_a_schema_offers_the_kinds_that_fit_with_words_for_each():
    definitions = _schema("robot")["$defs"]
    loads = {part: definitions[part]["properties"]["loads"]["additionalProperties"] for part in ("Rod", "Rigid")}
    kinds = {part: choice["properties"]["kind"] for part, choice in loads.items()}
    assert "tendon" in kinds["Rod"]["enum"] and "tendon" not in kinds["Rigid"]["enum"]
    assert "lumped_drag" in kinds["Rigid"]["enum"] and "lumped_drag" not in kinds["Rod"]["enum"]
    assert [len(kind["enum"]) for kind in kinds.values()] == [len(kind["enumDescriptions"]) for kind in kinds.values()]
    assert all(kind["enumDescriptions"] for kind in kinds.values())


@pytest.mark.parametrize("file", FILES, ids=[str(file.relative_to(ROOT)) for file in FILES])
def test_every_file_of_the_house_names_the_schema_of_its_kind(file):
    text = file.read_text(encoding="utf-8")
    kind = kind_of_file(read_yaml(text, str(file))[0])
    assert kind is not None
    named = text.splitlines()[0].partition("$schema=")[2]
    assert (file.parent / named).resolve() == ROOT / "src/nectosome/schemas" / kind.schema_file


@pytest.mark.parametrize("file", FILES, ids=[str(file.relative_to(ROOT)) for file in FILES])
def test_an_editor_marks_nothing_in_a_file_of_the_house_and_a_wrong_field_where_it_stands(file):
    data = read_yaml(file.read_text(encoding="utf-8"), str(file))[0]
    kind = kind_of_file(data)
    assert kind is not None
    schema = _schema(kind.name)
    assert list(marked(schema, data, schema)) == []
    assert list(marked(schema, data | {"nonsense": 1}, schema)) == ["nonsense"]


@pytest.mark.parametrize(
    ("kind", "path", "value"),
    [
        ("robot", "body.raduis", "2 cm"),
        ("robot", "body.joint.stifness", "1 N m/rad"),
        ("robot", "body.joint.axis", "w"),
        ("robot", "body.loads.drag.kind", "glue"),
        ("robot", "water.density", ["1000 kg/m3"]),
        ("problem", "maximise", "sped"),
        ("mission", "modes.0.untill", "2 s"),
    ],
)
def test_an_editor_marks_a_wrong_field_or_value_where_it_stands(kind, path, value):
    text = {"robot": BALL + "water: {}\n", "problem": PROBLEM, "mission": MISSION}[kind]
    schema, data = _schema(kind), read_yaml(text, kind)[0]
    *names, last = path.split(".")
    here = data
    for name in names:
        here = here[int(name) if name.isdigit() else name]
    here[last] = value
    assert list(marked(schema, data, schema)) == [path]


@pytest.mark.parametrize("kind", KINDS)
def test_a_kind_is_told_by_fields_that_it_has(kind):
    assert set(KINDS[kind].told_by) <= top_fields(kind)


@pytest.mark.parametrize(
    ("argv", "text", "said"),
    [
        (("simulate", "x.yaml"), CAMPAIGN, "a campaign of recordings, and a robot file is needed"),
        (("simulate", "x.yaml"), MISSION, "a mission, and a robot file is needed"),
        (("show", "x.yaml"), PROBLEM, "a design problem, and a robot file is needed"),
        (("check", "x.yaml"), RIG, "a rig file, and a robot file is needed"),
        (("check", "x.yaml"), SHEET, "a sheet of a recording, and a robot file is needed"),
        (("simulate", "flagellum", "--mission", "x.yaml"), BALL, "a robot file, and a mission is needed"),
        (("design", "flagellum", "--problem", "x.yaml"), BALL, "a robot file, and a design problem is needed"),
        (("design", "flagellum", "--problem", "x.yaml"), MISSION, "a mission, and a design problem is needed"),
        (("measure", "--campaign", "x.yaml"), BALL, "a robot file, and a campaign of recordings is needed"),
        (("measure", "--campaign", "x.yaml"), SHEET, "a sheet of a recording, and a campaign of recordings"),
        (("measure", "run.csv", "--config", "x.yaml"), CAMPAIGN, "a campaign of recordings, and a sheet of a"),
        (("measure", "run.csv", "--config", "x.yaml"), VIDEO, "a sheet of a video, and a sheet of a recording"),
        (("measure", "x.yaml"), CAMPAIGN, "a campaign of recordings, and a recording is needed"),
        (("measure", "x.yaml"), BALL, "a robot file, and a recording is needed"),
        (("identify", "flagellum", "--campaign", "x.yaml", "--vary", "E=1..9MPa", "--compare", "a=surge"), BALL,
         "a robot file, and a campaign of recordings is needed"),
        (("correct", "paddle", "--over", "f=0.5..1:0.5Hz", "--campaign", "x.yaml"), BALL,
         "a robot file, and a campaign of recordings is needed"),
        (("identify", "gait", "--target", "x.yaml"), PROBLEM, "a design problem, and a file of gaits is needed"),
        (("identify", "gait", "--target", "x.yaml"), CAMPAIGN, "a campaign of recordings, and a file of gaits"),
        (("track", "a.mp4", "--config", "x.yaml"), SHEET, "a sheet of a recording, and a sheet of a video"),
        (("control", "rig", "--config", "x.yaml", "--reference", "sine"), BALL, "a robot file, and a rig file"),
        (("design", "x.yaml"), GAITS, "a file of gaits, and a robot file is needed"),
    ],
)  # fmt: skip
def test_a_file_of_another_kind_is_told_with_the_command_that_takes_it(nectosome, argv, text, said):
    Path("run.csv").write_text("t [s],F [N]\n0,1\n1,2\n")
    Path("x.yaml").write_text(text)
    kind = kind_of_file(read_yaml(text, "x.yaml")[0])
    assert kind is not None
    answer = nectosome(*argv)
    assert faults(answer.code, answer.err) == []
    assert answer.err.startswith(f"x.yaml: this is {said}")
    assert answer.err.endswith(f"It goes to: {kind.command.replace('FILE', 'x.yaml')}\n")


@pytest.mark.parametrize("kind", KINDS)
def test_a_schema_is_printed_or_written(nectosome, kind):
    answer = nectosome("schema", kind)
    assert (answer.code, answer.err) == (0, "")
    assert answer.out == schema_text(kind)
    name = KINDS[kind].schema_file
    assert nectosome("schema", kind, "--save", name).out == f"written: {name}\n"
    assert Path(name).read_text() == schema_text(kind)
    again = nectosome("schema", kind, "--save", name)
    assert (again.code, again.err) == (2, f"--save: {name} exists. Give another name, or --force to overwrite it.\n")


def test_a_kind_without_a_schema_is_told(nectosome):
    answer = nectosome("schema", "robott")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith('KIND: "robott" is none of mission, campaign')
