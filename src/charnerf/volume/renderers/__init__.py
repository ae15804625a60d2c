"""Renderers: one file, one class, one option."""
