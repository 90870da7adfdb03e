"""Atomic files: results, checkpoints, journals, locks, provenance, YAML."""

from .atomic import write_atomic
from .checkpoint import load_checkpoint, save_checkpoint
from .file_system import reason
from .results import is_results, load_dataset, provenance, save_dataset
