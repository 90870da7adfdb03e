"""All classes of attacks, and how many of each."""

import random
from collections.abc import Callable, Iterator
from typing import NamedTuple

from . import bench_files, caches, command_lines, kills, saved_runs, shape_files, studio, terminal, yaml_files
from .attempt import Attack


class AttackClass(NamedTuple):
    """Attacks of one kind."""

    about: str
    attacks: Callable[[random.Random, int], Iterator[Attack]]
    count: int


CLASSES = {
    "robots": AttackClass("robot files", yaml_files.robots, 420),
    "problems": AttackClass("design problems", yaml_files.problems, 150),
    "campaigns": AttackClass("campaigns", yaml_files.campaigns, 150),
    "sheets": AttackClass("sheets of recordings", yaml_files.sheets, 150),
    "rigs": AttackClass("rig files", yaml_files.rigs, 150),
    "plans": AttackClass("plans of runs on a rig", yaml_files.plans, 100),
    "loops": AttackClass("loops of a robot", yaml_files.loops, 100),
    "missions": AttackClass("missions", yaml_files.missions, 100),
    "gaits": AttackClass("files of gaits", yaml_files.gaits, 60),
    "videos": AttackClass("sheets of videos", yaml_files.videos, 60),
    "recordings": AttackClass("recordings, damaged", bench_files.damaged_recordings, 320),
    "tables": AttackClass("tables with hostile cells", bench_files.hostile_tables, 150),
    "meshes": AttackClass("meshes of parts, damaged", shape_files.meshes, 160),
    "drawings": AttackClass("drawings of outlines, damaged", shape_files.drawings, 120),
    "stores": AttackClass("bombs, links, objects, odd arrays", bench_files.hostile_stores, 120),
    "runs": AttackClass("saved runs and sweeps", saved_runs.saved_runs, 60),
    "commands": AttackClass("command lines", command_lines.command_lines, 400),
    "streams": AttackClass("commands whose streams are closed or full", command_lines.closed_streams, 30),
    "terminal": AttackClass("names with orders to a terminal", terminal.terminal, 160),
    "caches": AttackClass("caches of programs", caches.caches, 120),
    "kills": AttackClass("signals while a file is written", kills.kills, 20),
    "studio": AttackClass("frames, messages and uploads to the studio", studio.studio, 60),
}
