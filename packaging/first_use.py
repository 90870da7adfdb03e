"""Install the wheel in dist/ without extras, without a compiler, at a path with spaces, use it, and add the studies."""

import re
import subprocess
import venv
from pathlib import Path

ROOT = Path(__file__).parents[1]
PLACE = ROOT / "out" / "first use"
USE = """
import importlib, pathlib, pkgutil, nectosome
from importlib.util import find_spec
assert not any(map(find_spec, ("av", "cv2", "gymnasium", "numpyro", "pymoo"))), "an extra is installed"
refused = []  # rooms that need an extra as a whole
for module in [module.name for module in pkgutil.walk_packages(nectosome.__path__, "nectosome.", refused.append)]:
    if not module.endswith("__main__") and module not in refused:
        importlib.import_module(module)
assert refused == ["nectosome.gym"], refused
print(pathlib.Path(nectosome.__file__).parent / "robots" / "turtle.yaml")
"""


def main() -> None:
    """Raise CalledProcessError where something cannot be installed or does not work."""
    (wheel,) = (ROOT / "dist").glob("*.whl")
    venv.create(PLACE, clear=True, with_pip=True)
    binaries = PLACE / "bin"
    lock = (ROOT / "requirements" / "run.lock").read_text(encoding="utf-8")
    pins = PLACE / "pins.txt"  # without hashes, or pip would want one of the wheel too
    pins.write_text("\n".join(re.findall(r"^(\S+==.*) \\$", lock, re.MULTILINE)), encoding="utf-8")
    quiet = ("install", "-q", "--only-binary", ":all:", "-c", str(pins), str(wheel))
    subprocess.run([binaries / "python", "-m", "pip", *quiet], check=True)
    used = subprocess.run([binaries / "python", "-c", USE], check=True, cwd=PLACE, text=True, stdout=subprocess.PIPE)
    nectosome = binaries / "nectosome"
    for command in (("--version",), ("check", used.stdout.strip()), ("new", "ring"), ("check", "ring.yaml")):
        subprocess.run([nectosome, *command], check=True, cwd=PLACE)
    study = [nectosome, "reproduce", "eel", "--quick"]
    alone = subprocess.run(study, check=False, cwd=PLACE, text=True, stderr=subprocess.PIPE)
    if alone.returncode != 2 or "pip install" not in alone.stderr:
        raise RuntimeError(f"without the studies `nectosome reproduce` does not say how to get them: {alone.stderr}")
    subprocess.run([binaries / "python", "-m", "pip", "install", "-q", "--no-deps", ROOT / "studies"], check=True)
    subprocess.run(study, check=True, cwd=PLACE)


if __name__ == "__main__":
    main()
