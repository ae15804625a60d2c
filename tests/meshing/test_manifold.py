"""Decimated surfaces become manifolds: closed stays closed, folds go, welded sheets come apart."""

import numpy as np
import trimesh

from charnerf.meshing.manifold import make_manifold


def _mesh(vertices, faces) -> trimesh.Trimesh:
    return trimesh.Trimesh(*make_manifold(vertices, faces), process=False)


def test_a_manifold_stays_as_it_is():
    ball = trimesh.creation.icosphere(subdivisions=2)
    mesh = _mesh(ball.vertices, ball.faces)
    assert mesh.is_watertight and mesh.euler_number == 2
    assert len(mesh.vertices) == len(ball.vertices)
    np.testing.assert_allclose(mesh.triangles, ball.triangles)


def test_boxes_welded_along_an_edge_come_apart():
    first = trimesh.creation.box(bounds=[(0, 0, 0), (1, 1, 1)])
    second = trimesh.creation.box(bounds=[(1, 1, 0), (2, 2, 1)])
    welded = trimesh.util.concatenate([first, second])
    welded.merge_vertices()
    assert len(welded.vertices) == 14 and not welded.is_watertight
    mesh = _mesh(welded.vertices, welded.faces)
    assert mesh.is_watertight and len(mesh.vertices) == 16 and len(mesh.faces) == 24
    assert mesh.volume == 2.0


def test_a_fold_is_removed():
    box = trimesh.creation.box()
    tip = len(box.vertices)
    a, b = box.faces[0][:2]
    fold = np.array([[b, a, tip], [a, b, tip]])  # two faces on one another, hung on an edge
    mesh = _mesh(np.vstack((box.vertices, [[2.0, 0.0, 0.0]])), np.vstack((box.faces, fold)))
    assert mesh.is_watertight and mesh.euler_number == 2 and len(mesh.faces) == 12
