"""A silicone beam that others let go and filmed: its stiffness and damping from one release, the others predicted."""
