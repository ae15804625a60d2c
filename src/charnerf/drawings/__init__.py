"""Drawings to source views: read, cut out, aligned."""
