"""`nectosome schema`: the model behind each kind of file, and its JSON Schema for editors."""

import json
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from nectosome.cli.options import command
from nectosome.cli.output import Force, check_target, report, write_text
from nectosome.io import write_atomic
from nectosome.io.schema.kinds import KINDS
from nectosome.units import check_choice

_MODELS = {
    "robot": "nectosome.description.RobotDescription",
    "mission": "nectosome.description.mission.MissionDescription",
    "problem": "nectosome.designs.problem.ProblemDescription",
    "gaits": "nectosome.identification.gait.files.GaitsDescription",
    "sheet": "nectosome.measure.Sheet",
    "campaign": "nectosome.measure.campaign.CampaignSheet",
    "segments": "nectosome.vision.video.sheet.SegmentSheet",
    "markers": "nectosome.vision.video.sheet.MarkerSheet",
    "plan": "nectosome.rigs.run_plan.PlanDescription",
    "loops": "nectosome.rigs.loops_file.LoopsDescription",
    "rig": "nectosome.rigs.rig_file.RigDescription",
}  # imported on demand


def model_of(kind: str) -> Any:
    """Return the model of a kind of file, one of `io.schema.kinds.KINDS`."""
    module, _, name = _MODELS[kind].rpartition(".")
    return getattr(import_module(module), name)


def schema_text(kind: str) -> str:
    """Return the JSON Schema of a kind of file, as the file that editors read."""
    from nectosome.io.schema.editor import json_schema

    return json.dumps(json_schema(model_of(kind)), indent=1) + "\n"


@command
def schema(
    kind: Annotated[str, Parameter(help=f"Kind of file: {', '.join(sorted(KINDS))}.")] = "robot",
    /,
    *,
    save: Annotated[Path | None, Parameter("--save", help="Write the schema to this file (.json).")] = None,
    force: Force = False,
) -> None:
    """Print the JSON Schema of a kind of file, with which editors complete and explain it.

    `nectosome new` and `nectosome tutorial` write it beside their files, whose first line names it.
    """
    check_choice(kind, KINDS, "KIND")
    check_target(save, "--save", ".json", force)
    text = schema_text(kind)
    if save is None:
        write_text(text.rstrip())
        return
    write_atomic(save, text.encode())
    report(save)
