import subprocess
import sys


def test_the_room_is_light_to_enter():
    """The command line answers at once: the heavy packages are imported where they are used."""
    heavy = ["jax", "xarray", "pint", "numpy", "ruamel.yaml"]
    code = f"import sys, nectosome.io; print([m for m in {heavy} if m in sys.modules])"
    seen = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert seen.strip() == "[]"


def test_every_public_name_is_there():
    import nectosome.io

    assert all(hasattr(nectosome.io, name) for name in nectosome.io.__all__)
