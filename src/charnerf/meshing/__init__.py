"""Fields to meshes: density grid, level, surface, colours, files."""
