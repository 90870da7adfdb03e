"""Parameters of a walking robot from features of its gait."""
