"""Solids put on characters: nothing of the character goes, what is worn is where it is worn, seeds decide."""

import numpy as np
import pytest
import trimesh

from charnerf.capture.character import CaptureOptions
from charnerf.capture.dataset import capture_dataset
from charnerf.capture.dressing import dress
from charnerf.surfaces.scene_mesh import surface_of_scene


@pytest.fixture(scope="module")
def bare():
    """Boxes: legs, a body, a thin neck, a head; 2 m, 0.7 m wide, 0.4 m deep."""
    boxes = [
        ((0.2, 0.3, 0.8), (-0.2, 0.0, 0.4)),
        ((0.2, 0.3, 0.8), (0.2, 0.0, 0.4)),
        ((0.7, 0.4, 0.7), (0.0, 0.0, 1.15)),
        ((0.15, 0.15, 0.1), (0.0, 0.0, 1.55)),
        ((0.5, 0.5, 0.4), (0.0, 0.0, 1.8)),
    ]
    meshes = []
    for size, middle in boxes:
        mesh = trimesh.creation.box(size).subdivide().subdivide()
        mesh.apply_translation(middle)
        meshes.append(mesh)
    return surface_of_scene(trimesh.util.concatenate(meshes))


def test_the_character_stays_as_it_was_under_what_it_wears(bare):
    worn = set()
    for seed in range(12):
        dressed = dress(bare, np.random.default_rng(seed))
        kept, added = np.split(dressed.triangles.astype(np.float64), [len(bare.triangles)])
        assert len(added) and np.isfinite(added).all()
        scale = np.ptp(kept[..., 2]) / np.ptp(bare.triangles[..., 2])
        back = (kept - kept.min(axis=(0, 1))) / scale
        np.testing.assert_allclose(back, bare.triangles - bare.triangles.min(axis=(0, 1)), atol=1e-5)
        assert dressed.triangles[..., 2].min() == pytest.approx(0.0, abs=1e-5)
        assert dressed.triangles[..., 2].max() == pytest.approx(2.0, abs=1e-5)
        assert scale <= 1.0 + 1e-6
        height = (added[..., 2].mean() - kept[..., 2].min()) / scale
        assert 0.3 < height < 2.3
        worn.add(round(height, 2))
    assert len(worn) > 6


def test_what_is_worn_touches_the_character(bare):
    """Boxes of body and clothes overlap: nothing floats beside it."""
    low, high = bare.triangles.min(axis=(0, 1)), bare.triangles.max(axis=(0, 1))
    for seed in range(30):
        dressed = dress(bare, np.random.default_rng(seed))
        kept, added = np.split(dressed.triangles.astype(np.float64), [len(bare.triangles)])
        scale = np.ptp(kept[..., 2]) / (high - low)[2]
        ids = dressed.material_ids[len(bare.triangles) :]
        for piece in (added[ids == one] for one in np.unique(ids)):
            places = (piece - kept.min(axis=(0, 1))) / scale + low
            assert (places.min(axis=(0, 1)) < high).all() and (places.max(axis=(0, 1)) > low).all()


def test_dressed_copies_differ_by_seed_and_number_alone(tmp_path):
    trimesh.creation.capsule(height=1.4, radius=0.3).export(tmp_path / "one.glb")
    options = CaptureOptions(views=1, size=16)
    many = capture_dataset(
        [tmp_path / "one.glb"], tmp_path / "a", "w", options=options, dressed=2, processes=1
    )
    capture_dataset([tmp_path / "one.glb"], tmp_path / "b", "w", options=options, dressed=1, processes=1)
    assert many.captured == ("one+w1", "one+w2")
    first, second, again = (
        (tmp_path / name / "mesh" / "mesh.obj").read_bytes() for name in ("a/one+w1", "a/one+w2", "b/one+w1")
    )
    assert first == again != second
