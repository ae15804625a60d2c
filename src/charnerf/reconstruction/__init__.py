"""Drawings and a model to a folder with mesh, turntable, views and report."""
