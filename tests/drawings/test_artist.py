"""Drawings of a known character can be read back as drawings, and stand where the character stands."""

from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh

from charnerf.capture.character import CaptureOptions
from charnerf.capture.dataset import capture_dataset
from charnerf.config.options import option
from charnerf.data.characters import load_character
from charnerf.data.layout import names_of, read_dataset
from charnerf.drawings import redrawn as redrawing
from charnerf.drawings.artist import LEVELS, PAPER, draw_character, write_drawings
from charnerf.drawings.options import ReadingOptions
from charnerf.drawings.redrawn import VIEW_SHARES, redrawn, with_drawn_sources
from charnerf.drawings.turnaround import read_views
from charnerf.drawings.viewpoints import turnaround, viewpoint
from charnerf.errors import ConfigError, DataError
from charnerf.reconciling.agreement import iou
from charnerf.surfaces.mesh_files import load_surface_mesh

AS_DRAWN = ReadingOptions(reconciled=False)


@pytest.fixture(scope="module")
def character(figure_dataset):
    return load_character(figure_dataset, names_of(read_dataset(figure_dataset), "train")[0])


@pytest.fixture
def small(monkeypatch):
    """Drawings of fewer pixels than are made for training."""
    monkeypatch.setattr(redrawing, "SIDE", 160)


def test_drawings_have_the_size_that_is_asked_for_and_lie_on_paper(character):
    drawings = draw_character(character, size=96, seed=1)
    assert list(drawings) == ["front", "side", "back"]
    for pixels in drawings.values():
        assert pixels.shape == (96, 96, 3) and pixels.dtype == np.uint8
        assert tuple(pixels[0, 0]) == PAPER
        assert (pixels != np.array(PAPER)).any()


def test_a_seed_is_an_artist_and_each_character_has_its_own_style(character, figure_dataset):
    first, again, other = (draw_character(character, size=64, seed=seed) for seed in (1, 1, 2))
    assert all(np.array_equal(first[view], again[view]) for view in first)
    assert not np.array_equal(first["front"], other["front"])


def test_reconstruct_reads_them_as_the_silhouettes_that_were_drawn(character, tmp_path):
    """The masks that are cut out of the paper against the captured ones, both brought to one height."""
    front, side, back = write_drawings(draw_character(character, size=256, seed=3), tmp_path)
    size = character.sources.images.shape[-1]
    read = read_views(turnaround(front, side, back), size=size).views
    for view in range(3):
        extents = []
        for images in (read.images, character.sources.images):
            mask = images[0, view, 3] > 0.5
            rows, columns = torch.nonzero(mask, as_tuple=True)
            extents.append(float((columns.max() - columns.min() + 1) / (rows.max() - rows.min() + 1)))
        assert extents[0] == pytest.approx(extents[1], abs=0.08)  # two pixels of 32


def test_a_careful_hand_makes_the_mistakes_that_training_draws():
    drawing, careful = option("augmentation", "drawing"), LEVELS[1]
    assert (careful.wobble, careful.shift, careful.scale) == (drawing.wobble, drawing.shift, drawing.scale)
    assert careful.limbs_deg == careful.head_deg == 0.0


def test_views_differ_more_from_level_to_level(character):
    """From as captured to other poses: the back's outline leaves the mirrored front's."""
    apart = []
    for level in range(len(LEVELS)):
        front, side, back = draw_character(character, size=128, seed=5, level=level).values()
        read = read_views(turnaround(front, side, back), size=64, options=AS_DRAWN)
        apart.append(read.reconciliation.views[2].apart_before)
    assert apart[0] <= apart[1] < apart[3] and apart[2] < apart[3]
    with pytest.raises(ConfigError, match="level: found 4, expected 0 to 3"):
        draw_character(character, size=64, seed=1, level=4)


def test_a_redrawn_character_keeps_its_truth(character, small):
    """Other source views of the model's size, the same targets; level 0 is the character itself."""
    assert redrawn(character, level=0, seed=0, size=64) is character
    again = redrawn(character, level=2, seed=0, size=64)
    assert again.sources.images.shape == (1, 3, 4, 64, 64)
    assert again.image_files == character.image_files and again.mesh_file == character.mesh_file
    front, back = again.sources.images[0, 0, 3], again.sources.images[0, 2, 3]
    assert torch.equal(back, front.flip(-1)), "reconciled: the back takes the mirrored front's outline"
    loose = redrawn(character, level=2, seed=0, size=64, options=AS_DRAWN).sources.images[0]
    assert not torch.equal(loose[2, 3], loose[0, 3].flip(-1))


def test_other_views_are_drawn_of_the_mesh(character, small):
    """In the order given, the first of which rules; of the left one the picture that was captured, but for paper and framing."""
    views = [viewpoint(name) for name in ("left", "front", "right", "45")]
    again = redrawn(character, level=0, seed=0, size=64, views=views)
    assert again.source_names == ("side", "front", "right", "three-quarter-front")
    assert again.sources.images.shape == (1, 4, 4, 64, 64)
    left, front, right = again.sources.images[0, :3, 3]
    assert iou(left.numpy(), right.flip(-1).numpy()) > 0.9 > iou(left.numpy(), front.numpy())
    with pytest.raises(DataError, match=r"found no mesh to draw right.*captured views"):
        redrawn(replace(character, mesh_file=None), level=1, seed=0, size=64, views=[viewpoint("right")])


def test_training_characters_get_drawings_of_some_usual_views(character, small, tmp_path):
    """Copies of a mesh: their targets are as captured, their source views drawn, and the seed says how."""
    mesh = tmp_path / "figure.obj"
    surface = load_surface_mesh(character.mesh_file)
    trimesh.Trimesh(
        surface.triangles.reshape(-1, 3), np.arange(3 * len(surface.triangles)).reshape(-1, 3)
    ).export(mesh)
    options = CaptureOptions(views=2, size=32)
    for root, drawn in (("two", 2), ("one", 1)):
        capture_dataset([mesh], tmp_path / root, "train", options=options, drawn=drawn, draw=with_drawn_sources,
                        seed=4, processes=1, up="z", facing="-y")  # fmt: skip
    one, other = (load_character(tmp_path / root, "figure+d1") for root in ("one", "two"))
    assert torch.equal(one.sources.images, other.sources.images), "however many are made"
    for number in (1, 2):
        one = load_character(tmp_path / "two", f"figure+d{number}")
        names = tuple("left" if name == "side" else name for name in one.source_names)
        assert set(names) in map(set, VIEW_SHARES)
        assert one.images([0, 1]).shape == (2, 32, 32, 4) and one.mesh_file.is_file()
        colors = one.sources.images[0, 0, :3][:, one.sources.images[0, 0, 3] > 0.5]
        assert len(colors.T.unique(dim=0)) > 1, "ink beside paint"
