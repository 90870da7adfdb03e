import numpy as np
import pytest

from nectosome.vision.video import SegmentSheet
from nectosome_studies.track.render import write_clip

from . import scenes

RATE = 30


def sheet_of(px_per_cm=5.0, size=(320, 320), **more):
    """A sheet for the four colours, with the origin where the camera looks."""
    hues = {"arm": (205, 245), "first": (345, 15), "second": (110, 150), "third": (40, 65)}
    ranges = {"saturation": (0.45, 1.0), "value": (0.2, 1.0)}
    segments = {name: {"hue": tuple(np.deg2rad(hue)), **ranges} for name, hue in hues.items()}
    settings = {"pixel": 0.01 / px_per_cm, "origin": tuple((n - 1) / 2 for n in size), "segments": segments}
    return SegmentSheet.model_validate(settings | more)


@pytest.fixture(scope="session")
def rowing(tmp_path_factory):
    """A stroke without losses: file and times."""
    time = np.arange(50) / RATE
    scene = scenes.paddle()
    path = tmp_path_factory.mktemp("video") / "rowing.mkv"
    return write_clip(path, (scene.frame(t) for t in time), RATE, "ffv1"), time
