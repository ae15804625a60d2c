"""Embedded characters: many different humanoids from a seed, without any file."""
