"""The axis change between our world (Z up, facing -Y) and file formats that stand Y up, facing +Z."""

import numpy as np

Y_UP_SUFFIXES = (".glb", ".gltf", ".obj", ".usdz")  # the others we write are Z up, facing -Y, as our world is


def vertices_for(suffix: str, vertices: np.ndarray) -> np.ndarray:
    """World positions or directions (P, 3) in the axes of a file format.

    Args:
        suffix: The format, such as ".glb".
        vertices: (P, 3), world frame.

    Returns:
        (P, 3) float64: x stays the character's left; Y-up formats get (x, z, -y).
    """
    vertices = np.asarray(vertices, np.float64)
    if suffix not in Y_UP_SUFFIXES:
        return vertices
    return np.stack((vertices[:, 0], vertices[:, 2], -vertices[:, 1]), axis=1)
