import itertools

import numpy as np
import pytest
import trimesh

from charnerf.capture.character import CaptureOptions
from charnerf.capture.dataset import capture_dataset
from charnerf.capture.part_swaps import CutSurface, slab, swap_parts
from charnerf.data.layout import read_dataset
from charnerf.errors import DataError
from charnerf.surfaces.scene_mesh import surface_of_scene
from charnerf.surfaces.surface_mesh import SurfaceMesh, shade, triangle_areas


def figure(color, *, neck=1.55, hips=0.8, wide=1.8, fine=1):
    """Boxes: two legs, a body, arms held out, a thin neck, a head. 2 m."""
    boxes = [
        ((0.2, 0.3, hips), (-0.2, 0.0, hips / 2)),
        ((0.2, 0.3, hips), (0.2, 0.0, hips / 2)),
        ((0.7, 0.4, neck - 0.1 - hips), (0.0, 0.0, (neck - 0.1 + hips) / 2)),
        ((wide, 0.2, 0.2), (0.0, 0.0, neck - 0.2)),
        ((0.15, 0.15, 0.2), (0.0, 0.0, neck)),
        ((0.5, 0.5, 1.9 - neck), (0.0, 0.0, (neck + 2.1) / 2)),
    ]
    meshes = []
    for size, middle in boxes:
        mesh = trimesh.creation.box(size)
        mesh.apply_translation(middle)
        for _ in range(fine):
            mesh = mesh.subdivide()
        mesh.visual = trimesh.visual.ColorVisuals(
            mesh, vertex_colors=np.tile((*color, 255), (len(mesh.vertices), 1))
        )
        meshes.append(mesh)
    return surface_of_scene(trimesh.util.concatenate(meshes))


@pytest.mark.parametrize(("neck", "hips"), [(1.5, 0.8), (1.7, 0.5), (1.2, 0.4)])
def test_neck_and_hips_are_found_in_the_outline(neck, hips):
    found = CutSurface(figure((9, 9, 9), neck=neck, hips=hips))
    assert found.neck == pytest.approx(neck, abs=0.13)
    assert found.hips == pytest.approx(hips, abs=0.06)


@pytest.mark.parametrize("height", [0.3, 0.777, 1.0, 1.6])
def test_a_cut_loses_no_surface_and_leaves_none_on_the_wrong_side(height):
    surface = figure((200, 30, 30), fine=0)
    above, below = slab(surface, height, np.inf), slab(surface, -np.inf, height)
    assert above.triangles[..., 2].min() >= height - 1e-6
    assert below.triangles[..., 2].max() <= height + 1e-6
    whole = triangle_areas(surface).sum()
    assert triangle_areas(above).sum() + triangle_areas(below).sum() == pytest.approx(whole, rel=1e-5)


def test_cut_corners_have_the_colors_and_texture_places_of_where_they_are():
    """Coordinates and colours that are linear in space stay so, and triangles keep their winding."""
    surface = figure((255, 255, 255), fine=0)
    linear = SurfaceMesh(
        triangles=surface.triangles,
        uvs=surface.triangles[..., [0, 2]] * np.float32(0.3),
        colors=np.concatenate((surface.triangles * 0.2, np.ones_like(surface.triangles[..., :1])), -1),
        material_ids=surface.material_ids,
        materials=surface.materials,
    )
    for low, high in ((0.63, 1.41), (-np.inf, 1.0), (1.37, np.inf)):
        cut = slab(linear, low, high)
        np.testing.assert_allclose(cut.uvs, cut.triangles[..., [0, 2]] * 0.3, atol=1e-6)
        np.testing.assert_allclose(cut.colors[..., :3], cut.triangles * 0.2, atol=1e-6)
    box = surface_of_scene(trimesh.creation.box((1.0, 1.0, 2.0)))
    cut = slab(box, -0.25, 0.5)
    first, second, third = np.moveaxis(cut.triangles, 1, 0)
    outward = np.einsum(
        "mc,mc->m", np.cross(second - first, third - first), cut.triangles.mean(1) * (1, 1, 0)
    )
    assert (outward > 0.0).all()


@pytest.mark.parametrize("seed", range(8))
def test_each_part_comes_from_its_character(seed):
    """From feet to top: the third's colour, the first's, the second's; 2 m tall, on the floor, in the middle."""
    red, green, blue = figure((255, 0, 0)), figure((0, 255, 0), neck=1.3), figure((0, 0, 255), hips=0.5)
    made = swap_parts([red, green, blue], np.random.default_rng(seed))
    low, high = made.triangles.min(axis=(0, 1)), made.triangles.max(axis=(0, 1))
    np.testing.assert_allclose((low[2], high[2]), (0.0, 2.0), atol=1e-5)
    np.testing.assert_allclose((low + high)[:2], 0.0, atol=1e-5)
    assert (np.diff(made.material_ids) >= 0).all()
    third = np.full(len(made.triangles), 1.0 / 3.0)
    colors = shade(made, np.arange(len(third)), third, third)[:, :3]
    middle = made.triangles.mean(1)
    trunk = np.abs(middle[:, 0]) < 0.3  # lowered hands may hang beside the legs
    by_color = [middle[trunk & (colors.argmax(1) == channel), 2] for channel in (2, 0, 1)]
    assert all(len(part) for part in by_color)
    for lower, upper in itertools.pairwise(by_color):
        assert lower.max() <= upper.min() + 1e-3


def test_no_swap_leaves_the_box():
    """A short body with wide arms on short legs, under a flat head: brought to 2 m it would be 4 m wide."""
    short = figure((9, 9, 9), neck=1.2, hips=0.3, wide=3.0)
    flat = figure((9, 9, 9), neck=1.8, hips=0.3)
    for seed in range(10):
        made = swap_parts([short, flat, short], np.random.default_rng(seed))
        assert np.abs(made.triangles[..., :2]).max() <= 1.5 + 1e-5
        np.testing.assert_allclose(np.ptp(made.triangles[..., 2]), 2.0, atol=1e-5)


def test_a_character_without_a_body_is_refused():
    """Two plates, one at the feet and one at the top."""
    plates = [trimesh.creation.box((1.0, 1.0, 0.04)) for _ in range(2)]
    plates[1].apply_translation((0.0, 0.0, 1.96))
    surface = surface_of_scene(trimesh.util.concatenate(plates))
    with pytest.raises(DataError, match=r"nothing of the character is its body.*leave it out"):
        swap_parts([surface, figure((9, 9, 9)), figure((9, 9, 9))], np.random.default_rng(0))


def test_captured_swaps_differ_by_seed_and_number_alone(tmp_path):
    names = ("red", "green")
    for name, color in zip(names, ((255, 0, 0), (0, 255, 0)), strict=True):
        mesh = trimesh.creation.capsule(height=1.4, radius=0.3)
        mesh.visual = trimesh.visual.ColorVisuals(
            mesh, vertex_colors=np.tile((*color, 255), (len(mesh.vertices), 1))
        )
        mesh.export(tmp_path / f"{name}.glb")
    files, options = [tmp_path / f"{name}.glb" for name in names], CaptureOptions(views=2, size=16)
    many = capture_dataset(files, tmp_path / "a", "extra", options=options, swaps=2, processes=1)
    capture_dataset(files[::-1], tmp_path / "b", "extra", options=options, swaps=1, variants=1, processes=1)
    assert many.captured == ("red+s1", "red+s2", "green+s1", "green+s2")
    assert read_dataset(tmp_path / "b").splits == {"extra": ("green+1", "green+s1", "red+1", "red+s1")}
    for name in ("red+s1", "green+s1"):
        first, again = ((tmp_path / root / name / "mesh" / "mesh.obj").read_bytes() for root in "ab")
        assert first == again
    first, second = ((tmp_path / "a" / name / "mesh" / "mesh.obj").read_bytes() for name in many.captured[:2])
    assert first != second
