"""A command of nectosome that lists what it compiles: `python watched.py PROGRAMS.json WORDS...`.

It runs whatever package PYTHONPATH names, and uses nothing but JAX's own events and dumps.
"""

import json
import os
import re
import sys
import tempfile
import threading
from collections import Counter
from pathlib import Path
from typing import Any

_TRACE, _LOWER, _BACKEND = (
    f"/jax/core/compile/{name}_duration" for name in ("jaxpr_trace", "jaxpr_to_mlir_module", "backend_compile")
)
_LOAD = "/jax/compilation_cache/cache_retrieval_time_sec"
_OPERATION = re.compile(r"^ *(?:%\S+ = )?\"?(?:stablehlo|call|func\.call)\b", re.MULTILINE)


class Programs:
    """Programs in the order in which they were ready, and their seconds; threads compile side by side."""

    def __init__(self, dumps: Path) -> None:
        self.rows: list[dict[str, Any]] = []
        self._dumps = dumps
        self._seconds: dict[int, Counter[str]] = {}

    def listen(self, event: str, seconds: float, **of: Any) -> None:
        """Gather one duration; a program is ready when the backend is done with it."""
        own = self._seconds.setdefault(threading.get_ident(), Counter())
        own[event] += seconds
        if event == _BACKEND:
            compiled = 0.0 if own[_LOAD] else own[_BACKEND]
            times = {"trace": own[_TRACE], "lower": own[_LOWER], "compile": compiled, "load": own[_LOAD]}
            name = str(of.get("fun_name", "?")).removeprefix("jit(").removesuffix(")")
            self.rows.append({"program": name, **times})
            own.clear()

    def with_operations(self) -> list[dict[str, Any]]:
        """The rows, each with the operations of the largest module of its name that was lowered."""
        found: Counter[str] = Counter()
        for path in self._dumps.glob("jax_ir*_compile.mlir"):
            name = path.name.split("_", 2)[2].removeprefix("jit_").removesuffix("_compile.mlir")
            found[name] = max(found[name], len(_OPERATION.findall(path.read_text())))
        return [{**row, "operations": found[re.sub(r"\W", "_", row["program"])]} for row in self.rows]


def main(file: str, words: list[str]) -> None:
    """Run the command in this process; its programs go to `file`."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["JAX_DUMP_IR_TO"] = folder
        from jax import monitoring

        from nectosome.cli import main as command

        programs = Programs(Path(folder))
        monitoring.register_event_duration_secs_listener(programs.listen)
        code = command(words)
        Path(file).write_text(json.dumps(programs.with_operations()))
    sys.stdout.flush()
    os._exit(code)  # as `nectosome` ends


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
