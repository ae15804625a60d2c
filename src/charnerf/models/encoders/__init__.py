"""Encoders E: one file, one class, one option."""
