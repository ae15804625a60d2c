"""Data sets: the layout on disk, characters, surface points, batches."""
