"""A character evaluated once on a grid, and looked at there."""
