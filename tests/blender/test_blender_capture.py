"""Files of every format through Blender: `-m blender`. They are made by Blender itself, in a process of its own."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from charnerf.capture.character import CaptureOptions, capture_character
from charnerf.capture.dataset import capture_dataset
from charnerf.capture.lights import Headlight
from charnerf.capture.renderers.blender import Blender
from charnerf.capture.renderers.built_in import BuiltIn
from charnerf.data.characters import load_character
from charnerf.errors import DataError
from charnerf.surfaces.color import linear_from_srgb
from charnerf.surfaces.surface_mesh import shade, triangle_areas

pytestmark = pytest.mark.blender

MAKER = Path(__file__).parents[1] / "support" / "blender_files.py"
LEGS = (0.6, 0.1, 0.05)  # linear, as the maker has it


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> Path:
    pytest.importorskip("bpy", reason="needs charnerf[blender]")
    folder = tmp_path_factory.mktemp("blender")
    subprocess.run([sys.executable, str(MAKER), str(folder)], check=True, capture_output=True)
    return folder


@pytest.fixture(scope="module")
def reference(files):
    """The figure as the built-in reader reads it."""
    return BuiltIn().read(files / "glb.glb", None, None).surface


def read(file, **options):
    return Blender(**options).read(file, None, None)


def colors_at(surface, points):
    """Colours of a surface at the corners' middles nearest to points (n, 3)."""
    middles = surface.triangles.mean(axis=1)
    nearest = np.linalg.norm(middles[None] - np.asarray(points)[:, None], axis=-1).argmin(axis=1)
    third = np.full(len(nearest), 1.0 / 3.0)
    return shade(surface, nearest, third, third)


@pytest.mark.parametrize("name", ["fbx.fbx", "blend.blend", "glb.glb", "vrm1.vrm"])
def test_every_format_is_the_same_character(files, reference, name):
    """Though the animation was left at another frame: the rest pose is what is captured."""
    found = read(files / name)
    assert found.notes == ()
    surface = found.surface
    np.testing.assert_allclose(surface.triangles.min((0, 1)), reference.triangles.min((0, 1)), atol=1e-4)
    np.testing.assert_allclose(surface.triangles.max((0, 1)), reference.triangles.max((0, 1)), atol=1e-4)
    np.testing.assert_allclose(triangle_areas(surface).sum(), triangle_areas(reference).sum(), rtol=1e-4)
    middles = reference.triangles.mean(axis=1)
    np.testing.assert_allclose(colors_at(surface, middles), colors_at(reference, middles), atol=4e-3)
    assert np.isclose(colors_at(surface, middles)[:, :3], LEGS, atol=1e-4).all(axis=1).any()


def test_a_vrm_of_version_0_looks_the_other_way(files, reference):
    """In both readers."""
    for renderer in (BuiltIn(), Blender()):
        turned = renderer.read(files / "vrm0.vrm", None, None).surface
        np.testing.assert_allclose(
            turned.triangles[..., 0].max(), -reference.triangles[..., 0].min(), atol=1e-4
        )
        head, other = (
            surface.triangles[surface.triangles[..., 2] > 1.6][:, 0].mean() for surface in (turned, reference)
        )
        assert abs(head + other) < 1e-4 < abs(head)


def test_both_renderers_take_the_same_pictures(files):
    """Cameras exactly, silhouettes to a pixel, depth to 2 mm, colours away from edges to 2 of 255."""
    kind = {"views": 3, "size": 64, "depth": True}
    root = files / "set"
    for name, renderer in (("ours", BuiltIn(subsamples=64)), ("theirs", Blender())):
        (files / name).mkdir()
        (files / name / f"{name}.glb").symlink_to(files / "glb.glb")
        options = CaptureOptions(**kind, renderer=renderer)
        done = capture_dataset([files / name], root, "train", options=options, processes=1)
        assert done.captured == (name,) and done.characters_a_second > 0.0
    ours, theirs = (load_character(root, name) for name in ("ours", "theirs"))
    np.testing.assert_allclose(
        ours.cameras.world_from_camera.numpy(), theirs.cameras.world_from_camera.numpy(), atol=1e-5
    )
    first, second = (np.asarray(each.images([0, 1, 2])).astype(float) for each in (ours, theirs))
    for one, other in zip(first, second, strict=True):
        masks = one[..., 3] > 127.5, other[..., 3] > 127.5
        for mask, near in (masks, masks[::-1]):
            assert not (mask & ~ndimage.binary_dilation(near, np.ones((3, 3)))).any()
        flat = ndimage.maximum_filter(one, (3, 3, 1)) - ndimage.minimum_filter(one, (3, 3, 1))
        inside = (flat[..., :3].max(-1) < 40.0) & (flat[..., 3] == 0.0) & masks[0]
        assert inside.sum() > 100
        assert np.abs(one - other)[inside].max() <= 2.0


def test_with_as_many_rays_colours_are_the_same_at_edges_too(files):
    """Of every inner pixel, wherever colours meet in it; by few rays they are not."""
    options = {"views": 1, "size": 48}
    inner, pictures = np.ones((48, 48), bool), []
    for renderer in (BuiltIn(subsamples=1024, edge_subsamples=1024), Blender(samples=1024), BuiltIn()):
        surface = renderer.read(files / "glb.glb", None, None).surface
        made = capture_character(surface, CaptureOptions(**options, renderer=renderer)).pictures
        pictures.append(made.source_images[0].astype(int))
        inner &= ndimage.binary_erosion(pictures[-1][..., 3] == 255, np.ones((3, 3)))
    many, theirs, few = (one[inner][:, :3] for one in pictures)
    assert len(many) > 100 and np.abs(many - theirs).max() <= 2 < np.abs(many - few).max()


def test_depth_and_light_are_the_same(files, reference):
    options = {"views": 2, "size": 48, "depth": True, "light": Headlight()}
    ours = capture_character(reference, CaptureOptions(**options)).pictures
    theirs = capture_character(reference, CaptureOptions(**options, renderer=Blender())).pictures
    both = (ours.depths > 0) & (theirs.depths > 0)
    assert both.sum() > 200 and ((ours.depths > 0) != (theirs.depths > 0)).sum() < 8
    assert np.percentile(np.abs(ours.depths.astype(int) - theirs.depths)[both], 98) <= 2
    pictures = np.stack((ours.images[0], theirs.images[0])).astype(int)
    legs = (pictures[..., 3] == 255).all(0) & (pictures[0, ..., 2] < 70)  # of one colour, by light of three
    assert legs.sum() > 20 and np.median(np.abs(pictures[0] - pictures[1])[legs]) <= 2


@pytest.mark.parametrize("name", ["blend.blend", "glb.glb", "fbx.fbx"])
def test_an_action_is_shown_at_its_frame(files, reference, name):
    """Frame 20 of `Bow` turns the upper half forwards by 60 degrees; an action that is not there is answered by those that are."""
    action = _refusal(files / name, pose="Walk:1").split("there are ")[1].split(" (")[0]
    bowed = read(files / name, pose=f"{action}:20").surface.triangles
    assert np.ptp(bowed[..., 1]) > 1.5 * np.ptp(reference.triangles[..., 1])
    assert bowed[bowed[..., 2] < 0.2][:, 1].mean() > 0.0  # the middle of its box lies before its feet


def test_a_frame_that_an_action_does_not_have_is_refused(files):
    assert "has no frame 99 in action 'Bow', expected one of 1 to 20" in _refusal(
        files / "blend.blend", pose="Bow:99"
    )


def _refusal(file, **options):
    with pytest.raises(DataError) as caught:
        read(file, **options)
    assert str(caught.value).startswith(f"{file}: ")
    return str(caught.value)


def test_one_of_several_figures_is_chosen_by_name(files):
    message = _refusal(files / "two.blend")
    assert "2 figures (anna_Hero, ben_Hero)" in message and "--object" in message
    assert "anna_Hero, ben_Hero" in _refusal(files / "two.blend", objects=("carl",))
    anna, ben = (read(files / "two.blend", objects=(f"{name}_Hero",)).surface for name in ("anna", "ben"))
    np.testing.assert_allclose(anna.triangles.max((0, 1)), ben.triangles.max((0, 1)), atol=1e-4)
    assert Blender(objects=("anna_Hero",)).name_of(files / "two.blend") == "two-anna_Hero"


def test_instances_and_curves_are_taken_once(files):
    triangles = read(files / "kinds.blend").surface.triangles
    assert len(triangles) > 500 and len(np.unique(triangles.reshape(-1, 9), axis=0)) == len(triangles)
    assert len(read(files / "kinds.blend", objects=("placed",)).surface.triangles) == 12


def test_no_script_of_a_file_runs(files):
    """Nor the Python of its drivers; that they were not run is told."""
    assert read(files / "evil.blend").notes == ("its scripts and scripted drivers were not run",)
    assert not list(files.glob("ran-*"))


def test_what_lies_elsewhere_is_refused_by_name(files):
    assert "outside.png" in _refusal(files / "own" / "picture.blend")
    assert "outside.wav" in _refusal(files / "own" / "sound.blend")
    assert "two.blend" in _refusal(files / "own" / "linked.blend")


def test_a_broken_file_is_told(tmp_path, files):
    for name in ("a.blend", "a.fbx"):
        half = tmp_path / name
        half.write_bytes((files / f"{half.suffix[1:]}{half.suffix}").read_bytes()[:900])
        assert "can not be read by Blender" in _refusal(half)


def test_materials_that_no_picture_says_are_baked_and_named(files):
    """Mixes of colours and shaders are baked; colour times corner colour, and moved pictures on a second UV map, are exact."""
    found = read(files / "materials.blend")
    assert sorted(note.split("'")[1] for note in found.notes) == ["mixed", "shaders", "veil"]
    surface = found.surface
    x = surface.triangles.mean(axis=1)[:, 0]
    boxes = np.floor((x - surface.triangles[..., 0].min()) / 0.3 + 0.01)
    third = np.full(len(x), 1.0 / 3.0)
    rgba = shade(surface, np.arange(len(x)), third, third)
    wanted = (
        0.75 * np.array((0.8, 0.2, 0.1)) + 0.25 * np.array((0.0, 0.6, 0.9)),
        0.5 * np.array((0.5, 0.4, 0.1)) + 0.5 * np.array((0.1, 0.4, 0.9)),
        (0.4, 0.3, 0.2),
        linear_from_srgb(np.array((0.2 + 0.6 * 0.35, 0.3 + 0.4 * 0.5, 0.6 - 0.3 * 0.35))),
        (0.2, 0.2, 0.2),
        (0.2, 0.2, 0.2),
    )
    for index, color in enumerate(wanted):
        found = rgba[boxes == index]
        np.testing.assert_allclose(found[:, :3], np.tile(color, (12, 1)), atol=0.02)
        assert (found[:, 3] == (index < 4)).all()  # an alpha of 0.3 is a hole
    assert surface.materials[3].cutoff == 0.5
