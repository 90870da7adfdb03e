"""Published and closed-form cases that every rod and load model must pass."""
