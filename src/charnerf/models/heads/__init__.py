"""Colour heads."""
