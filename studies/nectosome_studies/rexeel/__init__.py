"""RExEel, an eel robot that others built, recorded and simulated, swum from its motors' angles; nothing is fitted."""
