"""Cameras and points that the tests of `nectosome.vision.cameras` share."""

import numpy as np

from nectosome.vision.cameras import Camera, Lens

BOX = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.3, 0.3) for z in (-0.2, 0.2)])
UNEVEN = BOX + np.random.default_rng(7).uniform(-0.04, 0.04, BOX.shape)
SIZE = (1280, 1024)
CENTRES = ([0.3, -2.0, 0.4], [-1.8, -1.2, 0.2], [1.6, -1.3, 0.9])


def camera(centre, focal=1200.0, distortion=None, at=(0.0, 0.0, 0.0), turn=0.0):
    """A camera that looks at a point, turned about its axis; pixels not quite square."""
    centre = np.asarray(centre, float)
    K = np.array([[focal, 0, 637.0], [0, 1.01 * focal, 514.0], [0, 0, 1]])
    z = np.asarray(at) - centre
    z /= np.linalg.norm(z)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(z, x), z])
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ R
    lens = None if distortion is None else Lens(K, np.array(distortion))
    return Camera(K @ np.column_stack([R, -R @ centre]), lens, SIZE)


def opencv(camera_):
    """K, rotation vector, translation and distortion of a camera, as OpenCV has them."""
    import cv2

    K, R, centre = cv2.decomposeProjectionMatrix(camera_.matrix)[:3]
    t = -R @ (centre[:3] / centre[3])
    return K / K[2, 2], cv2.Rodrigues(R)[0], t, None if camera_.lens is None else camera_.lens.distortion


def inside(n, seed=0):
    """Points within the box [m]."""
    return np.random.default_rng(seed).uniform(-1, 1, (n, 3)) * [0.5, 0.3, 0.2]
