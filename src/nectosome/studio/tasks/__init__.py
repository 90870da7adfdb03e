"""What a robot is worked on with in the studio: one tab for each task, in the panel on the left."""

from nectosome.studio.desk import Tasks

from .bench_results import BenchResults
from .control import Control
from .correct import Correct
from .design import Design
from .identify import Identify
from .map import Map
from .motion_intervals import Intervals
from .rig import RigTask
from .scorecard import Scorecard

TASKS: Tasks = {
    "Design": Design,
    "Map": Map,
    "Intervals": Intervals,
    "Identify": Identify,
    "Correct": Correct,
    "Control": Control,
    "Rig": RigTask,
    "Measured": BenchResults,
    "Scorecard": Scorecard,
}
