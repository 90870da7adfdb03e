"""A soft actuator with hysteresis and inertia, from pressure and displacement."""
