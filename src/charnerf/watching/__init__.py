"""Runs and grids while they train: how far each is, as lines and as a page that refreshes itself."""
