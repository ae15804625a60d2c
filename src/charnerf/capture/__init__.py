"""From meshes to data sets: loading, pictures by Embree, embedded characters."""
