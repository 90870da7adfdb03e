"""The model behind each kind of file, and its JSON Schema for editors."""

import json
from importlib import import_module
from typing import Any

_MODELS = {
    "robot": "nectosome.description.RobotDescription",
    "mission": "nectosome.description.mission.MissionDescription",
    "problem": "nectosome.designs.problem_file.ProblemDescription",
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
