"""Combinators H: one file, one class, one option."""
