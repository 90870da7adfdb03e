"""Searches for the best: tasks, optimisers, journals, many starts; nothing is lost when one is killed."""

from .contract import Ask, Optimiser, Outcome, Search
from .executors.cluster import cluster
from .executors.processes import Workers
from .executors.spread import LostError
from .history import Result, Start, front, undominated
from .multistart import minimise, multistart
from .optimisers import *  # noqa: F403  their names stand in one place
from .optimisers import OPTIMISERS, make_optimiser
from .search_folder import gather_starts, read_search, read_starts
from .task import BatchTask, Evaluate, Evaluation, Space, Task
