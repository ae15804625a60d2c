"""Textured triangles: mesh files, surfaces, rays that hit them, pictures, colour."""
