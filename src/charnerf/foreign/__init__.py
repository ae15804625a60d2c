"""Data sets of other programs, read as they are: one format, one file, one class; all become characters of ours at one place."""
