"""The model behind each kind of file, and its JSON Schema for editors."""

import json
from typing import Any


def model_of(kind: str) -> Any:
    """Return the model of a kind of file, one of `io.schema.kinds.KINDS`."""
    if kind == "robot":
        from nectosome.description import RobotDescription as Model
    elif kind == "mission":
        from nectosome.description.mission import MissionDescription as Model
    elif kind == "problem":
        from nectosome.designs.problem_file import ProblemDescription as Model
    elif kind == "gaits":
        from nectosome.identification.gait.files import GaitsDescription as Model
    elif kind == "sheet":
        from nectosome.measure import Sheet as Model
    elif kind == "campaign":
        from nectosome.measure.campaign import CampaignSheet as Model
    elif kind == "segments":
        from nectosome.vision.video.sheet import SegmentSheet as Model
    elif kind == "markers":
        from nectosome.vision.video.sheet import MarkerSheet as Model
    elif kind == "plan":
        from nectosome.rigs.run_plan import PlanDescription as Model
    elif kind == "loops":
        from nectosome.rigs.loops_file import LoopsDescription as Model
    else:
        assert kind == "rig"
        from nectosome.rigs.files import RigDescription as Model
    return Model


def schema_text(kind: str) -> str:
    """Return the JSON Schema of a kind of file, as the file that editors read."""
    from nectosome.io.schema.editor import json_schema

    return json.dumps(json_schema(model_of(kind)), indent=1) + "\n"
