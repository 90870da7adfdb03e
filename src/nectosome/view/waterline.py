"""Where a level surface of water cuts a body in a picture."""

import numpy as np
from jaxtyping import Float


def parted(
    faces: Float[np.ndarray, "n 4 3"], colours: Float[np.ndarray, "n 3"], height: float
) -> tuple[Float[np.ndarray, "m 4 3"], Float[np.ndarray, "m 3"], Float[np.ndarray, "k 2 3"]]:
    """Faces and their colours, cut where they cross the level `height` [m], and the line along which they do.

    Each face that crosses is taken as two triangles. A triangle a b c with a alone on its side is cut into a triangle
    at a and the rest between b and c.
    """
    over = faces[..., 2] > height
    crosses = over.any(axis=1) & ~over.all(axis=1)
    triangles = faces[crosses][:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)
    tints = colours[crosses].repeat(2, axis=0)
    over = triangles[..., 2] > height
    cut = over.any(axis=1) & ~over.all(axis=1)
    alone = np.argmax(over == (over.sum(axis=1) == 1)[:, None], axis=1)
    turned = np.take_along_axis(triangles, ((alone[:, None] + np.arange(3)) % 3)[..., None], axis=1)[cut]
    a, b, c = np.moveaxis(turned, 1, 0)
    ab, ac = (a + ((height - a[:, 2]) / (x[:, 2] - a[:, 2]))[:, None] * (x - a) for x in (b, c))
    pieces = [
        faces[~crosses],
        triangles[~cut][:, [0, 1, 2, 2]],
        np.stack([a, ab, ac, ac], 1),
        np.stack([ab, b, c, ac], 1),
    ]
    return (
        np.concatenate(pieces),
        np.concatenate([colours[~crosses], tints[~cut], tints[cut], tints[cut]]),
        np.stack([ab, ac], axis=1),
    )
