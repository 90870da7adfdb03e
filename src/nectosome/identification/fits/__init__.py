"""What fits share: misfits, intervals, identifiability, posteriors, models linear in their parameters."""
