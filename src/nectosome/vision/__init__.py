"""Videos and cameras: angles of coloured segments, and the pose of a body from markers seen by several cameras."""
