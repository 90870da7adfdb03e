"""File formats: each reader hands over columns, and their numbers in pieces that fit into memory."""
