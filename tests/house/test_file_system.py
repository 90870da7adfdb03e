"""The file system is asked in one place: what pathlib asks fails for long names and folders that may not be entered."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2] / "src" / "nectosome"
ASKING = {"exists", "is_file", "is_dir", "is_symlink", "is_mount", "iterdir", "glob", "rglob", "mkdir"}


def test_the_file_system_is_asked_in_one_place():
    """`st_size` of a file that was opened before is no question."""
    elsewhere = [
        f"{path.relative_to(ROOT)}:{node.lineno} {node.func.attr}"
        for path in sorted(ROOT.rglob("*.py"))
        if path != ROOT / "io" / "file_system.py"
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in ASKING
    ]
    assert elsewhere == []
