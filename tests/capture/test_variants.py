import numpy as np
import pytest
import trimesh

from charnerf.capture.character import CaptureOptions
from charnerf.capture.dataset import capture_dataset
from charnerf.capture.variants import variant
from charnerf.data.layout import read_dataset
from charnerf.surfaces.mesh_files import load_surface_mesh
from charnerf.surfaces.scene_mesh import surface_of_scene


def standing_capsule():
    mesh = trimesh.creation.capsule(height=1.4, radius=0.3, count=[24, 24])
    mesh.apply_translation((0.0, 0.0, -mesh.bounds[0, 2]))
    return surface_of_scene(mesh)


def volume(triangles):
    return trimesh.Trimesh(**trimesh.triangles.to_kwargs(triangles.astype(np.float64))).volume


@pytest.mark.parametrize("seed", range(12))
def test_a_variant_stands_where_the_character_stood(seed):
    """2 m tall, on the floor, in the middle; turned inside out by no mirror, closed where it was closed."""
    surface = standing_capsule()
    bent = variant(surface, np.random.default_rng(seed))
    low, high = bent.triangles.min(axis=(0, 1)), bent.triangles.max(axis=(0, 1))
    np.testing.assert_allclose((low[2], high[2]), (0.0, 2.0), atol=1e-5)
    np.testing.assert_allclose((low + high)[:2], 0.0, atol=1e-5)
    assert volume(bent.triangles) > 0.1 * volume(surface.triangles) > 0.0
    mesh = trimesh.Trimesh(**trimesh.triangles.to_kwargs(bent.triangles.astype(np.float64)))
    mesh.merge_vertices(digits_vertex=4)
    assert mesh.is_watertight


def test_no_variant_leaves_the_box():
    """A character with long arms, in many variants: none reaches farther than 1.5 m or than it did itself."""
    wide = trimesh.creation.box((3.2, 0.3, 2.0))
    wide.apply_translation((0.0, 0.0, 1.0))
    surface = surface_of_scene(wide.subdivide().subdivide())
    for seed in range(20):
        triangles = variant(surface, np.random.default_rng(seed)).triangles
        assert np.abs(triangles[..., 0]).max() <= 1.6 + 1e-5
        assert np.abs(triangles[..., 1]).max() <= 1.5 + 1e-5


def test_variants_differ_by_seed_and_number_alone(tmp_path):
    trimesh.creation.box((0.6, 0.4, 2.0)).export(tmp_path / "hero.obj")
    options = CaptureOptions(views=2, size=16)
    many = capture_dataset(
        [tmp_path / "hero.obj"], tmp_path / "a", "extra", options=options, variants=2, processes=1
    )
    capture_dataset(
        [tmp_path / "hero.obj"], tmp_path / "b", "extra", options=options, variants=1, processes=1
    )
    assert many.captured == ("hero+1", "hero+2")
    assert read_dataset(tmp_path / "a").splits == {"extra": ("hero+1", "hero+2")}
    first, second = (load_surface_mesh(tmp_path / "a" / name / "mesh" / "mesh.obj") for name in many.captured)
    again = load_surface_mesh(tmp_path / "b" / "hero+1" / "mesh" / "mesh.obj")
    np.testing.assert_array_equal(first.triangles, again.triangles)
    assert np.abs(first.triangles - second.triangles).max() > 0.01
