"""Videos and cameras: segments by their colours to angles, markers of several cameras to the pose of a body."""
