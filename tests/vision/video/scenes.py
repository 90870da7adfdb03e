"""Rendered scenes that the tests track; the renderer knows nothing of the tracker."""

import numpy as np

from nectosome_studies.track.render import Film, Floor, Occluder, Paddle, PaddleScene, RenderCamera, RenderLens

LENGTHS = (0.105, 0.035, 0.035, 0.035)  # m, of the paddle's layers with half a joint on either side
GAP = 0.003  # m, half of it
THICKNESS = 0.006
RED, GREEN, BLUE, YELLOW = (200, 45, 40), (40, 170, 60), (45, 75, 200), (220, 200, 40)
COLOURS = (BLUE, RED, GREEN, YELLOW)
HEIGHT = 2.0  # m, of the camera over the paddle


def angles(t):
    """Directions of the four layers [rad], of a row at 0.6 Hz."""
    phase = 2 * np.pi * 0.6 * np.asarray(t, float)
    servo = np.deg2rad(75) * np.sin(phase)
    bends = [a * np.sin(phase - lag) for a, lag in ((0.0, 0.0), (0.4, 1.0), (0.7, 1.3), (0.9, 1.6))]
    return np.stack([servo + bend for bend in bends], axis=-1)


def ends(t):
    """Start and end of each layer [m]."""
    direction = angles(t)
    unit = np.stack([np.cos(direction), np.sin(direction)], axis=-1)
    joint = np.zeros((len(direction), 2))
    layers = []
    for k, length in enumerate(LENGTHS):
        layers.append(np.stack([joint + GAP * unit[:, k], joint + (length - GAP) * unit[:, k]], axis=1))
        joint = joint + length * unit[:, k]
    return np.stack(layers, axis=1)


def above(px_per_m, size):
    """A camera that looks straight down on the origin, x to the right, y up."""
    return RenderCamera(size, RenderLens(px_per_m * HEIGHT), (0, 0, HEIGHT), (0, 0, 0), up=(0, 1, 0))


def paddle(px_per_cm=5.0, size=(320, 320), colours=COLOURS, film=None, motion=ends, bar=None, during=None):
    """The scene of a paddle; `bar` covers a part of it."""
    film = film or Film(rate=30, defocus=0.6, grain=2.0)
    occluder = None if bar is None else Occluder(bar, during)
    drawn = Paddle(colours, THICKNESS)
    return PaddleScene(above(100 * px_per_cm, size), film, motion, drawn, Floor(-0.3), occluder=occluder)
