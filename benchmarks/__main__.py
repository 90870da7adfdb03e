"""Run all benchmarks and print their tables."""

import os
import platform
from importlib.metadata import version

from benchmarks import command_line, engine


def main() -> None:
    print(
        f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, ",
        end="",
    )
    print(f"jax {version('jax')}, float64")
    engine.main()
    command_line.main()


if __name__ == "__main__":
    main()
