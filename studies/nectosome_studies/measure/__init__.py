"""Measurements that others made and published: read as they are, and what they come to."""
