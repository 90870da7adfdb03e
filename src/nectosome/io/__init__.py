"""Atomic files: results, checkpoints, journals, locks, provenance, YAML."""

from .atomic import reason, write_atomic
from .checkpoint import load_checkpoint, save_checkpoint
from .results import is_results, load_dataset, provenance, save_dataset

__all__ = [
    "is_results",
    "load_checkpoint",
    "load_dataset",
    "provenance",
    "reason",
    "save_checkpoint",
    "save_dataset",
    "write_atomic",
]
