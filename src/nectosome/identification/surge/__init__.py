"""A body driven along a line through water: its added mass and drag from speed and thrust."""
