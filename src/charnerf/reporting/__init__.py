"""Reports from what runs left on disk: of one run, and of all runs below a folder."""
