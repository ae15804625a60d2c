"""Geometry as pure functions: cameras, rays, sampling, encoding, the visual hull."""
