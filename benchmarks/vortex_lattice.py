"""The forces of PteraSoftware that ship with the study `vortex`, and the tuna's fin, made again.

    pip install --no-deps -e . -e studies && pip install -r requirements/run.lock pterasoftware==5.1.0
    python benchmarks/vortex_lattice.py

It needs an environment of its own: PteraSoftware wants MuJoCo below 4, the tests of nectosome want 4. It takes about a
quarter of an hour on two cores.
"""

import time
from importlib.metadata import version
from pathlib import Path

from nectosome_studies.vortex.cases import CASES, TUNA, swum_tuna
from nectosome_studies.vortex.kept import keep
from nectosome_studies.vortex.lattice import PACKAGE, lattice, settings

FOLDER = Path(__file__).parents[1] / "studies" / "nectosome_studies" / "vortex"


def main() -> None:
    """Write the files into the package."""
    text, fin = swum_tuna()
    FOLDER.joinpath(TUNA).write_text(text, encoding="utf-8")
    forces = {}
    for name, (_, make) in CASES.items():
        began = time.perf_counter()
        forces[name] = lattice(fin if name == "tuna" else make())
        print(f"{name}: {time.perf_counter() - began:.0f} s", flush=True)
    made = f"PteraSoftware {version(PACKAGE)}, {time.strftime('%Y-%m-%d', time.gmtime())}, {settings()}"
    keep(FOLDER, made, forces)


if __name__ == "__main__":
    main()
