"""A run in 3-D in the browser: bodies, forces, surroundings, playback, and the page that plays without a server."""
