"""From meshes to data sets: loading, pictures, variants, embedded characters."""
