import subprocess
import sys


def test_the_room_is_light_to_enter():
    """The command line answers at once: the heavy packages are imported where they are used."""
    heavy = ["jax", "xarray", "pint", "numpy", "ruamel.yaml"]
    code = f"import sys, nectosome.io; print([m for m in {heavy} if m in sys.modules])"
    seen = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert seen.strip() == "[]"
