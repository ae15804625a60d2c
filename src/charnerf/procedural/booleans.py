"""Solids united and cut, their colours kept: by manifold3d (the extra `shapes`)."""

from collections.abc import Sequence

import numpy as np

from charnerf.procedural.solids import Solid


def united(solids: Sequence[Solid], cutters: Sequence[Solid] = ()) -> Solid:
    """The outer surface of solids together, less what cutters take away; cut faces show the cutters' colours.

    A cutter that would part a piece in two, or take a whole one away, is left out.

    Args:
        solids: Closed surfaces that may overlap; at least one.
        cutters: Closed surfaces.

    Returns:
        One closed surface.
    """
    from manifold3d import Manifold, Mesh, OpType

    def manifold(solid: Solid) -> Manifold:
        values = np.concatenate((solid.vertices, solid.colors), axis=-1)
        return Manifold(
            Mesh(vert_properties=values.astype(np.float32), tri_verts=solid.faces.astype(np.uint32))
        )

    together = Manifold.batch_boolean([manifold(solid) for solid in solids], OpType.Add)
    pieces = len(together.decompose())
    for cutter in cutters:
        left = together - manifold(cutter)
        together = left if len(left.decompose()) == pieces else together
    mesh = together.to_mesh()
    values = np.asarray(mesh.vert_properties, dtype=np.float64)
    return Solid(values[:, :3], np.asarray(mesh.tri_verts, dtype=np.int64), np.clip(values[:, 3:6], 0.0, 1.0))
